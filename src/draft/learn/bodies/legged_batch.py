"""Numbers of many designs of one quadruped for learning, by arrays.

They are those of `legged` for each design alone, to rounding. Designs whose legs are
not those of the first, by the directions of axes or the places of feet, are read alone.
"""

from __future__ import annotations

import copy
from dataclasses import replace

import mujoco
import numpy as np
from numpy.typing import NDArray

from draft import geometry as g
from draft.design import Design
from draft.design.legs import crouch, legs
from draft.errors import DraftError
from draft.learn.bodies.legged import (
    LeggedRobot,
    corners,
    estimated_speed,
    known_ratings,
    legged_robot,
    lowest_point,
    radius_of_foot,
    stated_battery,
    stated_electronics,
)
from draft.learn.bodies.topology import APART, MIDDLE
from draft.model import pose
from draft.model.batch import ModelBatch, build_batch, follows_mujoco
from draft.model.mjcf import robot_texts
from draft.values import Array, Value, maximum

Rows = NDArray[np.intp]
Found = dict[int, LeggedRobot | DraftError]


def legged_robots(design: Design, rows: Rows) -> Found:
    """Quadrupeds of some of N designs by row, or the error of those that are none.

    Args:
        design: N designs.
        rows: which of them, increasing.
    """
    found: Found = {}
    left = list(map(int, rows))
    while left:
        row = left.pop(0)
        found[row] = first = _alone(design, row)
        if isinstance(first, LeggedRobot):
            found |= _like(design, row, first, np.array(left, dtype=np.intp))
            break
    return {int(row): found[row] if row in found else _alone(design, int(row)) for row in rows}


def _alone(design: Design, row: int) -> LeggedRobot | DraftError:
    try:
        return legged_robot(design[row])
    except DraftError as error:
        return error


def _like(design: Design, first_row: int, first: LeggedRobot, rows: Rows) -> Found:
    """Robots of the designs that can be read by arrays because they resemble the first."""
    if not follows_mujoco() or not len(rows):
        return {}
    (text,) = robot_texts(design, np.array([first_row]))
    if text != first.text:
        return {}
    home = _home(design, first)
    if home is None:
        return {}
    ranges = _table(
        design, [end for name in first.joints for end in design.joints[name].range]
    ).reshape(-1, len(first.joints), 2)
    alike = _alike(design, first_row, first)
    alike &= ((ranges[..., 0] <= home) & (home <= ranges[..., 1])).all(axis=1)
    try:
        batch = build_batch(design, rows[alike[rows]])
    except DraftError:
        return {}
    rows = batch.rows
    drives = [design.drive(design.joints[name]) for name in first.joints]
    motors = [motor for motor in drives if motor is not None]
    columns = {
        "text": robot_texts(design, rows),
        "home": _tuples(home[rows]),
        "ranges": [tuple(map(tuple, row)) for row in ranges[rows].tolist()],
        "peak_torque": _tuples(_table(design, [m.peak_torque for m in motors])[rows]),
        "corner_speed": [
            corners(row) for row in _tuples(_table(design, [m.corner_speed for m in motors])[rows])
        ],
        "no_load_speed": _tuples(_table(design, [m.no_load_speed for m in motors])[rows]),
        "motor_heat": _tuples(_table(design, [m.copper_loss for m in motors])[rows]),
        "battery": _stated(design, stated_battery(design), rows),
        "electronics": _stated(design, stated_electronics(design), rows),
        "rated_torque": [
            known_ratings(*pair)
            for pair in zip(
                _tuples(_table(design, [m.rated_torque for m in motors])[rows]),
                _tuples(_table(design, [m.peak_torque for m in motors])[rows]),
                strict=True,
            )
        ],
        "leg_length": _column(design, maximum(*(leg.length for leg in legs(design))), rows),
        "foot_radius": _foot_radii(batch, first),
        "height": _heights(batch, first, home[rows]),
        "top_speed": _column(design, estimated_speed(design), rows),
        "mass": _column(design, design.mass, rows),
    }
    same = {name: getattr(first, name) for name in LeggedRobot.__dataclass_fields__}
    found: Found = {first_row: replace(first, text=text)}
    for row, *values in zip(rows.tolist(), *columns.values(), strict=True):
        found[row] = LeggedRobot(**same | dict(zip(columns, values, strict=True)))
    return found


