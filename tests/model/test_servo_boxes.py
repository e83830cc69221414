"""A servo is a box beside its output axis: where it lies, what it weighs, and what reads it.

MuJoCo's compiled inertia and statics, and textbook formulas, are the judges.
"""

# pyright: reportAttributeAccessIssue=false
# (MuJoCo's compiled modules carry no types.)
from __future__ import annotations

import math
from typing import Any
from xml.etree import ElementTree

import mujoco
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import draft
from draft import geometry as g
from draft.design.loads import home_loads
from draft.design.solids import Block, solid
from draft.errors import ResolveError
from draft.laws.catalogue import SERVO, catalogue
from draft.laws.servos import usual_face_ratio
from draft.model.batch import build_batch
from draft.model.shapes import shapes
from draft.model.urdf import robot_urdf
from draft.values import Array, scalar
from tests import fixed
from tests.helpers import ids, parameter
from tests.model.test_batch import (
    TOLERANCE,
    assert_within,
    errors_of_dynamics,
    errors_of_fields,
)
from tests.model.test_masses import inertia

XC330 = {"like": "XC330-M288"}
HIGH, WIDE, LONG, MASS = 0.034, 0.020, 0.026, 0.023  # Its box and its mass, as its maker prints.
OFF = (HIGH - WIDE) / 2  # From its axis to its middle: half of its width is beyond the axis.
ROD = {"axis": "z", "length": 0.1, "mass": 0.03, "radius": 0.004}
components = st.tuples(*[st.integers(-100, 100)] * 3).filter(any)


def machine(motor: dict[str, Any], link: dict[str, Any] | None = None, **more: Any) -> draft.Spec:
    """A link with a servo at its tip, and a passive hinge that moves it."""
    arm = {
        "name": "arm",
        "joint": {"name": "swing", "axis": "y", "range": [-1, 1]},
        "motor": {"actuator": "servo", "axis": "y"} | motor,
    }
    if link is not None:
        arm["link"] = link
    hand = {
        "name": "hand",
        "joint": {"name": "turn", "axis": "y", "range": [-1, 1], "actuator": "servo"},
        "link": {"axis": "z", "length": 0.2, "mass": 0.01},
    }
    files = {
        "parameters.yaml": {
            "name": "tester",
            "population": "humanoid",
            "parameters": more.get("parameters", {}),
            "actuators": {"servo": more.get("servo", XC330)},
            "allow": ["cannot_hold", "below_floor"],
        },
        "tree.yaml": {
            "tree": {
                "name": "base",
                "type": "fixed",
                "at": [0, 0, 1],
                "children": [{"chain": "limb", **more.get("use", {})}],
            },
            "chains": {"limb": [arm, hand]},
        },
    }
    return draft.Spec.parse(files)


def block(design: draft.Design, body: str = "arm") -> Block:
    """Box of the servo of a body, in the frame of the body."""
    (geom,) = (b.motor_geom for b in design.bodies if b.name == body)
    assert geom is not None
    assert geom.form == "box"
    found = solid(geom, g.ORIGIN)
    assert isinstance(found, Block)
    return found


def unit(v: Any) -> Array:
    """Vector of length one."""
    return np.asarray(v, dtype=float) / np.linalg.norm(v)


def across(v: Any, axis: Array) -> Array:
    """Unit vector: the part of a vector across an axis."""
    return unit(np.asarray(v, dtype=float) - (np.asarray(v) @ axis) * axis)


def test_the_edges_of_a_catalogue_servo_are_those_that_its_maker_prints() -> None:
    servo = machine({}, ROD).resolve().actuators["servo"]
    assert (servo.width, servo.height, servo.length) == pytest.approx((WIDE, HIGH, LONG))
    assert servo.surface == pytest.approx(2 * (HIGH * WIDE + HIGH * LONG + WIDE * LONG))
    printed = {part.name: part for part in catalogue(SERVO).values()}
    assert len(printed) == 116
    assert all((part.face_ratio or 0) >= 1 for part in printed.values())


