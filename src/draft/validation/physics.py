"""Capabilities under other physics: steps, friction, contacts, delay, noise, and another engine.

A claim that holds under one setting only is a claim on the simulation and not on the robot.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

from draft.learn.bodies.legged import LeggedRobot
from draft.learn.measuring.evaluation import setting
from draft.learn.measuring.evaluation_options import Extras
from draft.learn.measuring.policies import Source
from draft.validation.capabilities import Estimate, measured

USUAL = "as trained"


@dataclass(frozen=True)
class Setting:
    """A setting of the physics.

    Attributes:
        label: words for tables.
        extras: what differs from the training.
        engine: "auto", "native" or "warp".
    """

    label: str
    extras: Extras
    engine: str = "auto"


SETTINGS = (
    Setting(USUAL, Extras()),
    Setting("half the step", Extras(timestep=0.0025)),
    Setting("a quarter of the step", Extras(timestep=0.00125)),
    Setting("friction 0.6", Extras(friction=0.6)),
    Setting("friction 1.4", Extras(friction=1.4)),
    Setting("contacts of 20 ms", Extras(contact_time=0.02)),
    Setting("contacts of 10 ms", Extras(contact_time=0.01)),
    Setting("contacts of 4 ms", Extras(contact_time=0.004, timestep=0.00125)),
    Setting("no delay", Extras(delay=0.0)),
    Setting("delay of 10 ms", Extras(delay=0.01)),
    Setting("delay of 20 ms", Extras(delay=0.02)),
    Setting("no noise", Extras(noise=0.0)),
    Setting("every part collides", Extras(all_collide=True)),
    Setting("MuJoCo Warp", Extras(), "warp"),
)


def under_physics(
    source: Source,
    member: LeggedRobot,
    settings: Sequence[Setting] = SETTINGS,
    *,
    replicas: int = 16,
    climber: Source | None = None,
    report: Callable[[str], None] = lambda label: None,
) -> Iterator[tuple[Setting, dict[str, Estimate]]]:
    """Yield the capabilities of a robot under each setting.

    Args:
        source: the policy.
        member: the robot.
        settings: settings of the physics.
        replicas: roll-outs at each level.
        climber: policy that climbs and descends stairs; None to leave stairs out.
        report: called with the label of each setting before it.

    Raises:
        DraftError: the policy does not drive the robot, or a setting is impossible.
    """
    for one in settings:
        report(one.label)
        where = setting("cpu" if one.engine == "warp" else "auto", one.engine)
        yield (
            one,
            measured(
                source,
                member,
                *where,
                replicas=replicas,
                conditions=one.extras,
                climber=climber,
            ),
        )
