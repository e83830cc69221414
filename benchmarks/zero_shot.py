"""How well do the policies that ship walk real robots that they have never seen?

    python -m benchmarks.zero_shot                # robots of ../shared/robots, the shipped policy
    python -m benchmarks.zero_shot --robots DIR --policy FILE
    python -m benchmarks.zero_shot --out examples/results/zero_shot.json

Each robot is its maker's: kinematics, masses, inertias, torques and speeds of the description, and
the law's torques and speeds where it has a placeholder (`draft.validation.arms.by_maker`). It walks
for 12 s at four commands, up to sqrt(g L) on four legs or more and half of it on two, from noisy
starts, and is pushed while it walks: with the policy of all legs, and with that of all quadrupeds
where it drives the robot, since Draft then uses it. Some eight minutes on two idle cores.
"""

from __future__ import annotations

import csv
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.table import Table

from benchmarks.any_legs import cases_record
from benchmarks.roll_outs import (
    PUSH,
    SECONDS,
    WIDTH,
    Case,
    bar,
    bars_table,
    distance,
    number,
    record_of,
    rolled_out,
    run_as_command,
    save,
)
from draft import parallel
from draft.errors import DraftError, counted
from draft.laws.survey import read
from draft.learn.bodies.legged import LeggedRobot
from draft.learn.bodies.slots import describe
from draft.learn.engine.machine import cores
from draft.learn.measuring.policies import Source, of_legs, open_source
from draft.learn.policy.policy import ANY
from draft.learn.policy.reduced import LegsPolicy, open_legs_policy
from draft.learn.silence import quiet
from draft.twins.compare import Comparison, compare_twin
from draft.validation.arms import by_maker

ROBOTS = Path("../shared/robots")
MANIFEST = "manifest.csv"
REPLICAS = 8
UP, ERROR = 7 / 8, 0.10  # Least share that stays up, and largest error, of a robot that walks.
FOUR, TWO = "quadrupeds", "bipeds and humanoids"
FAMILY = "family"  # What a quadruped does with the policy of all quadrupeds.
AT = {FOUR: 0.5, TWO: 0.25}  # Commands of the bars [sqrt(g L)].
WALK = {FOUR: 0.9, TWO: 0.6}  # Shares of machines that are to walk.
_KINDS = (".urdf", ".xml")
_NAMED = 2  # Numbers outside the region that are named.


@dataclass(frozen=True)
class Entry:
    """A description of a robot.

    Attributes:
        key: its name.
        file: the description.
        again: whether it is another file of a machine that is measured by its first one.
    """

    key: str
    file: Path
    again: bool = False


@dataclass(frozen=True)
class Job:
    """A robot to roll out.

    Attributes:
        legs: the policy.
        entry: the robot.
        replicas: roll-outs at each case.
        seconds: duration of a roll-out [s].
        velocity_noise: largest error of the observed velocity [m/s]; None for that of the training.
    """

    legs: LegsPolicy
    entry: Entry
    replicas: int
    seconds: float
    velocity_noise: float | None = None


def main(
    robots: Path = ROBOTS,
    policy: Path = ANY,
    replicas: int = REPLICAS,
    seconds: float = SECONDS,
    only: tuple[str, ...] = (),
    velocity_noise: float | None = None,
    out: Path | None = None,
) -> None:
    """Roll out and print.

    Args:
        robots: folder of the descriptions; a manifest.csv in it names them.
        policy: policy of all legs.
        replicas: roll-outs at each command and with pushes.
        seconds: duration of a roll-out [s].
        only: names of robots; all by default.
        velocity_noise: largest error of the observed velocity [m/s]; by default that of the
            training.
        out: JSON file for the numbers.
    """
    legs = open_legs_policy(policy)
    if robots == ROBOTS and not robots.is_dir():
        print(f"skipped: there is no folder {robots}; name another one with --robots")
        return
    chosen = [entry for entry in entries(robots) if not only or entry.key in only]
    if not chosen:
        raise DraftError(f"{robots} has no robot {' or '.join(only)}", "name others with --only")
    jobs = [Job(legs, entry, replicas, seconds, velocity_noise) for entry in chosen]
    rows: dict[str, dict[str, Any]] = {}
    for job, row in parallel.run(jobs, measured, min(cores(), len(jobs))):
        rows[job.entry.key] = row
        print(line(row), flush=True)
    found = {
        "policy": record_of(legs),
        "replicas": replicas,
        "seconds": seconds,
        "velocity_noise": velocity_noise,  # None for that of each policy's training.
        "robots": [rows[entry.key] for entry in chosen],
    }
    show(found, Console(width=WIDTH))
    if out is not None:
        save(out, found)


