"""Inertias of many bodies at once: composed, and their principal moments and frames by MuJoCo.

All functions take arrays whose last axis counts designs; quaternions are (w, x, y, z).
"""

from __future__ import annotations

import mujoco
import numpy as np

from draft.values import Array

# Products of inertia that are rounding, relative to the moments.
_ROUNDING = 1e-13


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
    """Inertia tensors of principal moments in turned frames, shape (..., 3, 3, N).

    Args:
        moments: principal moments, shape (..., 3, N).
        rotation: shape (..., 3, 3, N), or (..., 3, 3, 1) for all.
    """
    return product(rotation * moments[..., None, :, :], rotation.swapaxes(-2, -3))


def product(a: Array, b: Array) -> Array:
    """Products of matrices, shape (..., 3, 3, N)."""
    return np.einsum("...ijn,...jkn->...ikn", a, b)


def apply(matrix: Array, v: Array) -> Array:
    """Products of matrices, shape (..., 3, 3, N), and vectors, shape (..., 3, N)."""
    return np.einsum("...ijn,...jn->...in", matrix, v)


def composed(a: Array, b: Array) -> Array:
    """Products of unit quaternions, shape (4, N): the turn of b, then that of a."""
    (w, x, y, z), (s, i, j, k) = a, b
    return np.stack(
        [
            w * s - x * i - y * j - z * k,
            w * i + x * s + y * k - z * j,
            w * j - x * k + y * s + z * i,
            w * k + x * j - y * i + z * s,
        ]
    )


def off_centre(mass: Array, arm: Array) -> Array:
    """Inertia tensors of points of a mass, shape (..., N), at arms, shape (..., 3, N)."""
    square = (arm * arm).sum(axis=-2)[..., None, None, :] * np.eye(3)[..., None]
    return mass[..., None, None, :] * (square - arm[..., :, None, :] * arm[..., None, :, :])


def principal(tensor: Array) -> tuple[Array, Array]:
    """Principal moments and frames of inertia tensors, as MuJoCo's compiler finds them.

    MuJoCo stops at an absolute tolerance, so its frames are not those of a library's eigenvectors:
    they differ by up to 1e-8 of the moments.

    Args:
        tensor: shape (..., 3, 3, N).

    Returns:
        Moments in decreasing order, shape (..., 3, N), and quaternions, shape (..., 4, N).
    """
    full = np.moveaxis(tensor, -1, -3).reshape(-1, 9)
    moments, frames = full[:, ::4].copy(), np.zeros((len(full), 4))
    frames[:, 0] = 1.0
    rounding = _ROUNDING * moments.max(axis=1, keepdims=True)
    done = (abs(full[:, [1, 2, 5]]) <= rounding).all(axis=1)
    done &= (np.diff(moments, axis=1) <= 0).all(axis=1)
    axes = np.empty(9)
    for i in np.flatnonzero(~done & np.isfinite(full).all(axis=1)).tolist():
        mujoco.mju_eig3(moments[i], axes, frames[i], full[i])
    shape = (*tensor.shape[:-3], tensor.shape[-1], -1)
    return (
        moments.reshape(shape).swapaxes(-1, -2),
        frames.reshape(shape).swapaxes(-1, -2),
    )
