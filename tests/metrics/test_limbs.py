"""Metrics of arms and hands, against MuJoCo, closed forms and a search of another kind."""

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
from draft import geometry as g
from draft.design.legs import GRAVITY
from draft.design.limbs import home_columns, limbs
from draft.design.machine import kinds, machine
from draft.metrics import METRICS, limits, of_batch, of_design, of_model, payload_for
from draft.metrics.stretch import Chain, Search, Segment, stretched
from draft.metrics.workspace import workspace_volume
from draft.values import Array, scalar
from tests import fixed

ARM, HAND, BOTH = fixed.arm(), fixed.hand(), fixed.arm_and_hand()
SPECS = {"arm": ARM, "hand": HAND, "both": BOTH}
PLANAR, TWO = fixed.planar(3), fixed.planar(2)
LENGTHS = st.floats(0.05, 1.0)
ANGLES = st.floats(-2.9, 2.9)


def value(design: draft.Design, name: str) -> float:
    return scalar(of_design(design, [name])[name])


def at_home(model: draft.Model) -> mujoco.MjData:
    joints = model.design.joints
    return fixed.posed(model.mujoco, {name: scalar(joint.home) for name, joint in joints.items()})


def site_jacobian(model: mujoco.MjModel, data: mujoco.MjData, site: str) -> Array:
    jacobian = np.empty((3, model.nv))
    mujoco.mj_jacSite(model, data, jacobian, None, model.site(site).id)
    return jacobian


# --- what a limb is ------------------------------------------------------------------------


def test_an_arm_ends_at_its_site_and_a_hand_branches_into_fingers() -> None:
    arm, hand, both = (limbs(spec.resolve()) for spec in SPECS.values())
    assert arm.arm is not None
    assert len(arm.arm.joints) == 6
    assert arm.fingers == ()
    assert arm.arm.point == pytest.approx((0, 0, 0.06))
    assert hand.arm is None
    assert [len(finger.joints) for finger in hand.fingers] == [2, 2, 2, 2]
    assert hand.fingers[0].radius == 0.012
    assert both.arm is not None
    assert both.arm.point == arm.arm.point
    assert [len(finger.joints) for finger in both.fingers] == [2, 2]
    assert limbs(draft.load("humanoid").resolve()).outer == ()


def test_kinds_of_machine_are_named() -> None:
    found = {name: (sorted(kinds(spec)), machine(spec.resolve())) for name, spec in SPECS.items()}
    assert found == {
        "arm": (["arm", "fixed"], "fixed arm"),
        "hand": (["fixed", "hand"], "hand of 4 fingers on a fixed base"),
        "both": (["arm", "fixed", "hand"], "fixed arm with a hand of 2 fingers"),
    }
    assert kinds(draft.load("hopper")) == {"floating"}


def test_without_a_site_the_tip_is_the_end_of_the_last_link() -> None:
    found = limbs(TWO.resolve({"length_1": 0.7})).arm
    assert found is not None
    assert found.point == pytest.approx((0.7, 0, 0))


@pytest.mark.parametrize("name", SPECS)
def test_every_metric_of_a_machine_has_a_value(name: str) -> None:
    found = of_model(SPECS[name].resolve().build())
    assert not [one for one, number in found.items() if math.isnan(number)]
    own = {"arm": {"reach", "payload_peak", "workspace_volume"}, "hand": {"pinch_force"}}
    assert all(
        (kind in kinds(SPECS[name])) == (names <= found.keys()) for kind, names in own.items()
    )
    assert {"tip_force", "tip_speed", "manipulability", "reflected_mass"} <= found.keys()
    assert not {"jump_height", "top_speed"} & found.keys()


def test_a_metric_of_another_machine_is_named_with_the_reason() -> None:
    for spec, name, words in (
        (ARM, "pinch_force", "no fingers"),
        (HAND, "reach", "no arm"),
        (HAND, "payload_peak", "no arm"),
        (draft.load("hopper"), "tip_force", "robots on a fixed base; this one floats"),
    ):
        with pytest.raises(draft.DraftError, match=words):
            of_design(spec.resolve(), [name])


# --- against MuJoCo ------------------------------------------------------------------------


