"""Robots side by side at one scale, as a Plotly scene."""

from __future__ import annotations

import math
from collections.abc import Sequence
from html import escape
from typing import Any

import mujoco
import numpy as np

from draft.model import Model
from draft.model.scene import home_position
from draft.model.shapes import shapes
from draft.model.solids import Triangles, triangles
from draft.reporting.motion import SEGMENTS, Motion, belt, packed
from draft.reporting.subjects import Subject
from draft.spec.primitives import colors
from draft.values import Array

YAW = 0.75  # of every robot, away from the camera [rad]
# Width of the panel over its height; a narrower panel shows the scene smaller.
ASPECT = 2.6
_GAP = 0.12
_LINE = 0.17  # height of a line of text over half the height of the panel
_VIEW = np.array([1.0, 0.0, 0.22])
_FILLED = 0.92  # share of the panel that the robots fill
_DISTANCE = 3.0  # of the camera [units of the scene]
_STEPS = (0.1, 0.2, 0.5, 1.0, 2.0, 5.0)
# Plotly has no lamps without perspective: the data contain the shade of each vertex.
_LIGHT = {"ambient": 1.0, "diffuse": 0.0, "specular": 0.0, "fresnel": 0.0}
_LAMP = np.array([0.55, -0.35, 0.76])
_DARK, _BRIGHT = 0.38, 1.12


def figure(subjects: Sequence[Subject]) -> dict[str, Any] | None:
    """Return traces, layout and floor step [m] of the scene; None if no design has a model.

    Where designs walk, `walk` has their motion, see `draft.reporting.motion`.
    """
    drawn = [(subject, robot_triangles(subject.model)) for subject in subjects if subject.model]
    if not drawn:
        return None
    traces: list[dict[str, Any]] = []
    labels: list[tuple[Subject, Array]] = []
    corners: list[Array] = []
    moving: list[dict[str, Any]] = []
    edge = 0.0
    for subject, parts in drawn:
        points = np.vstack([part.points for part in parts.values()])
        low, high = points.min(axis=0), points.max(axis=0)
        motion = Motion.of(subject, YAW)
        if motion is not None:
            low, high = np.minimum(low, motion.low), np.maximum(high, motion.high)
        shift = np.array([-(low[0] + high[0]) / 2, edge - low[1], 0.0])
        edge += float(high[1] - low[1]) + _GAP * float(max(high - low))
        # The floor is the first trace.
        if motion is not None:
            traces.append(belt(subject))
            moving.append(motion.plain(shift, len(traces)))
        traces += [_mesh(subject, kind, part, shift) for kind, part in parts.items()]
        labels.append((subject, np.array([high[0], (low[1] + high[1]) / 2, 0.0]) + shift))
        corners += [low + shift, high + shift]
    box = np.array([np.min(corners, axis=0), np.max(corners, axis=0)])
    box[0, 2] = min(box[0, 2], 0.0)
    # Labels lie on the floor in front of the robots, which needs room for one line of text.
    front, room = float(box[1, 0]), _LINE * _unit(box) * float(np.linalg.norm(_VIEW) / _VIEW[2])
    box[1, 0] += room
    step = grid_step(float(box[1, 1] - box[0, 1]))
    return {
        "data": [_floor(box, step), *traces, _labels(labels, front + room / 2)],
        "layout": _layout(box, step),
        "floor_step": step,
        **({"walk": moving} if moving else {}),
    }


def robot_triangles(model: Model) -> dict[str, Triangles]:
    """Triangles [m] of a robot in its home pose, turned by `YAW`, by kind of part."""
    data = home(model)
    c, s = math.cos(YAW), math.sin(YAW)
    yaw = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])
    found: dict[str, list[Triangles]] = {}
    for shape in filter(lambda one: one.drawn, shapes(model.mujoco, model.design)):
        solid = triangles(shape, SEGMENTS)
        frame = data.xmat[shape.body].reshape(3, 3)
        position = data.xpos[shape.body] + frame @ shape.position
        rotation = yaw @ frame @ shape.rotation
        parts = found.setdefault(shape.kind, [])
        before = sum(len(part.points) for part in parts)
        points = solid.points @ rotation.T + yaw @ position
        parts.append(Triangles(points, solid.normals @ rotation.T, solid.faces + before))
    return {kind: Triangles(*map(np.vstack, zip(*p, strict=True))) for kind, p in found.items()}


def home(model: Model) -> mujoco.MjData:
    """State of a robot in its home pose, standing at z = 0 above the origin."""
    data = mujoco.MjData(model.mujoco)
    data.qpos[:] = home_position(model.design)
    mujoco.mj_kinematics(model.mujoco, data)
    return data


