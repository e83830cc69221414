"""Robots on two or six legs, with plates, arms and a waist, train as quadrupeds do."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

torch = pytest.importorskip("torch")
pytest.importorskip("mjlab")

from draft.errors import DraftError  # noqa: E402
from draft.learn.engine.machine import obstacle  # noqa: E402
from draft.learn.measuring.levels import skill_tests  # noqa: E402
from draft.learn.measuring.rollout.evaluate import evaluate, trained  # noqa: E402
from draft.learn.measuring.rollout.trial import Trial  # noqa: E402
from draft.learn.task.config import Config  # noqa: E402
from draft.learn.task.mdp.rewards import upper_legs  # noqa: E402
from draft.learn.task.recipes import RECIPES  # noqa: E402
from draft.learn.task.world.task import Task  # noqa: E402
from draft.learn.training import session  # noqa: E402
from draft.learn.training.run import Plan  # noqa: E402
from tests.learn.bodies.test_legged import walker  # noqa: E402
from tests.learn.runs import begin, train  # noqa: E402
from tests.learn.small import SMALL  # noqa: E402

pytestmark = pytest.mark.filterwarnings("ignore::UserWarning:mujoco_warp.*")
NATIVE = pytest.param(
    "native", marks=pytest.mark.skipif(obstacle() is not None, reason="needs mjbatch")
)


def plan(name: str, folder: Path) -> Plan:
    laptop = {key: change.value for key, change in RECIPES["laptop"].changes.items()}
    config = Config().with_values(laptop | SMALL)
    member = walker(name, folder)
    return Plan((member,), "base", environments=4, config=config, ground="flat", see_ground=False)


@pytest.mark.parametrize("engine", ["warp", NATIVE])
@pytest.mark.parametrize("name", ["hexapod", "plates", "arm", "humanoid"])
def test_any_legs_train_and_are_evaluated(name: str, engine: str, tmp_path: Path) -> None:
    asked = plan(name, tmp_path / "robot")
    run = begin(tmp_path / "run", asked)
    trainer = train(run, 2, engine=engine)
    found = upper_legs(trainer.env)
    assert found.shape == (4,)
    assert float(found.max()) <= len(asked.members[0].feet)
    walk = skill_tests(["walk"], [0.3])
    task = Task(asked.members, "base", asked.config, ground="flat", see_ground=False)
    of = Trial(task, walk, replicas=2, seconds=0.4, settle=0.1)
    worlds, counted = evaluate(of, trained(run, 2, "cpu"), "cpu", engine=engine)
    assert len(worlds.fell) == 2
    assert np.isfinite(worlds.speed[~worlds.fell]).all()
    assert counted.classes == asked.members[0].classes
    assert counted.counts.shape[1] == len(counted.classes)


def test_only_quadrupeds_have_features_to_see(tmp_path: Path) -> None:
    asked = plan("hexapod", tmp_path / "robot")
    seeing = Plan(asked.members, see_design=True)
    with pytest.raises(DraftError, match="no features that a policy could see"):
        session.begin(tmp_path / "run", seeing, {"hexapod": "values: {}\n"})
    assert not (tmp_path / "run").exists()
