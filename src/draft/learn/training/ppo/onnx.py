"""Export of a policy as ONNX, with metadata for a controller on a robot.

Keys and values have mjlab's format, so that readers of its policies read these: entries of a list
are separated by commas, numbers of an entry by semicolons. Numbers have all their digits, where
mjlab writes three decimals. Gains are those of the robot, where mjlab reads the compiled actuator,
which for a DC motor has none. docs/learning.md lists all keys.
"""

from __future__ import annotations

import contextlib
import io
import tempfile
import warnings
from pathlib import Path

import numpy as np
import onnx
import torch
from mjlab.envs import ManagerBasedRlEnv
from mjlab.envs.mdp.actions import JointPositionAction
from mjlab.rl.exporter_utils import attach_metadata_to_onnx, get_base_metadata

from draft.extras import own_version
from draft.files import write
from draft.learn.bodies.features import family_features, features
from draft.learn.policy.matching import structure_of
from draft.learn.policy.onnx_write import text
from draft.learn.task.mdp.commands import command_term
from draft.learn.task.stages import is_like
from draft.learn.task.world.access import robot_of
from draft.learn.training.ppo.loaded import Loaded
from draft.learn.training.ppo.ppo import action_std
from draft.learn.training.reached import commanded
from draft.learn.training.run import Run

_NAMED = 64  # Most designs of a family that are named.


def export(player: Loaded, run: Run, path: Path) -> None:
    """Write the network from observations, not normalised, to mean actions.

    Args:
        player: the policy.
        run: its run.
        path: file to write.

    Raises:
        DraftError: the file cannot be written; an existing one is left unchanged.
    """
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "policy.onnx"
        with warnings.catch_warnings(), contextlib.redirect_stdout(io.StringIO()):
            warnings.simplefilter("ignore")  # PyTorch's, about its older exporter that mjlab uses.
            player.runner.export_policy_to_onnx(folder, file.name)
        attach_metadata_to_onnx(str(file), dict(metadata(player, run)))
        onnx.checker.check_model(str(file))
        write(path, file.read_bytes())


def metadata(player: Loaded, run: Run) -> dict[str, str]:
    """Metadata for a controller, as text by key; see docs/learning.md."""
    env, member, plan = player.env.unwrapped, player.member, run.plan
    numbers = plan.config.observations
    stiffness, damping = _gains(env)
    values: dict[str, object] = {**get_base_metadata(env, run.folder.resolve().name)}
    action = env.action_manager.get_term("joint_pos")
    if not isinstance(action, JointPositionAction):
        raise TypeError(f"the action is a {type(action).__name__}, not a joint position")
    largest = command_term(env).largest[0].tolist()
    if is_like(plan.stage, "velocity") and plan.config.velocity.growth:
        largest[0] = commanded(run, player.iteration) or largest[0]
    values |= {
        "joint_stiffness": stiffness,
        "joint_damping": damping,
        "joint_peak_torque": list(member.peak_torque),
        "joint_no_load_speed": list(member.no_load_speed),
        "joint_range": [list(ends) for ends in member.ranges],
        "action_names": action.target_names,
        "action_scale": _scales(action),
        "action_std": action_std(player.runner.alg.get_policy()).tolist(),
        "control_rate": 1.0 / env.step_dt,
        "physics_timestep": env.physics_dt,
        "contact_time": list(plan.config.episodes.contact_time),
        "delay": list(plan.config.episodes.delay),
        "velocity_noise": plan.config.observations.linear_velocity_noise,
        "observation_terms_dim": _dims(env),
        "command_ranges": [[-most, most] for most in largest],
        "height_scan_size": list(numbers.scan_size),
        "height_scan_pitch": numbers.scan_pitch,
        "height_scan_range": numbers.scan_range,
        "design": member.name,
        "designs": [one.name for one in plan.members[:_NAMED]],
        "leg_length": member.leg_length,
        "stage": plan.stage,
        "seed": plan.seed,
        "iteration": player.iteration,
        "draft_version": own_version(),
    }
    if member.corner_speed:
        values["joint_stall_torque"] = list(member.stall_torque)
    if plan.config.actuation.support:
        values["joint_servo_torque"] = robot_of(env).servo_torque[0].tolist()
        values["support"] = plan.config.actuation.support
    if member.rolls:
        values["joint_rolls"] = list(map(int, member.rolls))
    values |= structure_of(member).texts()
    if member.is_quadruped:
        bodies = np.array(family_features(plan.members))
        values |= {
            "design_features": list(features(member)),
            "design_features_low": bodies.min(axis=0).tolist(),
            "design_features_high": bodies.max(axis=0).tolist(),
        }
    return {key: text(value) for key, value in values.items()}


def _gains(env: ManagerBasedRlEnv) -> tuple[list[float], list[float]]:
    """Gains kp [N m/rad] and kd [N m s/rad] of each joint, in the robot's order."""
    robot = robot_of(env)
    gains = {name: [0.0] * robot.num_joints for name in ("stiffness", "damping")}
    for actuator in robot.actuators:
        for column, joint in enumerate(actuator.target_ids.tolist()):
            for name, values in gains.items():
                values[joint] = float(getattr(actuator, name)[0, column])
    return gains["stiffness"], gains["damping"]


def _scales(action: JointPositionAction) -> list[float]:
    """Angle [rad], or speed of a wheel [rad/s], per unit of action, of each joint."""
    scale = action.scale
    if isinstance(scale, torch.Tensor):  # With wheels it is of each joint in each world.
        return scale[0].tolist()
    return [scale] * action.action_dim


def _dims(env: ManagerBasedRlEnv) -> list[int]:
    """Length of each observation term of the actor."""
    dims = env.observation_manager.group_obs_term_dim["actor"]
    return [one[0] for one in dims]
