"""N models compiled at once are the N models compiled one by one.

The single build is the reference. A few designs of each robot are compared; `DRAFT_DESIGNS=500`
compares that many of each, and `-s` prints the largest errors.
"""

from __future__ import annotations

import os
from functools import lru_cache
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
import pytest

import draft
from draft.errors import DraftError
from draft.imports.importer import import_robot
from draft.model.batch import ModelBatch, build_batch, follows_mujoco, indices
from draft.values import Array, scalar
from tests.helpers import BOX, leg, loaded, parameter, robot

pytestmark = pytest.mark.skipif(
    not follows_mujoco(), reason="batches follow the compilers of MuJoCo 3 and 4"
)

SHARED = Path(os.environ.get("DRAFT_SHARED", Path(__file__).parents[2].parent / "shared"))
DESIGNS = int(os.environ.get("DRAFT_DESIGNS", "6"))
SHIPPED = ("quadruped", "humanoid", "hopper")
MIXED = "wheels, boxes and slides"
# Feet with plates, spheres and wheels (deeprobotics_m20).
IMPORTED = (
    *("agibot_x1", "anymal_b", "atlas_v4", "azureloong", "berkeley_humanoid_lite"),
    *("booster_t1", "cassie", "deeprobotics_m20", "dobot_rover_x1", "draco3"),
    *("talos", "unitree_go2"),
)
TOLERANCE, DROP_TOLERANCE = 1e-9, 1e-6
# Fields of the robot that follow from its design; those of meshes are the template's.
FIELDS = (
    *("body_pos", "body_quat", "body_ipos", "body_mass", "body_inertia"),
    *("body_sameframe", "jnt_pos", "jnt_axis", "jnt_range", "jnt_actfrcrange", "dof_armature"),
    *("dof_damping", "dof_frictionloss", "qpos0", "qpos_spring", "site_pos", "site_quat"),
)
DERIVED = ("body_subtreemass", "body_invweight0", "dof_invweight0", "dof_M0")
GEOM_FIELDS = ("geom_size", "geom_pos", "geom_quat", "geom_rbound", "geom_aabb", "geom_sameframe")


@lru_cache(maxsize=1)
def spec_of(name: str, folder: Path) -> draft.Spec:
    if name in SHIPPED:
        return draft.load(name)
    if name == MIXED:
        return mixed()
    path = SHARED / "robots" / "survey" / f"{name}.urdf"
    if not path.is_file():
        pytest.skip(f"{path} is not here: the shared robots are not part of the repository")
    return import_robot(path, folder / name).spec


def mixed() -> draft.Spec:
    """A robot with wheels and plates under slides that lean, and a box on its trunk."""
    numbers = {"tilt": 0.1, "out": 0.03, "tyre": 0.06, "payload": 0.5}
    rod = {
        "name": "rod",
        "rpy": [0.2, "tilt", 0],
        "joint": {
            **{"name": "piston", "type": "slide", "axis": ["tilt", 0, -1]},
            **{"range": [-0.1, 0.1], "home": "out"},
        },
        "link": {"axis": "-z", "length": 0.1, "segment": "shank"},
    }
    wheel = {
        "name": "wheel",
        "type": "wheel",
        "joint": {"name": "turn", "axis": "y"},
        "wheel": {
            **{"radius": "tyre", "width": 0.04, "axis": "y"},
            **{"mass": "payload / 2", "site": "foot"},
        },
    }
    plate = {"length": 0.2, "width": 0.1, "thickness": 0.03, "offset": "out", "site": "foot"}
    sole = {**rod, "type": "foot", "plate": plate}
    load = {
        "name": "load",
        "type": "box",
        "link": {"axis": "x", "length": 0.1, "mass": 0.2},
        "box": {"size": [0.1, 0.2, "tyre"], "mass": "payload", "shift": [0.02, 0.03, "tilt"]},
    }
    shank = {
        "type": "basic",
        "sphere": None,
        "link": {"axis": "-z", "length": 0.15, "segment": "shank"},
    }
    upper = leg(shank=shank)
    places = [
        {"chain": chain, "at": [x, y, -0.2], "prefix": f"{chain}_{side}_", **mirror}
        for chain, x in (("rolls", 0.2), ("stands", -0.2))
        for side, y, mirror in (("left", 0.2, {}), ("right", -0.2, {"mirror": "y"}))
    ]
    return robot(
        children=[*places, load],
        parameters={name: parameter(value) for name, value in numbers.items()},
        chains={"rolls": [*upper, rod, wheel], "stands": [*upper, sole]},
    )


