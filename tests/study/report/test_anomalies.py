"""Results that look wrong are named, and those that do not are not."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

pytest.importorskip("matplotlib")
pytest.importorskip("pyarrow")

from draft.learn.bodies.legged import CLASSES
from draft.learn.measuring.utilisation import CELL, CELLS
from draft.study.report import anomalies
from draft.study.report.folder import read
from draft.study.report.records import Samples
from draft.study.report.run_tables import remarks
from tests.learn import synthetic
from tests.study.report.pages import page_of, tables_of


def one_run(folder: Path, stage: str, change: Any, seed: int = 0, arm: str = "nominal") -> None:
    run = synthetic.trained(folder, "cheetah", stage, seed)
    synthetic.evaluated(run, arm, change=change)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"survival": [0.25]}, "25 % of the roll-outs stay up at 0.4 m/s"),
        ({"speed": [0.05]}, "it walks at 0.05 m/s at a command of 0.4 m/s"),
    ],
)
def test_a_seed_that_does_not_walk_is_named(
    tmp_path: Path, change: dict[str, Any], words: str
) -> None:
    one_run(tmp_path, "base", lambda s: s["tests"]["walk"].update(change))
    one_run(tmp_path, "base", None, seed=1)
    said = [f"cheetah, seed 0, did not learn to walk: {words}."]
    assert anomalies.anomalies(read(tmp_path)) == said


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
    # Without samples it is not judged.
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


def test_whose_inertia_errors_the_perturbed_arm_had_is_reported(source: Path) -> None:
    said = page_of(source)
    words = "72 evaluations, nominal and perturbed inertia (errors of the twins of Go2 and B2)"
    assert words in said
    assert "3 nominal, 3 perturbed (twins)" in said
    assert "not to be compared" not in said


def test_evaluations_with_other_inertia_errors_than_most_are_flagged(tmp_path: Path) -> None:
    folder = synthetic.study(tmp_path, ("bear",), (0, 1), stages=("push",))
    run = synthetic.trained(folder, "bear", "push", 2)
    synthetic.evaluated(run, "perturbed", change=lambda summary: summary.update(errors="paper"))
    words = "published errors, where others have errors of the twins of Go2 and B2"
    said = f"bear, push, perturbed inertia, seed 2: {words}: not to be compared"
    assert remarks(read(folder)) == [said]
    (row,) = tables_of(folder)["evaluations"].rows
    assert row[2] == "2 nominal, 1 perturbed (paper), 2 perturbed (twins)"
