"""A policy as ONNX, with all that a controller on a robot needs to know in its metadata.

Keys and values are as mjlab writes them, so that what reads its policies reads these: numbers of
a list are separated by commas, numbers of an entry by semicolons. Numbers have all their digits,
where mjlab writes three decimals, and gains are the robot's, where mjlab takes what stands in the
compiled actuator, which for a DC motor is no gain. docs/learning.md tells every key.
"""

from __future__ import annotations

import contextlib
import io
import tempfile
import warnings
from collections.abc import Sequence
from importlib.metadata import version
from pathlib import Path
from typing import Any

import onnx
from mjlab.envs import ManagerBasedRlEnv
from mjlab.rl.exporter_utils import attach_metadata_to_onnx, get_base_metadata

from draft.files import write
from draft.learn.lab.mdp.access import COMMAND
from draft.learn.lab.play import Player
from draft.learn.progress import fastest
from draft.learn.run import PROGRESS, Run


def export(player: Player, run: Run, path: Path) -> None:
    """Write the policy: observations as they are in, mean actions out.

    Args:
        player: the policy.
        run: whose it is.
        path: of the file.

    Raises:
        DraftError: it cannot be written; what was there is as it was.
    """
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "policy.onnx"
        with warnings.catch_warnings(), contextlib.redirect_stdout(io.StringIO()):
            warnings.simplefilter("ignore")  # PyTorch's, of its older exporter that mjlab uses
            player.runner.export_policy_to_onnx(folder, file.name)
        attach_metadata_to_onnx(str(file), dict(metadata(player, run)))
        onnx.checker.check_model(str(file))
        write(path, file.read_bytes())


def metadata(player: Player, run: Run) -> dict[str, str]:
    """What a controller needs to know; see docs/learning.md."""
    env, member, plan = player.env.unwrapped, player.member, run.plan
    numbers = plan.config.observations
    stiffness, damping = _gains(env)
    found: dict[str, Any] = get_base_metadata(env, run.folder.resolve().name)
    action = env.action_manager.get_term("joint_pos")
    largest = env.command_manager.get_term(COMMAND).largest[0].tolist()  # type: ignore[attr-defined]
    if plan.stage == "velocity" and plan.config.velocity.growth:
        largest[0] = fastest(run.folder / PROGRESS, player.iteration) or largest[0]
    found |= {
        "joint_stiffness": stiffness,
        "joint_damping": damping,
        "joint_peak_torque": list(member.peak_torque),
        "joint_no_load_speed": list(member.no_load_speed),
        "joint_range": [list(ends) for ends in member.ranges],
        "action_names": action.target_names,  # type: ignore[attr-defined]
        "action_scale": [action.scale] * action.action_dim,  # type: ignore[attr-defined]
        "control_rate": 1.0 / env.step_dt,
        "physics_timestep": env.physics_dt,
        "observation_terms_dim": _dims(env),
        "command_ranges": [[-most, most] for most in largest],
        "height_scan_size": list(numbers.scan_size),
        "height_scan_pitch": numbers.scan_pitch,
        "height_scan_range": numbers.scan_range,
        "design": member.name,
        "designs": [one.name for one in plan.members],
        "leg_length": member.leg_length,
        "stage": plan.stage,
        "seed": plan.seed,
        "iteration": player.iteration,
        "draft_version": version("draft"),
    }
    return {key: _text(value) for key, value in found.items()}


def _gains(env: ManagerBasedRlEnv) -> tuple[list[float], list[float]]:
    """Gains kp [N m/rad] and kd [N m s/rad] of each joint, in the robot's order."""
    robot = env.scene["robot"]
    stiffness, damping = [0.0] * robot.num_joints, [0.0] * robot.num_joints
    for actuator in robot.actuators:
        for column, joint in enumerate(actuator.target_ids.tolist()):
            stiffness[joint] = float(actuator.stiffness[0, column])
            damping[joint] = float(actuator.damping[0, column])
    return stiffness, damping


def _dims(env: ManagerBasedRlEnv) -> list[int]:
    """Numbers of each observation term of the actor."""
    dims = env.observation_manager.group_obs_term_dim["actor"]
    return [one[0] for one in dims]


def _text(value: Any) -> str:
    """A value as mjlab's metadata has it, with all its digits."""
    if isinstance(value, Sequence) and not isinstance(value, str):
        return ",".join(
            ";".join(map(_one, x))
            if isinstance(x, Sequence) and not isinstance(x, str)
            else _one(x)
            for x in value
        )
    return _one(value)


def _one(value: Any) -> str:
    # Numbers of single precision come back as such: 7 digits say no more than they do.
    return f"{value:.9g}" if isinstance(value, float) else str(value)
