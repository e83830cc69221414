"""Solids lofted through cross-sections, with their exact mass properties.

The surface is a closed triangle mesh. Its volume, centre of mass and inertia follow in closed
form from the divergence theorem, as sums over triangles of polynomials in the corners (Tonon,
"Explicit exact formulas for the 3-D tetrahedron inertia tensor", 2004), so they are those of the
mesh to rounding. Corners are arrays of shape (corners, 3), or (corners, 3, N).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np
from numpy.typing import NDArray

from draft.values import Array, Mask, Value, both, either, minimum, some

Pair = tuple[Value, Value]
# Number of designs integrated at a time, so that the triangles of a row stay in the cache.
_ROWS = 2048
# Index in space of the coordinates (along, first, second): cyclic, so that they are right-handed.
FRAMES = {"x": (0, 1, 2), "y": (1, 2, 0), "z": (2, 0, 1)}


def rectangle(width: Value, height: Value, chamfer: Value | None) -> list[Pair]:
    """Corners of a chamfered rectangle, counter-clockwise.

    Args:
        width: size along the section's first coordinate [m].
        height: size along its second [m].
        chamfer: corner cut as a share of the shorter side, 0 to 0.5; None for plain corners.
    """
    a, b = width / 2, height / 2
    if chamfer is None:
        return [(-a, -b), (a, -b), (a, b), (-a, b)]
    c = chamfer * minimum(width, height)
    return [
        (-a + c, -b),
        (a - c, -b),
        (a, -b + c),
        (a, b - c),
        (a - c, b),
        (-a + c, b),
        (-a, b - c),
        (-a, -b + c),
    ]


@dataclass(frozen=True)
class Loft:
    """A closed solid through sections; `vertices` has shape (S K, 3) or (S K, 3, N)."""

    vertices: Array
    sections: int
    corners: int
    convex: bool

    @cached_property
    def volume(self) -> Value:
        """Volume [m3]."""
        if self.vertices.ndim == 2:
            return float(self._triangles[3].sum() / 6)
        count = self.vertices.shape[2]
        volume = np.empty(count)
        for i in range(0, count, _ROWS):
            volume[i : i + _ROWS] = self._volume(self.vertices[:, :, i : i + _ROWS])
        return volume

    def _volume(self, vertices: Array) -> Array:
        """Volume of N solids [m3]: the sum over triangles, with common terms taken together."""
        split = vertices.reshape(self.sections, self.corners, 3, -1)
        following = np.roll(split, -1, axis=1)
        six = np.zeros(vertices.shape[2])
        for low, low_j, high, high_j in zip(
            split[:-1], following[:-1], split[1:], following[1:], strict=True
        ):
            six += _products(low, low_j - high, high_j).sum(axis=0)
        for k, sign in ((0, -1), (-1, 1)):
            six += sign * _products(split[k, :1], split[k], following[k]).sum(axis=0)
        return six / 6

    @cached_property
    def _triangles(self) -> tuple[Array, Array, Array, Array]:
        """Corners of the triangles, and six times the signed volume of each with the origin."""
        faces = fan_faces(self.sections, self.corners)
        a, b, c = (self.vertices[faces[:, k]] for k in range(3))
        six = _products(a, b, c)
        return a, b, c, six

    @cached_property
    def com(self) -> Array:
        """Centre of mass of the uniform solid [m], shape (3,) or (3, N)."""
        a, b, c, six = self._triangles
        return np.einsum("f...,fi...->i...", six, a + b + c) / 24 / self.volume

    @cached_property
    def inertia(self) -> Array:
        """Inertia about the centre of mass per unit density [m5], shape (3, 3) or (3, 3, N)."""
        a, b, c, six = self._triangles
        total = a + b + c
        if self.vertices.ndim == 3:
            second = _second_moments(six, (a, b, c, total))
        else:
            second = (
                sum(
                    np.einsum("f...,fi...,fj...->ij...", six, corner, corner)
                    for corner in (a, b, c, total)
                )
                / 120
            )
        com = self.com
        second = second - self.volume * com[:, None] * com[None, :]
        identity = np.eye(3).reshape(3, 3, *([1] * (second.ndim - 2)))
        return np.trace(second) * identity - second

    def faces(self) -> NDArray[np.int64]:
        """Outward triangles of the mesh of one design, shape (F, 3); caps may be concave."""
        k, s = self.corners, self.sections
        if self.convex:
            return fan_faces(s, k)
        sides = fan_faces(s, k)[: 2 * k * (s - 1)]
        caps = []
        for section, outward in ((0, -1), (s - 1, 1)):
            polygon = self.vertices[section * k : (section + 1) * k]
            triangles = triangulate(_flat(polygon))
            caps.append(triangles[:, ::outward] + section * k)
        return np.vstack([sides, *caps])


def _products(a: Array, b: Array, c: Array) -> Array:
    """Triple products a . (b x c) of vectors along the second axis."""
    (ax, ay, az), (bx, by, bz), (cx, cy, cz) = ((v[:, 0], v[:, 1], v[:, 2]) for v in (a, b, c))
    return ax * (by * cz - bz * cy) + ay * (bz * cx - bx * cz) + az * (bx * cy - by * cx)


def _second_moments(six: Array, corners: tuple[Array, ...]) -> Array:
    """Integral of x_i x_j over N solids [m5], shape (3, 3, N); einsum is several times slower."""
    second = np.zeros((3, 3, six.shape[1]))
    for corner in corners:
        weighted = six[:, None] * corner
        for i in range(3):
            for j in range(i + 1):
                second[i, j] += (weighted[:, i] * corner[:, j]).sum(axis=0)
    for i, j in ((0, 1), (0, 2), (1, 2)):
        second[i, j] = second[j, i]
    return second / 120


def loft(axis: str, places: list[Value], sections: list[list[Pair]], convex: bool) -> Loft:
    """Loft a solid through sections.

    Args:
        axis: direction of the loft, "x", "y" or "z".
        places: place of each section along it [m], increasing.
        sections: corners of each section in its two coordinates [m], counter-clockwise; the same
            number in each.
        convex: whether every section is known to be convex.
    """
    along, first, second = FRAMES[axis]
    rows: list[list[Value]] = []
    for at, corners in zip(places, sections, strict=True):
        for u, w in corners:
            row: list[Value] = [0.0, 0.0, 0.0]
            row[along], row[first], row[second] = at, u, w
            rows.append(row)
    flat = [value for row in rows for value in row]
    if any(isinstance(value, np.ndarray) for value in flat):
        count = next(len(value) for value in flat if isinstance(value, np.ndarray))
        vertices = np.empty((len(rows), 3, count))
        for i, row in enumerate(rows):
            for j in range(3):
                vertices[i, j] = row[j]
    else:
        vertices = np.array(rows, dtype=np.float64)
    return Loft(vertices, len(sections), len(sections[0]), convex)


@lru_cache(maxsize=64)
def fan_faces(sections: int, corners: int) -> NDArray[np.int64]:
    """Outward triangles of a loft whose caps are fans: the sides, then the two caps."""
    k = corners
    faces = []
    for s in range(sections - 1):
        for i in range(k):
            j = (i + 1) % k
            low_i, low_j, high_i, high_j = s * k + i, s * k + j, (s + 1) * k + i, (s + 1) * k + j
            faces += [(low_i, low_j, high_j), (low_i, high_j, high_i)]
    last = (sections - 1) * k
    faces += [(0, i + 1, i) for i in range(1, k - 1)]
    faces += [(last, last + i, last + i + 1) for i in range(1, k - 1)]
    made = np.array(faces, dtype=np.int64)
    made.setflags(write=False)  # all callers share the cached array
    return made


def area(corners: list[Pair]) -> Value:
    """Signed area of a polygon [m2], positive when counter-clockwise (shoelace formula)."""
    result: Value = 0.0
    for (x0, y0), (x1, y1) in zip(corners, corners[1:] + corners[:1], strict=True):
        result = result + (x0 * y1 - x1 * y0) / 2
    return result


def crossing(corners: list[Pair]) -> tuple[Mask, tuple[int, int] | None]:
    """Whether edges of a polygon cross, and the first pair that crosses in any design."""
    k = len(corners)
    crossed: Mask = False
    first: tuple[int, int] | None = None
    for i in range(k):
        for j in range(i + 2, k):
            if i == 0 and j == k - 1:
                continue
            a, b = corners[i], corners[i + 1]
            c, d = corners[j], corners[(j + 1) % k]
            cross = both(_turn(a, b, c) * _turn(a, b, d) < 0, _turn(c, d, a) * _turn(c, d, b) < 0)
            if some(cross):
                crossed = either(crossed, cross)
                first = first or (i, j)
    return crossed, first


def triangulate(polygon: Array) -> NDArray[np.int64]:
    """Triangulate a simple counter-clockwise polygon of shape (K, 2) by ear clipping."""
    left = list(range(len(polygon)))
    triangles = []
    points = [(float(x), float(y)) for x, y in polygon]
    while len(left) > 3:
        for i in range(len(left)):
            a, b, c = left[i - 1], left[i], left[(i + 1) % len(left)]
            if _is_ear(points, left, a, b, c):
                triangles.append((a, b, c))
                left.remove(b)
                break
        else:  # only slivers remain; any order closes the mesh
            triangles += [(left[0], left[i], left[i + 1]) for i in range(1, len(left) - 1)]
            return np.array(triangles, dtype=np.int64)
    triangles.append((left[0], left[1], left[2]))
    return np.array(triangles, dtype=np.int64)


def _is_ear(points: list, left: list[int], a: int, b: int, c: int) -> bool:
    p, q, r = points[a], points[b], points[c]
    if _turn(p, q, r) <= 0:
        return False
    for other in left:
        if other in (a, b, c):
            continue
        o = points[other]
        if _turn(p, q, o) >= 0 and _turn(q, r, o) >= 0 and _turn(r, p, o) >= 0:
            return False
    return True


def _turn(a: Pair, b: Pair, c: Pair) -> Value:
    """Twice the signed area of a triangle: positive for a left turn."""
    return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])


def _flat(polygon: Array) -> Array:
    """Corners of a planar section in its two right-handed coordinates."""
    spread = np.ptp(polygon, axis=0)
    along = int(np.argmin(spread))
    return polygon[:, [(along + 1) % 3, (along + 2) % 3]]
