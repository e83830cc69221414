"""Inertias of many bodies at once, composed and diagonalised as MuJoCo's compiler does it.

The compiler diagonalises by Jacobi rotations of a quaternion. That of MuJoCo 3 stops at an absolute
tolerance, so its principal moments and frames are not those of a library's eigenvectors; that of
MuJoCo 4 goes on to rounding for bodies, but not for meshes. The same steps on arrays give the same
moments, in the same order, with axes of the same sign. All functions take arrays whose last axis
counts designs; quaternions are (w, x, y, z).
"""

from __future__ import annotations

import mujoco
import numpy as np

from draft.values import Array

# As in MuJoCo's compiler (user_util.cc).
_TOLERANCE = 1e-12
# Where it goes on to rounding: relative to the moments, and of an angle.
_BODIES_TO_ROUNDING = not mujoco.__version__.startswith("3.")
_ROUNDING, _LEAST_ANGLE = 1e-15, 1e-13
_MOST_STEPS = 500
_EIGHTH_TURN = 0.707106781186548
# Rows of the symmetric matrix (xx, yy, zz, xy, xz, yz).
_SYMMETRIC = np.array([[0, 3, 4], [3, 1, 5], [4, 5, 2]])


def matrices(q: Array) -> Array:
    """Rotation matrices of unit quaternions.

    Args:
        q: shape (..., 4, N).

    Returns:
        Shape (..., 3, 3, N).
    """
    w, x, y, z = (q[..., k, :] for k in range(4))
    found = np.empty((*q.shape[:-2], 3, 3, q.shape[-1]))
    ww, xx, yy, zz = w * w, x * x, y * y, z * z
    wx, wy, wz, xy, xz, yz = w * x, w * y, w * z, x * y, x * z, y * z
    found[..., 0, 0, :] = ww + xx - yy - zz
    found[..., 0, 1, :] = 2 * (xy - wz)
    found[..., 0, 2, :] = 2 * (xz + wy)
    found[..., 1, 0, :] = 2 * (xy + wz)
    found[..., 1, 1, :] = ww - xx + yy - zz
    found[..., 1, 2, :] = 2 * (yz - wx)
    found[..., 2, 0, :] = 2 * (xz - wy)
    found[..., 2, 1, :] = 2 * (yz + wx)
    found[..., 2, 2, :] = ww - xx - yy + zz
    return found


def turned(moments: Array, rotation: Array) -> Array:
    """Inertia tensors of principal moments in turned frames.

    Args:
        moments: principal moments, shape (..., 3, N).
        rotation: shape (..., 3, 3, N), or (..., 3, 3, 1) for all.

    Returns:
        xx, yy, zz, xy, xz and yz, shape (..., 6, N).
    """
    pairs = ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))
    i, j = (np.array(k) for k in zip(*pairs, strict=True))
    if rotation.shape[-1] == 1:
        only = rotation[..., 0]
        shares = only[..., i, :] * only[..., j, :]
        return np.matmul(shares, moments)
    r = [[rotation[..., i, j, :] for j in range(3)] for i in range(3)]
    m = [moments[..., k, :] for k in range(3)]
    return np.stack([sum(r[i][k] * (r[j][k] * m[k]) for k in range(3)) for i, j in pairs], axis=-2)


def product(a: Array, b: Array) -> Array:
    """Products of matrices, shape (..., 3, 3, N)."""
    return (
        a[..., :, 0, None, :] * b[..., None, 0, :, :]
        + a[..., :, 1, None, :] * b[..., None, 1, :, :]
        + a[..., :, 2, None, :] * b[..., None, 2, :, :]
    )


def apply(matrix: Array, v: Array) -> Array:
    """Products of matrices, shape (..., 3, 3, N), and vectors, shape (..., 3, N)."""
    return (
        matrix[..., 0, :] * v[..., None, 0, :]
        + matrix[..., 1, :] * v[..., None, 1, :]
        + matrix[..., 2, :] * v[..., None, 2, :]
    )


def off_centre(mass: Array, arm: Array) -> Array:
    """Inertia tensors of points of a mass, shape (..., N), at arms, shape (..., 3, N)."""
    x, y, z = (arm[..., k, :] for k in range(3))
    xx, yy, zz = x * x, y * y, z * z
    return np.stack(
        [
            mass * (yy + zz),
            mass * (xx + zz),
            mass * (xx + yy),
            -mass * x * y,
            -mass * x * z,
            -mass * y * z,
        ],
        axis=-2,
    )


