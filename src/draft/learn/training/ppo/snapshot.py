"""State of an environment and of all random numbers, to resume from exactly.

Derived quantities are omitted: the next step computes them from positions and velocities. The keys
of a state are names of attributes of managers, terms and sensors; renaming such an attribute makes
saved states unreadable.
"""

from __future__ import annotations

import random
from collections.abc import Iterator
from typing import Any

import numpy as np
import torch
from mjlab.envs import ManagerBasedRlEnv
from mjlab.managers.event_manager import RecomputeLevel

from draft.errors import DraftError

_STATE = (
    "qpos",
    "qvel",
    "ctrl",
    "time",
    "qacc_warmstart",
    "qfrc_applied",
    "xfrc_applied",
)
_WHOLE = "sim.state"
_SERVO = ".servo_torque"
_MANAGERS = ("command", "action", "event", "reward", "termination", "observation", "metrics")
# Attributes that refer to the environment, to its configuration or to the simulation.
_REFERENCES = {"env", "cfg", "sim", "model", "data", "robot", "scene", "func_cfg", "indexing"}


def capture(env: ManagerBasedRlEnv) -> dict[str, Any]:
    """Return the state of an environment and of all random numbers, as tensors and plain values."""
    _wait(env)
    robot = env.scene["robot"]
    # Worlds that have other designs than those of the plan.
    redrawn = getattr(robot, "redrawn", False)
    designs = {name: x.clone() for name, x in robot.numbers().items()} if redrawn else {}
    defaults = {name: x.clone() for name, x in _defaults(env).items()} if redrawn else {}
    return {
        "designs": designs,
        "defaults": defaults,
        "tensors": {path: tensor.clone() for path, tensor in _tensors(env)},
        "newest": {name: one._pointer for name, one in _histories(env)},
        "steps": env.common_step_counter,
        "physics_steps": env._sim_step_counter,
        "random": _random_state(torch.device(env.device)),
    }


def restore(env: ManagerBasedRlEnv, state: dict[str, Any]) -> None:
    """Restore a captured state in an environment of the same configuration.

    Raises:
        DraftError: the state is that of another environment.
    """
    tensors = dict(_tensors(env))
    saved = dict(state["tensors"])
    for path in tensors.keys() - saved.keys():
        if path.endswith(_SERVO):  # Earlier states had gains for the motors alone.
            saved[path] = saved[path.removesuffix(_SERVO) + ".peak_torque"]
    whole = _WHOLE in tensors and _WHOLE in saved
    for one in (tensors, saved):
        # The whole state must not be overwritten by its rounded parts. A state that the other
        # engine wrote has only the parts.
        for name in [f"sim.{name}" for name in _STATE] if whole else [_WHOLE]:
            one.pop(name, None)
    if {k: v.shape for k, v in tensors.items()} != {k: v.shape for k, v in saved.items()}:
        cause = "the saved state is of another environment, or of another version of Draft or mjlab"
        raise DraftError(cause, "start a new run from its policy: `origin=RUN`")
    _wait(env)
    if state.get("designs"):
        env.scene["robot"].restore(state["designs"])
        for name, values in _defaults(env).items():
            values.copy_(state["defaults"][name])
    for path, tensor in tensors.items():
        tensor.copy_(saved[path])
    if state.get("designs"):
        # The mean inertia, by which the solver stops, is no field of a world: it is computed with
        # the constants.
        env.sim.recompute_constants(RecomputeLevel.set_const)
        for path, tensor in tensors.items():
            tensor.copy_(saved[path])
    _wait(env)
    for name, one in _histories(env):
        one._pointer = state["newest"][name]
    env.common_step_counter = state["steps"]
    env._sim_step_counter = state["physics_steps"]
    warm = tensors[_WHOLE] if whole else _sim_tensor(env, "qacc_warmstart")
    kept = warm.clone()
    env.sim.forward()
    warm.copy_(kept)
    _wait(env)
    _set_random_state(state["random"], torch.device(env.device))


