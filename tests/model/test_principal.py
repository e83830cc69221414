"""Principal moments and frames by arrays are those of MuJoCo's own routine."""

from __future__ import annotations

import mujoco
import numpy as np
import pytest

from draft.model.batch import follows_mujoco
from draft.model.principal import principal
from draft.values import Array

pytestmark = pytest.mark.skipif(not follows_mujoco(), reason="it follows MuJoCo 3 and 4")
COUNT = 200


def tensors(kind: str, rng: np.random.Generator) -> Array:
    """Inertias of bodies from toys to trunks, shape (COUNT, 3, 3) [kg m2]."""
    moments = rng.uniform(1.0, 1.9, (COUNT, 3))
    rotation = np.linalg.qr(rng.normal(size=(COUNT, 3, 3)))[0]
    if kind == "of two equal moments":
        moments[:, 1] = moments[:, 0]
    if kind == "nearly aligned":
        small = 10.0 ** rng.uniform(-12, -3, (COUNT, 1, 1)) * rng.normal(size=(COUNT, 3, 3))
        rotation = np.linalg.qr(np.eye(3) + small)[0]
    found = np.einsum("nij,nj,nkj->nik", rotation, moments, rotation)
    found = (found + found.swapaxes(1, 2)) / 2
    return found * 10.0 ** rng.uniform(-6, 1, (COUNT, 1, 1))


@pytest.mark.parametrize("kind", ["turned", "of two equal moments", "nearly aligned"])
def test_they_are_those_of_mujoco(kind: str) -> None:
    many = tensors(kind, np.random.default_rng(0))
    flat = many[:, [0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]]
    moments, frames = principal(flat.T)
    for k, tensor in enumerate(many):
        expected, axes, quat = np.zeros(3), np.zeros(9), np.zeros(4)
        mujoco.mju_eig3(expected, axes, quat, tensor.ravel())
        np.testing.assert_allclose(moments[:, k], expected, rtol=1e-12)
        np.testing.assert_allclose(frames[:, k], quat, atol=1e-10)


@pytest.mark.skipif(mujoco.__version__.startswith("3."), reason="MuJoCo 3 stops before")
def test_frames_diagonalise_to_rounding() -> None:
    many = tensors("turned", np.random.default_rng(1))
    flat = many[:, [0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]]
    _, frames = principal(flat.T)
    for quat, tensor in zip(frames.T, many, strict=True):
        matrix = np.zeros(9)
        mujoco.mju_quat2Mat(matrix, quat)
        axes = matrix.reshape(3, 3)
        turned = axes.T @ tensor @ axes
        rest = abs(turned - np.diag(np.diag(turned))).max()
        assert rest < 1e-13 * abs(tensor).max()
