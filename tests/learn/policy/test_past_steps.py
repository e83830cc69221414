"""A policy that observes past steps and no velocity: trained, exported, run, measured, deployed."""

# pyright: reportAttributeAccessIssue=false
# (MuJoCo's compiled modules carry no types.)

from __future__ import annotations

import contextlib
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
import pytest

torch = pytest.importorskip("torch")
pytest.importorskip("mjlab")
pytest.importorskip("mjbatch")

from draft.browser.robots import driven  # noqa: E402
from draft.deployment.deploy import deploy  # noqa: E402
from draft.design.references import open_design  # noqa: E402
from draft.errors import DraftError  # noqa: E402
from draft.learn.measuring.policies import open_source  # noqa: E402
from draft.learn.policy.controller import Controller  # noqa: E402
from draft.learn.policy.matching import Match  # noqa: E402
from draft.learn.policy.policy import open_policy  # noqa: E402
from draft.learn.training import session  # noqa: E402
from draft.learn.training.run import Run  # noqa: E402
from draft.learn.watching.play import Player  # noqa: E402
from draft.model.model import preview  # noqa: E402
from tests.learn.runs import begin, exported, train  # noqa: E402
from tests.learn.small import plan  # noqa: E402

pytestmark = pytest.mark.filterwarnings("ignore")
STEPS, COMMAND = 4, (0.4, 0.1, -0.2)
BLIND = {"observations.history": STEPS, "observations.linear_velocity": False}
TERMS = (
    *(("base_ang_vel", 3 * STEPS), ("projected_gravity", 3 * STEPS)),
    *(("joint_pos", 12 * STEPS), ("joint_vel", 12 * STEPS), ("actions", 12 * STEPS)),
    ("command", 3),
)


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Run:
    folder = tmp_path_factory.mktemp("past") / "run"
    made = begin(folder, plan(ground="flat", see_ground=False, values=BLIND))
    train(made, 1, engine="native")
    return made


@pytest.fixture(scope="module")
def file(run: Run) -> Path:
    return exported(run)


def test_the_file_says_how_many_steps_of_each_term_are_observed(file: Path) -> None:
    policy = open_policy(file)
    assert policy.terms == TERMS
    assert policy.history == (*(STEPS,) * 5, 1)
    assert policy.network.size == sum(length for _, length in TERMS)


def test_a_controller_in_plain_mujoco_remembers_what_the_environment_does(
    run: Run, file: Path
) -> None:
    model = open_design("cheetah").build().scene()
    controller, data = Controller(open_policy(file), model), mujoco.MjData(model)
    controller.reset(data)
    with contextlib.closing(Player(run, "cpu", command=COMMAND, engine="native")) as player:
        player.env.reset()
        env, state = player.env.unwrapped, player.env.unwrapped.sim.data
        for i in range(STEPS + 2):
            # The same state in both, so that only what they remember can differ.
            data.qpos[:], data.qvel[:] = state.qpos[0].numpy(), state.qvel[0].numpy()
            seen: Any = env.observation_manager.compute()["actor"]
            found = controller.observe(data, COMMAND)
            np.testing.assert_allclose(found, seen[0].numpy(), atol=1e-4, err_msg=f"step {i}")
            np.testing.assert_array_equal(controller.observe(data, COMMAND), found)
            with torch.inference_mode():
                player.env.step(player.policy({"actor": seen}))
            for _ in range(4):
                controller.step(data, COMMAND)
    controller.reset(data)
    start = controller.observe(data, COMMAND)[: 3 * STEPS].reshape(STEPS, 3)
    assert (start == start[0]).all()


def test_it_is_measured_with_what_it_observes(run: Run, file: Path) -> None:
    numbers = open_source(file, blind=True).plan.config.observations
    assert (numbers.linear_velocity, numbers.history) == (False, STEPS)
    usual = open_source(None).plan.config.observations
    assert (usual.linear_velocity, usual.history) == (True, 1)
    assert run.plan.config.observations.history == STEPS


def test_it_needs_nothing_that_a_robot_must_estimate(file: Path, tmp_path: Path) -> None:
    found = deploy(file, tmp_path / "controller")
    assert found.estimated == ()
    assert found.policy.history == (*(STEPS,) * 5, 1)


def test_joints_of_another_order_are_those_of_every_step() -> None:
    match = Match((2, 0, 1), (1.0, -1.0, 1.0))
    entries, signs = match.entries("joint_vel", (), 6)
    assert entries == [2, 0, 1, 5, 3, 4]
    assert signs == [1.0, -1.0, 1.0] * 2
    entries, signs = match.entries("joint_pos", (False, True, False), 4)
    assert entries == [1, 0, 3, 2]
    assert signs == [1.0, -1.0] * 2


def test_it_is_where_another_training_of_the_same_observations_starts(
    file: Path, tmp_path: Path
) -> None:
    of = plan(stage="push", ground="flat", see_ground=False, values=BLIND)
    made = session.begin(tmp_path / "push", of, {}, str(file))
    train(made, 1, engine="native")
    other = plan(stage="push", ground="flat", see_ground=False)
    made = session.begin(tmp_path / "other", other, {}, str(file))
    with pytest.raises(DraftError, match="and this training base_lin_vel 3") as caught:
        train(made, 1, engine="native")
    assert "start from a policy that observes the velocity and no past" in str(caught.value)


def test_a_policy_of_several_topologies_remembers_nothing(tmp_path: Path) -> None:
    for values in (BLIND, {"observations.history": 2}, {"observations.linear_velocity": False}):
        mixed = plan("cheetah", "hexapod", stage="any", ground="flat", values=values)
        with pytest.raises(DraftError, match="observes the velocity, and no past steps"):
            session.begin(tmp_path / "run", mixed, {})


def test_a_page_says_why_its_robot_stands(file: Path) -> None:
    found: Any = driven([preview(open_design("cheetah"))], "walk", [open_policy(file)])
    assert found.fits == ()
    assert found.why == "its policy observes past steps, which no page remembers"
