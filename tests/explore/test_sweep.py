"""Sweeps: a row for every design, also for those of which no model comes."""

from __future__ import annotations

import math
import signal
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import draft
from draft.design import Design
from draft.explore.engines import LocalEngine
from draft.explore.sweep import chunk, run_sweep
from draft.metrics import METRICS, of_model
from draft.model import batch
from tests.commands import Command
from tests.explore.small import HERE, VARY, StopError, Stops, job, metric, paused, rows

SPEC = draft.load("quadruped")


def test_every_row_is_the_model_built_alone(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    metric(monkeypatch, "weight", "design")
    metric(monkeypatch, "model_weight", "model")
    summary = run_sweep(job(SPEC, 60, "sweep", metrics=None, chunk=20), tmp_path / "s", HERE)
    found = rows(tmp_path / "s")
    assert [row["index"] for row in found] == list(range(60))
    assert 0 < summary["accepted"] < 60
    for row in found:
        values = {key: row[key] for key in ("thigh_length", "actuators.leg.peak_torque")}
        design = SPEC.resolve(values)
        assert row["accepted"] == design.accepted
        assert row["weight"] == pytest.approx(10 * float(design.mass), rel=1e-12)
        if design.accepted:
            assert row["error"] is None
            assert row["model_weight"] == pytest.approx(row["weight"], rel=1e-12)
        else:
            assert row["error"].startswith(f"refused: {row['refused_by']}:")
            assert math.isnan(row["model_weight"])


def test_metrics_of_a_batch_are_those_of_models_built_alone(tmp_path: Path) -> None:
    of_legs = ["foot_inertia", "impact_mitigation", "reflected_share"]
    for robot, first, second, names in (
        ("quadruped", "thigh_length", "shank_length", of_legs),
        ("humanoid", "thigh_length", "shank_length", of_legs),
        ("arm", "upper_arm_length", "forearm_length", ["reflected_mass"]),
    ):
        spec = draft.load(robot)
        assert [name for name, one in METRICS.items() if one.batch and one.fits(spec)] == names
        words = (f"{first}=0.2:0.4", f"{second}=0.2:0.4")
        one = job(spec, 16, "sweep", metrics=names, vary=words, chunk=8)
        run_sweep(one, tmp_path / robot, HERE)
        found = rows(tmp_path / robot)
        assert sum(row["accepted"] for row in found) > 8
        for row in found:
            values = {key: row[key] for key in (first, second)}
            if row["accepted"]:
                alone = of_model(spec.resolve(values).build(), names)
                assert {name: row[name] for name in names} == pytest.approx(alone, rel=1e-9)


def test_a_design_that_no_batch_holds_is_built_alone(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    one = job(SPEC, 20, "sweep", metrics=None)
    run_sweep(one, tmp_path / "whole", HERE)

    def build_batch(design: Design, rows: Any, template: Any = None) -> Any:
        return original(design, rows[::3], template)

    original = batch.build_batch
    monkeypatch.setattr(batch, "build_batch", build_batch)
    run_sweep(one, tmp_path / "some", HERE)
    whole, some = rows(tmp_path / "whole"), rows(tmp_path / "some")
    for row, other in zip(whole, some, strict=True):
        for name, value in row.items():
            numeric = isinstance(value, float)
            expected = pytest.approx(other[name], rel=1e-9, nan_ok=True) if numeric else other[name]
            assert value == expected, name


def test_a_model_that_mujoco_rejects_is_a_row_that_says_so(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    import draft.model.model as made

    monkeypatch.setattr(made.mjcf, "robot_xml", lambda design: "<mujoco><bad/></mujoco>")
    metric(monkeypatch, "model_weight", "model")
    run_sweep(job(SPEC, 20, "sweep", metrics=None), tmp_path / "s", HERE)
    for row in rows(tmp_path / "s"):
        assert not row["accepted"]
        assert row["refused_by"] or "MuJoCo does not accept the model" in row["error"]
        assert math.isnan(row["model_weight"])


def test_a_condition_may_read_what_only_models_have_and_spares_them_where_it_does_not(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    metric(monkeypatch, "model_weight", "model")
    one = job(SPEC, 60, "sweep", where="model_weight < 300", metrics=["model_weight"])
    summary = run_sweep(one, tmp_path / "s", HERE)
    found = rows(tmp_path / "s")
    assert 0 < len(found) == summary["rows"] < 60
    assert all(row["accepted"] and row["model_weight"] < 300 for row in found)
    monkeypatch.setattr(draft.Design, "build", lambda self: pytest.fail("built"))
    summary = run_sweep(job(SPEC, 60, "sweep", where="leg.mass < 0"), tmp_path / "none", HERE)
    assert (summary["rows"], summary["dropped"]) == (0, 60)


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A sweep that was never stopped."""
    out = tmp_path_factory.mktemp("whole") / "s"
    run_sweep(job(SPEC, 60, "sweep", chunk=10), out, HERE)
    return out


@settings(max_examples=5)
@given(after=st.integers(0, 5))
def test_a_sweep_that_goes_on_gives_the_rows_of_one_never_stopped(
    tmp_path_factory: pytest.TempPathFactory, after: int, whole: Path
) -> None:
    folder = tmp_path_factory.mktemp("run")
    one = job(SPEC, 60, "sweep", chunk=10)
    with pytest.raises(StopError):
        run_sweep(one, folder / "s", Stops(after))
    assert run_sweep(one, folder / "s", HERE)["computed"] == 60 - 10 * after
    assert rows(folder / "s") == rows(whole)


@pytest.mark.slow
def test_processes_give_the_rows_of_one_process(tmp_path: Path) -> None:
    one = job(SPEC, 120, "sweep", chunk=20, metrics=None)
    run_sweep(one, tmp_path / "one", HERE)
    run_sweep(one, tmp_path / "two", LocalEngine(2))
    assert str(rows(tmp_path / "one")) == str(rows(tmp_path / "two"))  # NaN is not NaN


@pytest.mark.slow
@pytest.mark.parametrize("with_", [signal.SIGKILL, signal.SIGINT])
def test_a_sweep_that_is_ended_goes_on(tmp_path: Path, with_: signal.Signals) -> None:
    out = tmp_path / "s"
    process = paused(2, "sweep", "quadruped", "--vary", *VARY, "--n", "400", "--out", str(out))
    process.send_signal(with_)
    _, said = process.communicate()
    assert process.returncode == (130 if with_ == signal.SIGINT else -signal.SIGKILL)
    kept = "interrupted: the parts done so far are kept; the same command resumes\n"
    assert with_ == signal.SIGKILL or said.endswith(kept)
    assert len(list(out.glob("part-*"))) == 2
    one = job(SPEC, 400, "sweep", metrics=None, chunk=chunk(400))
    with pytest.raises(StopError):
        run_sweep(one, out, Stops(3))
    assert len(list(out.glob("part-*"))) == 2 + 3


@pytest.mark.usefixtures("here")
def test_the_command_prints_one_object_and_weighs_robots_with_their_load(command: Command) -> None:
    words = "sweep quadruped:cheetah --vary thigh_length=0.2:0.3 --n 4 --workers 1 --metrics mass"
    assert command.json(f"{words} --out bare")["designs"] == 4
    command(f"{words} --out loaded --payload 10")
    pairs = zip(rows(Path("bare")), rows(Path("loaded")), strict=True)
    assert [b["mass"] - a["mass"] for a, b in pairs] == pytest.approx([10.0] * 4)
