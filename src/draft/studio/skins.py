"""Triangles of a robot for the browser: one mesh per colour, which draws faster than many."""

from __future__ import annotations

from collections.abc import Iterable
from typing import NamedTuple

import mujoco
import numpy as np
from numpy.typing import NDArray

from draft.model import Model
from draft.model.shapes import shapes
from draft.model.solids import triangles
from draft.spec.primitives import colors
from draft.values import Array

SEGMENTS, COARSE = 24, 8
Color = tuple[int, int, int]


class Skin(NamedTuple):
    """The shapes of a robot in one colour.

    Attributes:
        vertices: vertices in the frames of their bodies [m], shape (n, 3).
        bodies: index of the body of each vertex, shape (n,).
        faces: vertices of each triangle, shape (k, 3).
    """

    vertices: Array
    bodies: NDArray[np.intp]
    faces: NDArray[np.uint32]

    def placed(self, data: mujoco.MjData) -> NDArray[np.float32]:
        """Vertices in the world frame at a state [m], shape (n, 3)."""
        frames = data.xmat.reshape(-1, 3, 3)[self.bodies]
        turned = np.einsum("nij,nj->ni", frames, self.vertices)
        return (turned + data.xpos[self.bodies]).astype(np.float32)


def hit(
    skins: Iterable[Skin], vertices: Iterable[Array], origin: Array, direction: Array
) -> int | None:
    """Return the body that a ray meets first; None if it meets none.

    Args:
        skins: skins of the robot.
        vertices: vertices of each skin in the frame of the ray [m], shape (n, 3) each.
        origin: start of the ray [m], shape (3,).
        direction: direction of the ray, shape (3,).
    """
    nearest, found = np.inf, None
    for skin, points in zip(skins, vertices, strict=True):
        # Moeller and Trumbore, "Fast, minimum storage ray/triangle intersection", 1997.
        a, b, c = (points[skin.faces[:, k]] for k in range(3))
        across = np.cross(direction, c - a)
        volume = np.einsum("ij,ij->i", across, b - a)
        with np.errstate(divide="ignore", invalid="ignore"):
            start = origin - a
            u = np.einsum("ij,ij->i", across, start) / volume
            other = np.cross(start, b - a)
            v = other @ direction / volume
            far = np.einsum("ij,ij->i", other, c - a) / volume
            meets = (u >= 0) & (v >= 0) & (u + v <= 1) & (far > 0)
        far = np.where(meets, far, np.inf)
        first = int(far.argmin())
        if far[first] < nearest:
            nearest, found = far[first], int(skin.bodies[skin.faces[first, 0]])
    return found


def outline(model: Model) -> Skin:
    """Return all shapes of a robot as one coarse skin, whose shadow is quick to draw."""
    return _joined([*skins(model, COARSE).values()])


def skins(model: Model, segments: int = SEGMENTS) -> dict[Color, Skin]:
    """Return the skins of a robot by colour (red, green, blue), each from 0 to 255.

    Args:
        model: the robot.
        segments: edges of the polygon that stands for a circle.
    """
    parts: dict[Color, list[Skin]] = {}
    for shape in filter(lambda one: one.drawn, shapes(model.mujoco, model.design)):
        solid = triangles(shape, segments)
        vertices = solid.points @ shape.rotation.T + shape.position
        bodies = np.full(len(vertices), shape.body)
        red, green, blue = (round(255 * x) for x in colors()[shape.kind][:3])
        skin = Skin(vertices, bodies, solid.faces.astype(np.uint32))
        parts.setdefault((red, green, blue), []).append(skin)
    return {color: _joined(of) for color, of in parts.items()}


def _joined(parts: list[Skin]) -> Skin:
    starts = np.cumsum([0, *(len(part.vertices) for part in parts[:-1])])
    faces = [part.faces + start for part, start in zip(parts, starts, strict=True)]
    return Skin(
        np.concatenate([part.vertices for part in parts]),
        np.concatenate([part.bodies for part in parts]),
        np.concatenate(faces).astype(np.uint32),
    )