def values_of(spec: draft.Spec, count: int, spread: float, seed: int = 0) -> dict[str, Any]:
    """Random values of every number that a spec states, around its own."""
    rng = np.random.default_rng(seed)
    values: dict[str, Any] = {}
    for name, p in spec.parameters.items():
        if p.value.constant is not None:
            low, high = p.bounds or (-np.inf, np.inf)
            drawn = p.value.constant * rng.uniform(1 - spread, 1 + spread, count)
            values[name] = np.clip(drawn, low, high)
    for name, a in spec.actuators.items():
        for quantity, stated in a.stated.items():
            if stated.constant:
                drawn = stated.constant * rng.uniform(1 - spread / 2, 1 + spread / 2, count)
                values[f"actuators.{name}.{quantity}"] = drawn
    return values


def batch_of(spec: draft.Spec, count: int, spread: float = 0.2) -> ModelBatch:
    """So many accepted designs, drawn at random."""
    design = spec.resolve(values_of(spec, 40 * count, spread))
    return build_batch(design, np.flatnonzero(design.accepted)[:count])


def error(one: Array, other: Array) -> float:
    """Largest difference of two arrays, relative to the largest entry."""
    one, other = np.asarray(one, dtype=float), np.asarray(other, dtype=float)
    assert one.shape == other.shape
    size = max(np.abs(one).max(initial=0.0), 1e-12)
    found = float(np.abs(one - other).max(initial=0.0)) / size
    return np.inf if np.isnan(found) else found


def same(one: Array, other: Array, tolerance: float = TOLERANCE) -> bool:
    """Whether two arrays are equal, relative to the largest entry."""
    return error(one, other) <= tolerance


Errors = dict[str, float]


def errors_of_fields(reference: mujoco.MjModel, model: mujoco.MjModel) -> Errors:
    solid = reference.geom_type != mujoco.mjtGeom.mjGEOM_MESH
    found = {
        name: error(getattr(reference, name), getattr(model, name)) for name in (*FIELDS, *DERIVED)
    }
    for name in GEOM_FIELDS:
        found[name] = error(getattr(reference, name)[solid], getattr(model, name)[solid])
    each = zip(inertias(reference)[1:], inertias(model)[1:], strict=True)
    found["inertia of a body"] = max(error(one, other) for one, other in each)
    mean = (np.array(one.stat.meaninertia) for one in (reference, model))
    return found | {"mean inertia": error(*mean)}


def inertias(model: mujoco.MjModel) -> Array:
    """Inertia tensors of the bodies in their own axes, shape (bodies, 3, 3) [kg m2].

    Frames of nearly equal moments differ, as MuJoCo 4 stops early for meshes; these do not.
    """
    axes = np.empty((model.nbody, 9))
    for matrix, quat in zip(axes, model.body_iquat, strict=True):
        mujoco.mju_quat2Mat(matrix, quat)
    axes = axes.reshape(-1, 3, 3)
    return np.einsum("bij,bj,bkj->bik", axes, model.body_inertia, axes)


def errors_of_dynamics(
    reference: mujoco.MjModel, model: mujoco.MjModel, rng: np.random.Generator
) -> Errors:
    """Kinematics, M(q), bias forces and gravity at a random state."""
    found = []
    qpos, qvel = reference.qpos0.copy(), rng.normal(size=reference.nv)
    mujoco.mj_integratePos(reference, qpos, rng.normal(size=reference.nv), 1.0)
    for one in (reference, model):
        data = mujoco.MjData(one)
        data.qpos[:], data.qvel[:] = qpos, qvel
        mujoco.mj_forward(one, data)
        inertia = np.empty((one.nv, one.nv))
        mujoco.mj_fullM(one, data, inertia)
        bias = data.qfrc_bias.copy()
        data.qvel[:] = 0
        mujoco.mj_forward(one, data)
        found.append((data.xpos, data.xmat, data.xipos, inertia, bias, data.qfrc_bias.copy()))
    whats = ("places", "rotations", "centres of mass", "M(q)", "bias forces", "gravity")
    return {what: error(one, other) for what, one, other in zip(whats, *found, strict=True)}


