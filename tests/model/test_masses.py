"""What MuJoCo weighs is what the design says, to the kilogram and to the inertia."""

# pyright: reportAttributeAccessIssue=false
# (MuJoCo's compiled modules carry no types.)
from __future__ import annotations

import math
from typing import Any

import mujoco
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import draft
from draft.errors import ModelError
from draft.laws.structure import population
from draft.model import mjcf
from draft.model.model import preview
from tests.helpers import leg, robot
from tests.model.shipped import SHIPPED, built

QUADRUPED = draft.load("quadruped")


def inertia(model: mujoco.MjModel, body: str) -> np.ndarray:
    """Inertia of a body about its centre of mass along its own axes [kg m2], shape (3, 3)."""
    rotation = np.empty(9)
    mujoco.mju_quat2Mat(rotation, model.body(body).iquat)
    turn = rotation.reshape(3, 3)
    return turn @ np.diag(model.body(body).inertia) @ turn.T


@pytest.mark.parametrize(("name", "label"), SHIPPED)
def test_mujoco_weighs_every_body_as_the_design_does(name: str, label: str | None) -> None:
    design, model = built(name, label).design, built(name, label).mujoco
    for body, mass in design.body_masses().items():
        assert model.body(body).mass[0] == pytest.approx(mass, rel=1e-6)
    assert model.body_subtreemass[0] == pytest.approx(design.mass, rel=1e-6)


values = st.fixed_dictionaries(
    {
        "thigh_length": st.floats(0.15, 0.9),
        "shank_length": st.floats(0.1, 0.9),
        "hip_offset": st.floats(0.15, 0.4),
        "trunk_length": st.floats(0.6, 1.5),
        "trunk_width": st.floats(0.05, 1.0),
        "actuators.leg.peak_torque": st.floats(20, 100),
    }
)


@settings(max_examples=10)
@given(values)
def test_whatever_the_parameters_mujoco_weighs_the_design(table: dict[str, float]) -> None:
    design = QUADRUPED.resolve(table)
    model = preview(design).mujoco  # The motors of some are too weak for the filter.
    expected = [float(mass) for mass in design.body_masses().values()]
    assert model.body_mass[1:] == pytest.approx(expected, rel=1e-6)


WAISTED = {
    "axis": "z",
    "sections": [
        {"at": -0.2, "rectangle": [0.3, 0.2], "chamfer": 0.2},
        {"at": 0.05, "rectangle": [0.06, 0.05], "chamfer": 0.1, "offset": [0.02, 0.01]},
        {"at": 0.2, "rectangle": [0.2, 0.3], "chamfer": 0.3},
    ],
}
NOTCHED = {
    "axis": "x",
    "sections": [
        {"at": at, "polygon": [[-0.1, -0.1], [0.1, -0.1], [0.1, 0.1], [0.0, -0.05], [-0.1, 0.1]]}
        for at in (-0.2, 0.2)
    ],
}
MIXED = {
    "axis": "y",
    "sections": [
        {"at": -0.1, "rectangle": [0.2, 0.2], "chamfer": 0},
        {"at": 0.1, "rectangle": [0.2, 0.2], "chamfer": 0.3},
    ],
}


@pytest.mark.parametrize("root", [WAISTED, NOTCHED, MIXED], ids=["waisted", "notched", "mixed"])
def test_a_trunks_inertia_is_exact_for_its_shape(root: dict[str, Any]) -> None:
    design = robot(root=root).resolve()
    model, trunk = design.build().mujoco, design.trunk
    expected = trunk.loft.inertia * trunk.density
    bound = 1e-6 * np.abs(expected).max()
    assert inertia(model, "trunk") == pytest.approx(expected, abs=bound)
    assert model.body("trunk").ipos == pytest.approx(trunk.loft.com, abs=1e-6)


