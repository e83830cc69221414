"""Metrics of behaviour: names, regions, and their way through sweeps, searches and conditions."""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import draft
from draft import metrics
from draft.cli import main
from draft.design import Design
from draft.errors import DraftError
from draft.learn.engine.machine import obstacle
from draft.learn.policy.policy import FAMILY
from draft.metrics import LEARNED, METRICS

THIGHS = [0.22, 0.25, 0.28, 0.31]
needs_learning = pytest.mark.skipif(obstacle() is not None, reason="needs mjbatch")


def fast(
    design: Design, names: Iterable[str], policy: Any = None, *, known: str = "", rows: Any = None
) -> Any:
    """Instead of roll-outs: the thigh as a speed; NaN for rows that are not asked for."""
    values = np.broadcast_to(np.asarray(design.parameters["thigh_length"]), design.count or 1)
    found = np.full(design.count or 1, np.nan)
    found[rows] = 10 * values[rows]
    return dict.fromkeys(names, found)


@pytest.fixture
def quick(monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("pyarrow")
    monkeypatch.setattr("draft.explore.sweep.of_policy", fast)


@needs_learning
def test_a_policy_that_changed_since_a_sweep_began_measures_no_more_of_it() -> None:
    design = draft.load("quadruped").resolve("cheetah")
    with pytest.raises(DraftError, match="has changed since this began"):
        metrics.of_policy(design, ["learned.kick"], FAMILY, known="another")


def test_learned_metrics_are_found_by_name_and_are_no_part_of_the_others() -> None:
    assert not METRICS.keys() & LEARNED.keys()
    assert metrics.find("learned.top_speed").unit == "m/s"
    assert all(one.needs == "policy" and one.doc and one.formula for one in LEARNED.values())


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda d: metrics.of_design(d, ["learned.kick"]), "'learned.kick' needs a policy"),
        (lambda d: metrics.of_model(d.build(), ["learned.kick"]), "'learned.kick' needs a policy"),
        (lambda d: metrics.of_policy(d, ["mass"]), "'mass' needs no policy"),
        (lambda d: metrics.find("learned.speed"), "did you mean 'learned.top_speed'"),
        (
            lambda d: draft.screen(
                d, vary={"thigh_length": THIGHS}, out="x.parquet", metrics=["learned.kick"]
            ),
            "'learned.kick' needs a policy",
        ),
    ],
)
def test_a_metric_in_the_wrong_place_is_explained(
    call: Callable[[Design], object], message: str
) -> None:
    with pytest.raises(DraftError, match=message):
        call(draft.load("quadruped").resolve("cheetah"))


@pytest.mark.usefixtures("quick")
def test_a_sweep_has_them_as_columns_and_conditions(tmp_path: Path) -> None:
    rows = draft.sweep(
        "quadruped",
        vary={"thigh_length": THIGHS},
        sampler="grid",
        n=4,
        metrics=["mass", "learned.top_speed"],
        where="learned.top_speed > 2.4",
        out=tmp_path / "sweep",
    )
    table = rows.table()
    assert table["learned.top_speed"].to_pylist() == pytest.approx([2.5, 2.8, 3.1])
    manifest = json.loads((tmp_path / "sweep/_manifest.json").read_text(encoding="utf-8"))
    assert len(manifest["policy"]) == 16


@pytest.mark.usefixtures("quick")
def test_refused_designs_are_not_rolled_out(tmp_path: Path) -> None:
    rows = draft.sweep(
        "quadruped",
        vary={"actuators.leg.peak_torque": [72.0, 900.0]},
        sampler="grid",
        n=2,
        metrics=["learned.top_speed"],
        out=tmp_path / "sweep",
    )
    found = rows.table()["learned.top_speed"].to_pylist()
    assert found[0] == pytest.approx(2.5)
    assert math.isnan(found[1])


@pytest.mark.usefixtures("quick")
def test_a_sweep_without_them_has_the_manifest_that_it_had(tmp_path: Path) -> None:
    draft.sweep(
        "hopper", vary={"thigh_length": THIGHS}, n=2, metrics=["mass"], out=tmp_path / "sweep"
    )
    manifest = json.loads((tmp_path / "sweep/_manifest.json").read_text(encoding="utf-8"))
    assert "policy" not in manifest