def _home(design: Design, first: LeggedRobot) -> Array | None:
    """Angles of the home pose, shape (N, joints); None if only some designs state the legs'."""
    stated, angles = {name: design.joints[name].home for name in first.joints}, crouch(design)
    states = (_table(design, [stated[name] for name in angles]) != 0).any(axis=1)
    if states.any() and not states.all():
        return None
    return _table(design, list((stated if states.all() else stated | angles).values()))


def _alike(design: Design, first_row: int, first: LeggedRobot) -> NDArray[np.bool_]:
    """Mask of the designs with the axes and the mirror image of the first.

    Where all axes are the same, so are the legs' kinds and the signs of mirrored motions.
    """
    frames = design.frames()
    numbers: list[Value] = []
    for body, (_, rotation) in zip(design.bodies, frames, strict=True):
        if body.joint is not None:
            numbers += g.rotate(rotation, body.joint_axis)
    axes = _table(design, numbers)
    alike = (abs(axes - axes[first_row]) < 1e-12).all(axis=1)
    ends = {
        f"{body.name}_end": origin for body, (origin, _) in zip(design.bodies, frames, strict=True)
    }
    x, y = (_table(design, [ends[name][k] for name in first.foot_geoms]) for k in (0, 1))
    images = np.hypot(x[:, :, None] - x[:, None], y[:, :, None] + y[:, None]).argmin(axis=2)
    alike &= (images == first.leg_mirror).all(axis=1)
    anchors = {
        body.prefix + body.joint.name: origin
        for body, (origin, _) in zip(design.bodies, frames, strict=True)
        if body.joint is not None
    }
    lines = dict(zip(anchors, axes[first_row].reshape(-1, 3), strict=True))
    of_legs = {joint for leg in first.leg_joints for joint in leg}
    for joint, other in enumerate(first.mirror):
        if joint not in of_legs:
            a, b = (_table(design, [*anchors[first.joints[k]]]) for k in (joint, other))
            far, axis = a * (1.0, -1.0, 1.0) - b, lines[first.joints[other]]
            alike &= np.linalg.norm(far - (far @ axis)[:, None] * axis, axis=1) <= APART
            alike &= (other != joint) | (abs(a[:, 1]) <= MIDDLE)
    return np.asarray(alike)


def _foot_radii(batch: ModelBatch, first: LeggedRobot) -> list[float]:
    model = copy.copy(batch.template)
    found = []
    for place in range(len(batch)):
        batch.write(place, model)
        found.append(min(radius_of_foot(model, name) for name in first.foot_geoms))
    return found


def _heights(batch: ModelBatch, first: LeggedRobot, home: Array) -> list[float]:
    """Trunk's origin above the lowest foot in the home pose [m]."""
    model = copy.copy(batch.template)
    data = mujoco.MjData(model)
    found = []
    for place, angles in enumerate(home):
        batch.write(place, model)
        pose.put(model, data, angles)
        found.append(-min(lowest_point(model, data, name) for name in first.foot_geoms))
    return found


def _table(design: Design, values: list[Value]) -> Array:
    """Values of all designs, shape (N, values)."""
    return np.stack([np.broadcast_to(x, (design.count or 1,)) for x in values], axis=1)


def _column(design: Design, value: Value, rows: Rows) -> list[float]:
    return np.broadcast_to(value, (design.count or 1,))[rows].tolist()


def _stated(design: Design, stated: tuple[Value, ...], rows: Rows) -> list[tuple[float, ...]]:
    """Numbers that all designs state, or none does, by design."""
    return _tuples(_table(design, [*stated])[rows]) if stated else [()] * len(rows)


def _tuples(table: Array) -> list[tuple[float, ...]]:
    return [tuple(row) for row in table.tolist()]
