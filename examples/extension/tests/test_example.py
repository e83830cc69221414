"""The extension, as a user tests it: with Draft and the package installed."""

from __future__ import annotations

import math
import re
from pathlib import Path

import numpy as np
import pytest

import draft

HOPPER = Path(draft.__file__).parent / "robots" / "hopper"


def padded(pad: str) -> draft.Spec:
    """The hopper on a pad in place of its ball."""
    files = {name: (HOPPER / name).read_text() for name in ("parameters.yaml", "root.yaml")}
    tree = (HOPPER / "tree.yaml").read_text().replace("type: sphere", "type: pad")
    return draft.Spec.parse({**files, "tree.yaml": re.sub(r"sphere: \{.*\}", pad, tree)})


def test_the_metric_is_one_of_draft() -> None:
    design = draft.load("quadruped").resolve("cheetah")
    found = draft.metrics.of_design(design, ["fall_time"])["fall_time"]
    assert design.leg_length is not None
    assert found == pytest.approx(math.sqrt(design.leg_length / 9.81))
    many = draft.load("quadruped").resolve({"thigh_length": np.array([0.3, 0.4])})
    assert np.shape(draft.metrics.of_design(many)["fall_time"]) == (2,)
    assert draft.metrics.find("fall_time").doc.startswith("Time constant of falling over")


def test_the_primitive_is_weighed_compiled_and_exported(tmp_path: Path) -> None:
    design = padded("pad: {radius: 0.05, thickness: 0.02, site: foot}").resolve()
    assert design.accepted
    model = design.build()
    geom = model.mujoco.geom("shin_end")
    assert geom.size[:2] == pytest.approx([0.05, 0.01])  # radius and half thickness
    folder = draft.export(model, tmp_path / "padded")
    assert 'radius="0.05"' in (folder / "robot.urdf").read_text()
    assert (folder / "robot.glb").is_file()


def test_a_mistake_in_the_primitive_has_its_place() -> None:
    with pytest.raises(draft.SpecError, match=r"tree.yaml:\d+:\d+: 'thickness' is missing"):
        padded("pad: {radius: 0.05, site: foot}")


def test_the_exporter_writes_its_table(tmp_path: Path) -> None:
    design = draft.load("hopper").resolve()
    folder = draft.export(design, tmp_path / "hopper", ["bodies", "mjcf"])
    head, *rows = (folder / "bodies.csv").read_text().splitlines()
    assert head == "name,mass,x,y,z"
    assert sum(float(row.split(",")[1]) for row in rows) == pytest.approx(design.mass, rel=1e-5)
    draft.export(design, folder)  # known as Draft's own, so that the folder is replaced
    assert not (folder / "bodies.csv").exists()


def test_the_reward_has_its_numbers_among_those_of_the_task() -> None:
    from draft.learn.task.config import Config

    rows = {row.name: row for row in Config().rows(scale=4.0)["standing"]}
    assert rows["standing.weight"].value == -0.5
    assert rows["standing.gate"].scaled == pytest.approx(0.2)
    with pytest.raises(draft.DraftError, match=r"standing\.gate must be at least 0"):
        Config().with_values({"standing.gate": -1})


def test_the_reward_is_zero_unless_a_robot_moves_that_should_stand() -> None:
    pytest.importorskip("mjlab")
    from mjlab.envs import ManagerBasedRlEnv

    from draft.learn.bodies.legged import legged_robot
    from draft.learn.task.mdp.environment import environment
    from draft.learn.task.world.access import command_of
    from draft.learn.task.world.task import Task

    members = (legged_robot(draft.load("quadruped").resolve("cheetah")),)
    env = ManagerBasedRlEnv(environment(Task(members, ground="flat"), 3), "cpu")
    env.reset()
    env.sim.data.qvel[1:, 0] = 0.3
    env.sim.forward()
    command_of(env)[:] = 0.0
    command_of(env)[2, 0] = 1.0
    env.reward_manager.compute(dt=env.step_dt)
    column = env.reward_manager.active_terms.index("standing")
    still, moving, walking = env.reward_manager._step_reward[:, column].tolist()
    assert (still, walking) == pytest.approx((0.0, 0.0), abs=1e-6)
    assert moving == pytest.approx(-0.15, rel=0.05)
