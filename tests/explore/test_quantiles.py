"""Quantiles over the errors of laws in conditions and goals."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

import draft
from draft.design.error_samples import sample_errors
from draft.errors import DraftError
from draft.explore.quantiles import SAMPLES
from draft.explore.solve import solve
from draft.explore.where import condition
from draft.metrics import of_design
from draft.twins.compare import compare_twin
from draft.values import scalar
from tests.commands import Command

QUADRUPED = draft.load("quadruped")
BEAR = QUADRUPED.resolve("bear")


def value(text: str, design: draft.Design) -> np.ndarray:
    found = condition(design.spec, text)
    return np.asarray(found.value(design, of_design(design, found.metrics)))


def test_a_quantile_is_that_of_designs_whose_laws_err() -> None:
    many = QUADRUPED.resolve("bear", errors=sample_errors(BEAR, SAMPLES))
    for share in (0.1, 0.5, 0.9):
        wanted = np.quantile(np.asarray(of_design(many, ["jump_height"])["jump_height"]), share)
        found = value(f"q{round(100 * share)}(jump_height)", BEAR)
        assert float(found) == pytest.approx(float(wanted), rel=1e-9)


def test_quantiles_of_n_designs_are_those_of_each() -> None:
    lengths = np.array([0.3, 0.35, 0.45])
    many = QUADRUPED.resolve("bear", {"thigh_length": lengths})
    found = value("q10(mass) + 0 * mass", many)
    own = [value("q10(mass)", QUADRUPED.resolve("bear", {"thigh_length": x})) for x in lengths]
    np.testing.assert_allclose(found, own, rtol=1e-9)


def test_the_band_of_the_mass_is_that_of_its_quantiles() -> None:
    low, high = BEAR.mass_band(0.9)
    middle = scalar(BEAR.mass) / float(value("q50(mass)", BEAR))
    # Few samples tell the ends of a wide band roughly.
    assert float(value("q05(mass)", BEAR)) * middle == pytest.approx(low, rel=0.15)
    assert float(value("q95(mass)", BEAR)) * middle == pytest.approx(high, rel=0.2)


def test_a_robust_target_asks_for_more_than_the_plain_one() -> None:
    plain = solve(BEAR, ["jump_height >= 0.06"], {"actuators.leg.no_load_speed": (8.0, 16.0)})
    sure = solve(BEAR, ["q10(jump_height) >= 0.06"], {"actuators.leg.no_load_speed": (8.0, 16.0)})
    assert plain.change == 0
    assert sure.conflict is None
    assert sure.moved[0].after > 11.5
    assert float(value("q10(jump_height)", sure.design)) >= 0.06


def test_a_screen_keeps_by_quantiles(command: Command, tmp_path: object) -> None:
    pytest.importorskip("pyarrow")
    pytest.importorskip("scipy")
    line = "screen quadruped:bear --n 64 --vary thigh_length=0.3:0.45 --out"
    wide, sure = (f"{tmp_path}/{name}.parquet" for name in ("wide", "sure"))
    kept = [
        int(re.search(r"(\d+) kept", command(f'{line} {file} --where "{text} <= 120"').out)[1])  # pyright: ignore[reportOptionalSubscript]
        for file, text in ((wide, "mass"), (sure, "q90(mass)"))
    ]
    assert kept[0] == 64
    assert kept[1] < kept[0]


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("q10(jump_height", "'q10(' is not closed"),
        ("q10(q90(mass)) < 3", "a quantile cannot be within another"),
        ("q10(impact_mitigation) < 3", "would need models or roll-outs"),
        ("q10(mas) < 3", "unknown name 'mas'"),
        ("q10() < 3", "is empty"),
        ("q1(mass) < 3", "q1"),
    ],
)
def test_what_makes_no_sense_is_refused(text: str, message: str) -> None:
    with pytest.raises(DraftError, match=re.escape(message)):
        condition(QUADRUPED, text)


ROBOTS = Path(__file__).parents[3] / "shared/robots/survey"


@pytest.mark.slow
@pytest.mark.skipif(not ROBOTS.is_dir(), reason="the descriptions of real robots are not here")
def test_nine_of_ten_machines_that_are_held_out_weigh_what_their_quantiles_say() -> None:
    keys = ("anymal_b", "anymal_c", "anymal_d", "deeprobotics_lite3", "deeprobotics_x30")
    keys += ("dfki_quad", "dobot_rover_x1", "magicdog", "unitree_a1", "unitree_a2", "unitree_b1")
    keys += ("unitree_aliengo", "unitree_b2", "unitree_go1", "unitree_go2", "unitree_laikago")
    keys += ("xiaomi_cyberdog2", "zsibot_zsl1", "booster_t1", "h1", "h1_2", "gr1")
    inside = []
    for key in keys:
        twin = compare_twin(ROBOTS / f"{key}.urdf", poses=2, without=(key,), key=key)
        low, middle, high = (float(value(f"{q}(mass)", twin.design)) for q in ("q05", "q50", "q95"))
        centre = scalar(twin.design.mass) / middle
        inside.append(low * centre <= twin.vendor_mass <= high * centre)
    assert np.mean(inside) >= 0.9