@pytest.mark.parametrize("name", SPECS)
def test_jacobians_and_torques_are_those_of_mujoco(name: str) -> None:
    model = SPECS[name].resolve().build()
    data = at_home(model)
    arm, fingers = limbs(model.design)
    for limb in (*([] if arm is None else [arm]), *fingers):
        body = model.design.bodies[limb.path[-1]]
        end: Any = body.link.end
        jacobian = site_jacobian(model.mujoco, data, body.prefix + end.site)
        for column in home_columns(model.design, limb):
            dof = model.mujoco.joint(column.name).dofadr[0]
            assert column.arm == pytest.approx(jacobian[:, dof], abs=1e-9)
            assert GRAVITY * column.torque == pytest.approx(data.qfrc_bias[dof], abs=1e-6)


@pytest.mark.parametrize("name", ["payload_peak", "payload_rated"])
def test_a_body_of_the_payload_at_the_tip_takes_the_limiting_torque(name: str) -> None:
    design = ARM.resolve({"actuators.large.rated_torque": 90, "actuators.small.rated_torque": 15})
    mass = value(design, name)
    assert mass > 1
    (limit, *_) = limits(design, [name])[name]
    stretch = stretched(design)
    assert stretch is not None
    text = mujoco.MjSpec.from_string(design.build().xml)
    site = text.site("grasp")
    load = text.body("tool").add_body(
        pos=list(site.pos), ipos=[0, 0, 0], mass=mass, inertia=[1e-9] * 3
    )
    load.explicitinertial = True
    model = text.compile()
    angles = {x.joint.names[0]: scalar(x.joint.angle) for x in stretch.loads}
    data = fixed.posed(model, angles)
    torque = {name: abs(data.joint(name).qfrc_bias[0]) for name in angles}
    kind = name.removeprefix("payload_") + "_torque"
    strength = {x.joint.names[0]: scalar(getattr(x.actuator, kind)) for x in stretch.loads}
    assert torque[limit.joints[0]] == pytest.approx(strength[limit.joints[0]], rel=1e-6)
    assert all(torque[one] <= strength[one] * (1 + 1e-6) for one in angles)
    tip, shoulder = data.site("grasp").xpos, data.joint("pan").xanchor
    assert math.hypot(*(tip - shoulder)[:2]) == pytest.approx(scalar(stretch.reach), abs=1e-9)


@pytest.mark.parametrize("name", ["arm", "hand"])
def test_the_reflected_mass_is_the_largest_over_directions(name: str) -> None:
    model = SPECS[name].resolve().build()
    data = at_home(model)
    inertia = np.empty((model.mujoco.nv,) * 2)
    mujoco.mj_fullM(model.mujoco, data, inertia)
    rng = np.random.default_rng(0)
    worst = 0.0
    for limb in limbs(model.design).outer:
        body = model.design.bodies[limb.path[-1]]
        end: Any = body.link.end
        dofs = [int(model.mujoco.joint(x.name).dofadr[0]) for x in home_columns(model.design, limb)]
        jacobian = site_jacobian(model.mujoco, data, body.prefix + end.site)[:, dofs]
        mobility = jacobian @ np.linalg.inv(inertia[np.ix_(dofs, dofs)]) @ jacobian.T
        # Directions in which the tip can move are combinations of the columns.
        ways = jacobian @ rng.normal(size=(len(dofs), 20_000))
        ways /= np.linalg.norm(ways, axis=0)
        masses = 1.0 / np.einsum("ik,ij,jk->k", ways, mobility, ways)
        worst = max(worst, masses.max())
    found = of_model(model, ["reflected_mass"])["reflected_mass"]
    assert worst <= found * (1 + 1e-9)
    assert worst == pytest.approx(found, rel=5e-3)


def test_reflected_masses_of_a_batch_are_those_of_each() -> None:
    many = ARM.resolve({"forearm_length": np.array([0.25, 0.35, 0.6])})
    found = of_batch(many.build_batch(), ["reflected_mass"])["reflected_mass"]
    alone = [of_model(one.build(), ["reflected_mass"])["reflected_mass"] for one in many]
    assert found == pytest.approx(alone, rel=1e-9)


# --- closed forms --------------------------------------------------------------------------


