"""Results of an evaluation: a folder RUN/evaluation/ARM-PROTOCOL, written whole or not at all.

worlds.parquet        one row per roll-out
utilisation.parquet   histograms of the joints' shares of their limits
occupancy.parquet     joint histograms of their torque and speed
summary.json          curves, scalars, utilisation, and the request and versions that gave them
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from draft.extras import need
from draft.files import new_folder, write
from draft.learn.measuring.energy import add_energy, supply_record
from draft.learn.measuring.evaluation_options import Extras, Options
from draft.learn.measuring.heating import add_heat
from draft.learn.measuring.levels import SPEED, SkillTest, flags, settle, trained
from draft.learn.measuring.scalars import Worlds, curves, scalars
from draft.learn.measuring.summary import ARMS, FORMAT, Request, Summary, parse
from draft.learn.measuring.utilisation import QUANTITIES, Histograms, utilisation
from draft.learn.training.members import robots_digest
from draft.learn.training.run import Run, file_digest, versions
from draft.settings import shown

if TYPE_CHECKING:
    from draft.learn.bodies.legged import LeggedRobot

FOLDER = "evaluation"
SUMMARY, WORLDS, UTILISATION = "summary.json", "worlds.parquet", "utilisation.parquet"
OCCUPANCY = "occupancy.parquet"
PARTS = (WORLDS, UTILISATION, OCCUPANCY, SUMMARY)
_FAMILY = "several designs: see by_member"
# Columns without meaning for a roll-out that fell.
_OF_WALKERS = ("speed", "mechanical", "heat", "copper", "driving", "rise")


def make_request(run: Run, tests: Sequence[SkillTest], options: Options) -> Request:
    """Return the request for an evaluation of a run.

    Args:
        run: the run.
        tests: skill tests with their levels.
        options: the options.

    Raises:
        DraftError: there is no such checkpoint.
    """
    iteration, file = run.checkpoint(options.checkpoint)
    return Request(
        iteration=iteration,
        checkpoint=file_digest(file),
        robots=robots_digest(run.plan.members),
        arm=ARMS[options.errors is not None],
        errors=options.errors,
        protocol=options.protocol,
        replicas=options.replicas,
        seconds=options.seconds,
        settle=settle(options.seconds, () if options.protocol == "published" else tests),
        evaluation_seed=options.seed,
        levels={test.name: list(test.levels) for test in tests},
        **options.model_dump(include={*Extras.model_fields}),
    )


def result_folder(run: Run, request: Request, out: Path | None = None) -> Path:
    """Return the folder of a result.

    Args:
        run: the run.
        request: everything that determines the result.
        out: folder with one folder per run; None for the run's own folder.
    """
    units = {name: shown(field).unit for name, field in Extras.model_fields.items()}
    extras = [f"-{name}-{value:g}{units[name]}" for name, value in request.extras().items()]
    base = run.folder / FOLDER if out is None else out / run.folder.resolve().name
    base = base.with_name(base.name + "".join(extras))
    return base / f"{request.arm}-{request.protocol}"


def read(folder: Path) -> Summary | None:
    """Read the summary of a result; None if the result is missing or incomplete."""
    if not all((folder / name).is_file() for name in PARTS):
        return None
    try:
        summary = parse((folder / SUMMARY).read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return None
    return summary if summary.asked is not None else None


def summarise(
    run: Run,
    request: Request,
    tests: Sequence[SkillTest],
    worlds: Worlds,
    histograms: Histograms,
    **record: str | float,
) -> Summary:
    """Summarise roll-outs.

    Args:
        run: the run.
        request: everything that determines the result.
        tests: skill tests with their levels.
        worlds: the roll-outs.
        histograms: histograms of the joints' samples.
        record: `device`, `engine` and `took_s`.
    """
    members = run.plan.members
    reached = run.reached(request.iteration)
    notes = flags(tests, run.plan, request.iteration, reached)
    fastest = trained(SPEED, run.plan, request.iteration, reached)
    asked = request.as_dict()
    return Summary.model_validate(
        {
            "format": FORMAT,
            "design": members[0].name if len(members) == 1 else run.folder.resolve().name,
            "members": tuple(member.name for member in members),
            "stage": run.plan.stage,
            "seed": run.plan.seed,
            **{name: value for name, value in asked.items() if name != "levels"},
            "asked": request,
            "versions": versions(),
            **record,
            **_measured(members, request, worlds, histograms, notes, fastest),
            "flags": tuple(dict.fromkeys(notes)),
        }
    )


def save(folder: Path, summary: Summary, worlds: Worlds, histograms: Histograms) -> None:
    """Write a result, whole or not at all, replacing an older one.

    Raises:
        DraftError: it cannot be written, or pyarrow is missing.
    """
    arrow, parquet = need("pyarrow", "learn"), need("pyarrow.parquet", "learn")
    with new_folder(folder) as new:
        parquet.write_table(arrow.table(_world_columns(arrow, worlds)), new / WORLDS)
        parquet.write_table(arrow.table(_counts(histograms)), new / UTILISATION)
        parquet.write_table(arrow.table(_plane(histograms)), new / OCCUPANCY)
        write(new / SUMMARY, summary.text())


def _measured(
    members: Sequence[LeggedRobot],
    request: Request,
    worlds: Worlds,
    histograms: Histograms,
    notes: list[str],
    fastest: float,
) -> dict[str, Any]:
    """Numbers of one design, or curves over all and each design's own; adds to the flags."""
    if len(members) == 1:
        return _of_member(members[0], request, worlds, histograms, notes, fastest)
    by_member = {}
    for member in members:
        own: list[str] = []
        by_member[member.name] = _of_member(member, request, worlds, histograms, own, fastest)
        notes += [f"{member.name}: {text}" for text in own]
    names = by_member[members[0].name]["scalars"]
    return {
        "tests": curves(worlds, request.regeneration),
        "scalars": dict.fromkeys(names),
        "reasons": dict.fromkeys(names, _FAMILY),
        "by_member": by_member,
    }