def entries(folder: Path) -> list[Entry]:
    """Descriptions of a folder: those of its manifest, or all.

    Raises:
        DraftError: there is none.
    """
    manifest = folder / MANIFEST
    if manifest.is_file():
        with manifest.open(encoding="utf-8", newline="") as file:
            rows = [row for row in csv.DictReader(file) if (folder / row["file"]).is_file()]
        found = [Entry(row["key"], folder / row["file"], _again(row)) for row in rows]
    else:
        files = sorted(path for path in folder.rglob("*") if path.suffix in _KINDS)
        found = [Entry(path.stem, path) for path in files]
    if not found:
        cause = f"{folder} has no descriptions of robots"
        raise DraftError(cause, f"name a folder with files {' or '.join(_KINDS)}")
    return found


def _again(row: Mapping[str, str]) -> bool:
    """Whether a row of the manifest is a further file of a machine."""
    kept = "kept for comparison" in row.get("exclusion_reason", "")
    return kept or row["file"].startswith("twins/")


def cases_of(feet: int) -> tuple[Case, ...]:
    """What a robot is asked: those on two legs walk half as fast."""
    fastest = 0.5 if feet == 2 else 1.0
    ahead = (Case.ahead(share * fastest) for share in (0.0, 0.25, 0.5, 1.0))
    return *ahead, Case("push", (0.25, 0.0, 0.0), PUSH)


def measured(job: Job) -> dict[str, Any]:
    """What one robot does, or the reason why it is not measured."""
    quiet()
    entry, legs = job.entry, job.legs
    row: dict[str, Any] = {"robot": entry.key, "again": entry.again}
    try:
        key = entry.key if any(one.robot == entry.key for one in read()) else ""
        twin = compare_twin(entry.file, poses=2, key=key)
        member = by_maker(twin)
        far = outside(legs, member)
    except DraftError as error:
        return row | {"reason": " ".join(error.problems[0].cause.split())}
    row |= {
        "legs": len(member.feet),
        "joints": len(member.joints),
        "leg_length": round(member.leg_length, 4),
        "mass": round(member.mass, 3),
        **_walked(job, of_legs(legs, legs.file.name, member), member),
        **far,
        "notes": notes(twin),
    }
    usual = open_source(robot=member)
    if usual.of_any_legs:
        return row
    departures = [str(one) for one in usual.drive.departures(member)]
    own = {"outside": len(departures), "farthest": departures[:_NAMED]}
    return row | {FAMILY: _walked(job, usual, member) | own}


def _walked(job: Job, source: Source, member: LeggedRobot) -> dict[str, Any]:
    """What a robot does with a policy, and the joint nearest its limit."""
    cases = cases_of(len(member.feet))
    options = {"replicas": job.replicas, "seconds": job.seconds}
    found = rolled_out(source, [member], cases, **options, velocity_noise=job.velocity_noise)
    fastest = max((i for i in range(4) if found.up(i) >= 0.5), default=None)
    limit = None if fastest is None else found.limit(fastest)
    if limit is not None and fastest is not None:
        limit |= {"at": cases[fastest].name, "value": round(limit["value"], 3)}
    return {"cases": cases_record(found), "limit": limit}


def outside(legs: LegsPolicy, member: LeggedRobot) -> dict[str, Any]:
    """How far a robot lies outside the region, and its farthest numbers, of the left alone."""
    found = legs.departures(member, describe(member)[1])
    farthest = [str(one) for one in found if " right " not in one.name][:_NAMED]
    return {"outside": round(distance(legs, member), 3), "farthest": farthest}


def notes(twin: Comparison) -> list[str]:
    """What of a robot is not its maker's."""
    drives = twin.files.drives.values()
    guessed = sum(one.guessed for one in drives)
    found = []
    if guessed:
        found.append(f"{guessed} of {len(drives)} torques are those of usual motors")
    if twin.unstated:
        found.append(f"{counted(len(twin.unstated), 'link')} of which the file states no mass")
    return found


def walks(row: Mapping[str, Any], at: float) -> bool:
    """Whether a robot walks at a command: it stays up, and the error is small."""
    one = row.get("cases", {}).get(Case.ahead(at).name)
    if one is None or one["error"] is None:
        return False
    return bool(one["up"] >= UP and one["error"] <= ERROR)


