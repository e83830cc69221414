"""Chains of many joints: roundings that would add up, and limits of depth."""

from __future__ import annotations

from pathlib import Path

import mujoco
import numpy as np
import pytest

from draft.description.xmlfile import DescriptionError
from draft.imports.importer import Imported
from tests.commands import refusal
from tests.imports.written import imported, joint, link, notes, written


def chain(count: int, kind: str = "revolute", first: str = "revolute") -> str:
    """A chain of equal links, the first of which turns."""
    lines = [link("l0")]
    for i in range(1, count + 1):
        at = (0.013, 0.002, 0.05)
        lines += [link(f"l{i}"), joint(f"j{i}", f"l{i - 1}", f"l{i}", at, kind=kind)]
    text = "\n".join(lines)
    return f'<robot name="snake">\n{text.replace(kind, first, 1)}\n</robot>'


def turned_chain(count: int) -> str:
    """A chain whose frames are turned by quarters to four decimals, with oblique links."""
    rng = np.random.default_rng(0)
    lines = [link("l0")]
    for i in range(1, count + 1):
        x, y, z = rng.uniform(-0.1, 0.1, 3).round(6)
        turn = " ".join(map(str, rng.choice([-1.5708, 0.0, 1.5708], 3)))
        text = joint(f"j{i}", f"l{i - 1}", f"l{i}", (x, y, z), "0 0 1")
        text = text.replace("/><axis", f' rpy="{turn}"/><axis')
        lines += [link(f"l{i}"), text]
    return '<robot name="snake">\n' + "\n".join(lines) + "\n</robot>"


def gaps(found: Imported) -> tuple[float, float]:
    """Largest distance [m] and angle [rad] of hinges from MuJoCo's own model of the file."""
    text = Path("beast.urdf").read_text()
    text = text.replace('">', '"><mujoco><compiler fusestatic="false"/></mujoco>', 1)
    theirs, ours = mujoco.MjModel.from_xml_string(text), found.spec.resolve().build().mujoco
    a, b = mujoco.MjData(theirs), mujoco.MjData(ours)
    rng = np.random.default_rng(1)
    most = [0.0, 0.0]
    for _ in range(10):
        for name, own in found.joints.items():
            a.joint(name).qpos[0] = b.joint(own).qpos[0] = rng.uniform(-1.0, 1.5)
        base = np.zeros(3)
        if ours.jnt_type[0] == mujoco.mjtJoint.mjJNT_FREE:
            b.qpos[:7] = (0, 0, 0, 1, 0, 0, 0)
        else:
            base = ours.body_pos[1]  # A fixed base is raised until nothing is below the floor.
        mujoco.mj_kinematics(theirs, a)
        mujoco.mj_kinematics(ours, b)
        for name, own in found.joints.items():
            gap = a.joint(name).xanchor - (b.joint(own).xanchor - base)
            axis = np.cross(a.joint(name).xaxis, b.joint(own).xaxis)
            most = [
                max(x, float(np.linalg.norm(y))) for x, y in zip(most, (gap, axis), strict=True)
            ]
    return most[0], most[1]


def test_roundings_do_not_add_up_along_a_chain() -> None:
    distance, angle = gaps(imported(turned_chain(100)))
    assert distance < 1e-5
    assert angle < 1e-6


def arms(hinges: int, off: float) -> str:
    """Two arms of as many hinges; each axis of the right one is off by an angle [rad]."""
    lines = [link("base", 10.0)]
    for side, sign in (("left", 1), ("right", -1)):
        above = "base"
        for i in range(hinges):
            at = (0.0, 0.2 * sign, 0.0) if i == 0 else (0.0, 0.0, -0.1)
            axis = (0.0, 1.0, off) if sign < 0 else (0.0, 1.0, 0.0)
            own = f"{side}_l{i}"
            words = " ".join(f"{x:.8f}" for x in axis)
            lines += [link(own), joint(f"{side}_j{i}", above, own, at, words)]
            above = own
    return '<robot name="snake">\n' + "\n".join(lines) + "\n</robot>"


@pytest.mark.parametrize("off", [5e-5, 1.2e-4])
def test_small_differences_of_two_limbs_do_not_add_up(off: float) -> None:
    """Each hinge is within 0.01 degrees of its mirror image, the last one's frame is not."""
    distance, angle = gaps(imported(arms(7, off)))
    assert distance < 1e-4
    assert angle < np.radians(0.01)


def test_a_single_small_difference_leaves_two_limbs_copies() -> None:
    found = imported(arms(7, 1e-6))
    assert found.files.mirrored == 1
    assert not found.files.deviations


@pytest.mark.parametrize("count", [250, 990, 2500])
def test_a_chain_that_is_too_long_is_refused_by_its_joint(count: int) -> None:
    with pytest.raises(DescriptionError, match=r"'j200' is the 200th in series.* at most 199"):
        imported(chain(count))


@pytest.mark.parametrize("command", ["import", "twin"])
def test_a_chain_too_long_ends_the_command_with_a_message(command: str) -> None:
    written(chain(990), "snake.urdf")
    assert refusal(command, "snake.urdf").startswith("snake.urdf:")


def test_the_longest_chain_is_imported() -> None:
    assert len(imported(chain(199)).joints) == 199


def test_links_that_mujoco_cannot_read_are_merged_and_told() -> None:
    found = imported(chain(2000, "fixed"))
    assert len(found.joints) == 1
    (told,) = notes(found, "not compared with MuJoCo's")
    assert "2001 links" in told or "depth limit" in told  # The words of MuJoCo 3, and of 4.
