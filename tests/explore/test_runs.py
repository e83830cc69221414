"""Screens, sweeps and searches from Python: the same rows as from the command line."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import draft
from draft.cli import main
from draft.variation.axes import parse
from tests.explore.small import pq, rows

VARY = {"thigh_length": (0.2, 0.5), "actuators.leg.peak_torque": (20, 300, "log")}
SMALL: dict[str, Any] = {"n": 64, "metrics": ["mass"]}


def _same(one: Path, other: Path) -> None:
    assert rows(one) == rows(other)


def test_a_screen_from_python_has_the_rows_of_the_command(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    found = draft.screen(
        "quadruped:bear", vary=VARY, out=tmp_path / "a.parquet", where="mass < 90", **SMALL
    )
    words = ["--vary", "thigh_length=0.2:0.5", "actuators.leg.peak_torque=20:300:log"]
    words += ["--n", "64", "--metrics", "mass", "--where", "mass < 90"]
    out = tmp_path / "b.parquet"
    assert main(["screen", "quadruped", "--design", "bear", *words, "--out", str(out)]) == 0
    assert f"64 designs, {found.rows} kept" in capsys.readouterr().out
    _same(found.out, out)
    assert found.table().num_rows == found.rows > 0
    assert (found.designs, found.dropped) == (64, 64 - found.rows)


def test_a_spec_a_design_and_a_reference_are_the_same_robot(tmp_path: Path) -> None:
    spec = draft.load("quadruped")
    outs = []
    for number, robot in enumerate([spec.resolve("bear"), "bear", "quadruped:bear"]):
        outs.append(draft.screen(robot, vary=VARY, out=tmp_path / f"{number}.parquet", **SMALL).out)
    bear = {k: v for k, v in spec.designs["bear"].values.items() if k not in VARY}
    outs.append(draft.screen(spec, vary=VARY, values=bear, out=tmp_path / "x.parquet", **SMALL).out)
    for out in outs[1:]:
        _same(outs[0], out)
    other = draft.screen(spec, vary=VARY, out=tmp_path / "y.parquet", **SMALL).out
    assert rows(other) != rows(outs[0])


def test_a_run_that_is_repeated_computes_nothing_and_reports_progress(tmp_path: Path) -> None:
    seen: list[tuple[int, int]] = []
    options: dict[str, Any] = {**SMALL, "n": 40, "out": tmp_path / "sweep", "metrics": ["mass"]}
    first = draft.sweep(
        "hopper",
        vary={"actuators.leg.peak_torque": (60, 80)},
        progress=lambda done, total: seen.append((done, total)),
        **options,
    )
    assert seen == [(0, 40), (20, 40), (40, 40)]
    again = draft.sweep("hopper", vary=["actuators.leg.peak_torque=60:80"], **options)
    assert (first.computed, again.computed) == (40, 0)
    assert again.table()["index"].to_pylist() == list(range(40))
    assert "error" in pq.read_schema(next((tmp_path / "sweep").glob("*.parquet"))).names


def test_a_front_is_a_sequence_of_designs_that_resolve(tmp_path: Path) -> None:
    front = draft.optimise(
        "quadruped", vary=VARY, minimise="mass", subject_to="accepted", trials=60, out=tmp_path
    )
    assert len(front) == 1
    assert repr(front) == f"Front('{tmp_path}', 60 trials, 1 best design)"
    saved = draft.load("quadruped").resolve(tmp_path / "designs" / f"{front[0]['design']}.yaml")
    assert saved.mass == pytest.approx(front[0]["goals"]["mass"])
    assert draft.load("quadruped").resolve(front[0]["values"]).mass == saved.mass


def test_ranges_by_name_are_those_of_the_command() -> None:
    spec = draft.load("quadruped")
    given = {"thigh_length": (0.2, np.float64(0.3)), "shank_length": [0.2, 0.3]}
    given |= {"actuators.leg.peak_torque": (40, 90, "log"), "trunk_width": np.array([0.2])}
    words = ["thigh_length=0.2:0.3", "shank_length=0.2,0.3"]
    words += ["actuators.leg.peak_torque=40:90:log", "trunk_width=0.2"]
    assert parse(spec, given) == parse(spec, words)
    with pytest.raises(draft.DraftError, match=r"thigh_length=0.3:0.2': the range .* is empty"):
        parse(spec, {"thigh_length": (0.3, 0.2)})


@pytest.mark.parametrize(
    "given",
    [
        *(3, (1,), (1, 2, 3), (1, 2, "lin"), [], "1:2", [True], [[1], [2]], [[1], [1, 2]]),
        *((1, 10**400), {1: 2}, ("a", "b"), (0.2, float("nan"))),
    ],
)
def test_what_is_neither_a_range_nor_a_list_is_an_error(given: Any) -> None:
    words = r"vary\['thigh_length'\] is .*\n  give \(low, high\)"
    with pytest.raises(draft.DraftError, match=words):
        parse(draft.load("quadruped"), {"thigh_length": given})


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"vary": {}}, "nothing is varied"),
        ({"vary": {"thigh": (0.2, 0.3)}}, "'thigh' is not a parameter"),
        ({"robot": "quadrupd"}, "did you mean 'quadruped'?"),
        ({"n": 0.5}, "`n` 0.5 is not a whole number of at least 1"),
        ({"n": 1e3}, "`n` 1000 is not a whole number of at least 1"),
        ({"n": "1e3"}, "`n` '1e3' is not a whole number of at least 1"),
        ({"vary": 3}, "`vary` is 3, neither ranges by name nor words"),
        ({"values": 3}, "`values` 3 is not values by name"),
        ({"sampler": "sobel"}, "did you mean 'sobol'?"),
        ({"seed": 1 << 63}, "is not a whole number from 0 to 2**63 - 1"),
        ({"seed": "0"}, "`seed` '0' is not a whole number from 0"),
    ],
)
def test_bad_arguments_are_errors_and_nothing_is_written(
    changes: dict[str, Any], message: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    arguments: dict[str, Any] = {"robot": "quadruped", "vary": VARY, "out": "s.parquet"} | changes
    with pytest.raises(draft.DraftError) as raised:
        draft.screen(arguments.pop("robot"), **arguments)
    assert message in str(raised.value)
    assert list(tmp_path.iterdir()) == []


def test_many_designs_are_no_robot(tmp_path: Path) -> None:
    many = draft.load("quadruped").resolve({"shank_length": np.array([0.2, 0.3])})
    with pytest.raises(draft.DraftError, match=r"this is 2 designs\n  select one: design\[0\]"):
        draft.screen(many, vary=VARY, out=tmp_path / "s.parquet")