def test_a_servo_by_its_laws_has_the_face_of_the_usual_servo_and_its_volume() -> None:
    stated = {"kind": "servo", "peak_torque": 3, "no_load_speed": 6}
    servo = machine({}, ROD, servo=stated).resolve().actuators["servo"]
    assert servo.height / servo.width == pytest.approx(usual_face_ratio())
    assert f"{usual_face_ratio():.2f}" == "1.82"  # As docs/actuator-trends.md says.
    assert servo.width * servo.height * servo.length == pytest.approx(servo.volume)
    assert servo.width * servo.height == pytest.approx(math.pi * servo.radius**2)


def test_edges_say_where_they_are_from() -> None:
    printed = machine({}, ROD).resolve().actuators["servo"]
    assert (printed.origins["width"].kind, printed.origins["width"].detail) == (
        *("catalogue", "XC330-M288"),
    )
    wider = machine({}, ROD, servo=XC330 | {"radius": 0.02}).resolve().actuators["servo"]
    assert wider.origins["height"].kind == "derived"
    assert wider.height / wider.width == pytest.approx(HIGH / WIDE)
    stated = {"kind": "servo", "peak_torque": 3, "no_load_speed": 6}
    design = machine({}, ROD, servo=stated).resolve()
    bands = design.actuator_bands()["servo"]
    for edge in ("width", "height"):
        share = getattr(design.actuators["servo"], edge) / design.actuators["servo"].radius
        assert list(bands[edge]) == pytest.approx([share * end for end in bands["radius"]])
    module = draft.load("quadruped").resolve().actuators["leg"]
    assert not {"width", "height"} & {*module.quantities}


def test_expressions_read_the_edges_and_a_module_has_its_diameter() -> None:
    room = parameter("servo.height + 10 * servo.width + 100 * servo.length")
    design = machine({}, ROD, parameters={"room": room}).resolve()
    assert design.parameters["room"] == pytest.approx(HIGH + 10 * WIDE + 100 * LONG)
    module = draft.load("quadruped").resolve().actuators["leg"]
    assert module.width == module.height == 2 * module.radius
    assert not module.is_box


AXES = {
    "x": (1, 0, 0),
    "y": (0, 1, 0),
    "z": (0, 0, 1),
    "-x": (-1, 0, 0),
    "-z": (0, 0, -1),
}


@pytest.mark.parametrize(
    ("axis", "member", "long", "points"),
    [
        ("y", "z", None, "-z"),
        ("y", "x", None, "-x"),
        ("x", "-z", None, "z"),
        ("z", "z", None, "-x"),
        ("y", "y", None, "-z"),
        ("y", None, None, "-z"),
        ("z", None, None, "-x"),
        ("y", "z", "x", "x"),
        ("z", "z", "-x", "-x"),
        ("y", "z", [3, 50, 0], "x"),
    ],
)
def test_the_box_extends_back_along_its_link_unless_its_long_side_is_stated(
    axis: str, member: str | None, long: Any, points: str
) -> None:
    motor: dict[str, Any] = {"axis": axis} | ({"long": long} if long is not None else {})
    link = None if member is None else {**ROD, "axis": member}
    design = machine(motor, link).resolve()
    box = block(design)
    tip = np.zeros(3) if member is None else 0.1 * np.array(AXES[member])
    assert np.array(box.center) == pytest.approx(tip + OFF * np.array(AXES[points]))
    # The horn is in the middle of the short side, as far from the near end as from both sides.
    reach = [box.extent(tuple(d)) for d in np.eye(3)]
    sizes = {"x": HIGH / 2, "y": WIDE / 2, "z": LONG / 2}
    named = {"x": points[-1], "z": axis}
    named["y"] = next(name for name in "xyz" if name not in named.values())
    assert reach == pytest.approx([sizes[k] for name in "xyz" for k in sizes if named[k] == name])
    near = np.array(box.center) - (HIGH / 2) * np.array(AXES[points])
    assert np.linalg.norm(near - tip) == pytest.approx(WIDE / 2)


