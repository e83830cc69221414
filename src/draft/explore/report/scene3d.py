"""Robots side by side at true relative size, as a Plotly scene."""

# pyright: reportAttributeAccessIssue=false
# (MuJoCo's compiled modules carry no types.)
from __future__ import annotations

import base64
import math
from collections.abc import Sequence
from html import escape
from typing import Any

import mujoco
import numpy as np

from draft.explore.report.subjects import Subject
from draft.model import Model
from draft.model.mjcf import COLORS
from draft.model.shapes import shapes
from draft.model.solids import triangles
from draft.values import Array

TURN = 0.75  # of every robot, away from the camera [rad]
SEGMENTS = 24
# Height of the panel over its width below which the page steps the camera back.
ASPECT = 2.6
_GAP = 0.12
_LABEL = 0.05
_VIEW = np.array([1.0, 0.0, 0.16])
_SLOPE = math.tan(math.pi / 8)  # half of Plotly's field of view
_STEPS = (0.1, 0.2, 0.5, 1.0, 2.0, 5.0)
_LIGHT = {"ambient": 0.62, "diffuse": 0.6, "specular": 0.06, "roughness": 0.9, "fresnel": 0.0}


def packed(values: Any, kind: str) -> dict[str, str]:
    """Numbers as Plotly reads them in bytes; kind is "f4" or "i4"."""
    raw = np.ascontiguousarray(values, dtype=f"<{kind}").tobytes()
    return {"dtype": kind, "bdata": base64.b64encode(raw).decode()}


def figure(subjects: Sequence[Subject]) -> dict[str, Any] | None:
    """Traces and layout of the scene; None where no design has a model."""
    drawn = [(subject, robot_triangles(subject.model)) for subject in subjects if subject.model]
    if not drawn:
        return None
    traces: list[dict[str, Any]] = []
    labels, edge = [], 0.0
    corners = []
    for subject, parts in drawn:
        points = np.vstack([part[0] for part in parts.values()])
        low, high = points.min(axis=0), points.max(axis=0)
        shift = np.array([-(low[0] + high[0]) / 2, edge - low[1], 0.0])
        edge += float(high[1] - low[1]) + _GAP * float(max(high - low))
        traces += [_mesh(subject, kind, *part, shift) for kind, part in parts.items()]
        labels.append((subject, np.array([high[0], (low[1] + high[1]) / 2, 0.0]) + shift))
        corners += [low + shift, high + shift]
    box = np.array([np.min(corners, axis=0), np.max(corners, axis=0)])
    box[0, 2] = min(box[0, 2], 0.0)
    # Labels lie on the floor before the robots.
    front = float(box[1, 0]) + _LABEL * float(box[1, 1] - box[0, 1])
    box[1, 0] = front + _LABEL * float(box[1, 1] - box[0, 1])
    step = grid_step(float(box[1, 1] - box[0, 1]))
    return {
        "data": [_floor(box, step), *traces, _labels(labels, front)],
        "layout": _layout(box, step),
        "floor_step": step,
    }


def robot_triangles(model: Model) -> dict[str, tuple[Array, Array]]:
    """Points [m], standing and turned, and triangles of a robot by kind of part."""
    data = home(model)
    c, s = math.cos(TURN), math.sin(TURN)
    turn = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])
    found: dict[str, tuple[list[Array], list[Any]]] = {kind: ([], []) for kind in COLORS}
    for i, shape in enumerate(shapes(model.mujoco, model.design)):
        solid = triangles(shape, model.design.trunk.loft, SEGMENTS)
        if shape.form == "mesh":
            frame, place = data.xmat[shape.body], data.xpos[shape.body]
        else:
            frame, place = data.geom_xmat[i], data.geom_xpos[i]
        points, faces = found[shape.kind]
        faces.append(solid.faces + sum(map(len, points)))
        points.append((solid.points @ frame.reshape(3, 3).T + place) @ turn.T)
    return {k: (np.vstack(p), np.vstack(f)) for k, (p, f) in found.items() if p}