def assert_within(tolerance: float, errors: Errors) -> None:
    assert {what: size for what, size in errors.items() if not size <= tolerance} == {}


def print_largest(name: str, each: list[Errors]) -> None:
    """Print the largest error of each quantity over all designs of a robot."""
    largest = {what: max(errors[what] for errors in each) for what in each[0]}
    words = ", ".join(f"{what} {size:.1e}" for what, size in largest.items() if size)
    print(f"\n{name}, {len(each)} designs: {words or 'no difference'}")


def on_floor(xml: str) -> mujoco.MjModel:
    """The robot over a floor that leans: which corner of a flat foot lands first is no tie."""
    spec = mujoco.MjSpec.from_string(xml)
    spec.worldbody.add_geom(
        name="floor", type=mujoco.mjtGeom.mjGEOM_PLANE, size=[0, 0, 1], quat=[1, 0.02, 0.03, 0]
    )
    model = spec.compile()
    # Contacts may come in another order, so the solver must find the solution, not come near it.
    model.opt.tolerance, model.opt.iterations = 0.0, 100
    return model


def dropped(model: mujoco.MjModel, design: draft.Design) -> tuple[Array, int]:
    """Path of a drop of 100 steps from the home pose, and in how many of them feet touched.

    Joints begin inside their ranges: at an end, whether the limit acts would be a tie.
    """
    mujoco.mj_setConst(model, mujoco.MjData(model))
    data = mujoco.MjData(model)
    middle = model.jnt_range[1:].mean(axis=1)
    home = np.array([scalar(joint.home) for joint in design.joints.values()])
    data.qpos[7:] = home + 0.1 * (middle - home)
    data.qpos[2] = scalar(design.lowest(home=True)) + 0.01
    path, touched = [], 0
    for _ in range(100):
        mujoco.mj_step(model, data)
        touched += data.ncon > 0
        path.append(np.concatenate([data.qpos, data.qvel]))
    return np.array(path), touched


@pytest.mark.slow
@pytest.mark.parametrize("name", [*SHIPPED, MIXED, *IMPORTED])
def test_each_model_of_a_batch_is_and_falls_as_the_one_compiled_alone(
    name: str, tmp_path: Path
) -> None:
    batch = batch_of(spec_of(name, tmp_path), DESIGNS, 0.05 if name in IMPORTED else 0.2)
    assert len(batch) == DESIGNS
    assert batch.outside == {}
    scene = on_floor(batch.design[batch.rows[0]].build().xml)
    ids = indices(batch.template, scene)
    rng = np.random.default_rng(1)
    found: list[Errors] = []
    touched = 0
    for place, row in enumerate(batch.rows):
        alone = batch.design[row].build()
        model = batch.model(place)
        errors = errors_of_fields(alone.mujoco, model)
        errors |= errors_of_dynamics(alone.mujoco, model, rng)
        assert_within(TOLERANCE, errors)
        batch.write(place, scene, ids)
        path, contacts = dropped(scene, alone.design)
        expected, _ = dropped(on_floor(alone.xml), alone.design)
        fall = {"drop": error(expected, path)}
        assert_within(DROP_TOLERANCE, fall)
        touched += contacts
        found.append(errors | fall)
    assert touched > 10 * DESIGNS  # it does reach the floor
    print_largest(name, found)


def test_the_mixed_robot_has_what_its_name_says() -> None:
    model = mixed().resolve().build().mujoco
    ends = {
        int(model.geom_type[i]) for i in range(model.ngeom) if model.geom(i).name.endswith("_end")
    }
    assert ends == {int(mujoco.mjtGeom.mjGEOM_CYLINDER), int(mujoco.mjtGeom.mjGEOM_BOX)}
    assert np.count_nonzero(model.jnt_type == mujoco.mjtJoint.mjJNT_SLIDE) == 4
    assert np.count_nonzero(model.jnt_limited == 0) == 3  # two wheels and the floating base


