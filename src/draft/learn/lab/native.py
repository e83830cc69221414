"""Native MuJoCo behind the surface of mjlab's `Simulation`, stepped by mjbatch on CPU threads.

`NativeSimulation` has the attributes and methods that mjlab's environments, managers, entities,
sensors and viewers use of `mjlab.sim.Simulation`. Arrays are shared with mjbatch, so that what a
term writes to `data` or to an expanded field of `model` reaches the physics at its next call. The
module depends on nothing of Draft: it could stand beside mjlab's own `sim.py`.

Differences from MuJoCo Warp that a reader may notice:

- states are kept in double precision; `data` shows them in single precision, and a single-precision
  write replaces only the elements that it changes;
- expanded model fields are in double precision, and integer fields have no world axis;
- no world resets itself where its state is no longer finite (`mjDSBL_AUTORESET`), as on Warp.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import mujoco
import numpy as np
import torch
from mjbatch import Batch
from mjlab.managers.event_manager import RecomputeLevel
from mjlab.sim.sim import Simulation, SimulationCfg
from mjlab.utils.nan_guard import NanGuard

# Arrays of MjData whose last axis is a row-major 3 x 3 matrix.
_MATRICES = ("xmat", "ximat", "geom_xmat", "site_xmat", "cam_xmat")
# Derived fields that walking tasks read. Others are bound when they are asked for: they are then
# shown as of the present state at first, and lag by a time step from the next step on.
_DERIVED = (
    *("xpos", "xquat", "xmat", "site_xpos", "site_xmat", "cvel", "subtree_com", "sensordata"),
    "qfrc_actuator",
)
# The state: set by the user or by integration, not derived by `mj_forward`.
_INPUTS = frozenset(
    (
        *("qpos", "qvel", "act", "ctrl", "time", "qacc_warmstart", "qfrc_applied"),
        *("xfrc_applied", "mocap_pos", "mocap_quat", "eq_active", "userdata", "warning"),
    )
)
# Fields of the model that `mj_setConst` works out.
_CONSTANTS = (
    *("body_subtreemass", "body_invweight0", "dof_invweight0", "dof_M0"),
    *("tendon_length0", "tendon_invweight0", "actuator_acc0", "actuator_length0"),
)
_AUTORESET = int(mujoco.mjtDisableBit.mjDSBL_AUTORESET)


class NativeSimulation(Simulation):
    """N simulations of one model on native MuJoCo, for what mjlab does with its `Simulation`.

    It is one, since mjlab's viewers ask for one, and inherits only what reads attributes.

    Attributes:
        cfg: mjlab's configuration; what concerns MuJoCo Warp alone is ignored.
        device: "cpu".
        num_envs: number of worlds.
        use_cuda_graph: False.
        nan_guard: mjlab's.
    """

    def __init__(
        self,
        num_envs: int,
        cfg: SimulationCfg,
        model: mujoco.MjModel | None = None,
        device: str = "cpu",
        *,
        spec: mujoco.MjSpec | None = None,
        variant_info: Sequence[Any] | None = None,
        threads: int = 1,
    ) -> None:
        """Allocate the worlds, each in the model's reference state.

        Args:
            num_envs: number of worlds.
            cfg: mjlab's configuration of the simulation.
            model: compiled model; or give `spec`.
            device: must be "cpu".
            spec: model to compile.
            variant_info: must be empty: meshes per world exist on MuJoCo Warp alone.
            threads: threads that step the worlds.

        Raises:
            ValueError: neither model nor spec is given, another device, or variants.
        """
        if torch.device(device).type != "cpu":
            raise ValueError(f"native MuJoCo runs on the CPU, not on '{device}'")
        if variant_info:
            raise ValueError("native MuJoCo has no meshes per world; use MuJoCo Warp")
        if spec is not None:
            model = spec.compile()
        if model is None:
            raise ValueError("either model or spec must be given")
        cfg.mujoco.apply(model)
        model.opt.disableflags |= _AUTORESET
        self.cfg, self.device, self.num_envs = cfg, "cpu", num_envs
        self.use_cuda_graph = False
        self._mj_model, self._mj_data = model, mujoco.MjData(model)
        mujoco.mj_forward(model, self._mj_data)
        self._batch = Batch(model, num_envs, num_threads=threads)
        # What the properties of mjlab's class read.
        self._default_model_fields: dict[str, torch.Tensor] = {}
        self._expanded_fields: set[str] = set()
        self._per_world_default_fields: set[str] = set()
        self._world_to_variant: dict[str, torch.Tensor] = {}
        self._model_bridge: Any = NativeModel(self._mj_model, self._batch)
        self._data_bridge: Any = NativeData(self._batch)
        self._state = torch.from_numpy(self._batch.bind("state"))
        for name in _DERIVED:
            getattr(self.data, name)
        self._batch.forward()
        self.nan_guard = NanGuard(cfg.nan_guard, num_envs, model)

    @property
    def state(self) -> torch.Tensor:
        """All that integration continues from (`mjSTATE_INTEGRATION`), shape (worlds, states).

        A row that is written is the world's state at its next call; `data` shows it after that.
        """
        return self._state

    def expand_model_fields(self, fields: tuple[str, ...]) -> None:
        """Give every world its own value of model fields, seeded from the model.

        Raises:
            ValueError: there is no such field.
        """
        unknown = [name for name in fields if not hasattr(self._mj_model, name)]
        if unknown:
            raise ValueError(f"Fields not found in model: {unknown}")
        self._expanded_fields.update(fields)
        self._model_bridge.own(fields)

    def recompute_constants(self, level: RecomputeLevel) -> None:
        """Compute the constants that follow from expanded fields, by `mj_setConst` in each world.

        Args:
            level: ignored: all are recomputed, so that each world has those of its own model.
        """
        del level
        self._batch.set_const()
        self._model_bridge.own(_CONSTANTS)

    def step(self) -> None:
        """Advance all worlds by one time step; derived fields lag by one, as after `mj_step`."""
        with self.nan_guard.watch(self.data):
            self._batch.step()

    def forward(self) -> None:
        """Compute the derived fields of all worlds."""
        self._batch.forward()

    def reset(self, env_ids: torch.Tensor | None = None) -> None:
        """Put worlds into the reference state of the model."""
        if env_ids is None:
            self._batch.reset()
            return
        chosen = np.zeros(self.num_envs, dtype=bool)
        chosen[env_ids.numpy()] = True
        self._batch.reset(chosen)

    def create_graph(self) -> None:
        """Do nothing: there is no graph to capture."""

    def set_sensor_context(self, ctx: Any) -> None:
        """Refuse cameras and ray-cast sensors, which need MuJoCo Warp.

        Raises:
            NotImplementedError: always.
        """
        raise NotImplementedError("cameras and ray-cast sensors need MuJoCo Warp")

    def sense(self) -> None:
        """Do nothing: there are no cameras and no ray-cast sensors."""


class NativeData:
    """Fields of MjData of all worlds as tensors that share mjbatch's memory, shape (worlds, ...).

    Attributes:
        nworld: number of worlds.
    """

    def __init__(self, batch: Batch) -> None:
        self._batch, self.nworld = batch, batch.num_sims
        self._derived: list[torch.Tensor] = []

    def __getattr__(self, name: str) -> torch.Tensor:
        if name.startswith("_"):
            raise AttributeError(name)
        try:
            # Fields of another type than mjtNum have their own.
            bound = self._bind(name)
        except (ValueError, KeyError, TypeError, AttributeError) as error:
            raise AttributeError(f"MjData has no field '{name}' per world: {error}") from None
        if name in _MATRICES:
            bound = bound.reshape(*bound.shape[:2], 3, 3)
        tensor = torch.from_numpy(bound)
        object.__setattr__(self, name, tensor)
        if name not in _INPUTS:
            # It is filled now, from the present state; those that lag behind it still do.
            kept = [other.clone() for other in self._derived]
            self._batch.forward()
            for other, value in zip(self._derived, kept, strict=True):
                other.copy_(value)
            self._derived.append(tensor)
        return tensor

    def _bind(self, name: str) -> np.ndarray:
        try:
            return self._batch.bind(name, np.float32)
        except (ValueError, TypeError):
            return self._batch.bind(name)


class NativeModel:
    """Fields of MjModel as tensors: with a world axis where they are numbers in floating point.

    Those that are each world's own share mjbatch's memory. The others are views of one value, in
    single precision, and must not be written.
    """

    def __init__(self, model: Any, batch: Batch) -> None:
        self._model, self._batch = model, batch
        self._own: set[str] = set()
        self._cache: dict[str, Any] = {}

    def __getattr__(self, name: str) -> Any:
        if name.startswith("_"):
            raise AttributeError(name)
        if name not in self._cache:
            self._cache[name] = self._tensor(name)
        return self._cache[name]

    def own(self, names: Sequence[str]) -> None:
        """Show fields as each world's own from now on."""
        self._own.update(names)
        self.clear_cache()

    def clear_cache(self) -> None:
        """Drop views of fields."""
        self._cache = {}

    def _tensor(self, name: str) -> Any:
        found = self._found(name)
        # On Warp a box is its centre and its half sides, and mjlab writes it so.
        return found.unflatten(-1, (2, 3)) if name == "geom_aabb" else found

    def _found(self, name: str) -> Any:
        value = getattr(self._model, name)
        if name in self._own:
            return torch.from_numpy(self._batch.expand(name))
        if not isinstance(value, np.ndarray):
            return value
        if not np.issubdtype(value.dtype, np.floating):
            return torch.from_numpy(value.copy())
        tensor = torch.from_numpy(value.astype(np.float32))
        return tensor.expand(self._batch.num_sims, *tensor.shape)