@settings(max_examples=25)
@given(axis=components, long=components, member=components, shift=components)
def test_mass_centre_and_inertia_are_those_of_a_box_and_a_rod(
    axis: Any, long: Any, member: Any, shift: Any
) -> None:
    """The tensor of the textbook, about the common centre, for any directions."""
    e_axis, e_member = unit(axis), unit(member)
    if np.linalg.norm(np.cross(e_axis, unit(long))) < 0.05:
        return
    moved = 1e-4 * np.array(shift)
    motor = {"axis": list(axis), "long": list(long), "shift": moved.tolist()}
    model = machine(motor, {**ROD, "axis": list(member)}).resolve().build().mujoco
    e_long = across(long, e_axis)
    e_wide = np.cross(e_axis, e_long)
    middle = 0.1 * e_member + moved + OFF * e_long
    edges = ((e_long, WIDE, LONG), (e_wide, HIGH, LONG), (e_axis, HIGH, WIDE))
    box = sum(MASS / 12 * (a * a + b * b) * np.outer(e, e) for e, a, b in edges)
    r, h, m = 0.004, 0.1, 0.03
    along, about = m * r * r / 2, m * (3 * r * r + h * h) / 12
    rod = about * np.eye(3) + (along - about) * np.outer(e_member, e_member)
    centre = (MASS * middle + m * 0.05 * e_member) / (MASS + m)
    whole = box + rod
    for mass, place in ((MASS, middle), (m, 0.05 * e_member)):
        d = place - centre
        whole = whole + mass * (d @ d * np.eye(3) - np.outer(d, d))
    assert model.body("arm").mass[0] == pytest.approx(MASS + m)
    assert model.body("arm").ipos == pytest.approx(centre, abs=1e-9)
    bound = 1e-6 * np.trace(whole)
    assert inertia(model, "arm") == pytest.approx(whole, abs=bound)


def test_a_box_alone_has_the_inertia_of_the_textbook() -> None:
    model = machine({"long": "x"}).resolve().build().mujoco
    x, y, z = HIGH, LONG, WIDE
    expected = np.diag([y * y + z * z, z * z + x * x, x * x + y * y]) * MASS / 12
    assert inertia(model, "arm") == pytest.approx(expected, rel=1e-9, abs=1e-15)


@pytest.mark.parametrize("mirror", ["x", "y", "xy"])
def test_a_mirrored_box_is_the_mirror_image(mirror: str) -> None:
    motor = {"axis": [1, 2, 0.5], "long": [0.3, -0.1, 1], "shift": [0.01, 0.02, 0.005]}
    link = {**ROD, "axis": [0.2, 0.4, 1]}
    one, two = (machine(motor, link, use=use).resolve() for use in ({}, {"mirror": mirror}))
    signs = np.array([-1.0 if name in mirror else 1.0 for name in "xyz"])
    a, b = block(one), block(two)
    assert np.array(b.center) == pytest.approx(signs * np.array(a.center))
    corners = [
        {
            tuple(np.round(flip * (np.array(s.center) + np.array(k) @ halves), 9) + 0.0)
            for k in np.array(np.meshgrid(*[[-1, 1]] * 3)).T.reshape(-1, 3)
        }
        for s, flip in ((a, signs), (b, np.ones(3)))
        for halves in [np.array(s.edges) * np.array(s.halves)[:, None]]
    ]
    assert corners[0] == corners[1]
    tensors = [inertia(design.build().mujoco, "arm") for design in (one, two)]
    assert tensors[1] == pytest.approx(np.outer(signs, signs) * tensors[0], abs=1e-12)


def test_gravity_acts_on_the_middle_of_the_box() -> None:
    """Torques of Draft's own statics are those of MuJoCo."""
    model = draft.load("hand").resolve().build()
    data = mujoco.MjData(model.mujoco)
    for name, joint in model.design.joints.items():
        data.joint(name).qpos[0] = joint.home
    mujoco.mj_forward(model.mujoco, data)
    loads = [load for load in home_loads(model.design) if abs(load.torque) > 1e-4]
    assert loads
    for load in loads:
        (torque,) = data.joint(load.joint.names[0]).qfrc_bias
        assert abs(scalar(load.torque)) == pytest.approx(abs(torque), rel=1e-6)


