"""A robot in the page moves as the same robot does natively."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from draft.browser.page import page
from draft.design.references import open_design
from draft.learn.policy.validity import fit
from draft.learn.policy.walk import Walk
from draft.model.model import preview

pytestmark = pytest.mark.slow
pytest.importorskip("mjswan", reason="needs the extra page")

STEPS = 400
# Steps with the whole state of the robot, its observation, action and torques.
RECORD = """([command, steps]) => {
  const robot = draftPage.robots[0], rows = [];
  robot.qpos.fill(0);
  robot.restart();
  robot.command = command;
  for (let i = 0; i < steps; i++) {
    robot.step();
    rows.push([robot.qpos, robot.observation, robot.action, robot.torque].map((one) => [...one]));
  }
  return rows;
}"""
# Joint positions after 100 steps are within 1e-5 rad; single precision of the network and the order
# of sums let a robot that runs drift apart from there.
FIRST, PRECISE, WHOLE = 100, 1e-5, 1e-3


@pytest.mark.parametrize(
    ("design", "skill"),
    [
        *((name, skill) for name in ("cheetah", "bear", "giraffe") for skill in ("walk", "run")),
        ("cheetah", "push"),
        ("hexapod", "walk"),
        ("humanoid", "walk"),
    ],
)
def test_states_observations_actions_and_torques_are_the_native_ones(
    design: str, skill: str, tmp_path: Path, opened: Callable[[Path, str], Any]
) -> None:
    page([design], tmp_path / "page", skill)
    tab = opened(tmp_path / "page", "#slow=0")
    model = preview(open_design(design))
    chosen = fit(model, skill)
    command = [0.6 * chosen.policy.forward, 0.05, 0.2]
    rows = tab.evaluate(RECORD, [command, STEPS])
    walk = Walk(model, chosen, (command[0], command[1], command[2]))
    peak, seen = chosen.policy.peak_torque, walk.controller.observe(walk.data, command)
    for i, (position, observation, action, torque) in enumerate(rows):
        if i % round(chosen.policy.control_period / chosen.policy.timestep) == 0:
            seen = walk.controller.observe(walk.data, command)
        walk.step()
        near = PRECISE if i < FIRST else WHOLE
        off = np.abs(np.array(position) - walk.data.qpos)
        assert off[7:].max() < near, f"joint positions after step {i + 1}"
        assert off[:7].max() < near, f"the base after step {i + 1}"
        # Speeds are the positions of one physics step over its time.
        assert np.abs(np.array(observation) - seen).max() < near * 100
        acted = chosen.policy(seen)
        assert np.abs(np.array(action) - acted).max() < near * 100
        native = walk.data.qfrc_applied[walk.controller.dofs]
        assert (np.abs(np.array(torque) - native) / peak).max() < near * 100


def test_a_robot_that_falls_lies_for_a_moment_and_starts_again(
    tmp_path: Path, opened: Callable[[Path, str], Any]
) -> None:
    page(["cheetah"], tmp_path / "page")
    tab = opened(tmp_path / "page", "#slow=0")
    found = tab.evaluate(
        """() => {
          const robot = draftPage.robots[0], heights = [];
          robot.push(0, 9);
          for (let i = 0; i < 600; i++) { robot.walk(); heights.push(robot.qpos[2]); }
          return [robot.falls, Math.min(...heights), robot.qpos[2], robot.numbers.home_position[2]];
        }"""
    )
    falls, least, last, home = found
    assert falls == 1
    assert least < 0.5 * home < 0.8 * home < last