def test_a_waisted_trunk_is_not_weighed_by_its_convex_hull() -> None:
    design = robot(root=WAISTED).resolve()
    xml = design.build().xml
    hull = mujoco.MjModel.from_xml_string(xml.replace('inertia="exact"', 'inertia="convex"'))
    assert hull.body("trunk").mass[0] > 1.5 * float(design.trunk.mass)


def test_the_inertia_of_a_thigh_is_that_of_its_rod_and_its_actuator() -> None:
    link = {"axis": "-z", "length": 0.3, "mass": 0.7, "segment": "thigh", "radius": 0.02}
    design = robot(leg(thigh={"link": link})).resolve()
    a: Any = design.actuators["leg"]
    rod, motor, r, h = 0.7, a.mass, a.radius, a.length
    com = (rod * 0.15 + motor * 0.3) / (rod + motor)
    about_x = rod * (0.3**2 / 12 + 0.02**2 / 4 + (0.15 - com) ** 2)
    # The actuator lies along y.
    about_x += motor * (h**2 / 12 + r**2 / 4 + (0.3 - com) ** 2)
    about_z = rod * 0.02**2 / 2 + motor * (h**2 / 12 + r**2 / 4)
    model = design.build().mujoco
    found = inertia(model, "thigh")
    assert model.body("thigh").ipos == pytest.approx([0, 0, -com], abs=1e-9)
    assert found[0, 0] == pytest.approx(about_x, rel=1e-6)
    assert found[2, 2] == pytest.approx(about_z, rel=1e-6)


def test_a_foot_sphere_and_its_rod_have_the_textbook_inertia() -> None:
    sphere = {"radius": 0.03, "mass": 0.1}
    shank = {"axis": "-z", "length": 0.25, "mass": 0.5, "segment": "shank", "radius": 0.01}
    model = robot(leg(shank={"link": shank, "sphere": sphere})).resolve().build().mujoco
    rod, ball = 0.4, 0.1
    com = (rod * 0.125 + ball * 0.25) / 0.5
    about_x = rod * (0.25**2 / 12 + 0.01**2 / 4 + (0.125 - com) ** 2)
    about_x += ball * (0.4 * 0.03**2 + (0.25 - com) ** 2)
    found = inertia(model, "shank")
    assert found[0, 0] == pytest.approx(about_x, rel=1e-6)
    assert found[2, 2] == pytest.approx(rod * 0.01**2 / 2 + ball * 0.4 * 0.03**2, rel=1e-6)


def test_a_foot_plate_is_a_box_of_its_mass() -> None:
    plate = {
        "length": 0.2,
        "width": 0.08,
        "thickness": 0.02,
        "offset": 0.03,
        "mass": 0.15,
        "site": "sole",
    }
    chain = leg(shank={"type": "foot", "plate": plate, "sphere": None})
    model = robot(chain).resolve().build().mujoco
    geom = model.geom("shank_end")
    assert geom.size == pytest.approx([0.1, 0.04, 0.01])
    assert geom.pos == pytest.approx([0.03, 0, -0.25 + 0.01])
    assert model.site("sole_front_left").pos == pytest.approx([0.13, 0.04, -0.25])
    assert model.site("sole_rear_right").pos == pytest.approx([-0.07, -0.04, -0.25])
    assert model.site("sole_toe").pos == pytest.approx([0.13, 0, -0.25])


def test_a_model_that_weighs_something_else_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    design = robot().resolve()
    right = mjcf.body_masses(design)
    monkeypatch.setattr(mjcf, "body_masses", lambda _: right * np.array([1, 1, 1.00001, 1]))
    with pytest.raises(ModelError, match="the mass of 'thigh' is"):
        design.build()


def test_the_sphere_of_a_foot_has_the_mass_the_design_gives_it() -> None:
    design = robot().resolve()
    shank = design.bodies[3]
    ball = min(population("quadruped").end_density * 4 / 3 * math.pi * 0.02**3, shank.mass / 2)
    assert shank.end_mass == pytest.approx(ball)
