"""Whether two solids share space: MuJoCo's own distances are the judge."""

# pyright: reportAttributeAccessIssue=false
# (MuJoCo's compiled modules carry no types.)
from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from functools import lru_cache
from typing import Any

import mujoco
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from draft import geometry as g
from draft.design.solids import SLACK, Ball, Block, Cylinder, Solid, overlap
from draft.geometry import Matrix, Vector
from draft.values import Value

seeds = st.integers(0, 2**32 - 1)
kinds = st.sampled_from([Cylinder, Ball])
angles = st.floats(-math.pi, math.pi)
places = st.tuples(*[st.floats(-0.4, 0.4)] * 3)
rotations = st.builds(g.from_rpy, angles, angles, angles)


def _solid(rng: np.random.Generator, kind: type[Solid]) -> Solid:
    """A random solid; as on robots, many lie along an axis and many share a line.

    Random numbers rather than hypothesis' own, which seek out the exact touching that MuJoCo's
    distance does not survive.
    """
    x, y, z = (float(v) for v in rng.uniform(-0.35, 0.35, 3))
    center = (0.0, 0.0, z) if rng.random() < 0.3 else (x, y, z)
    radius, half = (float(v) for v in rng.uniform(0.02, 0.3, 2))
    if kind is Ball:
        return Ball(center, radius)
    axis = rng.normal(size=3)
    if rng.random() < 0.5:
        axis = np.eye(3)[rng.integers(3)] * rng.choice([-1, 1])
    u, v, w = (float(c) for c in axis / np.linalg.norm(axis))
    return Cylinder(center, (u, v, w), radius, half)


def _pair(seed: int, kind: type[Solid]) -> tuple[Cylinder, Solid]:
    """A cylinder and another solid whose gap is not within the slack of touching."""
    rng = np.random.default_rng(seed)
    while True:
        a, b = _solid(rng, Cylinder), _solid(rng, kind)
        # Nearer than that, the design filter's slack decides.
        if isinstance(a, Cylinder) and abs(_distance(a, b)) > 1.001 * SLACK * (a.reach + b.reach):
            return a, b


pairs = st.builds(_pair, seeds, kinds)

_XML = """<mujoco><worldbody>
<body><freejoint/><geom type="{}" size="0.1 0.1" mass="1"/></body>
<body><freejoint/><geom type="{}" size="0.1 0.1" mass="1"/></body>
</worldbody></mujoco>"""


@lru_cache(maxsize=4)
def _model(first: str, second: str) -> mujoco.MjModel:
    model = mujoco.MjModel.from_xml_string(_XML.format(first, second))
    model.geom_rbound[:] = 10
    return model


def _distance(a: Solid, b: Solid) -> float:
    """Signed distance between two solids by MuJoCo [m]."""
    kinds = ["cylinder" if isinstance(s, Cylinder) else "sphere" for s in (a, b)]
    model = _model(*kinds)
    data = mujoco.MjData(model)
    for i, solid in enumerate((a, b)):
        model.geom_size[i] = (solid.radius, solid.half if isinstance(solid, Cylinder) else 0, 0)
        data.qpos[7 * i : 7 * i + 3] = solid.center
        mujoco.mju_quatZ2Vec(data.qpos[7 * i + 3 : 7 * i + 7], np.array(solid.axis, dtype=float))
    mujoco.mj_kinematics(model, data)
    return mujoco.mj_geomDistance(model, data, 0, 1, 10.0, None)


@settings(max_examples=150)
@given(pairs)
def test_solids_overlap_where_mujoco_finds_them_to(pair: tuple[Cylinder, Solid]) -> None:
    assert overlap(*pair) == (_distance(*pair) < 0)


@given(pairs)
def test_a_pair_overlaps_in_either_order(pair: tuple[Cylinder, Solid]) -> None:
    a, b = pair
    assert overlap(a, b) == overlap(b, a)


def _moved(solid: Solid, rotation: Matrix, shift: Vector) -> Solid:
    center = g.add(g.rotate(rotation, solid.center), shift)
    if isinstance(solid, Ball):
        return Ball(center, solid.radius)
    return Cylinder(center, g.rotate(rotation, solid.axis), solid.radius, solid.half)


@given(pairs, rotations, places)
def test_turning_and_moving_a_pair_together_changes_nothing(
    pair: tuple[Cylinder, Solid], rotation: Matrix, shift: Vector
) -> None:
    turned = [_moved(solid, rotation, shift) for solid in pair]
    assert overlap(*turned) == overlap(*pair)


@given(pairs, st.sampled_from([(-1.0, 1.0, 1.0), (1.0, -1.0, 1.0), (-1.0, -1.0, 1.0)]))
def test_a_mirrored_pair_overlaps_as_the_pair_does(
    pair: tuple[Cylinder, Solid], signs: tuple[float, float, float]
) -> None:
    x, y, z = signs
    mirror = ((x, 0.0, 0.0), (0.0, y, 0.0), (0.0, 0.0, z))
    mirrored = [_moved(solid, mirror, g.ZERO) for solid in pair]
    assert overlap(*mirrored) == overlap(*pair)


def _block(rng: np.random.Generator) -> Block:
    """A random box; half of them lie along the axes."""
    roll, pitch, yaw = (float(v) for v in rng.uniform(-math.pi, math.pi, 3))
    turn = g.IDENTITY if rng.random() < 0.5 else g.from_rpy(roll, pitch, yaw)
    first, second, third = (g.rotate(turn, axis) for axis in g.IDENTITY)
    x, y, z, *halves = (
        float(v) for v in (*rng.uniform(-0.35, 0.35, 3), *rng.uniform(0.02, 0.3, 3))
    )
    return Block((x, y, z), (first, second, third), (halves[0], halves[1], halves[2]))


