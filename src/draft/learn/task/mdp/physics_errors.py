"""Physics that differs between worlds: contacts of the feet, motors and friction of joints."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import torch
from mjlab.managers.event_manager import EventTermCfg, requires_model_fields

from draft.learn.task.groups import Episodes, Range
from draft.learn.task.world.access import robot_of

if TYPE_CHECKING:
    from mjlab.envs import ManagerBasedRlEnv

# Of random numbers: these errors change nothing else that a seed draws.
STREAM, DRY_STREAM = 0x30705, 0xD12


@requires_model_fields("geom_solref")
def contact_time(env: ManagerBasedRlEnv, env_ids: torch.Tensor | None, within: Range) -> None:
    """Draw the time constant of the contacts of all feet of each world [s]."""
    robot, solref = robot_of(env), _model(env).geom_solref
    feet = robot.indexing.geom_ids[robot.find_geoms(robot.cfg.members[0].foot_geoms)[0]]
    low, high = within
    drawn = low + (high - low) * torch.rand(env.num_envs, 1, device=env.device)
    solref[:, feet, 0] = drawn.expand(-1, len(feet)).to(solref.dtype)


class MotorErrors:
    """Factors on the torques of motors, and viscous friction of joints, of each world.

    Parameters of the term: `motor`, range of the factor on the gains and limits of a motor;
    `friction`, range of the friction torque at the no-load speed per peak torque.
    """

    model_fields = ("dof_damping",)  # mjlab gives each world its own.

    def __init__(self, cfg: EventTermCfg, env: ManagerBasedRlEnv) -> None:
        self._env, self._robot = env, robot_of(env)
        seed = env.cfg.seed
        rng = np.random.default_rng(None if seed is None else (STREAM, seed))
        shape = self._robot.peak_torque.shape

        def drawn(within: Range) -> torch.Tensor:
            return torch.tensor(rng.uniform(*within, shape), dtype=torch.float32, device=env.device)

        self._motor, self._friction = drawn(cfg.params["motor"]), drawn(cfg.params["friction"])

    def __call__(
        self, env: ManagerBasedRlEnv, env_ids: torch.Tensor | None, motor: Range, friction: Range
    ) -> None:
        """Give all worlds their errors; they stay."""
        self._robot.set_motors(self._motor)
        self.rescale()

    def rescale(self) -> None:
        """Set the friction of the joints from the motors of each world's design."""
        robot, env = self._robot, self._env
        at = robot.indexing.joint_v_adr
        added = self._friction * robot.peak_torque / robot.no_load_speed
        damping, usual = _model(env).dof_damping, env.sim.get_default_field("dof_damping")
        damping[:, at] = usual[..., at].to(damping.dtype) + added


class DryFriction:
    """Dry friction of joints of each world, beside that of its design.

    Parameter of the term: `within`, range of the friction torque per peak torque.
    """

    model_fields = ("dof_frictionloss",)  # mjlab gives each world its own.

    def __init__(self, cfg: EventTermCfg, env: ManagerBasedRlEnv) -> None:
        self._env, self._robot = env, robot_of(env)
        seed = env.cfg.seed
        rng = np.random.default_rng(None if seed is None else (DRY_STREAM, seed))
        low, high = cfg.params["within"]
        drawn = rng.uniform(low, high, self._robot.peak_torque.shape)
        self._share = torch.tensor(drawn, dtype=torch.float32, device=env.device)

    def __call__(self, env: ManagerBasedRlEnv, env_ids: torch.Tensor | None, within: Range) -> None:
        """Give all worlds their friction; it stays."""
        self.rescale()

    def rescale(self) -> None:
        """Set the friction of the joints from the motors of each world's design."""
        robot, env = self._robot, self._env
        at = robot.indexing.joint_v_adr
        friction = _model(env).dof_frictionloss
        usual = env.sim.get_default_field("dof_frictionloss")
        own = usual[..., at].to(friction.dtype)
        friction[:, at] = own + self._share * robot.peak_torque


def physics_errors(numbers: Episodes) -> dict[str, EventTermCfg]:
    """Configurations of the events by name, without those that change nothing."""
    usual, terms = Episodes(), {}
    if numbers.contact_time != usual.contact_time:
        params: dict[str, Any] = {"within": numbers.contact_time}
        terms["contact_time"] = EventTermCfg(func=contact_time, mode="startup", params=params)
    if (numbers.motor, numbers.joint_friction) != (usual.motor, usual.joint_friction):
        params = {"motor": numbers.motor, "friction": numbers.joint_friction}
        terms["motor_errors"] = EventTermCfg(func=MotorErrors, mode="startup", params=params)
    if numbers.dry_friction != usual.dry_friction:
        params = {"within": numbers.dry_friction}
        terms["dry_friction"] = EventTermCfg(func=DryFriction, mode="startup", params=params)
    return terms


def _model(env: ManagerBasedRlEnv) -> Any:
    return env.sim.model  # mjlab's bridge of Warp arrays has no types.
