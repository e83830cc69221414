"""A controller in plain MuJoCo sees and does what mjlab's environment does."""

# pyright: reportAttributeAccessIssue=false
# (MuJoCo's compiled modules carry no types.)
from __future__ import annotations

import contextlib
from collections.abc import Iterator
from typing import Any

import mujoco
import numpy as np
import pytest

pytest.importorskip("mjlab")
pytest.importorskip("mjbatch")

import torch

import draft
from draft.learn.policy.controller import Controller
from draft.learn.policy.policy import open_policy
from draft.learn.training.ppo.onnx import export
from draft.learn.training.ppo.trainer import Trainer
from draft.learn.training.run import create
from draft.learn.watching.play import Player
from tests.learn.small import plan
from tests.learn.task.states import place, turn

pytestmark = pytest.mark.filterwarnings("ignore")
COMMAND = (0.4, 0.1, -0.2)


@pytest.fixture(scope="module")
def both(tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[Player, Controller]]:
    folder = tmp_path_factory.mktemp("both")
    run = create(folder / "run", plan(ground="flat", see_ground=False), {})
    with contextlib.closing(Trainer(run, "cpu")) as trainer:
        trainer.keep()
    with contextlib.closing(Player(run, "cpu", command=COMMAND, engine="native")) as player:
        export(player, run, folder / "policy.onnx")
        model = draft.load("quadruped").resolve("cheetah").build().scene()
        yield player, Controller(open_policy(folder / "policy.onnx"), model)


def same_state(player: Player, controller: Controller) -> mujoco.MjData:
    """A tumbling state, in both simulations."""
    player.env.reset()
    random, env = np.random.default_rng(3), player.env.unwrapped
    place(
        env,
        at=(0.3, -0.2, 0.46),
        quat=turn("y", 0.3),
        linear=random.uniform(-0.5, 0.5, 3),
        angular=random.uniform(-0.5, 0.5, 3),
        joints=controller.policy.home + random.uniform(-0.2, 0.2, 12),
        speeds=torch.tensor(random.uniform(-0.5, 0.5, 12), dtype=torch.float32),
    )
    data = mujoco.MjData(controller.model)
    controller.reset(data)
    state: Any = env.sim.data
    data.qpos[:], data.qvel[:] = state.qpos[0].numpy(), state.qvel[0].numpy()
    return data


def seen(player: Player) -> Any:
    return player.env.unwrapped.observation_manager.compute(update_history=True)


def test_both_see_the_same(both: tuple[Player, Controller]) -> None:
    player, controller = both
    data = same_state(player, controller)
    expected = seen(player)["actor"][0].numpy()
    np.testing.assert_allclose(controller.observe(data, COMMAND), expected, atol=2e-5)


def test_both_do_the_same_in_a_control_step(both: tuple[Player, Controller]) -> None:
    player, controller = both
    data = same_state(player, controller)
    with torch.inference_mode():
        action = player.policy(seen(player))
        found = controller.policy(controller.observe(data, COMMAND))
        np.testing.assert_allclose(found, action[0].numpy(), atol=1e-4)
        player.env.step(action)
    for _ in range(4):
        controller.step(data, COMMAND)
    state: Any = player.env.unwrapped.sim.data
    np.testing.assert_allclose(data.qpos[7:], state.qpos[0, 7:].numpy(), atol=1e-5)
    np.testing.assert_allclose(data.qvel[6:], state.qvel[0, 6:].numpy(), atol=1e-3)