@given(seeds, st.booleans())
@settings(max_examples=150)
def test_boxes_overlap_where_mujoco_finds_them_to(seed: int, round_: bool) -> None:
    """A box and a box, or a box and a cylinder, that are not within the slack of touching."""
    rng = np.random.default_rng(seed)
    while True:
        a, b = _block(rng), _solid(rng, Cylinder) if round_ else _block(rng)
        spec = mujoco.MjSpec()
        for each in (a, b):
            body = spec.worldbody.add_body(pos=[float(x) for x in each.center])
            if isinstance(each, Block):
                turn = g.transposed(each.edges)
                body.add_geom(
                    type=mujoco.mjtGeom.mjGEOM_BOX, size=each.halves, quat=g.quaternion(turn)
                )
            elif isinstance(each, Cylinder):
                quat = np.empty(4)
                mujoco.mju_quatZ2Vec(quat, np.array(each.axis))
                size = (float(each.radius), float(each.half), 0)
                body.add_geom(type=mujoco.mjtGeom.mjGEOM_CYLINDER, size=size, quat=quat.tolist())
        model = spec.compile()
        data = mujoco.MjData(model)
        mujoco.mj_kinematics(model, data)
        distance = mujoco.mj_geomDistance(model, data, 0, 1, 10.0, None)
        if abs(distance) > 1.001 * SLACK * (a.reach + b.reach):
            break
    assert overlap(a, b) == (distance < 0)
    assert overlap(b, a) == (distance < 0)


def _stacked(solids: Sequence[Solid]) -> Solid:
    """Solids of one kind as one solid of many designs."""

    def column(read: Callable[[Any], Value]) -> np.ndarray:
        return np.array([float(read(s)) for s in solids])

    center = tuple(column(lambda s, k=k: s.center[k]) for k in range(3))
    radius = column(lambda s: s.radius)
    if isinstance(solids[0], Ball):
        return Ball(center, radius)  # type: ignore[arg-type]
    axis = tuple(column(lambda s, k=k: s.axis[k]) for k in range(3))
    return Cylinder(center, axis, radius, column(lambda s: s.half))  # type: ignore[arg-type]


@given(st.lists(seeds, min_size=1, max_size=8), kinds)
def test_many_pairs_at_once_answer_as_one_by_one(own: list[int], kind: type[Solid]) -> None:
    drawn = [_pair(seed, kind) for seed in own]
    first, second = _stacked([a for a, _ in drawn]), _stacked([b for _, b in drawn])
    expected = [overlap(a, b) for a, b in drawn]
    assert list(np.asarray(overlap(first, second))) == expected


@given(st.lists(seeds, min_size=1, max_size=4))
def test_one_design_alike_for_all_is_compared_with_many(own: list[int]) -> None:
    drawn = [_pair(seed, Cylinder) for seed in own]
    first, second = drawn[0][0], _stacked([b for _, b in drawn])
    expected = [overlap(first, b) for _, b in drawn]
    assert list(np.asarray(overlap(first, second))) == expected


@given(rotations, places, st.floats(-0.9, 0.9), st.floats(0, 0.9), angles)
def test_a_ball_about_a_point_inside_a_cylinder_overlaps_it(
    rotation: Matrix, center: Vector, along: float, out: float, angle: float
) -> None:
    point = (0.1 * out * math.cos(angle), 0.1 * out * math.sin(angle), 0.2 * along)
    cylinder = Cylinder((0.0, 0.0, 0.0), (0.0, 0.0, 1.0), 0.1, 0.2)
    placed = _moved(cylinder, rotation, center)
    for radius in (0.001, 0.02, 0.5):
        assert overlap(placed, _moved(Ball(point, radius), rotation, center))


@pytest.mark.parametrize(
    ("axes", "center", "sizes"),
    [
        (((-3, 3, 2), (-2, -3, 0)), (0.28, 0.02, 0.04), (0.19, 0.07, 0.06, 0.22)),
        (((1, -1, -1), (-1, -2, 0)), (0.18, 0.13, -0.31), (0.26, 0.06, 0.13, 0.17)),
        (((2, -3, 2), (1, 2, 3)), (-0.3, 0.35, 0.17), (0.11, 0.3, 0.28, 0.12)),
        (((-1, -1, -1), (3, -2, -3)), (0.29, 0.16, -0.13), (0.1, 0.21, 0.28, 0.07)),
    ],
)
def test_rims_that_only_a_direction_of_their_own_parts_are_apart(
    axes: tuple[Vector, Vector], center: Vector, sizes: tuple[float, ...]
) -> None:
    one, two = (g.scale(axis, 1 / g.norm(axis)) for axis in axes)
    a = Cylinder(g.ZERO, one, sizes[0], sizes[1])
    b = Cylinder(center, two, sizes[2], sizes[3])
    assert _distance(a, b) > 0
    assert not overlap(a, b)


@pytest.mark.parametrize("gap", [-0.005, 0.0, 0.001])
def test_faces_may_touch(gap: float) -> None:
    below = Cylinder((0.0, 0.0, 0.0), (0.0, 0.0, 1.0), 0.1, 0.2)
    above = Cylinder((0.0, 0.0, 0.4 + gap), (0.0, 0.0, 1.0), 0.1, 0.2)
    assert not overlap(below, above)
    deeper = Cylinder((0.0, 0.0, 0.39), (0.0, 0.0, 1.0), 0.1, 0.2)
    assert overlap(below, deeper)
