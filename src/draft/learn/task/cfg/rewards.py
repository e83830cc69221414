"""Rewards of a stage: the terms of all stages, and what the stage changes."""

from __future__ import annotations

from mjlab.managers.reward_manager import RewardTermCfg

from draft.learn.task.cfg.task import Task
from draft.learn.task.config import Config
from draft.learn.task.constants import Scaled, scaled
from draft.learn.task.mdp import rewards


def reward_cfgs(task: Task) -> dict[str, RewardTermCfg]:
    """Configurations of the reward terms of a stage, by name."""
    config = task.config
    terms = {name: term.cfg(config.rewards) for name, term in rewards.TERMS.items()}
    terms["action_rate"].params = {
        "ramp": config.rewards.action_rate_ramp if task.stage == "base" else 0,
        "steps": config.learning.steps,
    }
    if task.stage == "push":
        terms["linear_velocity"].params = {"sigma": Scaled(config.push.sigma)}
    elif task.stage == "terrain" and config.terrain.progress:
        terms["progress"] = RewardTermCfg(
            func=rewards.progress,
            weight=config.terrain.progress,
            params={"gate": scaled(config.rewards, "clearance_gate")},
        )
    elif task.stage == "velocity":
        _reward_speed(config, terms)
    return terms


def _reward_speed(config: Config, terms: dict[str, RewardTermCfg]) -> None:
    """Change the terms that differ in stage `velocity`."""
    v, gate = config.velocity, terms["air_time"].params["gate"]
    if v.relative:
        terms["linear_velocity"].func = rewards.track_relative
        terms["linear_velocity"].params["share"] = v.relative
    else:
        terms["linear_velocity"] = RewardTermCfg(
            func=rewards.track_capped,
            weight=config.rewards.linear_weight,
            params={"headroom": v.headroom, "share": v.sigma},
        )
    terms["air_time"] = RewardTermCfg(
        func=rewards.air_time,
        weight=v.air_time_weight,
        params={"most": Scaled(v.air_time_most), "gate": gate},
    )
    terms["action_rate"].weight = v.action_rate_weight
    terms["speed"] = RewardTermCfg(
        func=rewards.speed,
        weight=v.speed_weight,
        params={"headroom": v.headroom, "gate": v.speed_gate},
    )
