"""Joint-space inertia and gravity torque of two models of one robot, compared pose by pose.

The base is held still; rotors, friction and damping are left out, so that only the links' masses
and where they are count. Source: arXiv 2609.38405, twins.
"""

# pyright: reportAttributeAccessIssue=false
# (MuJoCo's compiled modules carry no types.)
from __future__ import annotations

import copy
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import mujoco
import numpy as np

import draft.mujoco_log  # noqa: F401 - before anything is simulated
from draft.values import Array

GRAVITY = 9.81  # [m/s2]
POSES = 300
SEED = 0


class Machine:
    """A model of which one body is held still, and some hinges turn."""

    def __init__(
        self,
        model: mujoco.MjModel,
        joints: Sequence[str],
        base: int,
        upright: Array,
    ) -> None:
        """Prepare a model on a floating base, whose joint is the first one, or on a fixed one.

        Args:
            model: the model; it is not changed.
            joints: names of the hinges that turn, in the order of all results; others stay at 0.
            base: number of the body that is held still.
            upright: rotation of that body's frame while it is held, shape (3, 3).
        """
        self._take(model)
        ids = [model.joint(name).id for name in joints]
        self.places: Any = model.jnt_qposadr[ids]
        self.dofs: Any = model.jnt_dofadr[ids]
        self.limits: Array = model.jnt_range[ids].copy()
        self.base, self.upright = base, upright
        self.floats = model.jnt_type[0] == mujoco.mjtJoint.mjJNT_FREE

    def _take(self, model: mujoco.MjModel) -> None:
        self.model = copy.copy(model)
        self.model.dof_armature[:] = 0.0
        self.model.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_CONSTRAINT)
        self.data = mujoco.MjData(self.model)

    def of(self, model: mujoco.MjModel) -> Machine:
        """Return the machine of another model of the same joints."""
        other = copy.copy(self)
        other._take(model)
        return other

    def pose(self, q: Array) -> None:
        """Put the root at the origin and the hinges at the angles q [rad], shape (n,).

        The root's frame stays and gravity turns: what the held body feels is the same.
        """
        model, data = self.model, self.data
        data.qpos[:] = 0.0
        if self.floats:
            data.qpos[3] = 1.0
        data.qpos[self.places] = q
        mujoco.mj_kinematics(model, data)
        held = data.xmat[self.base].reshape(3, 3) @ self.upright.T
        model.opt.gravity[:] = held @ np.array([0.0, 0.0, -GRAVITY])

    def inertia_and_gravity(self, q: Array) -> tuple[Array, Array]:
        """M(q) [kg m2], shape (n, n), and g(q) [N m], shape (n,), with the base held still."""
        self.pose(q)
        model, data = self.model, self.data
        mujoco.mj_forward(model, data)
        full = np.empty((model.nv, model.nv))
        mujoco.mj_fullM(model, data, full)
        moves = np.zeros((model.nv, len(self.dofs)))
        if self.floats:
            linear, angular = np.empty((3, model.nv)), np.empty((3, model.nv))
            mujoco.mj_jacBody(model, data, linear, angular, self.base)
            jacobian = np.concatenate([linear, angular])
            # Hinges turn and the root moves such that the held body does not.
            moves[:6] = -np.linalg.solve(jacobian[:, :6], jacobian[:, self.dofs])
        moves[self.dofs, np.arange(len(self.dofs))] = 1.0
        return moves.T @ full @ moves, moves.T @ data.qfrc_bias


@dataclass(frozen=True, slots=True)
class Errors:
    """Frobenius error of one quantity over the poses, percent of the vendor's norm.

    Attributes:
        values: error at each pose, shape (poses,) [%]; nan where the vendor's norm is nothing.
    """

    values: Array

    @property
    def median(self) -> float:
        """Median over the poses [%]."""
        return self.quantile(0.5)

    @property
    def variance(self) -> float:
        """Variance over the poses [%^2]."""
        known = self._known
        return float(np.var(known, ddof=1)) if len(known) > 1 else float("nan")

    def quantile(self, share: float) -> float:
        """Quantile over the poses [%]."""
        return float(np.quantile(self._known, share)) if len(self._known) else float("nan")

    @property
    def _known(self) -> Array:
        return self.values[np.isfinite(self.values)]


def poses(vendor: Machine, twin: Machine, count: int = POSES, seed: int = SEED) -> Array:
    """Angles drawn evenly from the overlap of both machines' joint ranges [rad], (count, n).

    A hinge whose ranges do not overlap stays in the middle between them.
    """
    low = np.maximum(vendor.limits[:, 0], twin.limits[:, 0])
    high = np.minimum(vendor.limits[:, 1], twin.limits[:, 1])
    middle = (low + high) / 2
    low, high = np.where(low > high, middle, low), np.where(low > high, middle, high)
    return np.random.default_rng(seed).uniform(low, high, (count, len(low)))


def errors(vendor: Machine, twin: Machine, q: Array) -> tuple[Errors, Errors]:
    """Errors of the twin's M(q) and g(q) against the vendor's at poses of shape (poses, n)."""
    found = np.empty((2, len(q)))
    for k, angles in enumerate(q):
        true, own = vendor.inertia_and_gravity(angles), twin.inertia_and_gravity(angles)
        for row, (a, b) in enumerate(zip(true, own, strict=True)):
            size = float(np.linalg.norm(a))
            found[row, k] = 100 * np.linalg.norm(b - a) / size if size else np.nan
    return Errors(found[0]), Errors(found[1])
