"""Vectors and rotations as tuples, whose components are floats or arrays of shape (N,).

For a single design, tuples of floats are ten times as fast as small NumPy arrays; for many, tuples
of arrays need no broadcasting rules. Rotations are row-major 3 x 3 nested tuples; None is the
identity, which most links have.
"""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from draft.values import Value, cos, is_array, sin, sqrt

Vector = tuple[Value, Value, Value]
Matrix = tuple[Vector, Vector, Vector]
Rotation = Matrix | None
Frame = tuple[Vector, Rotation]  # origin [m] and rotation, in another frame

_ARRAY = np.ndarray

ZERO: Vector = (0.0, 0.0, 0.0)
ORIGIN: Frame = (ZERO, None)
IDENTITY: Matrix = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))


def add(a: Vector, b: Vector) -> Vector:
    """Sum of two vectors."""
    return (a[0] + b[0], a[1] + b[1], a[2] + b[2])


def subtract(a: Vector, b: Vector) -> Vector:
    """Difference of two vectors."""
    return (a[0] - b[0], a[1] - b[1], a[2] - b[2])


def scale(a: Vector, factor: Value) -> Vector:
    """Multiply a vector by a number."""
    if type(factor) is _ARRAY:
        return (_product(a[0], factor), _product(a[1], factor), _product(a[2], factor))
    return (a[0] * factor, a[1] * factor, a[2] * factor)


def reflect(a: Vector, signs: Vector) -> Vector:
    """Reflect a vector by signs, +1.0 or -1.0 per axis; unchanged components are shared."""
    return (_signed(a[0], signs[0]), _signed(a[1], signs[1]), _signed(a[2], signs[2]))


def _signed(value: Value, sign: Value) -> Value:
    # For many designs a component is an array; multiplying it by one would copy it.
    return value if sign == 1.0 else -value


def dot(a: Vector, b: Vector) -> Value:
    """Scalar product."""
    x, y, z = a
    # The types are compared here because a call takes longer than the sum.
    if type(x) is _ARRAY or type(y) is _ARRAY or type(z) is _ARRAY:
        return _sparse_dot(a, b)
    return x * b[0] + y * b[1] + z * b[2]


def _sparse_dot(a: Vector, b: Vector) -> Value:
    """`dot` without the terms that are zero for all designs."""
    result: Value = 0.0
    for x, y in zip(a, b, strict=True):
        if not (_is(x, 0.0) or _is(y, 0.0)):
            term = _product(x, y)
            result = term if _is(result, 0.0) else result + term
    return result


def _product(x: Value, y: Value) -> Value:
    """Product that is no array where a factor is zero, and no copy where it is one."""
    if _is(x, 0.0) or _is(y, 0.0):
        return 0.0
    return y if _is(x, 1.0) else x if _is(y, 1.0) else x * y


def _is(value: Value, number: float) -> bool:
    """Whether a value is this number for all designs."""
    return not is_array(value) and value == number


def cross(a: Vector, b: Vector) -> Vector:
    """Vector product."""
    return (
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    )


def norm(a: Vector) -> Value:
    """Euclidean length."""
    return sqrt(dot(a, a))


def rotate(rotation: Rotation, v: Vector) -> Vector:
    """Rotate a vector."""
    if rotation is None:
        return v
    return (dot(rotation[0], v), dot(rotation[1], v), dot(rotation[2], v))


def compose(a: Rotation, b: Rotation) -> Rotation:
    """Rotation that applies b first and then a."""
    if a is None:
        return b
    if b is None:
        return a
    x, y, z = zip(*b, strict=True)
    first, second, third = ((dot(row, x), dot(row, y), dot(row, z)) for row in a)
    return (first, second, third)


def transposed(rotation: Matrix) -> Matrix:
    """Transpose of a matrix, which is the inverse of a rotation."""
    (a, b, c), (d, e, f), (g, h, i) = rotation
    return ((a, d, g), (b, e, h), (c, f, i))


