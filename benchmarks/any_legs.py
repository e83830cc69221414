"""How well does the policy of all legs walk bodies that it was not trained with?

    python -m benchmarks.any_legs                 # the policy that ships, 80 bodies
    python -m benchmarks.any_legs --policy FILE   # an export of 'draft train any'
    python -m benchmarks.any_legs --out examples/results/any_legs.json

Bodies of every kind of the generator, drawn with another seed than those of the training, and of
three kinds that are never trained: quadrupeds whose knees point away from each other or whose legs
have five joints, and bodies on eight legs. Each is asked to walk ahead, sideways and to turn, and
is pushed. It also prints the time of one action, the top speed of the shipped humanoid, and those
of the bodies of `benchmarks.family` over what the policy of all quadrupeds reaches in the same
physics. It holds them against bars, and takes some four minutes on two idle cores.
"""

from __future__ import annotations

import math
import tempfile
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from rich.console import Console
from rich.table import Table

import draft
from benchmarks.roll_outs import (
    FOLLOWED,
    PUSH,
    SECONDS,
    SIDEWAYS,
    TURN,
    WIDTH,
    Case,
    Rolled,
    bar,
    bars_table,
    distance,
    number,
    record_of,
    rolled_out,
    rounded,
    run_as_command,
    save,
)
from benchmarks.untrained import kinds as with_untrained
from draft import parallel
from draft.errors import DraftError
from draft.learn.bodies.features import GRAVITY
from draft.learn.bodies.generated import KINDS, generate_kind
from draft.learn.bodies.legged import LeggedRobot, legged_robot
from draft.learn.engine.machine import cores
from draft.learn.measuring.policies import of_legs, open_source
from draft.learn.measuring.scalars import SURVIVAL
from draft.learn.policy.policy import ANY
from draft.learn.policy.reduced import LegsPolicy, open_legs_policy
from draft.learn.silence import quiet

HUMANOID = "humanoid"
SPEEDS = tuple(0.1 * i for i in range(1, 9))  # Commands of its top speed [sqrt(g L)].
FAMILY_SPEEDS = tuple(0.25 * i for i in range(1, 13))  # Of bodies of the truth map [sqrt(g L)].
FAMILY_BODIES, FAMILY_SEED, FAMILY_SHARE = 12, 1, 0.95
ACTIONS = 2000  # Actions that are timed.
TRAINED_SEED = 0
# Groups of kinds that a bar is for, and what its bodies have to stay up at.
GROUPS = {
    "quadrupeds": (("quadruped",), 0.99, 0.04),
    "hexapods": (("hexapod",), 0.99, 0.05),
    "bipeds and humanoids": (
        ("biped", "biped_of_four", "biped_slanting", HUMANOID),
        0.95,
        0.08,
    ),
}
PUSHED = {"quadrupeds": 0.95, "bipeds and humanoids": 0.75}
UNTRAINED_UP, HUMANOID_SPEED, MEGABYTES, MILLISECONDS = 0.8, 0.4, 2.0, 1.0
_SLOW, _HALF, _FAST = 0.25, 0.5, 1.0


@dataclass(frozen=True)
class Job:
    """Bodies of one kind to roll out.

    Attributes:
        legs: the policy.
        kind: name of the kind.
        count: number of bodies.
        seed: seed of the draws.
        replicas: roll-outs of each body at each case.
        seconds: duration of a roll-out [s].
    """

    legs: LegsPolicy
    kind: str
    count: int
    seed: int
    replicas: int
    seconds: float


def main(
    policy: Path = ANY,
    bodies: int = 80,
    seed: int = 7,
    replicas: int = 2,
    seconds: float = SECONDS,
    out: Path | None = None,
) -> None:
    """Roll out and print.

    Args:
        policy: policy of all legs.
        bodies: number of bodies, divided by the shares of the kinds; a kind that is never trained
            has an eighth of them.
        seed: seed of the draws, not that of the training.
        replicas: roll-outs of each body at each case.
        seconds: duration of a roll-out [s].
        out: JSON file for the numbers.
    """
    if seed == TRAINED_SEED:
        raise DraftError(f"bodies of seed {seed} are those of the training", "use another one")
    legs = open_legs_policy(policy)
    found = measured(legs, bodies, seed, replicas, seconds)
    show(found, Console(width=WIDTH))
    if out is not None:
        save(out, found)


