"""What is rewarded."""

from __future__ import annotations

from mjlab.envs import mdp as stock
from mjlab.managers.reward_manager import RewardTermCfg as Reward

from draft.learn.config import Config
from draft.learn.lab.tasks.task import Task
from draft.learn.lab.terms import rewards as terms
from draft.learn.numbers import Scaled, scaled


def rewards(task: Task) -> dict[str, Reward]:
    """Terms of the reward of a stage, by name."""
    r = task.config.rewards
    found = {
        "linear_velocity": Reward(
            func=terms.track_linear,
            weight=r.linear_weight,
            params={"sigma": scaled(r, "linear_sigma")},
        ),
        "angular_velocity": Reward(
            func=terms.track_angular,
            weight=r.angular_weight,
            params={"sigma": scaled(r, "angular_sigma")},
        ),
        "upright": Reward(
            func=terms.upright,
            weight=r.upright_weight,
            params={"sigma": scaled(r, "upright_sigma")},
        ),
        "air_time": Reward(
            func=terms.air_time,
            weight=r.air_time_weight,
            params={"most": scaled(r, "air_time_most"), "gate": scaled(r, "air_time_gate")},
        ),
        "height": Reward(
            func=terms.height,
            weight=r.height_weight,
            params={"target": scaled(r, "height"), "sigma": scaled(r, "height_sigma")},
        ),
        "clearance": Reward(
            func=terms.clearance,
            weight=r.clearance_weight,
            params={
                "target": scaled(r, "clearance"),
                "factor": scaled(r, "clearance_scale"),
                "gate": scaled(r, "clearance_gate"),
            },
        ),
        "vertical_velocity": Reward(
            func=terms.vertical,
            weight=r.vertical_weight,
            params={"factor": scaled(r, "vertical_scale")},
        ),
        "joint_limits": Reward(func=stock.joint_pos_limits, weight=r.limits_weight),
        "upper_legs": Reward(func=terms.upper_legs, weight=r.upper_leg_weight),
        "action_rate": Reward(
            func=terms.action_rate,
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
        found["progress"] = Reward(
            func=terms.progress,
            weight=task.config.terrain.progress,
            params={"gate": scaled(r, "clearance_gate")},
        )
    elif task.stage == "velocity":
        _reward_speed(task.config, found)
    return found


def _reward_speed(config: Config, found: dict[str, Reward]) -> None:
    """What stage `velocity` rewards otherwise."""
    v, gate = config.velocity, found["air_time"].params["gate"]
    if v.relative:
        found["linear_velocity"].func = terms.track_relative
        found["linear_velocity"].params["share"] = v.relative
    else:
        found["linear_velocity"] = Reward(
            func=terms.track_capped,
            weight=config.rewards.linear_weight,
            params={"headroom": v.headroom, "share": v.sigma},
        )
    found["air_time"] = Reward(
        func=terms.air_time,
        weight=v.air_time_weight,
        params={"most": Scaled(v.air_time_most), "gate": gate},
    )
    found["action_rate"].weight = v.action_rate_weight
    found["speed"] = Reward(
        func=terms.speed,
        weight=v.speed_weight,
        params={"headroom": v.headroom, "gate": v.speed_gate},
    )