def _of_member(
    member: LeggedRobot,
    request: Request,
    worlds: Worlds,
    histograms: Histograms,
    notes: list[str],
    fastest: float,
) -> dict[str, Any]:
    """Numbers of one design, as `Measured` takes them; adds to the flags."""
    of_member = curves(worlds.of(worlds.member == member.name), request.regeneration)
    add_energy(of_member, member, request.payload)
    add_heat(of_member, histograms, member)
    capabilities = scalars(of_member, member.leg_length, fastest)
    notes += capabilities.flags
    return {
        "leg_length": member.leg_length,
        "mass": member.mass,
        "top_speed_estimate": member.top_speed,
        "supply": supply_record(member),
        "tests": of_member,
        "scalars": capabilities.values,
        "reasons": capabilities.reasons,
        **utilisation(histograms, of_member, capabilities.values, member.name),
    }


def _world_columns(arrow: Any, worlds: Worlds) -> dict[str, Any]:
    """Columns of worlds.parquet; null where a column has no meaning."""
    columns = dict(vars(worlds))
    for name in _OF_WALKERS:
        columns[name] = arrow.array(columns[name], mask=worlds.fell)
    return columns


def _counts(histograms: Histograms) -> dict[str, np.ndarray]:
    """Columns of utilisation.parquet: bins that are not empty."""
    counts = histograms.counts
    group, joint, quantity, bin_ = np.nonzero(counts)
    return {
        **_groups(histograms, group, joint),
        "quantity": np.array(QUANTITIES)[quantity],
        "bin": bin_.astype(np.int32),
        "count": counts[group, joint, quantity, bin_],
    }


def _plane(histograms: Histograms) -> dict[str, np.ndarray]:
    """Columns of occupancy.parquet: cells that are not empty."""
    counts = histograms.plane
    group, joint, torque, speed = np.nonzero(counts)
    return {
        **_groups(histograms, group, joint),
        "torque": torque.astype(np.int32),
        "speed": speed.astype(np.int32),
        "count": counts[group, joint, torque, speed],
    }


def _groups(histograms: Histograms, group: np.ndarray, joint: np.ndarray) -> dict[str, np.ndarray]:
    """Columns with test, level, design and joint class of each row."""
    return {
        **{name: getattr(histograms, name)[group] for name in ("test", "level", "member")},
        "joint": np.array(histograms.classes)[joint],
    }