def as_used(row: Mapping[str, Any]) -> Mapping[str, Any]:
    """What a robot does with the policy that Draft uses for its legs."""
    return row | row.get(FAMILY, {})


def group_of(row: Mapping[str, Any]) -> str:
    """Group that a measured robot counts in."""
    return TWO if row["legs"] == 2 else FOUR


def machines(found: Mapping[str, Any], group: str) -> list[Mapping[str, Any]]:
    """Measured robots of a group, each machine once."""
    rows = (row for row in found["robots"] if "reason" not in row and not row["again"])
    return [row for row in rows if group_of(row) == group]


def share(
    found: Mapping[str, Any],
    group: str,
    by: Callable[[Mapping[str, Any]], Mapping[str, Any]] = lambda row: row,
) -> float | None:
    """Share of the machines of a group that walk; None if there is none.

    Args:
        found: all results.
        group: the group.
        by: takes the numbers of a robot that count; by default those of the policy of all legs.
    """
    of = machines(found, group)
    return sum(walks(by(row), AT[group]) for row in of) / len(of) if of else None


def bars(found: Mapping[str, Any]) -> list[dict[str, Any]]:
    """Shares of machines that walk, against their bars."""
    rows = []
    for group, at in AT.items():
        of = machines(found, group)
        what = f"{len(of)} real {group}, walk at {at:g} sqrt(g L)"
        rows.append(bar(what, share(found, group), WALK[group], "%"))
        if any(FAMILY in row for row in of):
            what = "the same, by the policy that Draft uses for their legs"
            rows.append(bar(what, share(found, group, as_used), WALK[group], "%"))
    return rows


def columns(group: str) -> dict[str, Callable[[Mapping[str, Any]], str]]:
    """Headings of the table of a group, and what each has of a row."""
    ahead = [case.name for case in cases_of(2 if group == TWO else 4)[:-1]]
    of_commands = {name: partial(_up_and_error, case=name) for name in ahead}
    return {
        "robot": lambda row: row["robot"],
        "legs": lambda row: str(row["legs"]),
        "joints": lambda row: str(row["joints"]),
        **of_commands,
        f"pushes {PUSH:g}": lambda row: number(row["cases"]["push"]["up"], "%"),
        "nearest limit": _limit,
        "region": _region,
    }


def line(row: Mapping[str, Any]) -> str:
    """A robot in one line."""
    if "reason" in row:
        return f"{row['robot']}: not measured: {row['reason']}"
    cells = (f"{name}: {cell(row)}" for name, cell in columns(group_of(row)).items())
    return ", ".join(cells)


def _up_and_error(row: Mapping[str, Any], case: str) -> str:
    one = row["cases"][case]
    error = "-" if one["error"] is None else f"{one['error']:.2f}"
    return f"{number(one['up'], '%')} / {error}"


def _limit(row: Mapping[str, Any]) -> str:
    one = row["limit"]
    return "-" if one is None else f"{one['joint']}, {one['by']} {one['value']:.2f}"


def _region(row: Mapping[str, Any]) -> str:
    """How far outside the region, of the family the number of its numbers that are."""
    if isinstance(row["outside"], int):
        count = row["outside"]
        return f"{count} of its numbers outside" if count else "inside"
    return f"{row['outside']:.2f} outside" if row["outside"] else "inside"


def tables(found: Mapping[str, Any]) -> dict[str, tuple[str, list[Mapping[str, Any]]]]:
    """Titles of the tables, with the group and the rows of each."""
    done = [row for row in found["robots"] if "reason" not in row]
    named = {}
    for group in AT:
        rows = [row for row in done if group_of(row) == group]
        named[group] = group, rows
        named[f"{group}, by the policy of all quadrupeds"] = (
            group,
            [as_used(row) for row in rows if FAMILY in row],
        )
    return {title: table for title, table in named.items() if table[1]}


def show(found: Mapping[str, Any], console: Console) -> None:
    """Print the tables, and what was not measured."""
    for title, (group, rows) in tables(found).items():
        cells = columns(group)
        table = Table(*cells, box=None, title=f"{title}: up / error per sqrt(g L)")
        for row in rows:
            table.add_row(*(cell(row) for cell in cells.values()))
        console.print(table)
    for row in found["robots"]:
        if "reason" in row:
            console.print(line(row), highlight=False, soft_wrap=True)
    console.print(bars_table(bars(found)))


if __name__ == "__main__":
    run_as_command(main, __doc__)
