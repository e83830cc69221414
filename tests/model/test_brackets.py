"""A bracket without mass joins the trunk and a part on it that does not touch it."""

# pyright: reportAttributeAccessIssue=false
# (MuJoCo's compiled modules carry no types.)
from __future__ import annotations

from pathlib import Path

import mujoco
import numpy as np
import pytest

import draft
from draft.imports.importer import spec_of, translate
from draft.model.model import preview
from tests.helpers import robot

SURVEY = Path(__file__).resolve().parents[3] / "shared" / "robots" / "survey"
NEAR = 0.005  # [m]


def hung(height: float) -> mujoco.MjModel:
    """Compile a trunk, 0.1 m high, with one leg below its origin."""
    spec = robot(children=[{"chain": "leg", "at": [0, 0, -height]}])
    return preview(spec.resolve()).mujoco


def gap(model: mujoco.MjModel, first: str, second: str) -> float:
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    a, b = model.geom(first).id, model.geom(second).id
    return mujoco.mj_geomDistance(model, data, a, b, 10.0, None)


def test_a_drive_below_its_trunk_gets_a_bracket_that_touches_both() -> None:
    model = hung(0.25)
    assert gap(model, "trunk_trunk", "housing_motor") > 0.08
    assert gap(model, "trunk_trunk", "housing_bracket") <= 0
    assert gap(model, "housing_motor", "housing_bracket") <= 0


def test_a_bracket_has_no_mass_and_touches_nothing() -> None:
    apart, joined = hung(0.25), hung(0.05)
    assert apart.ngeom == joined.ngeom + 1  # None where the drive touches.
    np.testing.assert_array_equal(apart.body_mass, joined.body_mass)
    np.testing.assert_array_equal(apart.body_inertia, joined.body_inertia)
    bracket = apart.geom("housing_bracket")
    assert bracket.contype[0] == bracket.conaffinity[0] == 0


def test_shipped_robots_need_none() -> None:
    for name in draft.shipped():
        assert "_bracket" not in draft.load(name).resolve().build().xml


@pytest.mark.slow
@pytest.mark.skipif(not SURVEY.is_dir(), reason="needs the surveyed descriptions")
def test_no_part_of_a_surveyed_robot_hangs_off_its_trunk() -> None:
    held: dict[str, float] = {}
    for file in sorted(SURVEY.glob("*.urdf")):
        design = spec_of(translate(file, "robot")).resolve()
        model = preview(design).mujoco
        trunk = design.bodies[0].name + design.trunk.suffix
        for i, body in enumerate(design.bodies):
            solids = [body.name + solid.suffix for solid in body.solids()]
            if body.parent != 0 or not solids:
                continue
            distance = min(gap(model, trunk, one) for one in solids)
            if distance > NEAR:
                bracket = f"{body.name}_bracket"
                assert gap(model, trunk, bracket) <= 0, (file.stem, i)
                assert min(gap(model, bracket, one) for one in solids) <= 0, (file.stem, i)
                held[file.stem] = max(distance, held.get(file.stem, 0.0))
    assert len(held) > 20
    assert max(held.values()) > 0.1
