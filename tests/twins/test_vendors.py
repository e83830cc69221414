"""Real robots come through the import: axes, anchors and masses; nothing of their inertia."""

# pyright: reportAttributeAccessIssue=false
# (MuJoCo's compiled modules carry no types.)
from __future__ import annotations

import csv
import math
import os
import re
import shutil
from pathlib import Path

import mujoco
import numpy as np
import pytest

from draft.description.description import Description
from draft.description.read import describe
from draft.imports.ends import WHEEL_DENSITY
from draft.imports.importer import Imported, import_robot, translate
from draft.values import Array

SHARED = Path(os.environ.get("DRAFT_SHARED", Path(__file__).parents[2].parent / "shared"))
ROBOTS = SHARED / "robots"
TWINS = {
    "g1": ("g1/g1_29dof_rev_1_0.urdf", 1.09),
    "h2": ("h2/H2.urdf", 0.99),
    "go2": ("go2/go2_description.urdf", 0.99),
    "b2": ("b2/b2_description.urdf", 0.92),
}
pytestmark = pytest.mark.skipif(not ROBOTS.is_dir(), reason="the robots are not beside this folder")


def vendors_hinges(description: Description, base: str) -> dict[str, tuple[Array, Array]]:
    """Point and axis of every moving joint in the frame of a link, zero pose."""
    poses = {description.root: (np.zeros(3), np.eye(3))}
    hinges: dict[str, tuple[Array, Array]] = {}
    waiting = [description.root]
    while waiting:
        name = waiting.pop()
        position, rotation = poses[name]
        for joint in description.children[name]:
            at = position + rotation @ np.array(joint.position)
            turn = rotation @ np.array(joint.rotation)
            poses[joint.child] = (at, turn)
            waiting.append(joint.child)
            hinges[joint.name] = (at + turn @ np.array(joint.anchor), turn @ np.array(joint.axis))
    position, rotation = poses[base]
    return {
        name: (rotation.T @ (at - position), rotation.T @ axis)
        for name, (at, axis) in hinges.items()
    }


def misplaced(
    found: Imported, description: Description, align: bool = False
) -> tuple[float, float]:
    """Largest distance of a hinge's point [m] and angle of its axis [rad] from the vendor's.

    A hinge between the vendor's base and the trunk is seen from its other side.
    """
    model = found.spec.resolve().build().mujoco
    data = mujoco.MjData(model)
    data.qpos[:] = 0
    data.qpos[3] = 1
    mujoco.mj_forward(model, data)
    hinges = vendors_hinges(description, found.spec.bodies[0].name)
    joints = [model.joint(own).id for own in found.joints.values()]
    points = np.array([hinges[name][0] for name in found.joints])
    axes = np.array([hinges[name][1] for name in found.joints])
    # An import may turn the trunk upright: robots can be laid onto each other first.
    own, middle = data.xanchor[joints], points.mean(axis=0)
    turn = np.eye(3)
    if align:
        own = own - own.mean(axis=0)
        left, _, right = np.linalg.svd(own.T @ (points - middle))
        flip = np.diag([1.0, 1.0, np.sign(np.linalg.det(left @ right))])
        turn = left @ flip @ right
        own = own + middle @ turn.T
    gap = np.linalg.norm(own @ turn - points, axis=1).max()
    turned = np.linalg.norm(np.cross(data.xaxis[joints] @ turn, axes), axis=1).max()
    angle = math.asin(min(float(turned), 1.0))
    return float(gap), angle


@pytest.mark.parametrize("name", TWINS)
def test_a_twin_stands_like_the_vendors_and_weighs_nearly_as_much(
    name: str, tmp_path: Path
) -> None:
    file, ratio = TWINS[name]
    found = import_robot(ROBOTS / "twins" / file, tmp_path / name)
    description = describe(ROBOTS / "twins" / file)
    assert len(found.joints) == len(description.moving)
    gap, angle = misplaced(found, description)
    assert gap < 1e-4
    assert angle < math.radians(0.1)
    design = found.spec.resolve()
    assert design.accepted
    assert float(design.mass) / description.mass == pytest.approx(ratio, abs=0.01)


def test_wheels_weigh_what_those_that_were_measured_do() -> None:
    measured: list[float] = []
    for key in ("deeprobotics_m20", "deeprobotics_m20s"):
        for link in describe(ROBOTS / "survey" / f"{key}.urdf").links.values():
            if link.name.endswith("_wheel"):
                assert link.inertial is not None
                sizes = [shape.size for shape in link.geometries if shape.kind == "cylinder"]
                measured += [link.inertial.mass / (math.pi * r * r * h) for r, h in sizes]
    assert len(measured) == 8
    assert float(np.median(measured)) == pytest.approx(WHEEL_DENSITY, abs=0.5)


@pytest.mark.parametrize("name", TWINS)
def test_no_mass_or_inertia_of_the_vendor_enters(name: str, tmp_path: Path) -> None:
    source = ROBOTS / "twins" / TWINS[name][0]
    shutil.copytree(source.parent, tmp_path / name)
    path = tmp_path / name / source.name
    before = translate(path, name).texts
    text = path.read_text(encoding="utf-8")
    poisoned = re.sub(r'<mass value="[^"]*"', '<mass value="123.4"', text)
    poisoned = re.sub(r'\bi([xyz]{2})="[^"]*"', r'i\1="5.6"', poisoned)
    assert poisoned != text
    path.write_text(poisoned, encoding="utf-8")
    assert translate(path, name).texts == before


@pytest.mark.slow
def test_the_surveys_robots_import_and_build(tmp_path: Path) -> None:
    with (ROBOTS / "manifest.csv").open(encoding="utf-8", newline="") as file:
        rows = [row for row in csv.DictReader(file) if row["used_in_fit"] == "true"]
    assert len(rows) == 49
    for row in rows:
        path = ROBOTS / row["file"]
        found = import_robot(path, tmp_path / row["key"])
        assert found.spec.population == row["population"], row["key"]
        gap, angle = misplaced(found, describe(path), align=True)
        assert gap < 1e-4, row["key"]
        assert angle < math.radians(0.1), row["key"]
