"""Results that look wrong are named, and those that do not are not."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

pytest.importorskip("pyarrow")

from draft.learn.bodies.legged import CLASSES
from draft.learn.measuring.utilisation import CELL, CELLS
from draft.study.report import anomalies
from draft.study.report.folder import read
from draft.study.report.records import Samples
from tests.learn import synthetic


def one_run(folder: Path, stage: str, change: Any, seed: int = 0, arm: str = "nominal") -> None:
    run = synthetic.trained(folder, "cheetah", stage, seed)
    synthetic.evaluated(run, arm, change=change)


def test_a_seed_that_falls_is_named(tmp_path: Path) -> None:
    one_run(tmp_path, "base", lambda s: s["tests"]["walk"].update(survival=[0.25]))
    one_run(tmp_path, "base", None, seed=1)
    words = "cheetah, seed 0, did not learn to walk: 25 % of the roll-outs stay up at 0.4 m/s."
    assert anomalies.anomalies(read(tmp_path)) == [words]


def test_a_seed_that_stands_still_is_named(tmp_path: Path) -> None:
    one_run(tmp_path, "base", lambda s: s["tests"]["walk"].update(speed=[0.05]))
    (said,) = anomalies.not_walking(read(tmp_path))
    assert "it walks at 0.05 m/s at a command of 0.4 m/s" in said


def test_a_design_that_cannot_climb_is_named(tmp_path: Path) -> None:
    def change(summary: dict[str, Any]) -> None:
        summary["scalars"].update(step_ascent=None, step=None)
        summary["reasons"].update(step_ascent="fewer than half traverse any step")

    for seed in (0, 1):
        one_run(tmp_path, "terrain", change, seed)
    (said,) = anomalies.not_climbing(read(tmp_path))
    assert said.startswith("cheetah cannot climb (nominal, seeds 0, 1)")
    assert "0.05 m" in said
    one_run(tmp_path, "terrain", None, 2)
    assert list(anomalies.not_climbing(read(tmp_path))) == []


@pytest.mark.parametrize(("speeds", "named"), [((3.0, 3.4, 3.7), False), ((3.0, 3.4, 3.9), True)])
def test_a_top_speed_that_varies_much_is_named(
    tmp_path: Path, speeds: tuple[float, ...], named: bool
) -> None:
    for seed, speed in enumerate(speeds):
        one_run(tmp_path, "velocity", lambda s, v=speed: s["scalars"].update(top_speed=v), seed)
    said = list(anomalies.varying(read(tmp_path)))
    assert len(said) == named
    assert not named or "ranges over 26 % of its median (3.00 to 3.90 m/s, 3 seeds)" in said[0]


def working_at(folder: Path, torque: float, speed: float, eta: float) -> Any:
    """A study whose joints all work at one torque and speed, per limit."""
    one_run(folder, "velocity", lambda s: s["scalars"].update(eta=eta))
    study = read(folder)
    cells = np.zeros((CELLS, CELLS))
    cells[int(torque / CELL), int(speed / CELL)] = 1000
    found = {"speed": Samples.model_validate({"plane": dict.fromkeys(CLASSES, cells)})}
    object.__setattr__(study.evaluations[0], "samples", found)
    return study


def test_an_efficiency_above_what_the_motors_allow_is_named(tmp_path: Path) -> None:
    # At one point Pm / (Pm + PJ) is w / (w + t): 0.5 / (0.5 + 0.3) here.
    exact = 0.5 / (0.5 + 0.3)
    study = working_at(tmp_path / "a", 0.3, 0.5, exact)
    bound = anomalies.largest_efficiency(study.evaluations[0])
    assert bound is not None
    assert exact < bound < exact + 0.1
    assert list(anomalies.too_efficient(study)) == []
    (said,) = anomalies.too_efficient(working_at(tmp_path / "b", 0.3, 0.5, bound + 0.001))
    assert "cheetah, seed 0: an efficiency of" in said


def test_an_efficiency_without_samples_is_not_judged(tmp_path: Path) -> None:
    one_run(tmp_path, "velocity", None)
    study = read(tmp_path)
    object.__setattr__(study.evaluations[0], "samples", {})
    assert anomalies.largest_efficiency(study.evaluations[0]) is None


def test_a_skill_that_errors_make_better_in_every_seed_is_named(tmp_path: Path) -> None:
    for seed in (0, 1):
        run = synthetic.trained(tmp_path, "cheetah", "push", seed)
        synthetic.evaluated(run, "nominal", change=lambda s: s["scalars"].update(kick=2.0))
        synthetic.evaluated(run, "perturbed", change=lambda s: s["scalars"].update(kick=2.5))
    (said,) = anomalies.anomalies(read(tmp_path))
    assert said == (
        "cheetah's kick is better with inertia errors than without, in every seed: at least "
        "2.50 m/s against at most 2.00 m/s."
    )