@settings(max_examples=25, deadline=None)
@given(lengths=st.tuples(LENGTHS, LENGTHS, LENGTHS), mass=st.floats(0.1, 3))
def test_parallel_links_reach_as_far_as_they_are_long(
    lengths: tuple[float, float, float], mass: float
) -> None:
    values = {f"length_{k}": length for k, length in enumerate(lengths)}
    design = PLANAR.resolve({**values, "mass_0": mass, "mass_1": 1e-6, "mass_2": 1e-6})
    whole = sum(lengths)
    assert value(design, "reach") == pytest.approx(whole, rel=1e-9)
    drive = design.actuators["drive"]
    expected = min(
        scalar(drive.peak_torque) / GRAVITY / whole - mass * lengths[0] / 2 / whole,
        scalar(drive.peak_torque) / GRAVITY / (whole - lengths[0]),
    )
    assert value(design, "payload_peak") == pytest.approx(expected, rel=1e-4)


@settings(max_examples=25, deadline=None)
@given(a=LENGTHS, b=LENGTHS, bend=st.floats(0.3, 2.5))
def test_an_elbow_that_cannot_straighten_shortens_the_reach(
    a: float, b: float, bend: float
) -> None:
    spec = fixed.planar(2, low=-math.pi + 0.01, high=math.pi)
    design = spec.resolve({"length_0": a, "length_1": b})
    first, second = limbs(design).arm.joints  # type: ignore[union-attr]
    ranged = Chain(
        (
            Segment(first, g.ORIGIN, (0.0, 1.0, 0.0), -3.1, 3.1),
            Segment(second, ((a, 0.0, 0.0), None), (0.0, 1.0, 0.0), bend, 2.9),
        ),
        (b, 0.0, 0.0),
    )
    search = Search(ranged)
    search.run()
    assert search.reach() == pytest.approx(math.sqrt(a * a + b * b + 2 * a * b * math.cos(bend)))


@settings(max_examples=25, deadline=None)
@given(a=LENGTHS, b=LENGTHS, first=ANGLES, second=ANGLES)
def test_two_parallel_links_by_hand(a: float, b: float, first: float, second: float) -> None:
    values = {"length_0": a, "length_1": b, "home_0": first, "home_1": second}
    design = TWO.resolve({**values, "mass_0": 1e-9, "mass_1": 1e-9})
    drive = design.actuators["drive"]
    span = math.sqrt(a * a + b * b + 2 * a * b * math.cos(second))
    torque, speed = scalar(drive.peak_torque), scalar(drive.no_load_speed)
    assert value(design, "tip_force") == pytest.approx(torque / max(span, b), rel=1e-5)
    along = math.sqrt(span**2 + b**2 + 2 * abs(b * b + a * b * math.cos(second)))
    assert value(design, "tip_speed") == pytest.approx(speed * along, rel=1e-9)
    area = abs(a * b * math.sin(second))
    assert value(design, "manipulability") ** 2 == pytest.approx(area, rel=1e-6, abs=1e-8)


def test_the_reflected_mass_of_one_rod_is_its_inertia_over_its_length_squared() -> None:
    model = fixed.pendulum().resolve({"length": 0.8, "mass": 3, "high": 2}).build()
    body = model.mujoco.body("arm")
    about = body.inertia.max() + body.mass[0] * body.ipos[0] ** 2
    expected = (about + model.mujoco.dof_armature[0]) / 0.8**2
    found = of_model(model, ["reflected_mass"])["reflected_mass"]
    assert found == pytest.approx(expected, rel=1e-9)


@pytest.mark.parametrize(
    ("turn", "first", "second"), [(math.pi, 0.5, 0.3), (1.0, 0.4, 0.4), (2.5, 0.3, 0.6)]
)
def test_an_arm_fills_a_shell_or_a_wedge_of_it(turn: float, first: float, second: float) -> None:
    design = shell(turn).resolve({"first": first, "second": second})
    whole = 4 / 3 * math.pi * ((first + second) ** 3 - abs(first - second) ** 3)
    # Behind the axis the arm reaches what it does in front of it, half a turn away.
    share = min(2 * turn / math.pi, 1.0)
    assert scalar(workspace_volume(design)) == pytest.approx(whole * share, rel=0.03)


