"""How well does a family's policy walk, run and survive kicks with bodies it was not trained with?

    python -m benchmarks.unseen                  # the policy that ships, 40 bodies
    python -m benchmarks.unseen --family RUN     # a family of your own, or an ONNX file

All bodies of the ranges (`benchmarks.family.RANGES`) are rolled out side by side at each command
and each kick. It prints medians of the speeds and shares that did not fall; some 5 minutes of CPU
time.
"""

from __future__ import annotations

from dataclasses import dataclass

import tyro
from rich.console import Console
from rich.table import Table

from benchmarks.family import drawn, rolled_out
from draft.learn.engine.machine import cores
from draft.learn.measuring.levels import PUSH, SPEED
from draft.learn.measuring.policies import open_source
from draft.learn.measuring.scalars import Curve
from draft.learn.silence import quiet

COMMANDS = (0.4, 0.6, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0)  # [m/s]
KICKS = (2.0, 3.0, 4.0, 5.0, 6.0)  # [m/s]


@dataclass(frozen=True)
class Numbers:
    """What was asked.

    Attributes:
        family: run or ONNX file of the family; by default the policy that ships.
        bodies: number of bodies.
        seed: seed of the draws; the family that ships was drawn with 0.
        replicas: roll-outs of each body at each command and kick.
        seconds: duration of a roll-out [s].
    """

    family: str | None = None
    bodies: int = 40
    seed: int = 7
    replicas: int = 4
    seconds: float = 12.0


def main(numbers: tyro.conf.OmitArgPrefixes[Numbers]) -> None:
    """Roll out and print."""
    quiet()
    found = measured(numbers)
    speed, push = found[SPEED], found[PUSH]
    console = Console()
    runs = Table("command, m/s", *(f"{level:g}" for level in speed["levels"]), box=None)
    cells = ("none" if one is None else f"{one:.2f}" for one in speed["speed"])
    runs.add_row("speed, m/s", *cells)
    runs.add_row("stay up, %", *(f"{100 * share:.0f}" for share in speed["survival"]))
    console.print(runs)
    kicks = Table("kick, m/s", *(f"{level:g}" for level in push["levels"]), box=None)
    kicks.add_row("stay up, %", *(f"{100 * share:.0f}" for share in push["survival"]))
    console.print(kicks)


def measured(numbers: Numbers) -> dict[str, Curve]:
    """Curves of all bodies together: `SPEED` over the commands, `PUSH` over the kicks."""
    robots = tuple(body.robot for body in drawn(numbers.bodies, numbers.seed))
    source = open_source(numbers.family, robot=robots[0])
    rolls = (COMMANDS, KICKS, numbers.replicas, numbers.seconds, cores())
    return rolled_out(robots, source.plan, source.drive.actor("cpu"), *rolls)


if __name__ == "__main__":
    tyro.cli(main)
