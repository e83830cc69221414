"""Export of a policy of all legs as ONNX; `draft.learn.policy.reduced` reads it."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import onnx
from onnx import helper, numpy_helper

from draft.errors import DraftError
from draft.extras import own_version
from draft.files import write
from draft.learn.bodies.features import GRAVITY
from draft.learn.bodies.legged import by_topology, kind_of
from draft.learn.bodies.slots import ranges, slot_features
from draft.learn.policy.reduced import LAYOUT
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
    weights = {
        "mean": arrays["obs_normalizer._mean"][0],
        "divisor": arrays["obs_normalizer._std"][0] + _EPSILON,
    }
    nodes = [
        helper.make_node("Sub", ["obs", "mean"], ["centred"]),
        helper.make_node("Div", ["centred", "divisor"], ["x0"]),
    ]
    layers = sorted(int(name.split(".")[1]) for name in arrays if name.endswith(".weight"))
    for k, layer in enumerate(layers):
        last = k + 1 == len(layers)
        out = "actions" if last else f"y{k}"
        for kind in ("weight", "bias"):
            weights[f"{kind}{k}"] = arrays[f"mlp.{layer}.{kind}"]
        names = [f"x{k}", f"weight{k}", f"bias{k}"]
        nodes.append(helper.make_node("Gemm", names, [out], alpha=1.0, beta=1.0, transB=1))
        if not last:
            nodes.append(helper.make_node("Elu", [out], [f"x{k + 1}"], alpha=1.0))
    sizes = {"obs": len(weights["mean"]), "actions": len(weights[f"bias{len(layers) - 1}"])}
    seen, actions = (
        [helper.make_tensor_value_info(name, onnx.TensorProto.FLOAT, [1, count])]
        for name, count in sizes.items()
    )
    tensors = [numpy_helper.from_array(values, name) for name, values in weights.items()]
    model = helper.make_model(
        helper.make_graph(nodes, "legs", seen, actions, tensors),
        opset_imports=[helper.make_opsetid("", 18)],
    )
    helper.set_model_props(model, _metadata(run, number))
    onnx.checker.check_model(model)
    write(path, model.SerializeToString())


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
        "action_scale": f"{config.actuation.action_scale:.9g}",
        "stiffness": f"{config.actuation.stiffness:.9g}",
        "damping": f"{config.actuation.damping:.9g}",
        **{f"features_of_{legs}": _row(values.ravel()) for legs, values in ends.items()},
        "forward": _forward(run, iteration),
        "draft_version": own_version(),
    }


def _forward(run: Run, iteration: int) -> str:
    """Largest |vx| that was commanded, per sqrt(g L), by number of legs."""
    found: dict[int, float] = {}
    rows = [row for row in read_progress(run.folder / PROGRESS) if row["iteration"] <= iteration]
    for members in by_topology(run.plan.members):
        speeds = (row.get(f"{kind_of(members)}/{FASTEST}", 0.0) for row in rows)
        size = np.mean([np.sqrt(GRAVITY * member.leg_length) for member in members])
        legs = len(members[0].feet)
        found[legs] = max(found.get(legs, 0.0), max(speeds, default=0.0) / float(size))
    return ",".join(f"{legs};{speed:.4g}" for legs, speed in found.items())


def _row(values: object) -> str:
    return ",".join(f"{x:.6g}" for x in np.asarray(values, float))
