"""Export of a policy of all legs as ONNX; `draft.learn.policy.reduced` reads it."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from draft.errors import DraftError
from draft.extras import own_version
from draft.files import write
from draft.learn.bodies.features import GRAVITY
from draft.learn.bodies.legged import REFERENCE_LEG, by_topology, kind_of
from draft.learn.bodies.slots import ranges, slot_features
from draft.learn.policy.onnx_write import chain
from draft.learn.policy.reduced import LAYOUT, LegsPolicy, open_legs_policy
from draft.learn.task.stages import largest_of_any
from draft.learn.training.ppo.checkpoint import read_checkpoint
from draft.learn.training.progress import FASTEST, PROGRESS
from draft.learn.training.progress import read as read_progress
from draft.learn.training.run import Run

_EPSILON = 1e-2  # That rsl-rl adds to standard deviations of observations.


def export_legs(run: Run, path: Path, iteration: int | None = None) -> None:
    """Write the network from padded observations to mean actions of the slots.

    Args:
        run: a run of several topologies.
        path: file to write.
        iteration: iterations of the checkpoint; None for the last.

    Raises:
        DraftError: the run is of one topology, it has no such checkpoint, or the file cannot be
            written.
    """
    if not run.plan.mixed:
        raise DraftError(f"{run.folder} is a run of one topology", "export it with 'draft play'")
    number, file = run.checkpoint(iteration)
    state = read_checkpoint(file, "cpu")["actor_state_dict"]
    arrays = {name: values.numpy().astype(np.float32) for name, values in state.items()}
    layers = sorted(int(name.split(".")[1]) for name in arrays if name.endswith(".weight"))
    model = chain(
        arrays["obs_normalizer._mean"][0],
        arrays["obs_normalizer._std"][0] + _EPSILON,
        [(arrays[f"mlp.{layer}.weight"], arrays[f"mlp.{layer}.bias"]) for layer in layers],
        _metadata(run, number) | {"action_std": _row(arrays["distribution.std_param"])},
    )
    write(path, model)


def legs_of(run: Run, iteration: int | None = None) -> LegsPolicy:
    """Return the policy of a run of several topologies.

    Args:
        run: the run.
        iteration: iterations of the checkpoint; None for the last.

    Raises:
        DraftError: as `export_legs`.
    """
    with TemporaryDirectory() as folder:
        file = Path(folder) / "legs.onnx"
        export_legs(run, file, iteration)
        return replace(open_legs_policy(file), file=run.checkpoint(iteration)[1])


def _metadata(run: Run, iteration: int) -> dict[str, str]:
    plan = run.plan
    config = plan.config
    known: dict[int, list[tuple[float, ...]]] = {}
    for members in by_topology(plan.members):
        known.setdefault(len(members[0].feet), []).extend(slot_features(members))
    ends = {legs: ranges(np.array(values)) for legs, values in known.items()}
    step = config.physics.timestep
    return {
        "layout": LAYOUT,
        "stage": plan.stage,
        "seed": str(plan.seed),
        "iteration": str(iteration),
        "control_rate": f"{1 / (step * config.physics.decimation):.9g}",
        "physics_timestep": f"{step:.9g}",
        "contact_time": _row(config.episodes.contact_time),
        "delay": _row(config.episodes.delay),
        "velocity_noise": f"{config.observations.linear_velocity_noise:.9g}",
        "action_scale": f"{config.actuation.action_scale:.9g}",
        "stiffness": f"{config.actuation.stiffness:.9g}",
        "damping": f"{config.actuation.damping:.9g}",
        "support": f"{config.actuation.support:.9g}",
        **{f"features_of_{legs}": _row(values.ravel()) for legs, values in ends.items()},
        "commands": _commands(run, iteration),
        "draft_version": own_version(),
    }


def _commands(run: Run, iteration: int) -> str:
    """Largest commands, per sqrt(g L) and sqrt(g / L), by number of legs.

    Those of a policy that the run started from count too: it begins with slow ones again.
    """
    origin = run.plan.origin
    file = origin.policy_file if origin is not None else None
    known = open_legs_policy(file).commands if file is not None and file.is_file() else {}
    found: dict[int, list[float]] = {}
    rows = [row for row in read_progress(run.folder / PROGRESS) if row["iteration"] <= iteration]
    for members in by_topology(run.plan.members):
        speeds = [row.get(f"{kind_of(members)}/{FASTEST}", 0.0) for row in rows]
        sizes = np.array([member.leg_length for member in members])
        legs, rate = len(members[0].feet), math.sqrt(GRAVITY / REFERENCE_LEG)
        _, sideways, turn = largest_of_any(run.plan.config.velocity, legs)
        reached = max(speeds, default=0.0) / float(np.sqrt(GRAVITY * sizes).mean())
        one = [reached, sideways.value / (rate * REFERENCE_LEG), turn.value / rate]
        found[legs] = np.maximum(found.get(legs, known.get(legs, [0.0] * 3)), one).tolist()
    rows = ([str(legs), *(f"{x:.4g}" for x in one)] for legs, one in found.items())
    return ",".join(map(";".join, rows))


def _row(values: object) -> str:
    return ",".join(f"{x:.6g}" for x in np.asarray(values, float))