def about(axis: Vector, angle: Value) -> Matrix:
    """Rotation by `angle` [rad] about a unit axis (Rodrigues' formula)."""
    x, y, z = axis
    c, s = cos(angle), sin(angle)
    if is_array(angle) and (turn := _about_an_axis(axis, c, s)) is not None:
        return turn
    t = 1.0 - c
    return (
        (c + t * x * x, t * x * y - s * z, t * x * z + s * y),
        (t * x * y + s * z, c + t * y * y, t * y * z - s * x),
        (t * x * z - s * y, t * y * z + s * x, c + t * z * z),
    )


def _about_an_axis(axis: Vector, c: Value, s: Value) -> Matrix | None:
    """Rotations about a coordinate axis, whose constant elements are floats; None about others."""
    for k in range(3):
        i, j = (k + 1) % 3, (k + 2) % 3
        if _is(axis[i], 0.0) and _is(axis[j], 0.0) and not is_array(axis[k]):
            rows: list[list[Value]] = [[0.0, 0.0, 0.0] for _ in range(3)]
            rows[k][k] = 1.0
            rows[i][i] = rows[j][j] = c
            rows[j][i] = s * axis[k]
            rows[i][j] = -rows[j][i]
            (a, b, d) = ((row[0], row[1], row[2]) for row in rows)
            return (a, b, d)
    return None


def from_rpy(roll: Value, pitch: Value, yaw: Value) -> Matrix:
    """Rotation of URDF's roll, pitch, yaw [rad]: about the fixed axes x, then y, then z."""
    cr, sr, cp, sp = cos(roll), sin(roll), cos(pitch), sin(pitch)
    cy, sy = cos(yaw), sin(yaw)
    return (
        (cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr),
        (sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr),
        (-sp, cp * sr, cp * cr),
    )


def quaternion(rotation: Matrix) -> tuple[Value, Value, Value, Value]:
    """Unit quaternion (w, x, y, z) of a rotation, with w >= 0 (Shepperd's method)."""
    ((a, b, c), (d, e, f), (g, h, i)) = rotation
    trace = a + e + i
    candidates = (trace, a, e, i)
    if any(is_array(x) for row in rotation for x in row):
        return _quaternions(rotation)
    best = max(range(4), key=lambda k: float(candidates[k]))
    q = (
        (1 + trace, h - f, c - g, d - b),
        (h - f, 1 + a - e - i, b + d, c + g),
        (c - g, b + d, 1 - a + e - i, f + h),
        (d - b, c + g, f + h, 1 - a - e + i),
    )[best]
    length = float(sqrt(sum(float(x) ** 2 for x in q)))
    sign = -1.0 if q[0] < 0 else 1.0
    w, x, y, z = (sign * float(component) / length for component in q)
    return (w, x, y, z)


def _quaternions(rotation: Matrix) -> tuple[Value, Value, Value, Value]:
    """`quaternion` of N rotations."""
    ((a, b, c), (d, e, f), (g, h, i)) = rotation
    candidates = np.stack(np.broadcast_arrays(a + e + i, a, e, i))
    rows = (
        (1 + a + e + i, h - f, c - g, d - b),
        (h - f, 1 + a - e - i, b + d, c + g),
        (c - g, b + d, 1 - a + e - i, f + h),
        (d - b, c + g, f + h, 1 - a - e + i),
    )
    each = np.array([np.broadcast_arrays(*row, candidates[0])[:4] for row in rows])
    best = np.argmax(candidates, axis=0)
    q = np.take_along_axis(each, best[None, None], axis=0)[0]
    w, x, y, z = np.where(q[0] < 0, -1.0, 1.0) * q / np.linalg.norm(q, axis=0)
    return (w, x, y, z)


def mirrored(rotation: Rotation, signs: Vector) -> Rotation:
    """Conjugate a rotation by a reflection, diag(signs) R diag(signs)."""
    if rotation is None:
        return None
    x, y, z = (
        (
            _signed(row[0], sign * signs[0]),
            _signed(row[1], sign * signs[1]),
            _signed(row[2], sign * signs[2]),
        )
        for row, sign in zip(rotation, signs, strict=True)
    )
    return (x, y, z)


def total(values: Iterable[Value]) -> Value:
    """Sum of values, added in order, starting from zero."""
    result: Value = 0.0
    for value in values:
        result = result + value
    return result