def shell(turn: float) -> draft.Spec:
    """An arm of a pan, a lift and an elbow without offsets, whose pan turns both ways by `turn`."""
    joints = [("pan", "z", turn), ("lift", "y", 3.14159), ("elbow", "y", 3.14159)]
    chain: list[dict[str, Any]] = [{"name": "housing", "motor": {"actuator": "drive", "axis": "z"}}]
    for (name, axis, end), length in zip(joints, (None, "first", "second"), strict=True):
        joint = {"name": name, "axis": axis, "range": [-end, end], "actuator": "drive"}
        chain.append({"name": f"{name}_link", "joint": joint})
        if length is not None:
            chain[-1]["link"] = {"axis": "x", "length": length, "mass": 1}
        if name != "elbow":
            chain[-1]["motor"] = {"actuator": "drive", "axis": "y"}
    parameters = {
        name: {"value": 0.4, "unit": "m", "range": [0.1, 2], "doc": "A length."}
        for name in ("first", "second")
    }
    drive = {"peak_torque": 60, "no_load_speed": 8, "gear_ratio": 50}
    return draft.Spec.parse(
        {
            "parameters.yaml": {
                "name": "shell",
                "population": "humanoid",
                "parameters": parameters,
                "actuators": {"drive": drive},
            },
            "tree.yaml": {
                "chains": {"limb": chain},
                "tree": {
                    "name": "base",
                    "type": "fixed",
                    "at": [0, 0, 2],
                    "children": [{"chain": "limb"}],
                },
            },
        }
    )


def test_a_tip_that_moves_in_a_plane_fills_no_volume() -> None:
    assert value(PLANAR.resolve(), "workspace_volume") == 0.0


def pincer(half: float, length: float, low: float = -1.4, high: float = 1.4) -> draft.Spec:
    """Two fingers of one joint each, upright at zero, at both sides of the middle."""
    joint = {"name": "bend", "axis": "y", "range": [low, high], "actuator": "drive"}
    joint["home"] = high if high < 0 else 0
    chain = [
        {"name": "knuckle", "motor": {"actuator": "drive", "axis": "y", "shift": [0, 0.05, 0]}},
        {
            "name": "finger",
            "type": "sphere",
            "joint": joint,
            "link": {"axis": "z", "length": length, "mass": 0.01},
            "sphere": {"radius": 0.005, "mass": 0.001, "site": "tip"},
        },
    ]
    sides = [
        {"chain": "finger", "prefix": "left_", "at": [-half, 0, 0.1]},
        {"chain": "finger", "prefix": "right_", "at": [half, 0, 0.1], "rpy": [0, 0, math.pi]},
    ]
    drive = {"peak_torque": 2, "no_load_speed": 8, "gear_ratio": 50, "mass": 0.02}
    return draft.Spec.parse(
        {
            "parameters.yaml": {
                "name": "pincer",
                "population": "humanoid",
                "parameters": {},
                "actuators": {"drive": drive},
            },
            "tree.yaml": {
                "chains": {"finger": chain},
                "tree": {"name": "palm", "type": "fixed", "children": sides},
            },
        }
    )


def test_a_pincer_holds_what_fits_between_its_friction_cones() -> None:
    half, length = 0.06, 0.08
    design = pincer(half, length).resolve()
    lean = length * math.sin(math.atan(0.5))
    step = 2 * 2.8 / 499 * length  # of the grid, of both fingers
    found = of_design(design)
    assert found["grasp_largest"] == pytest.approx(2 * (half + lean - 0.005), abs=2 * step)
    assert found["grasp_smallest"] == pytest.approx(2 * (half - lean - 0.005), abs=2 * step)
    assert 2 / length <= scalar(found["pinch_force"]) <= 2 / length * math.hypot(1, 0.5)
    assert found["opposability"] == 0.0
    near = of_design(pincer(0.03, length).resolve())
    assert near["grasp_smallest"] == 0.0
    assert 0 < scalar(near["opposability"]) < 2 * math.atan(0.5) / 2.8


def test_fingers_that_never_face_each_other_hold_nothing() -> None:
    found = of_design(pincer(0.06, 0.08, low=-1.4, high=-0.6).resolve())
    names = ("grasp_smallest", "grasp_largest", "pinch_force", "opposability")
    assert [found[name] for name in names] == [0, 0, 0, 0]


def test_a_fingertip_pushes_with_its_weaker_joint() -> None:
    design = HAND.resolve()
    # Across the last link: its own lever is 0.04 m; that of the first adds 0.05 cos(bend). What a
    # finger weighs is taken off the torque.
    lever = 0.04 + 0.05 * math.cos(0.3)
    weights = [
        GRAVITY * abs(scalar(home_columns(design, finger)[0].torque))
        for finger in limbs(design).fingers
    ]
    assert value(design, "fingertip_force") == pytest.approx((1.0 - max(weights)) / lever)


