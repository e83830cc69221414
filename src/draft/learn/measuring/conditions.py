"""Physics of an evaluation that differs from that of the training."""

from __future__ import annotations

from draft.errors import DraftError
from draft.learn.measuring.evaluation_options import Extras
from draft.learn.task.config import Config

_ROUNDED = 1e-6  # Relative error of a number of physics steps.


def with_conditions(config: Config, asked: Extras) -> Config:
    """Return the numbers of a task under the physics that an evaluation asks for.

    Args:
        config: numbers of the training.
        asked: what is asked for; None for what stays.

    Raises:
        DraftError: the physics step is no part of the control period, or too long for the contacts;
            or the delay is longer than the control period.
    """
    physics, episodes = config.physics, config.episodes
    period = physics.timestep * physics.decimation
    step = physics.timestep if asked.timestep is None else asked.timestep
    steps = round(period / step)
    if abs(steps * step - period) > _ROUNDED * period:
        cause = f"`timestep` {step:g} s is no part of the control period of {period:g} s"
        raise DraftError(cause, f"such as {period / max(steps, 1):.6g}")
    if asked.contact_time is not None and asked.contact_time < 2 * step * (1 - _ROUNDED):
        cause = f"`contact_time` {asked.contact_time:g} s needs two physics steps, of {step:g} s"
        most = period / -(-2 * period // asked.contact_time)
        raise DraftError(cause, f"pass `timestep` {most:.6g}")
    delay = (asked.delay,) * 2 if asked.delay is not None else episodes.delay
    if max(delay) > period * (1 + _ROUNDED):
        cause = f"`delay` {max(delay):g} s is longer than the control period of {period:g} s"
        raise DraftError(cause, "give a shorter one")
    changes: dict[str, object] = {
        "physics.timestep": step,
        "physics.decimation": steps,
        "episodes.delay": delay,
        "physics.all_collide": physics.all_collide or asked.all_collide,
    }
    noises = {name: x for name, x in vars(config.observations).items() if name.endswith("_noise")}
    changes |= {f"observations.{name}": asked.noise * value for name, value in noises.items()}
    for name in ("friction", "contact_time"):
        value = getattr(asked, name)
        if value is not None:
            changes[f"episodes.{name}"] = (value, value)
    return config.with_values(changes)