def measured(
    legs: LegsPolicy, bodies: int, seed: int, replicas: int, seconds: float
) -> dict[str, Any]:
    """All numbers, as the file of results has them."""
    with tempfile.TemporaryDirectory() as folder:
        names = list(with_untrained(Path(folder)))
    few = max(1, bodies // 8)
    counts = {
        name: max(1, round(bodies * KINDS[name].share)) if name in KINDS else few for name in names
    }
    jobs = [Job(legs, name, count, seed, replicas, seconds) for name, count in counts.items()]
    jobs.sort(key=lambda job: -job.count)  # The longest begin.
    workers = min(cores(), len(jobs))
    rows = {job.kind: row for job, row in parallel.run(jobs, _kind, workers)}
    humanoid = legged_robot(draft.load(HUMANOID).resolve())
    return {
        "policy": record_of(legs),
        "bodies": bodies,
        "seed": seed,
        "replicas": replicas,
        "seconds": seconds,
        "kinds": [rows[name] for name in names],
        "action": {"joints": len(humanoid.joints), "ms": action_time(legs, humanoid)},
        "humanoid": humanoid_speed(legs, humanoid, replicas, seconds),
        "family": family_speeds(legs, replicas, seconds),
    }


def cases_of(feet: int) -> tuple[Case, ...]:
    """What bodies are asked: those on two legs walk half as fast."""
    speeds = (_SLOW, _HALF) if feet == 2 else (_SLOW, _HALF, _FAST)
    return (
        Case("stand", (0.0, 0.0, 0.0)),
        *map(Case.ahead, speeds),
        Case("sideways", (0.0, SIDEWAYS, 0.0)),
        Case("turn", (0.0, 0.0, TURN)),
        Case("push", (_SLOW, 0.0, 0.0), PUSH),
    )


def half(legs: int) -> str:
    """Name of the case of half of the fastest command."""
    return Case.ahead(_SLOW if legs == 2 else _HALF).name


def _kind(job: Job) -> dict[str, Any]:
    """Draw bodies of a kind and roll them out."""
    quiet()
    with tempfile.TemporaryDirectory() as folder:
        kinds = with_untrained(Path(folder))
        members = generate_kind(job.kind, job.count, job.seed, kinds).members
    legs = len(members[0].feet)
    options = {"replicas": job.replicas, "seconds": job.seconds, "seed": job.seed}
    source = of_legs(job.legs, job.legs.file.name, members[0])
    found = rolled_out(source, members, cases_of(legs), **options)
    outside = [distance(job.legs, member) for member in members]
    return {
        "kind": job.kind,
        "trained": job.kind in KINDS,
        "bodies": len(members),
        "legs": legs,
        "joints": len(members[0].joints),
        "outside": round(max(outside), 3),
        "cases": cases_record(found),
    }


def cases_record(found: Rolled) -> dict[str, dict[str, Any]]:
    """Numbers of each case, by its name."""
    return {
        case.name: {
            "up": round(found.up(i), 4),
            "reached": rounded(found.reached(i)),
            "error": rounded(found.mean_error(i)),
            "followed": round(found.followed(i), 4),
        }
        for i, case in enumerate(found.cases)
    }


def action_time(legs: LegsPolicy, member: LeggedRobot) -> float:
    """Median time of one action by NumPy [ms]."""
    policy = legs.of_robot(member)
    seen = np.zeros(policy.network.size, np.float32)
    times = []
    for _ in range(ACTIONS):
        start = time.perf_counter()
        policy(seen)
        times.append(time.perf_counter() - start)
    return round(1e3 * float(np.median(times)), 4)


def humanoid_speed(
    legs: LegsPolicy, member: LeggedRobot, replicas: int, seconds: float
) -> dict[str, Any]:
    """Largest speed of a robot over the commands at which four of five stay up [m/s]."""
    cases = [Case.ahead(speed) for speed in SPEEDS]
    options = {"replicas": 2 * replicas, "seconds": seconds, "threads": cores()}
    found = rolled_out(of_legs(legs, legs.file.name, member), [member], cases, **options)
    root = math.sqrt(GRAVITY * member.leg_length)
    speeds = [found.reached(i) if found.up(i) >= SURVIVAL else None for i in range(len(cases))]
    known = [speed * root for speed in speeds if speed is not None]
    return {
        "commands": [round(speed * root, 3) for speed in SPEEDS],
        "speeds": [None if speed is None else round(speed * root, 3) for speed in speeds],
        "top_speed": round(max(known), 3) if known else None,
    }


def family_speeds(legs: LegsPolicy, replicas: int, seconds: float) -> dict[str, Any]:
    """Top speeds of bodies of the truth map with both policies, per sqrt(g L), and their ratio."""
    from benchmarks.family import drawn

    members = [body.robot for body in drawn(FAMILY_BODIES, FAMILY_SEED)]
    own, family = of_legs(legs, legs.file.name, members[0]), open_source(None)
    config = own.plan.config
    physics = {"episodes.contact_time": config.episodes.contact_time}
    of_family = replace(family.plan, config=family.plan.config.with_values(physics))
    cases = [Case.ahead(speed) for speed in FAMILY_SPEEDS]
    options = {"replicas": 2 * replicas, "seconds": seconds, "threads": cores()}
    options["velocity_noise"] = config.observations.linear_velocity_noise
    speeds = [
        [rounded(speed) for speed in top_speeds(rolled_out(source, members, cases, **options))]
        for source in (own, replace(family, plan=of_family))
    ]
    ratios = [first / second for first, second in zip(*speeds, strict=True) if second]
    return {
        "commands": list(FAMILY_SPEEDS),
        "speeds": speeds[0],
        "of_family": speeds[1],
        "ratio": rounded(float(np.median(ratios))) if ratios else None,
    }


def top_speeds(found: Rolled) -> list[float]:
    """Largest speed of each robot over the cases in which four of five stay up; 0 for none."""
    up, ahead = found.fell == 0, found.velocity[..., 0]
    mean = np.where(up, ahead, 0.0).sum(axis=1) / up.sum(axis=1).clip(min=1)
    return np.where(up.mean(axis=1) >= SURVIVAL, mean, 0.0).max(axis=0).tolist()


def bars(found: Mapping[str, Any]) -> list[dict[str, Any]]:
    """Numbers of `measured` against their bars."""
    kinds = {row["kind"]: row for row in found["kinds"]}
    rows = []
    for group, (names, up, error) in GROUPS.items():
        own = [kinds[name] for name in names]
        at = half(own[0]["legs"])
        rows.append(bar(f"{group}, up at {at} sqrt(g L)", _pooled(own, at, "up"), up, "%"))
        value = _pooled(own, at, "error")
        rows.append(bar(f"{group}, error there, per sqrt(g L)", value, error, at_least=False))
    for case, asked in (("sideways", SIDEWAYS), ("turn", TURN)):
        gaps = [(_gap(row, case, asked), name) for name, row in kinds.items() if row["trained"]]
        gap, worst = max(gaps)
        what = f"{case} {asked:g}, relative error, worst kind: {worst}"
        rows.append(bar(what, gap if gap < math.inf else None, FOLLOWED, "%", at_least=False))
    for group, share in PUSHED.items():
        own = [kinds[name] for name in GROUPS[group][0]]
        what = f"{group}, up after pushes of {PUSH:g} sqrt(g L)"
        rows.append(bar(what, _pooled(own, "push", "up"), share, "%"))
    others = [row for row in found["kinds"] if not row["trained"]]
    if others:
        at = Case.ahead(_SLOW).name
        worst = min(others, key=lambda row: row["cases"][at]["up"])
        what = f"never trained, up at {at}, worst: {worst['kind']}"
        rows.append(bar(what, worst["cases"][at]["up"], UNTRAINED_UP, "%"))
    speed, action = found["humanoid"]["top_speed"], found["action"]
    rows.append(bar("shipped humanoid, top speed", speed, HUMANOID_SPEED, "m/s"))
    what = f"{FAMILY_BODIES} quadrupeds, top speed over that by the policy of all quadrupeds"
    rows.append(bar(what, found["family"]["ratio"], FAMILY_SHARE))
    rows.append(bar("file", found["policy"]["megabytes"], MEGABYTES, "MB", at_least=False))
    what = f"one action, NumPy, {action['joints']} joints"
    return [*rows, bar(what, action["ms"], MILLISECONDS, "ms", at_least=False)]


def _pooled(rows: Sequence[Mapping[str, Any]], case: str, what: str) -> float | None:
    """Mean over bodies of a number of a case; of an error, over those that stay up."""
    pairs = [
        (one[what], row["bodies"] * (1.0 if what == "up" else one["up"]))
        for row in rows
        if (one := row["cases"][case])[what] is not None
    ]
    weight = sum(weight for _, weight in pairs)
    return sum(value * share for value, share in pairs) / weight if weight else None


def _gap(row: Mapping[str, Any], case: str, asked: float) -> float:
    """Relative error of the mean velocity along a command; infinite if all fall."""
    reached = row["cases"][case]["reached"]
    return math.inf if reached is None else abs(reached - asked) / asked


COLUMNS: Mapping[str, Callable[[Mapping[str, Any]], str]] = {
    "kind": lambda row: row["kind"],
    "bodies": lambda row: str(row["bodies"]),
    "legs": lambda row: str(row["legs"]),
    "joints": lambda row: str(row["joints"]),
    "stand": lambda row: _up_and_error(row, "stand"),
    "0.25": lambda row: _up_and_error(row, "0.25"),
    "0.5": lambda row: _up_and_error(row, "0.5"),
    "1": lambda row: _up_and_error(row, "1"),
    f"sideways {SIDEWAYS:g}": lambda row: _up_and_reached(row, "sideways"),
    f"turn {TURN:g}": lambda row: _up_and_reached(row, "turn"),
    f"pushes {PUSH:g}": lambda row: number(row["cases"]["push"]["up"], "%"),
}


def _up_and_error(row: Mapping[str, Any], case: str) -> str:
    one = row["cases"].get(case)
    return "" if one is None else f"{number(one['up'], '%')} / {_short(one['error'])}"


def _up_and_reached(row: Mapping[str, Any], case: str) -> str:
    one = row["cases"][case]
    return f"{number(one['up'], '%')} / {_short(one['reached'])}"


def _short(value: float | None) -> str:
    return "-" if value is None else f"{round(value, 2) + 0.0:.2f}"  # No "-0.00".


def show(found: Mapping[str, Any], console: Console) -> None:
    """Print the tables."""
    title = "up / mean error per sqrt(g L); sideways and turn: up / reached"
    table = Table(*COLUMNS, box=None, title=title)
    for row in found["kinds"]:
        table.add_row(*(cell(row) for cell in COLUMNS.values()))
    console.print(table)
    console.print(bars_table(bars(found)))


if __name__ == "__main__":
    run_as_command(main, __doc__)