def home(model: Model) -> mujoco.MjData:
    """The robot in its home pose, standing at z = 0, above the origin."""
    design: Any = model.design
    data = mujoco.MjData(model.mujoco)
    joints = [float(joint.home) for joint in design.joints.values()]
    data.qpos[:] = [0.0, 0.0, float(design.lowest(home=True)), 1.0, 0.0, 0.0, 0.0, *joints]
    mujoco.mj_kinematics(model.mujoco, data)
    return data


def _mesh(subject: Subject, kind: str, points: Array, faces: Array, shift: Array) -> dict[str, Any]:
    """All parts of one kind; the trunk wears the design's colour."""
    color = "rgb({:.0f},{:.0f},{:.0f})".format(*(255 * c for c in COLORS[kind][:3]))
    moved = points + shift
    return {
        "type": "mesh3d",
        "name": escape(subject.title),
        "hoverinfo": "name",
        "color": subject.color if kind == "trunk" else color,
        "lighting": _LIGHT,
        "lightposition": {"x": 1000, "y": -600, "z": 2000},
        **{axis: packed(moved[:, k], "f4") for k, axis in enumerate("xyz")},
        **{corner: packed(faces[:, k], "i4") for k, corner in enumerate("ijk")},
    }


def grid_step(span: float) -> float:
    """Distance of the floor's lines [m]: the largest that gives four or more over the span."""
    return max((step for step in _STEPS if span / step >= 4), default=_STEPS[0])


def _floor(box: Array, step: float) -> dict[str, Any]:
    """Lines on the floor, beyond the robots on all sides."""
    low = np.floor(box[0, :2] / step) * step
    high = np.ceil(box[1, :2] / step) * step
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


def _labels(places: Sequence[tuple[Subject, Array]], front: float) -> dict[str, Any]:
    """Title and mass on the floor before each robot."""
    return {
        "type": "scatter3d",
        "mode": "text",
        "hoverinfo": "skip",
        "x": [front for _ in places],
        "y": [float(place[1]) for _, place in places],
        "z": [0.0 for _ in places],
        "text": [f"{escape(s.title)}, {s.design.mass:.1f} kg" for s, _ in places],
        "textposition": "bottom center",
        "textfont": {"size": 14, "color": [subject.color for subject, _ in places]},
    }


def _layout(box: Array, step: float) -> dict[str, Any]:
    """Axes of one scale, and a camera that sees the box."""
    low = np.append(np.floor(box[0, :2] / step) * step, box[0, 2])
    high = np.append(np.ceil(box[1, :2] / step) * step, box[1, 2])
    span = high - low
    unit = float(span.max())
    axis = {"visible": False, "showspikes": False}
    distance = _distance((box - (low + high) / 2) / unit)
    eye = distance * _VIEW / np.linalg.norm(_VIEW)
    return {
        "height": 440,
        "margin": {"l": 0, "r": 0, "t": 0, "b": 0},
        "showlegend": False,
        "paper_bgcolor": "rgba(0,0,0,0)",
        "scene": {
            **{f"{n}axis": axis | {"range": [low[k], high[k]]} for k, n in enumerate("xyz")},
            "aspectmode": "manual",
            "aspectratio": {n: float(span[k]) / unit for k, n in enumerate("xyz")},
            "camera": {"eye": dict(zip("xyz", eye.tolist(), strict=True))},
            "dragmode": "orbit",
        },
    }


def _distance(box: Array) -> float:
    """How far a camera must stand to see a box, shape (2, 3), in a panel of ASPECT."""
    ahead = -_VIEW / np.linalg.norm(_VIEW)
    up = np.array([0.0, 0.0, 1.0]) - ahead[2] * ahead
    axes = np.array([np.cross(ahead, up), up, ahead])
    corners = np.array([(x, y, z) for x in box[:, 0] for y in box[:, 1] for z in box[:, 2]])
    across, high, depth = (corners @ axes.T).T
    needs = np.maximum(np.abs(across) / ASPECT, np.abs(high)) / _SLOPE
    return 1.04 * float((needs - depth).max())