def test_only_fields_that_differ_are_held() -> None:
    spec = draft.load("quadruped")
    batch = spec.resolve({"thigh_length": np.linspace(0.2, 0.3, 5)}).build_batch()
    assert {"body_pos", "geom_size", "site_pos", "qpos0"} - set(batch.fields) == {"site_pos"}
    assert not {"jnt_range", "dof_armature", "body_quat"} & set(batch.fields)
    for name, values in batch.fields.items():
        assert values.shape == (5, *getattr(batch.template, name).shape), name
    armature = batch.field("dof_armature")
    assert armature.shape == (5, batch.template.nv)
    assert np.all(armature == batch.template.dof_armature)


def test_boxes_around_geoms_hold_them() -> None:
    """MuJoCo's trees of boxes are the template's, and each box holds those below it."""
    batch = batch_of(draft.load("humanoid"), DESIGNS)
    for place in range(len(batch)):
        model, alone = batch.model(place), batch.design[batch.rows[place]].build().mujoco
        for body in range(1, model.nbody):
            start, count = model.body_bvhadr[body], model.body_bvhnum[body]
            solid = np.any(model.geom_type[model.geom_bodyid == body] != mujoco.mjtGeom.mjGEOM_MESH)
            if count and solid:  # the root's box holds all: any tree has the same
                assert same(alone.bvh_aabb[start], model.bvh_aabb[start])
            for node in range(start, start + count):
                for child in model.bvh_child[node]:
                    if child >= 0:
                        inner, outer = model.bvh_aabb[start + child], model.bvh_aabb[node]
                        apart = np.abs(inner[:3] - outer[:3]) + inner[3:]
                        assert np.all(apart <= outer[3:] + 1e-12)


def test_refused_designs_are_named() -> None:
    spec = draft.load("quadruped")
    torque = np.array([72.0, 3000.0, 80.0])
    batch = spec.resolve({"actuators.leg.peak_torque": torque}).build_batch()
    assert batch.rows.tolist() == [0, 2]
    assert list(batch.outside) == [1]
    assert batch.outside[1].startswith("refused: torque:leg")


def test_a_member_that_balances_in_its_middle_is_outside_the_topology() -> None:
    """It is one rod, where other designs have two halves of different densities."""
    shank = {
        "link": {"axis": "-z", "length": 0.25, "segment": "thigh"},  # a class that has a centre
        "sphere": {"radius": 0.02, "mass": "foot_mass", "site": "foot"},
    }
    spec = robot(leg(shank=shank), parameters={"foot_mass": parameter(0.05)})
    design = spec.resolve({"foot_mass": np.array([0.05, 0.06, 0.07])})
    body = next(b for b in design.bodies if b.name == "shank")
    assert isinstance(body.member_centre, np.ndarray)
    body.member_centre[1] = 0.5
    batch = build_batch(design)
    assert batch.rows.tolist() == [0, 2]
    assert batch.outside == {1: "its topology is not the others'"}


TURNED = leg(
    thigh={"rpy": ["roll", 0.3, -0.2], "motor": {"actuator": "leg", "axis": [0.1, 1, "roll"]}},
    shank={
        "link": {"axis": [0, "roll", -1], "length": 0.25, "segment": "shank"},
        "joint": {
            **{"name": "knee", "axis": ["roll", 1, 0]},
            **{"range": [-2, "2 + roll"], "actuator": "leg"},
        },
    },
)
NOTCHED = [[-0.2, -0.1], [0.2, -0.1], [0.2, 0.1], [0.0, "notch"], [-0.2, 0.1]]


def sections(end: Any = 0.2, **more: Any) -> dict[str, Any]:
    """A trunk of two sections, each of them a rectangle unless told otherwise."""
    shape = more or {"rectangle": [0.2, 0.1]}
    return {**BOX, "sections": [{"at": at, **shape} for at in (-0.2, end)]}


