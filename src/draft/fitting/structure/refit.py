"""Fit the structure trends to the parsed table and write the coefficients that the package ships.

`draft survey fit` or `python -m draft.fitting.structure.refit` rewrites the file; a test proves
that it is what this code gives.
"""

from __future__ import annotations

import json
from collections.abc import Collection, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

from draft import files
from draft.description.xmlfile import DescriptionError
from draft.errors import Location, Problem, suggest
from draft.fitting.structure import centres, feet, fits, holdout, whole
from draft.fitting.structure.attribution import Machine, machines
from draft.fitting.structure.published import classes, printed
from draft.fitting.structure.robots import robots as known
from draft.fitting.structure.rows import FILE as ROWS
from draft.fitting.structure.rows import read
from draft.laws.structure import FILE, Centre

SOURCE = (
    "fitted to draft/fitting/structure/data/segments.csv by the method of arXiv 2609.38405, "
    "structure trends; allometry as printed there"
)
SIZE = {"humanoid": "vertical span of the joint frames", "quadruped": "thigh + shank"}
FEWEST = 5


def structure_trends(rows: Path = ROWS, without: Collection[str] = ()) -> dict[str, Any]:
    """Fit every structure trend; the result is what the coefficients file holds.

    Args:
        rows: table of segments.
        without: keys of robots that are held out.

    Raises:
        DescriptionError: the table cannot be read, has fewer than five robots of a population, or
            none of a robot that is to be held out.
    """
    surveyed = machines(read(rows))
    for key in without:
        if key not in (keys := [robot.key for robot in surveyed]):
            cause = f"there is no robot '{key}' to hold out"
            raise DescriptionError(
                Problem(cause, Location(str(rows)), suggest(key, keys, "robots"))
            )
    surveyed = [robot for robot in surveyed if robot.key not in without]
    people = {name: [robot for robot in surveyed if robot.population == name] for name in SIZE}
    for name, own in people.items():
        if len(own) < FEWEST:
            cause = f"{len(own)} {name}s are too few to fit"
            raise DescriptionError(Problem(cause, Location(str(rows)), f"at least {FEWEST}"))
    table: dict[str, Any] = {"source": SOURCE}
    for name, own in people.items():
        table[name] = _population(name, own)
    table["quadruped"]["end"] = feet.density([f for f in feet.feet() if f.key not in without])
    across = holdout.across(people["humanoid"], people["quadruped"], holdout.published)
    table["quadruped"]["held_out"]["by_humanoid_trends"] = across.fold
    return _rounded(table)


def write(rows: Path = ROWS, file: Path = FILE, without: Collection[str] = ()) -> None:
    """Write the coefficients file, whole or not at all.

    Raises:
        DraftError: as `structure_trends`, and where it cannot be written.
    """
    table = structure_trends(rows, without)
    files.write(file, json.dumps(table, indent=2) + "\n")


def _population(name: str, robots: Sequence[Machine]) -> dict[str, Any]:
    paper = fits.structure(robots)
    low, middle, high = holdout.spread(robots)
    density, n = fits.trunk_density(robots)
    segments: dict[str, dict[str, Any]] = {kind: asdict(law) for kind, law in paper.fits.items()}
    for kind, centre in measured_centres(robots).items():
        if kind in segments and kind in centres.TRENDS:
            segments[kind]["centre"] = asdict(centre)
    shown = [kind for kind in classes(name) if kind in segments]
    torso = fits.usable_rows(robots).get("torso", [])
    lengths = [piece.row.length for piece in torso]
    return {
        "segments": {kind: segments[kind] for kind in shown},
        "unprinted_segments": {
            kind: law for kind, law in sorted(segments.items()) if kind not in shown
        },
        "trunk": {"density": density, "n": n, "fold": fits.trunk_fold(robots)},
        "trunks": {
            kind: {"density": paper.densities[kind], "n": paper.counts[kind]}
            for kind in fits.TRUNKS
            if paper.counts[kind]
        },
        "torso_range": [min(lengths), max(lengths)] if lengths else None,
        "other": asdict(fits.other(robots)),
        "whole": {**asdict(whole.fit(robots)), "size": "thigh + shank"},
        "allometry": {
            **{
                figure: float(text)
                for figure, text in printed(name, "allometry").items()
                if figure != "n"
            },
            "size": SIZE[name],
            "n": int(printed(name, "allometry")["n"]),
        },
        "actuator_share": {"median": middle, "p10": low, "p90": high},
        "held_out": _scores(robots),
    }


def measured_centres(robots: Sequence[Machine]) -> dict[str, Centre]:
    """Structural centres of one population's classes, shipped or not."""
    makers = {robot.key: maker for robot, maker in zip(robots, _makers(robots), strict=True)}
    return centres.centres(robots, makers)


def _scores(robots: Sequence[Machine]) -> dict[str, float | int]:
    """Fold errors of total mass, robots (or all of a maker's robots) held out."""
    return {
        "n": len(robots),
        "paper": holdout.leave_one_out(robots, holdout.published).fold,
        "draft": holdout.leave_one_out(robots, whole.by_legs).fold,
        "median_alone": holdout.leave_one_out(robots, holdout.population_median).fold,
        "paper_maker_out": holdout.leave_group_out(robots, _makers(robots), holdout.published).fold,
        "draft_maker_out": holdout.leave_group_out(robots, _makers(robots), whole.by_legs).fold,
    }


def _makers(robots: Sequence[Machine]) -> list[str]:
    table = known()
    return [table[robot.key].maker if robot.key in table else robot.key for robot in robots]


def _rounded(value: Any) -> Any:
    """Ten digits, so that the file does not depend on the last bit of a library."""
    if isinstance(value, float):
        return float(f"{value:.10g}")
    if isinstance(value, dict):
        return {key: _rounded(item) for key, item in value.items()}
    if isinstance(value, (list, tuple)):
        return [_rounded(item) for item in value]
    return value


if __name__ == "__main__":
    write()
