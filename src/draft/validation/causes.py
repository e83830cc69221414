"""Which error of predicted masses changes what a robot can do."""

from __future__ import annotations

from collections.abc import Callable

from draft.learn.engine.machine import Engine
from draft.learn.measuring.evaluation_options import Extras
from draft.learn.measuring.policies import Source
from draft.twins.compare import Comparison
from draft.validation.arms import ALL, by_maker, predicted
from draft.validation.capabilities import measured

JUDGED = ("top_speed", "kick", "walking_power")
TRUNK = "trunk"


def causes(
    twin: Comparison,
    source: Source,
    device: str,
    engine: Engine,
    *,
    replicas: int = 8,
    seconds: float = 9.0,
    seed: int = 0,
    conditions: Extras | None = None,
    report: Callable[[str], None] = lambda label: None,
) -> dict[str, dict[str, float]]:
    """Capabilities with one of the maker's numbers, over those with predicted ones.

    Args:
        twin: the twin of a robot.
        source: the policy, which drives it.
        device: "cpu" or "cuda:0" and the like.
        engine: physics engine.
        replicas: roll-outs at each level.
        seconds: duration of a roll-out [s].
        seed: seed of everything random, the same for all.
        conditions: physics that differs from that of the training.
        report: called with each number before it.

    Returns:
        For each of `JUDGED` the ratios by number, such as "mass of the trunk"; none where either
        cannot be measured.
    """
    groups = {pair.group for pair in twin.links}
    numbers = {"replicas": replicas, "seconds": seconds, "seed": seed}
    own = measured(source, predicted(twin), device, engine, **numbers, conditions=conditions)
    found: dict[str, dict[str, float]] = {name: {} for name in JUDGED}
    for words, chosen in ((TRUNK, {TRUNK}), ("limbs", groups - {TRUNK})):
        for what in ALL:
            label = f"{what} of the {words}"
            report(label)
            member = by_maker(twin, (what,), chosen)
            theirs = measured(source, member, device, engine, **numbers, conditions=conditions)
            for name in JUDGED:
                ratio = theirs[name].value / own[name].value
                if ratio > 0:
                    found[name][label] = ratio
    return found
