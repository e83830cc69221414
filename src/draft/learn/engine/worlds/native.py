"""Native MuJoCo with the interface of mjlab's `Simulation`, stepped by mjbatch on CPU threads.

`NativeSimulation` has the attributes and methods of `mjlab.sim.Simulation` that mjlab's
environments, managers, entities, sensors and viewers use. Arrays are shared with mjbatch, so that
values that a term writes to `data` or to an expanded field of `model` are used by the next step.
The module does not depend on Draft.

Differences from MuJoCo Warp:

- States have double precision. `data` shows them in single precision, and a single-precision write
  replaces only the elements that it changes.
- Expanded model fields have double precision, and integer fields have no world axis.
- A world is not reset when its state is no longer finite (`mjDSBL_AUTORESET`), as on Warp.
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
# Derived fields that locomotion tasks read. Others are bound on first access: they then have the
# values of the present state, and lag by a time step from the next step on.
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
# Fields of the model that `mj_setConst` computes.
_CONSTANTS = (
    *("body_subtreemass", "body_invweight0", "dof_invweight0", "dof_M0"),
    *("tendon_length0", "tendon_invweight0", "actuator_acc0", "actuator_length0"),
)
_AUTORESET = int(mujoco.mjtDisableBit.mjDSBL_AUTORESET)


class NativeSimulation(Simulation):
    """N simulations of one model on native MuJoCo, as mjlab's `Simulation`.

    It is a subclass, as mjlab's viewers require one, and inherits only properties that read
    attributes.

    Attributes:
        cfg: mjlab's configuration; settings of MuJoCo Warp are ignored.
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
            model: compiled model; alternatively pass `spec`.
            device: must be "cpu".
            spec: model to compile.
            variant_info: must be empty: only MuJoCo Warp has meshes per world.
            threads: number of threads that step the worlds.

        Raises:
            ValueError: neither model nor spec is given, or a device or variants are unsupported.
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
        # Attributes that the properties of mjlab's class read.
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
        """Integration states (`mjSTATE_INTEGRATION`), shape (worlds, states).

        A row that is written is the world's state at its next call; `data` shows it afterwards.
        """
        return self._state

    def expand_model_fields(self, fields: tuple[str, ...]) -> None:
        """Give every world its own values of model fields, initially those of the model.

        Raises:
            ValueError: there is no such field.
        """
        unknown = [name for name in fields if not hasattr(self._mj_model, name)]
        if unknown:
            raise ValueError(f"Fields not found in model: {unknown}")
        self._expanded_fields.update(fields)
        self._model_bridge.own(fields)

    def recompute_constants(self, level: RecomputeLevel) -> None:
        """Recompute the constants that depend on expanded fields, by `mj_setConst` in each world.

        Args:
            level: ignored: all constants are recomputed.
        """
        del level
        self._batch.set_const()
        self._model_bridge.own(_CONSTANTS)

    def step(self) -> None:
        """Advance all worlds by one time step; derived fields lag by one step, as in `mj_step`."""
        with self.nan_guard.watch(self.data):
            self._batch.step()

    def forward(self) -> None:
        """Compute the derived fields of all worlds."""
        self._batch.forward()

    def reset(self, env_ids: torch.Tensor | None = None) -> None:
        """Reset worlds to the reference state of the model; all if `env_ids` is None."""
        if env_ids is None:
            self._batch.reset()
            return
        chosen = np.zeros(self.num_envs, dtype=bool)
        chosen[env_ids.numpy()] = True
        self._batch.reset(chosen)

    def create_graph(self) -> None:
        """Do nothing: there is no graph to capture."""

    def set_sensor_context(self, ctx: Any) -> None:
        """Raise an error: cameras and ray-cast sensors need MuJoCo Warp.

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
            bound = self._bind(name)
        except (ValueError, KeyError, TypeError, AttributeError) as error:
            raise AttributeError(f"MjData has no field '{name}' per world: {error}") from None
        if name in _MATRICES:
            bound = bound.reshape(*bound.shape[:2], 3, 3)
        tensor = torch.from_numpy(bound)
        object.__setattr__(self, name, tensor)
        if name not in _INPUTS:
            # Fill it from the present state; fields that lag behind the state keep their values.
            kept = [other.clone() for other in self._derived]
            self._batch.forward()
            for other, value in zip(self._derived, kept, strict=True):
                other.copy_(value)
            self._derived.append(tensor)
        return tensor

    def _bind(self, name: str) -> np.ndarray:
        # Single precision where mjtNum is stored; other fields keep their type.
        try:
            return self._batch.bind(name, np.float32)
        except (ValueError, TypeError):
            return self._batch.bind(name)


class NativeModel:
    """Fields of MjModel as tensors, with a world axis if they are floating-point arrays.

    Expanded fields share mjbatch's memory. The others are views of one value in single precision,
    and must not be written.
    """

    def __init__(self, model: mujoco.MjModel, batch: Batch) -> None:
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
        """Share the worlds' own values of fields from now on."""
        self._own.update(names)
        self.clear_cache()

    def clear_cache(self) -> None:
        """Discard views of fields."""
        self._cache = {}

    def _tensor(self, name: str) -> Any:
        value = self._value(name)
        # Warp stores a box as centre and half sides, shape (2, 3), and mjlab writes it so.
        return value.unflatten(-1, (2, 3)) if name == "geom_aabb" else value

    def _value(self, name: str) -> Any:
        value = getattr(self._model, name)
        if name in self._own:
            return torch.from_numpy(self._batch.expand(name))
        if not isinstance(value, np.ndarray):
            return value
        if not np.issubdtype(value.dtype, np.floating):
            return torch.from_numpy(value.copy())
        tensor = torch.from_numpy(value.astype(np.float32))
        return tensor.expand(self._batch.num_sims, *tensor.shape)