def principal(tensor: Array, mesh: bool = False) -> tuple[Array, Array]:
    """Principal moments and frames of inertia tensors.

    Args:
        tensor: xx, yy, zz, xy, xz and yz, shape (..., 6, N).
        mesh: whether they are of meshes; otherwise of bodies.

    Returns:
        Moments in decreasing order, shape (..., 3, N), and quaternions, shape (..., 4, N).
    """
    flat = np.moveaxis(tensor, -2, 0).reshape(6, -1)
    moments, q = flat[:3].copy(), np.zeros((4, flat.shape[1]))
    q[0] = 1.0
    exact = _BODIES_TO_ROUNDING and not mesh
    least = _ROUNDING * moments.max(axis=0) if exact else _TOLERANCE
    active = np.flatnonzero(~(np.abs(flat[3:]).max(axis=0) < least))
    if len(active):
        moments[:, active], q[:, active] = _jacobi(flat[:, active], exact)
    _sort(moments, q)
    shape = (tensor.shape[:-2], tensor.shape[-1])
    return _unflattened(moments, *shape), _unflattened(q, *shape)


def _unflattened(values: Array, before: tuple[int, ...], count: int) -> Array:
    return np.moveaxis(values.reshape(len(values), *before, count), 0, -2)


def _jacobi(tensor: Array, exact: bool) -> tuple[Array, Array]:
    """Rotate until the largest product of inertia is small; shape (6, n) -> (3, n), (4, n)."""
    moments, result = tensor[:3].copy(), np.zeros((4, tensor.shape[1]))
    result[0] = 1.0
    here = np.arange(tensor.shape[1])
    q, matrix = result.copy(), tensor[_SYMMETRIC]
    for _ in range(_MOST_STEPS):
        v = matrices(q)
        d = product(product(v.swapaxes(0, 1), matrix), v)
        moments[:, here] = d[[0, 1, 2], [0, 1, 2]]
        xy, xz, yz = d[0, 1], d[0, 2], d[1, 2]
        first = (abs(xy) > abs(xz)) & (abs(xy) > abs(yz))
        second = ~first & (abs(xz) > abs(yz))
        # Axis of the rotation, and the row and column that it mixes.
        off = np.where(first, xy, np.where(second, xz, yz))
        row = np.where(first | second, d[0, 0], d[1, 1])
        column = np.where(first, d[1, 1], d[2, 2])
        with np.errstate(all="ignore"):
            tau = (column - row) / (2 * off)
            t = np.where(tau >= 0, 1.0, -1.0) / (abs(tau) + np.sqrt(1 + tau * tau))
        c = 1.0 / np.sqrt(1 + t * t)
        if exact:
            done = (abs(off) < _ROUNDING * moments[:, here].max(axis=0)) | (abs(t) < _LEAST_ANGLE)
        else:
            done = (abs(off) < _TOLERANCE) | (c > 1.0 - _TOLERANCE)
        going = ~done & np.isfinite(c)
        result[:, here[~going]] = q[:, ~going]
        if not going.any():
            break
        here, q, matrix = here[going], q[:, going], matrix[:, :, going]
        c, t, first, second = c[going], t[going], first[going], second[going]
        # Of half the angle; the second form loses digits of small ones, as the compiler does.
        half = abs(t) * c / np.sqrt(2.0 + 2.0 * c) if exact else np.sqrt(0.5 - 0.5 * c)
        sine = -np.sign(t) * half
        sine = np.where(second, -sine, sine)
        cosine = np.sqrt(1.0 - sine * sine)
        length = np.sqrt(cosine * cosine + sine * sine)
        zero = np.zeros_like(sine)
        turn = np.stack(
            [
                cosine,
                np.where(first | second, zero, sine),
                np.where(second, sine, zero),
                np.where(first, sine, zero),
            ]
        )
        q = _normal(_times(q, turn / length))
    return moments, result


def _sort(moments: Array, q: Array) -> None:
    """Put moments, shape (3, n), in decreasing order; turn the frames, shape (4, n), along."""
    for lead in (0, 1, 0):
        swap = np.flatnonzero(moments[lead] + _TOLERANCE < moments[lead + 1])
        if not len(swap):
            continue
        moments[lead : lead + 2, swap] = moments[lead : lead + 2, swap][::-1]
        turn = np.zeros((4, 1))
        turn[0] = turn[(lead + 2) % 3 + 1] = _EIGHTH_TURN
        q[:, swap] = _normal(_times(q[:, swap], turn))


def _times(a: Array, b: Array) -> Array:
    """Products of quaternions, shape (4, n)."""
    return np.stack(
        [
            a[0] * b[0] - a[1] * b[1] - a[2] * b[2] - a[3] * b[3],
            a[0] * b[1] + a[1] * b[0] + a[2] * b[3] - a[3] * b[2],
            a[0] * b[2] - a[1] * b[3] + a[2] * b[0] + a[3] * b[1],
            a[0] * b[3] + a[1] * b[2] - a[2] * b[1] + a[3] * b[0],
        ]
    )


def _normal(q: Array) -> Array:
    return q / np.sqrt((q * q).sum(axis=0))
