"""Write the policy of one robot, or its network, as an ONNX file (needs the library onnx)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import ArrayLike

from draft.extras import need, own_version
from draft.learn.bodies.legged import LeggedRobot
from draft.learn.policy.policy import Policy

_OPSET = 18


def chain(
    mean: ArrayLike,
    divisor: ArrayLike,
    layers: Sequence[tuple[ArrayLike, ArrayLike]],
    metadata: Mapping[str, str],
) -> bytes:
    """Return the file of a network that normalises its input, and then has layers with ELU between.

    Args:
        mean: mean of the input, shape (size,).
        divisor: divisor of the input, shape (size,).
        layers: weights, shape (outputs, inputs), and bias, shape (outputs,), of each layer.
        metadata: metadata as text by key.

    Raises:
        DraftError: the library onnx is missing.
    """
    onnx = need("onnx", "learn")
    node = onnx.helper.make_node
    weights: dict[str, ArrayLike] = {"mean": mean, "divisor": divisor}
    nodes = [
        node("Sub", ["obs", "mean"], ["centred"]),
        node("Div", ["centred", "divisor"], ["x0"]),
    ]
    for k, (weight, bias) in enumerate(layers):
        last = k + 1 == len(layers)
        weights |= {f"weight{k}": weight, f"bias{k}": bias}
        names, out = [f"x{k}", f"weight{k}", f"bias{k}"], "actions" if last else f"y{k}"
        nodes.append(node("Gemm", names, [out], alpha=1.0, beta=1.0, transB=1))
        if not last:
            nodes.append(node("Elu", [out], [f"x{k + 1}"], alpha=1.0))
    single = {name: np.asarray(values, np.float32) for name, values in weights.items()}
    seen, actions = (
        [onnx.helper.make_tensor_value_info(name, onnx.TensorProto.FLOAT, [1, count])]
        for name, count in (
            ("obs", len(single["mean"])),
            ("actions", len(single[f"bias{len(layers) - 1}"])),
        )
    )
    tensors = [onnx.numpy_helper.from_array(values, name) for name, values in single.items()]
    graph = onnx.helper.make_graph(nodes, "policy", seen, actions, tensors)
    opset = onnx.helper.make_opsetid("", _OPSET)
    model = onnx.helper.make_model(graph, opset_imports=[opset])
    onnx.helper.set_model_props(model, dict(metadata))
    onnx.checker.check_model(model)
    return model.SerializeToString()


def of_policy(policy: Policy, member: LeggedRobot, commands: Sequence[float]) -> bytes:
    """Return the file of a policy, as the export of a run is written.

    Args:
        policy: the policy, which observes neither its design nor the ground.
        member: its robot.
        commands: largest |vx|, |vy| [m/s] and |wz| [rad/s] of the training.

    Raises:
        DraftError: the library onnx is missing.
    """
    names, lengths = zip(*policy.terms, strict=True)
    metadata: dict[str, object] = {
        "joint_names": policy.joints,
        "action_names": policy.joints,
        "default_joint_pos": policy.home,
        "action_scale": policy.action_scale,
        "joint_stiffness": policy.stiffness,
        "joint_damping": policy.damping,
        "joint_peak_torque": policy.peak_torque,
        "joint_stall_torque": policy.stall_torque,
        "joint_no_load_speed": policy.no_load_speed,
        "joint_range": member.ranges,
        "control_rate": 1.0 / policy.control_period,
        "physics_timestep": policy.timestep,
        "contact_time": policy.contact_time,
        "delay": policy.delay,
        "velocity_noise": policy.velocity_noise,
        "observation_names": names,
        "observation_terms_dim": lengths,
        "observation_terms_scale": [1.0] * len(names),
        "observation_terms_history_length": [0 if one == 1 else one for one in policy.history],
        "command_names": "twist",
        "command_ranges": [(-most, most) for most in commands],
        "height_scan_size": (0.0, 0.0),
        "height_scan_pitch": 1.0,
        "height_scan_range": policy.scan_range,
        "design": policy.design,
        "leg_length": policy.leg_length,
        "stage": policy.stage,
        "seed": policy.seed,
        "iteration": policy.iterations,
        "draft_version": own_version(),
    }
    if policy.structure is not None:
        metadata |= policy.structure.texts()
    if policy.rolls.any():
        metadata["joint_rolls"] = policy.rolls.astype(int)
    if policy.support:
        metadata |= {"joint_servo_torque": policy.servo_torque, "support": policy.support}
    if policy.trim:
        metadata["trim"] = policy.trim.numbers()
    return chain(*policy.network.layers(), {key: text(value) for key, value in metadata.items()})


def text(value: object) -> str:
    """A value in the format of mjlab's metadata, with all its digits."""
    if isinstance(value, np.ndarray):
        value = value.tolist()
    if isinstance(value, Sequence) and not isinstance(value, str):
        return ",".join(
            ";".join(map(_one, x))
            if isinstance(x, Sequence) and not isinstance(x, str)
            else _one(x)
            for x in value
        )
    return _one(value)


def _one(value: object) -> str:
    # Nine digits restore every number of single precision.
    return f"{value:.9g}" if isinstance(value, float) else str(value)