def _histories(env: ManagerBasedRlEnv) -> Iterator[tuple[str, Any]]:
    """Buffers of past observations by name; the place of the newest is no tensor."""
    for group, buffers in env.observation_manager._group_obs_term_history_buffer.items():
        for name, buffer in buffers.items():
            yield f"{group}.{name}", buffer


def _defaults(env: ManagerBasedRlEnv) -> dict[str, torch.Tensor]:
    """Fields of each world's own design, from which randomisation starts."""
    sim = env.sim
    return {name: sim.default_model_fields[name] for name in sorted(sim.per_world_default_fields)}


def _wait(env: ManagerBasedRlEnv) -> None:
    """Wait for the GPU: Warp and PyTorch use different streams."""
    if torch.device(env.device).type == "cuda":
        torch.cuda.synchronize(env.device)


def _tensors(env: ManagerBasedRlEnv) -> Iterator[tuple[str, torch.Tensor]]:
    """All tensors of the state by path, each once."""
    # Native MuJoCo has the whole state in double precision; its parts are for other engines.
    whole = getattr(env.sim, "state", None)
    if whole is not None:
        yield _WHOLE, whole
    for name in _STATE:
        tensor = _sim_tensor(env, name)
        if tensor.numel():
            yield f"sim.{name}", tensor
    for name in sorted(env.sim.expanded_fields):
        yield f"model.{name}", _wrapped(getattr(env.sim.model, name))
    seen: set[int] = set()
    yield "env.episode_length", env.episode_length_buf
    for name in _MANAGERS:
        yield from _inside(getattr(env, f"{name}_manager"), name, seen)
    for name, sensor in sorted(env.scene.sensors.items()):
        yield from _inside(getattr(sensor, "_air_time_state", None), f"sensor.{name}", seen)
    robot = env.scene["robot"]
    for name in sorted(vars(robot.data)):
        value = getattr(robot.data, name)
        if type(value) is torch.Tensor and value.numel():
            yield f"robot.{name}", value
    terrain = env.scene.terrain
    for name in ("terrain_levels", "terrain_types", "env_origins"):
        value = getattr(terrain, name, None)
        if isinstance(value, torch.Tensor):
            yield f"terrain.{name}", value


def _inside(value: Any, path: str, seen: set[int]) -> Iterator[tuple[str, torch.Tensor]]:
    """Tensors of a manager and of its terms, by path."""
    if id(value) in seen:
        return
    if type(value) is torch.Tensor:
        seen.add(id(value))
        if value.numel():
            yield path, value
    elif isinstance(value, dict):
        for key, item in value.items():
            yield from _inside(item, f"{path}.{key}", seen)
    elif isinstance(value, (list, tuple)):
        for i, item in enumerate(value):
            yield from _inside(item, f"{path}.{i}", seen)
    elif type(value).__module__.split(".")[0] in ("mjlab", "draft") and hasattr(value, "__dict__"):
        seen.add(id(value))
        for name in sorted(vars(value)):
            if name.lstrip("_") not in _REFERENCES:
                yield from _inside(vars(value)[name], f"{path}.{name}", seen)


def _sim_tensor(env: ManagerBasedRlEnv, name: str) -> torch.Tensor:
    return _wrapped(getattr(env.sim.data, name))


def _wrapped(value: Any) -> torch.Tensor:
    """Tensor that shares the memory of mjlab's view of a Warp array."""
    return value[:]


def _random_state(device: torch.device) -> dict[str, Any]:
    kind, keys, *rest = np.random.get_state()
    state = {
        "torch": torch.get_rng_state(),
        "numpy": [kind, torch.from_numpy(np.asarray(keys, dtype=np.int64)), *rest],
        "python": list(random.getstate()[1]),
    }
    if device.type == "cuda":
        state["cuda"] = torch.cuda.get_rng_state(device)
    return state


def _set_random_state(state: dict[str, Any], device: torch.device) -> None:
    torch.set_rng_state(state["torch"].cpu())
    kind, keys, *rest = state["numpy"]
    np.random.set_state((kind, keys.cpu().numpy().astype(np.uint32), *rest))
    random.setstate((3, tuple(state["python"]), None))
    if device.type == "cuda" and "cuda" in state:
        torch.cuda.set_rng_state(state["cuda"].cpu(), device)
