"""Sobol indices against closed forms: a sum of lengths, and a product."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("SALib")
pytest.importorskip("pyarrow")
pytest.importorskip("matplotlib")

import draft
from draft.errors import DraftError
from draft.explore.indices import sobol_indices
from tests.commands import Command

BEAR = draft.load("quadruped").resolve("bear")
LENGTHS = ("thigh_length=0.3:0.5", "shank_length=0.3:0.4")


def test_shares_of_a_sum_are_those_of_the_squares_of_the_ranges() -> None:
    found = sobol_indices(BEAR, LENGTHS, ["leg_length"])
    np.testing.assert_allclose(found.first[:, 0], [0.8, 0.2], atol=0.02)
    np.testing.assert_allclose(found.total[:, 0], [0.8, 0.2], atol=0.02)
    assert (abs(found.first[:, 0] - [0.8, 0.2]) <= 2 * found.first_width[:, 0]).all()
    assert found.mean[0] == pytest.approx(0.75, abs=1e-3)
    assert found.deviation[0] == pytest.approx(np.hypot(0.2, 0.1) / np.sqrt(12), rel=0.01)
    assert found.warnings() == []


def test_what_numbers_do_together_is_in_the_total_index_and_told() -> None:
    # The mass of the trunk is its density times length, width and height.
    vary = ["trunk_length=0.1:1.5", "trunk_height=0.05:1.0"]
    with_others = draft.load("quadruped").resolve("bear", {"trunk_length": 0.4})
    found = sobol_indices(with_others, ["trunk_length=0.2:1.5", vary[1]], ["structure_mass"])
    alone, together = found.first[:, 0], found.total[:, 0]
    assert (together > alone).all()
    assert found.together[0] == pytest.approx(1 - alone.sum())
    # Of a product x y: alone (m_y s_x)^2 and (m_x s_y)^2, together (s_x s_y)^2.
    if found.together[0] > 0.1:
        assert "effects of single ones mislead" in found.warnings()[0]


def test_a_metric_that_stays_has_no_shares() -> None:
    found = sobol_indices(BEAR, ["crouch=0.9:1.1"], ["leg_length"], n=64)
    assert np.isnan(found.first).all()
    assert found.record()["metrics"]["leg_length"]["numbers"]["crouch"]["first"] is None


@pytest.mark.parametrize(
    ("vary", "of", "n", "message"),
    [
        (LENGTHS, ["mass"], 1000, "`n` 1000 is no power of two"),
        (LENGTHS, ["impact_mitigation"], 64, "'impact_mitigation' needs a compiled model"),
        ((), ["mass"], 64, "nothing is varied"),
        (("thigh=0.2:0.3",), ["mass"], 64, "'thigh' is not a parameter"),
        (LENGTHS, ["hold_time"], 64, "'hold_time' has no number somewhere in these ranges"),
    ],
)
def test_what_makes_no_sense_is_refused(
    vary: tuple[str, ...], of: list[str], n: int, message: str
) -> None:
    with pytest.raises(DraftError, match=re.escape(message)):
        sobol_indices(BEAR, vary, of, n=n)


def test_the_command_takes_ranges_or_those_of_a_screen(command: Command, tmp_path: Path) -> None:
    file, words = tmp_path / "screen.parquet", " ".join(LENGTHS)
    command(f"screen quadruped:bear --n 100 --vary {words} --out", file)
    options = "--of leg_length --n 64"
    first = command.json(f"sensitivity bear {options} --vary {words}")
    assert command.json(f"sensitivity bear {options} --screen", file) == first
    said = command(f"sensitivity bear {options} --vary {words} --figure", tmp_path / "s.pdf").out
    assert "shares of the variance" in said
    assert (tmp_path / "s.pdf").is_file()
    told = command.refuses(f"sensitivity bear --vary {words} --screen", file)
    assert "both --vary and --screen give ranges" in told
    assert "is no file of `draft.screen`" in command.refuses(
        "sensitivity bear --screen", tmp_path / "s.pdf"
    ).replace("'draft screen'", "`draft.screen`")
    assert "--by names single numbers" in command.refuses(
        f"sensitivity bear --vary {words} --by crouch"
    )