def test_a_sweep_outside_the_region_is_another_sweep(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    pytest.importorskip("pyarrow")
    asked: list[bool] = []

    def recorded(*args: Any, outside: bool = False, **options: Any) -> Any:
        asked.append(outside)
        return fast(*args, **options)

    monkeypatch.setattr("draft.explore.sweep.of_policy", recorded)
    words = ["sweep", "quadruped", "--vary", "thigh_length=0.22:0.3", "--n", "2"]
    words += ["--metrics", "learned.top_speed", "--out", str(tmp_path / "sweep")]
    assert main([*words, "--outside"]) == 0
    assert asked == [True]
    manifest = json.loads((tmp_path / "sweep/_manifest.json").read_text(encoding="utf-8"))
    assert manifest["outside"] is True
    assert main(words) == 2  # The folder belongs to another run.


@pytest.mark.usefixtures("quick")
def test_a_search_maximises_what_the_policy_reaches(tmp_path: Path) -> None:
    pytest.importorskip("optuna")
    found = draft.optimise(
        "quadruped",
        vary={"thigh_length": (0.2, 0.36)},
        maximise=["learned.top_speed"],
        minimise=["mass"],
        subject_to=["accepted", "learned.top_speed > 2.4"],
        trials=60,
        out=tmp_path / "search",
    )
    speeds = [one["goals"]["learned.top_speed"] for one in found]
    assert min(speeds) > 2.4
    assert max(speeds) > 3.4


def test_a_misspelt_metric_in_a_condition_names_the_nearest(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    words = ["sweep", "quadruped", "--vary", "thigh_length=0.2:0.3", "--out", str(tmp_path / "x")]
    assert main([*words, "--where", "learned.topspeed > 1"]) == 2
    assert "learned.top_speed" in capsys.readouterr().err
    assert not (tmp_path / "x").exists()


@pytest.mark.usefixtures("quick")
@pytest.mark.parametrize(
    ("robot", "policy", "message"),
    [
        ("hopper", None, "one leg with a knee and a foot"),
        ("humanoid", str(FAMILY), "does not drive the joints of"),
    ],
)
def test_a_robot_that_the_policy_cannot_drive_ends_a_sweep_before_it_begins(
    robot: str, policy: str | None, message: str, tmp_path: Path
) -> None:
    vary, out = {"thigh_length": [0.3]}, tmp_path / "sweep"
    with pytest.raises(DraftError, match=message):
        draft.sweep(robot, vary=vary, n=1, metrics=["learned.kick"], policy=policy, out=out)
    assert not out.exists()


@pytest.mark.slow
@needs_learning
@pytest.mark.parametrize("policy", [None, str(FAMILY)])
def test_the_shipped_policy_measures_a_design_and_knows_its_region(policy: str | None) -> None:
    pytest.importorskip("mjlab")
    spec = draft.load("quadruped")
    many = spec.resolve({"thigh_length": np.array([0.25, 0.3, 0.9])})
    found = metrics.of_policy(many, policy=policy, replicas=2, seconds=3.0)
    assert list(found) == list(LEARNED)
    speed = np.asarray(found["learned.top_speed"])
    assert (speed[:2] > 1.5).all()
    assert np.isnan(speed[2])
    assert np.asarray(found["learned.inside"]).tolist() == [1, 1, 0]
    assert (np.asarray(found["learned.cost_of_transport"])[:2] > 0).all()


@pytest.mark.slow
@needs_learning
def test_one_design_has_floats_and_a_refused_one_has_none() -> None:
    pytest.importorskip("mjlab")
    spec = draft.load("quadruped")
    one = metrics.of_policy(spec.resolve("cheetah"), ["learned.kick"], replicas=1, seconds=2.0)
    assert isinstance(one["learned.kick"], float)
    refused = spec.resolve({"actuators.leg.peak_torque": 900.0})
    none = metrics.of_policy(refused, ["learned.kick", "learned.inside"])
    assert math.isnan(float(none["learned.kick"]))
    assert none["learned.inside"] == 0


def test_a_policy_without_the_flag_and_a_missing_file_are_explained(
    capsys: pytest.CaptureFixture[str],
) -> None:
    assert main(["metrics", "cheetah", "--policy", "nowhere"]) == 2
    assert "--policy is for learned metrics" in capsys.readouterr().err
    assert main(["metrics", "cheetah", "--learned", "--policy", "nowhere"]) == 2
    assert "nowhere" in capsys.readouterr().err