def _mesh(subject: Subject, kind: str, part: Triangles, shift: Array) -> dict[str, Any]:
    """Mesh of all parts of one kind; the trunk has the colour of the design."""
    color = [255 * c for c in colors()[kind][:3]]
    if kind == "trunk":
        color = [int(subject.color[k : k + 2], 16) for k in (1, 3, 5)]
    ends = [[min(factor * c, 255.0) for c in color] for factor in (_DARK, _BRIGHT)]
    scale = [[k, "rgb({:.0f},{:.0f},{:.0f})".format(*end)] for k, end in enumerate(ends)]
    # Light from a lamp, and from the sky.
    lamp = np.maximum(part.normals @ (_LAMP / np.linalg.norm(_LAMP)), 0.0)
    shade = 0.6 * lamp + 0.4 * (0.5 + 0.5 * part.normals[:, 2])
    moved = part.points + shift
    return {
        "type": "mesh3d",
        "name": escape(subject.title),
        "hoverinfo": "name",
        "intensity": packed(shade, "f4"),
        "colorscale": scale,
        "cmin": 0,
        "cmax": 1,
        "showscale": False,
        "lighting": _LIGHT,
        **{axis: packed(moved[:, k], "f4") for k, axis in enumerate("xyz")},
        **{corner: packed(part.faces[:, k], "i4") for k, corner in enumerate("ijk")},
    }


def grid_step(span: float) -> float:
    """Distance between the lines on the floor [m], the largest that gives three over the span."""
    return max((step for step in _STEPS if span / step >= 3), default=_STEPS[0])


def _floor(box: Array, step: float) -> dict[str, Any]:
    """Grid on the floor, which reaches beyond the robots on all sides."""
    low, high = _edges(box, step)
    x: list[float | None] = []
    y: list[float | None] = []
    for at in np.arange(low[0], high[0] + step / 2, step):
        x += [float(at), float(at), None]
        y += [float(low[1]), float(high[1]), None]
    for at in np.arange(low[1], high[1] + step / 2, step):
        x += [float(low[0]), float(high[0]), None]
        y += [float(at), float(at), None]
    lines = {"color": "#c6cdd5", "width": 1.5}
    z = [None if value is None else 0.0 for value in x]
    return {
        "type": "scatter3d",
        "mode": "lines",
        "hoverinfo": "skip",
        "line": lines,
        **{"x": x, "y": y, "z": z},
    }


def _edges(box: Array, step: float) -> tuple[Array, Array]:
    """Corners of the floor, whole steps around the centre of the box, each of shape (2,)."""
    middle, half = box[:, :2].mean(axis=0), np.ptp(box[:, :2], axis=0) / 2
    reach = np.ceil(half / step) * step
    return middle - reach, middle + reach


def _labels(places: Sequence[tuple[Subject, Array]], front: float) -> dict[str, Any]:
    """Title and mass on the floor in front of each robot."""
    return {
        "type": "scatter3d",
        "mode": "text",
        "hoverinfo": "skip",
        "x": [front for _ in places],
        "y": [float(place[1]) for _, place in places],
        "z": [0.0 for _ in places],
        "text": [f"{escape(s.title)}, {s.design.mass:.1f} kg" for s, _ in places],
        "textposition": "middle center",
        "textfont": {"size": 14, "color": [subject.color for subject, _ in places]},
    }


def _layout(box: Array, step: float) -> dict[str, Any]:
    """Layout with equal axes, and an orthographic camera that sees the box."""
    unit = _unit(box)
    low, high = _edges(box, step)
    low, high = np.append(low, box[0, 2]), np.append(high, box[1, 2])
    axis = {"visible": False, "showspikes": False}
    eye = _DISTANCE * _VIEW / np.linalg.norm(_VIEW)
    return {
        "height": 440,
        "margin": {"l": 0, "r": 0, "t": 0, "b": 0},
        "showlegend": False,
        "paper_bgcolor": "rgba(0,0,0,0)",
        "scene": {
            **{f"{n}axis": axis | {"range": [low[k], high[k]]} for k, n in enumerate("xyz")},
            "aspectmode": "manual",
            "aspectratio": {n: float(high[k] - low[k]) / unit for k, n in enumerate("xyz")},
            "camera": {
                "eye": dict(zip("xyz", eye.tolist(), strict=True)),
                "projection": {"type": "orthographic"},
            },
            "dragmode": "orbit",
        },
    }


def _unit(box: Array) -> float:
    """Metres per unit of the scene, for a camera that looks at the centre of a box, shape (2, 3).

    An orthographic view of Plotly shows one unit up and down, and ASPECT units to either side.
    """
    ahead = -_VIEW / np.linalg.norm(_VIEW)
    up = np.array([0.0, 0.0, 1.0]) - ahead[2] * ahead
    up /= np.linalg.norm(up)
    corners = np.array([(x, y, z) for x in box[:, 0] for y in box[:, 1] for z in box[:, 2]])
    seen = (corners - box.mean(axis=0)) @ np.array([np.cross(ahead, up), up]).T
    half = np.abs(seen).max(axis=0)
    return float(max(half[0] / ASPECT, half[1]) / _FILLED)
