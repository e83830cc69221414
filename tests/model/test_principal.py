"""Principal moments in their frames are the inertia tensors, in decreasing order."""

from __future__ import annotations

import numpy as np
import pytest

from draft.model.principal import matrices, principal
from draft.values import Array

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
def test_moments_in_their_frames_are_the_tensors(kind: str) -> None:
    many = tensors(kind, np.random.default_rng(0))
    # Two bodies of COUNT / 2 designs.
    moments, frames = principal(np.moveaxis(many.reshape(2, -1, 3, 3), 1, -1))
    assert (moments.shape, frames.shape) == ((2, 3, COUNT // 2), (2, 4, COUNT // 2))
    turns = np.moveaxis(matrices(frames), -1, 1).reshape(-1, 3, 3)
    rows = np.moveaxis(moments, 1, 2).reshape(-1, 3)
    for moment, axes, tensor in zip(rows, turns, many, strict=True):
        np.testing.assert_allclose(moment, np.linalg.eigvalsh(tensor)[::-1], rtol=1e-11)
        np.testing.assert_allclose(axes @ axes.T, np.eye(3), atol=1e-14)
        # MuJoCo 3 stops at turns of 1.4e-6 rad.
        found = axes @ np.diag(moment) @ axes.T
        np.testing.assert_allclose(found, tensor, rtol=0, atol=2e-6 * abs(tensor).max())


def test_a_sorted_diagonal_tensor_has_no_turn_even_with_equal_moments_and_rounding() -> None:
    rows = 1e-6 * np.array([[3, 2, 1], [2, 2, 1], [2, 1, 1], [1, 1, 1]]).T
    moments, frames = principal(np.where(np.eye(3, dtype=bool)[..., None], rows, 1e-20))
    np.testing.assert_array_equal(moments, rows)
    np.testing.assert_array_equal(frames.T, np.tile([1.0, 0.0, 0.0, 0.0], (4, 1)))


def test_a_tensor_that_is_not_finite_spoils_no_other() -> None:
    one = np.array([[1.0, 0.1, 0.2], [0.1, 2.0, 0.3], [0.2, 0.3, 3.0]])
    tensor = np.tile(one[..., None], 3)
    tensor[0, 2, 1], tensor[0, 0, 2] = np.inf, np.nan
    moments, frames = principal(tensor)
    alone, frame = principal(tensor[..., :1])
    np.testing.assert_array_equal(moments[:, :1], alone)
    np.testing.assert_array_equal(frames[:, :1], frame)
