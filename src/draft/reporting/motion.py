"""Recorded gaits of a report's scene as plain data, and the marks on the floor that show speed.

The page moves the vertices of each robot's meshes by the poses of its bodies (`walk.js`).
"""

from __future__ import annotations

import base64
import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from draft.model.shapes import shapes
from draft.model.solids import triangles
from draft.reporting.subjects import Subject
from draft.values import Array

if TYPE_CHECKING:
    from draft.learn.policy.gait import Gait

SEGMENTS = 24  # Sides of a cylinder, as in `scene3d`.
_MOST = 32767  # Largest number of 16 bits.
_EVERY = 3  # Of these frames one is used to find the room that a gait takes.
_MARGIN = 0.02  # Room around a gait for the other frames [m].
MARK = 0.2  # Distance between two marks on the floor [m].


def packed(values: Any, kind: str) -> dict[str, str]:
    """Encode numbers as bytes for Plotly; kind is "f4", "i4", "i2", "i1" or "u1"."""
    raw = np.ascontiguousarray(values, dtype=f"<{kind}").tobytes()
    return {"dtype": kind, "bdata": base64.b64encode(raw).decode()}


@dataclass(frozen=True, eq=False)
class Part:
    """Vertices of the mesh of one kind of part, in the order of its trace.

    Attributes:
        points: positions in the frames of their bodies [m], shape (n, 3).
        normals: in the frames of their bodies, shape (n, 3).
        bodies: index of the body of each vertex, the trunk being 0, shape (n,).
    """

    points: Array
    normals: Array
    bodies: NDArray[np.intp]


@dataclass(frozen=True, eq=False)
class Motion:
    """Gait of one robot of the scene.

    Attributes:
        gait: the recording.
        parts: vertices by kind of part.
        yaw: angle by which the scene turns the robot about the vertical [rad].
        low, high: corners of the room that it takes [m], each of shape (3,).
    """

    gait: Gait
    parts: dict[str, Part]
    yaw: float
    low: Array
    high: Array

    @staticmethod
    def of(subject: Subject, yaw: float) -> Motion | None:
        """Return the motion of a design that walks, else None."""
        gait = subject.gait
        if gait is None or not gait.walks or subject.model is None:
            return None
        parts = _parts(subject)
        low, high = np.full(3, np.inf), np.full(3, -np.inf)
        for frame in range(0, len(gait.positions), _EVERY):
            turned = _matrices(gait.quaternions[frame])
            for part in parts.values():
                points = np.einsum("nij,nj->ni", turned[part.bodies], part.points)
                points = _turned(points + gait.positions[frame][part.bodies], yaw)
                low, high = (
                    np.minimum(low, points.min(axis=0)),
                    np.maximum(high, points.max(axis=0)),
                )
        return Motion(gait, parts, yaw, low - _MARGIN, high + _MARGIN)

    def plain(self, shift: Array, trace: int) -> dict[str, Any]:
        """Return the motion as plain data for the page.

        Args:
            shift: place of the robot in the scene [m], shape (3,).
            trace: index of the trace with its marks on the floor; those of its meshes follow.
        """
        gait = self.gait
        positions = _turned(gait.positions, self.yaw) + shift
        quantum = float(np.abs(positions).max()) / _MOST
        half = 0.5 * self.yaw
        w, x, y, z = np.moveaxis(gait.quaternions, -1, 0)
        c, s = math.cos(half), math.sin(half)
        facing = np.stack((c * w - s * z, c * x - s * y, c * y + s * x, c * z + s * w), axis=-1)
        ahead = np.array([math.cos(self.yaw), math.sin(self.yaw)])
        size = 0.5 * (self.high - self.low)[:2]
        return {
            "belt": {
                "trace": trace,
                "at": shift[:2].tolist(),
                "ahead": ahead.tolist(),
                "half": [float(0.9 * size @ ahead), float(0.3 * size @ ahead[::-1])],
                "step": MARK,
            },
            "meshes": [
                {
                    "trace": trace + 1 + k,
                    "points": packed(part.points, "f4"),
                    "normals": packed(np.rint(127 * part.normals), "i1"),
                    "bodies": packed(part.bodies, "u1"),
                }
                for k, part in enumerate(self.parts.values())
            ],
            "frames": len(positions),
            "bodies": positions.shape[1],
            "period": gait.period,
            "quantum": quantum,
            "positions": packed(np.rint(positions / quantum), "i2"),
            "quaternions": packed(np.rint(facing * _MOST), "i2"),
            "travel": packed(gait.travel, "f4"),
            "stride": gait.stride,
        }


def belt(subject: Subject) -> dict[str, Any]:
    """Trace of the marks on the floor below a walking robot, which the page fills and moves."""
    return {
        "type": "scatter3d",
        "mode": "lines",
        "hoverinfo": "skip",
        "line": {"color": subject.color, "width": 3},
        **{axis: [0.0, None] for axis in "xyz"},
    }


def _parts(subject: Subject) -> dict[str, Part]:
    """Vertices by kind, in the order of `scene3d.robot_triangles`."""
    model = subject.model
    if model is None:
        return {}
    found: dict[str, list[Part]] = {}
    for shape in filter(lambda one: one.drawn, shapes(model.mujoco, model.design)):
        solid = triangles(shape, SEGMENTS)
        points = solid.points @ shape.rotation.T + shape.position
        bodies = np.full(len(points), shape.body - 1)
        part = Part(points, solid.normals @ shape.rotation.T, bodies)
        found.setdefault(shape.kind, []).append(part)
    return {
        kind: Part(
            np.vstack([part.points for part in parts]),
            np.vstack([part.normals for part in parts]),
            np.concatenate([part.bodies for part in parts]),
        )
        for kind, parts in found.items()
    }


def _turned(points: Array, yaw: float) -> Array:
    """Points turned about the vertical, shape (..., 3)."""
    c, s = math.cos(yaw), math.sin(yaw)
    x, y, z = np.moveaxis(points, -1, 0)
    return np.stack((c * x - s * y, s * x + c * y, z), axis=-1)


def _matrices(quaternions: Array) -> Array:
    """Rotation matrices of unit quaternions (w, x, y, z), shape (n, 3, 3)."""
    w, x, y, z = quaternions.T
    rows = (
        (1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)),
        (2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)),
        (2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)),
    )
    return np.moveaxis(np.array(rows), -1, 0)