def test_mjcf_urdf_and_shapes_have_the_box() -> None:
    model = machine({"long": "x"}, ROD).resolve().build()
    drawn = next(s for s in shapes(model.mujoco, model.design) if s.name == "arm_motor")
    assert drawn.form == "box"
    assert drawn.size == pytest.approx((HIGH / 2, WIDE / 2, LONG / 2))
    assert drawn.rotation @ [1, 0, 0] == pytest.approx([1, 0, 0])
    assert drawn.rotation @ [0, 0, 1] == pytest.approx([0, 1, 0])
    root = ElementTree.fromstring(robot_urdf(model))
    box = root.find(".//link[@name='arm']/visual[@name='arm_motor']/geometry/box")
    assert box is not None
    assert [float(x) for x in box.attrib["size"].split()] == pytest.approx([HIGH, WIDE, LONG])


@pytest.mark.parametrize(("long", "meet"), [("-z", False), ("z", True)])
def test_two_servos_in_a_row_meet_where_one_box_points_at_the_other(long: str, meet: bool) -> None:
    spec = fixed.servo_finger(long)
    assert ("actuator_overlap" in ids(spec.resolve())) == meet


def test_a_box_on_the_axis_of_a_hinge_is_no_body_of_revolution() -> None:
    """The next servo is clear of it at one angle and not at another: that is no overlap."""
    spec = fixed.servo_finger("z", spread=True)
    assert "actuator_overlap" not in ids(spec.resolve())


def test_models_of_a_batch_of_servos_are_those_compiled_alone() -> None:
    motor = {"axis": ["a", 1, "b"], "long": [1, "a", "b"], "shift": ["b / 50", 0, 0]}
    stated = {"kind": "servo", "peak_torque": 3, "no_load_speed": 6}
    numbers = {"a": parameter(0.1), "b": parameter(0.2)}
    spec = machine(motor, ROD, servo=stated, parameters=numbers)
    rng = np.random.default_rng(0)
    values = {
        "a": rng.uniform(-1, 1, 12),
        "b": rng.uniform(-1, 1, 12),
        "actuators.servo.peak_torque": rng.uniform(1, 5, 12),
    }
    design = spec.resolve(values)
    batch = build_batch(design, np.flatnonzero(design.accepted))
    assert len(batch) >= 8
    for place, row in enumerate(batch.rows):
        alone, model = batch.design[row].build().mujoco, batch.model(place)
        assert_within(TOLERANCE, errors_of_fields(alone, model))
        assert_within(TOLERANCE, errors_of_dynamics(alone, model, rng))


def test_default_directions_of_n_designs_are_each_of_theirs() -> None:
    """Where the axis turns along the member in one of them, that one has the next default."""
    link = {**ROD, "axis": ["a", 0, 1]}
    spec = machine({"axis": [0, 0, 1]}, link, parameters={"a": parameter(0.5)})
    several = np.array([-0.5, 0.0, 0.5])
    many = block(spec.resolve({"a": several}))
    for k, value in enumerate(several):
        one = block(spec.resolve({"a": float(value)}))
        center = [np.broadcast_to(x, 3)[k] for x in many.center]
        assert center == pytest.approx(list(one.center), abs=1e-15)


def test_a_long_side_along_the_axis_is_refused_and_marks_one_of_n() -> None:
    with pytest.raises(ResolveError, match="'long' of the motor of arm is along") as caught:
        machine({"long": "-y"}, ROD).resolve()
    assert "long: z" in str(caught.value)
    spec = machine({"long": ["a", 1, 0]}, ROD, parameters={"a": parameter(0.5)})
    many = spec.resolve({"a": np.array([0.5, 0.0, 1.0])})
    (wrong,) = (f for f in many.findings if f.id == "not_physical")
    assert list(np.asarray(wrong.mask)) == [False, True, False]
