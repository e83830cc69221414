"""What is rewarded."""

from __future__ import annotations

from mjlab.envs import mdp as envs_mdp
from mjlab.managers.reward_manager import RewardTermCfg

from draft.learn.config import Config
from draft.learn.constants import Scaled, scaled
from draft.learn.lab.env_cfg.task import Task
from draft.learn.lab.mdp import rewards


def reward_cfgs(task: Task) -> dict[str, RewardTermCfg]:
    """Terms of the reward of a stage, by name."""
    r = task.config.rewards
    found = {
        "linear_velocity": RewardTermCfg(
            func=rewards.track_linear,
            weight=r.linear_weight,
            params={"sigma": scaled(r, "linear_sigma")},
        ),
        "angular_velocity": RewardTermCfg(
            func=rewards.track_angular,
            weight=r.angular_weight,
            params={"sigma": scaled(r, "angular_sigma")},
        ),
        "upright": RewardTermCfg(
            func=rewards.upright,
            weight=r.upright_weight,
            params={"sigma": scaled(r, "upright_sigma")},
        ),
        "air_time": RewardTermCfg(
            func=rewards.air_time,
            weight=r.air_time_weight,
            params={"most": scaled(r, "air_time_most"), "gate": scaled(r, "air_time_gate")},
        ),
        "height": RewardTermCfg(
            func=rewards.height,
            weight=r.height_weight,
            params={"target": scaled(r, "height"), "sigma": scaled(r, "height_sigma")},
        ),
        "clearance": RewardTermCfg(
            func=rewards.clearance,
            weight=r.clearance_weight,
            params={
                "target": scaled(r, "clearance"),
                "factor": scaled(r, "clearance_scale"),
                "gate": scaled(r, "clearance_gate"),
            },
        ),
        "vertical_velocity": RewardTermCfg(
            func=rewards.vertical,
            weight=r.vertical_weight,
            params={"factor": scaled(r, "vertical_scale")},
        ),
        "joint_limits": RewardTermCfg(func=envs_mdp.joint_pos_limits, weight=r.limits_weight),
        "upper_legs": RewardTermCfg(func=rewards.upper_legs, weight=r.upper_leg_weight),
        "action_rate": RewardTermCfg(
            func=rewards.action_rate,
            weight=r.action_rate_weight,
            params={
                "ramp": r.action_rate_ramp if task.stage == "base" else 0,
                "steps": task.config.learning.steps,
            },
        ),
    }
    if task.stage == "push":
        found["linear_velocity"].params = {"sigma": Scaled(task.config.push.sigma)}
    elif task.stage == "terrain" and task.config.terrain.progress:
        found["progress"] = RewardTermCfg(
            func=rewards.progress,
            weight=task.config.terrain.progress,
            params={"gate": scaled(r, "clearance_gate")},
        )
    elif task.stage == "velocity":
        _reward_speed(task.config, found)
    return found


def _reward_speed(config: Config, found: dict[str, RewardTermCfg]) -> None:
    """What stage `velocity` rewards otherwise."""
    v, gate = config.velocity, found["air_time"].params["gate"]
    if v.relative:
        found["linear_velocity"].func = rewards.track_relative
        found["linear_velocity"].params["share"] = v.relative
    else:
        found["linear_velocity"] = RewardTermCfg(
            func=rewards.track_capped,
            weight=config.rewards.linear_weight,
            params={"headroom": v.headroom, "share": v.sigma},
        )
    found["air_time"] = RewardTermCfg(
        func=rewards.air_time,
        weight=v.air_time_weight,
        params={"most": Scaled(v.air_time_most), "gate": gate},
    )
    found["action_rate"].weight = v.action_rate_weight
    found["speed"] = RewardTermCfg(
        func=rewards.speed,
        weight=v.speed_weight,
        params={"headroom": v.headroom, "gate": v.speed_gate},
    )
