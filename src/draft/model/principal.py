"""Inertias of many bodies at once: composed, and their principal moments and frames by MuJoCo.

All functions take arrays whose last axis counts designs; quaternions are (w, x, y, z).
"""

from __future__ import annotations

import mujoco
import numpy as np

from draft.values import Array

# Products of inertia that are rounding, relative to the moments.
_ROUNDING = 1e-13
# Rows of the symmetric matrix (xx, yy, zz, xy, xz, yz).
_SYMMETRIC = [0, 3, 4, 3, 1, 5, 4, 5, 2]


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


def principal(tensor: Array) -> tuple[Array, Array]:
    """Principal moments and frames of inertia tensors, as MuJoCo's compiler finds them.

    MuJoCo stops at an absolute tolerance, so its frames are not those of a library's eigenvectors:
    they differ by up to 1e-8 of the moments.

    Args:
        tensor: xx, yy, zz, xy, xz and yz, shape (..., 6, N).

    Returns:
        Moments in decreasing order, shape (..., 3, N), and quaternions, shape (..., 4, N).
    """
    flat = np.moveaxis(tensor, -2, 0).reshape(6, -1)
    moments, frames = flat[:3].T.copy(), np.zeros((flat.shape[1], 4))
    frames[:, 0] = 1.0
    done = (abs(flat[3:]) <= _ROUNDING * flat[:3].max(axis=0)).all(axis=0)
    done &= (flat[0] >= flat[1]) & (flat[1] >= flat[2])
    left = np.flatnonzero(~done & np.isfinite(flat).all(axis=0))
    axes = np.empty(9)
    for i, full in zip(left.tolist(), flat[:, left][_SYMMETRIC].T.copy(), strict=True):
        mujoco.mju_eig3(moments[i], axes, frames[i], full)
    shape = (*tensor.shape[:-2], tensor.shape[-1], -1)
    return (
        moments.reshape(shape).swapaxes(-1, -2),
        frames.reshape(shape).swapaxes(-1, -2),
    )