def alone(end: float) -> draft.Spec:
    """A trunk without limbs."""
    root = {**sections("end"), "axis": "z"}
    return robot(children=[], actuators={}, root=root, parameters={"end": parameter(end)})


# Where a frame changes with a number: a robot, and its values.
SPECIAL: dict[str, tuple[draft.Spec, dict[str, list[float]]]] = {
    # A geom without mass leaves its body the frame of the other geom.
    "a payload that may weigh nothing": (loaded(), {"payload": [0.5, 0.0, 2.0]}),
    "turned frames and oblique axes": (
        robot(TURNED, parameters={"roll": parameter(0.1)}),
        {"roll": [0.1, -0.4, 0.0, 1.5, -1.5]},
    ),
    "a trunk that is not convex": (
        robot(
            root=sections("depth", polygon=NOTCHED),
            parameters={"notch": parameter(0.0), "depth": parameter(0.2)},
        ),
        {"notch": [0.0, 0.05, -0.05, 0.15], "depth": [0.2, 0.25, 0.3, 0.1]},
    ),
    "a corner cut of zero": (
        robot(
            root=sections(rectangle=[0.2, 0.1], chamfer="cut"), parameters={"cut": parameter(0.1)}
        ),
        {"cut": [0.1, 0.0, 0.3]},
    ),
    # MuJoCo relies on a diagonal M(q) where centre and axes are those of the body.
    "a trunk alone that is centred after others": (alone(0.3), {"end": [0.3, 0.2, 0.4]}),
    "a trunk alone that is centred before others": (alone(0.3), {"end": [0.2, 0.3, 0.2]}),
}


@pytest.mark.parametrize(("spec", "values"), SPECIAL.values(), ids=SPECIAL)
def test_special_frames_are_those_of_mujoco(
    spec: draft.Spec, values: dict[str, list[float]]
) -> None:
    batch = spec.resolve({name: np.array(own) for name, own in values.items()}).build_batch()
    rng = np.random.default_rng(0)
    assert {*batch.rows, *batch.outside} == {*range(len(next(iter(values.values()))))}
    assert batch.outside == {} or not spec.actuators
    for place, row in enumerate(batch.rows):
        reference, model = batch.design[row].build().mujoco, batch.model(place)
        assert_within(TOLERANCE, errors_of_fields(reference, model))
        assert_within(TOLERANCE, errors_of_dynamics(reference, model, rng))


def test_a_trunk_that_twists_is_named() -> None:
    """The single build refuses it; among many designs only their compilation looks."""
    square = [[-0.1, -0.1], [0.1, -0.1], [0.1, 0.1], [-0.1, 0.1]]
    turned = [["x", "-y"], ["y", "x"], ["-x", "y"], ["-y", "-x"]]
    root = {**BOX, "sections": [{"at": -0.2, "polygon": square}, {"at": 0.2, "polygon": turned}]}
    spec = robot(root=root, parameters={"x": parameter(-0.1), "y": parameter(0.1)})
    batch = spec.resolve({"x": np.array([-0.1, 0.1]), "y": np.array([0.1, 0.11])}).build_batch()
    assert batch.rows.tolist() == [0]
    with pytest.raises(DraftError) as alone:
        batch.design[1]
    assert batch.outside[1] == alone.value.problems[0].cause


def test_a_template_of_another_topology_is_refused() -> None:
    design = draft.load("quadruped").resolve({"thigh_length": np.array([0.2, 0.3])})
    for other in ("hopper", "humanoid"):
        template = draft.load(other).resolve().build().mujoco
        with pytest.raises(DraftError, match=r"the template has another topology"):
            build_batch(design, template=template)


def test_one_design_is_no_batch() -> None:
    with pytest.raises(DraftError, match=r"this is one design"):
        draft.load("quadruped").resolve().build_batch()


def test_designs_none_of_which_compiles_say_why() -> None:
    design = draft.load("quadruped").resolve({"actuators.leg.peak_torque": np.array([3e3, 2.9e3])})
    with pytest.raises(DraftError, match=r"none of 2 designs has a model: refused: torque:leg"):
        design.build_batch()