# --- the search ----------------------------------------------------------------------------


def drawn(rng: np.random.Generator, n: int) -> Chain:
    """A chain with upright and level axes, some offsets and some narrow ranges."""
    axes = [(0.0, 0.0, 1.0), *[(0.0, 1.0, 0.0)] * 3, (0.0, 0.0, 1.0), (1.0, 0.0, 0.0)]
    segments = []
    for j in range(n):
        place = (0.0, 0.0, float(rng.uniform(0, 0.5)))
        if rng.random() < 0.3:
            place = (float(rng.uniform(-0.1, 0.1)), float(rng.uniform(-0.1, 0.1)), place[2])
        low, high = sorted(map(float, rng.uniform(-3, 3, 2))) if rng.random() < 0.4 else (-2.9, 2.9)
        segments.append(Segment(j, (place, None), axes[j], low, high))
    return Chain(tuple(segments), (0.0, 0.0, float(rng.uniform(0.05, 0.3))))


def distance(of: Chain, angles: Array, shoulder: g.Vector) -> Array:
    """Horizontal distance of the tip from the shoulder, of angles of shape (joints, poses) [m]."""
    origin, rotation = g.ORIGIN
    for one, angle in zip(of.segments, angles, strict=True):
        origin = g.add(origin, g.rotate(rotation, one.place[0]))
        rotation = g.compose(rotation, g.about(one.axis, angle))
    x, y, _ = g.subtract(g.add(origin, g.rotate(rotation, of.tip)), shoulder)
    return np.hypot(x, y)


@pytest.mark.parametrize("seed", range(12))
def test_no_pose_of_many_reaches_further(seed: int) -> None:
    rng = np.random.default_rng(seed)
    of = drawn(rng, 2 + seed % 5)
    search = Search(of)
    search.run()
    low, high = (np.array([getattr(x, end) for x in of.segments]) for end in ("low", "high"))
    angles = np.array([[float(angle)] for angle in search.angles])
    assert np.all((low - 1e-9 <= angles[:, 0]) & (angles[:, 0] <= high + 1e-9))
    assert distance(of, angles, search.shoulder)[0] == pytest.approx(search.reach(), abs=1e-9)
    poses = rng.uniform(low[:, None], high[:, None], (len(low), 50_000))
    # Draws that shrink about the best pose find a maximum near it.
    for width in 0.5 ** np.arange(1, 12):
        found = distance(of, poses, search.shoulder)
        best = poses[:, [int(np.argmax(found))]]
        around = best + width * rng.normal(size=(len(low), 5_000))
        poses = np.hstack([best, np.clip(around, low[:, None], high[:, None])])
    most = distance(of, poses, search.shoulder).max()
    assert search.reach() >= most * (1 - 2e-3)


@pytest.mark.parametrize("name", SPECS)
def test_many_designs_have_the_metrics_that_each_has_alone(name: str) -> None:
    if name == "hand":
        values: dict[str, Any] = {"actuators.servo.peak_torque": np.array([0.5, 1.0, 2.0])}
    else:
        values = {
            "forearm_length": np.array([0.2, 0.35, 0.7]),
            "actuators.large.peak_torque": np.array([60.0, 150.0, 300.0]),
        }
    many = SPECS[name].resolve(values)
    found = of_design(many)
    for i, one in enumerate(many):
        for key, number in of_design(one).items():
            assert np.asarray(found[key])[i] == pytest.approx(number, rel=1e-9), key


def test_the_peak_payload_is_held_until_its_limiting_joint_is_hot() -> None:
    design = ARM.resolve()
    found = value(design, "payload_peak_time")
    assert 0 < found < 60
    held = payload_for(design, found)
    assert scalar(held.mass) <= value(design, "payload_peak") * (1 + 1e-9)
    assert scalar(held.mass) == pytest.approx(value(design, "payload_peak"), rel=1e-6)


def test_metrics_from_many_poses_are_left_to_those_who_name_them() -> None:
    sampled = {one.name for one in METRICS.values() if one.sampled}
    assert sampled >= {"workspace_volume", "grasp_largest"}
    pytest.importorskip("pyarrow")
    assert not sampled & {*draft.sensitivity(ARM.resolve(), samples=2).metrics}
