"""Fit the structure trends to the parsed table and write the coefficients that the package ships.

`draft survey fit` or `python -m draft.fitting.structure.refit` rewrites the file; a test proves
that it is what this code gives.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

import numpy as np

from draft.description.xmlfile import DescriptionError
from draft.errors import Location, Problem, suggest
from draft.fitting import coefficients, least_squares
from draft.fitting.coefficients import rounded
from draft.fitting.scores import fold_error
from draft.fitting.structure import centres, feet, fits, holdout, whole
from draft.fitting.structure.attribution import Machine, Piece, machines
from draft.fitting.structure.published import classes, printed
from draft.fitting.structure.robots import robots as known
from draft.fitting.structure.rows import FILE as ROWS
from draft.fitting.structure.rows import read
from draft.laws.law import Law, Term
from draft.laws.structure import FILE, Centre
from draft.values import Array

SOURCE = f"{fits.SOURCE}; allometry as printed there"
PRINTED = "as printed in arXiv 2609.38405, structure trends"
SIZE = {"humanoid": "vertical span of the joint frames", "quadruped": whole.SIZE}
FEWEST = 5
Fitter = Callable[[Array, Array], Array]


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
    known_feet = [foot for foot in feet.feet() if foot.used and foot.key not in without]
    keys = [foot.key for foot in known_feet]
    end = _held_out(feet.fit(known_feet), *feet.columns(known_feet), keys, fits.proportional)
    table["quadruped"]["end"] = {**end.record(), **feet.quartiles(known_feet)}
    across = holdout.across(people["humanoid"], people["quadruped"], holdout.published)
    table["quadruped"]["held_out"]["by_humanoid_trends"] = across.fold
    return rounded(table)


def write(rows: Path = ROWS, file: Path = FILE, without: Collection[str] = ()) -> None:
    """Write the coefficients file, whole or not at all.

    Raises:
        DraftError: as `structure_trends`, and where it cannot be written.
    """
    coefficients.write(file, structure_trends(rows, without))


def _population(name: str, robots: Sequence[Machine]) -> dict[str, Any]:
    paper = fits.structure(robots)
    low, middle, high = holdout.spread(robots)
    rows = fits.usable_rows(robots)
    segments = {kind: _segment(law, rows[kind]) for kind, law in paper.fits.items()}
    for kind, centre in measured_centres(robots).items():
        if kind in segments and kind in centres.TRENDS:
            segments[kind]["centre"] = asdict(centre)
    shown = [kind for kind in classes(name) if kind in segments]
    lengths = [piece.row.length for piece in rows.get("torso", [])]
    limbs = [piece for pieces in fits.limbs(robots).values() for piece in pieces]
    keys = [robot.key for robot in robots]
    leg = _held_out(whole.fit(robots), *whole.columns(robots), keys, least_squares.fit)
    return {
        "segments": {kind: segments[kind] for kind in shown},
        "unprinted_segments": {
            kind: law for kind, law in sorted(segments.items()) if kind not in shown
        },
        "trunk": _trunk(robots).record(),
        "trunks": {
            kind: {"density": paper.densities[kind], "n": paper.counts[kind]}
            for kind in fits.TRUNKS
            if paper.counts[kind]
        },
        "torso_range": [min(lengths), max(lengths)] if lengths else None,
        "other": _segment(fits.other(robots), limbs, fits.proportional),
        "whole": leg.record(),
        "allometry": _allometry(name).record(),
        "actuator_share": {"median": middle, "p10": low, "p90": high},
        "held_out": _scores(robots),
    }


def _segment(law: Law, pieces: Sequence[Piece], by: Fitter = fits.growing) -> dict[str, Any]:
    """Record of a class's law, which holds the mass per metre of its edges."""
    keys = [piece.row.robot for piece in pieces]
    scored = _held_out(law, *fits.columns(pieces), keys, by)
    return replace(scored, beyond="proportional").record()


def _trunk(robots: Sequence[Machine]) -> Law:
    """Mass of the trunk that a designer means over its volume."""
    pieces = fits.solid(fits.trunks(robots))
    volume = np.array([piece.row.box_volume for piece in pieces])
    mass = np.array([piece.structure for piece in pieces])
    law = fits.law("trunk", fits.proportional(volume[:, None], mass), volume, mass, fits.VOLUME)
    return _held_out(law, volume, mass, [piece.row.robot for piece in pieces], fits.proportional)


def _allometry(name: str) -> Law:
    """Mass of a whole robot over its size, as printed: the sizes behind it are not."""
    figures = {figure: float(text) for figure, text in printed(name, "allometry").items()}
    factor, exponent = figures["coefficient"], figures["exponent"]
    return Law(
        name="allometry",
        unit="kg",
        formula=f"m = {factor:g} L^{exponent:g}, L = {SIZE[name]}",
        inputs=("size",),
        input_units=("m",),
        terms=(Term(factor, (exponent,)),),
        n=int(figures["n"]),
        ranges={},
        held_out={},
        source=PRINTED,
        sigma_log=figures["sigma_log"],
    )


def _held_out(law: Law, x: Array, mass: Array, keys: Sequence[str], by: Fitter) -> Law:
    """A law with its fold errors on rows whose robot, and whose maker, is held out.

    Rows without enough others to fit to do not count; an error that no row has is left out.

    Args:
        law: the law.
        x: its input, shape (n,).
        mass: what it gives, shape (n,).
        keys: the robot of each row.
        by: how it is fitted.
    """
    table = known()
    makers = [table[key].maker if key in table else key for key in keys]
    errors = {
        how: np.log(mass / least_squares.leave_group_out(x[:, None], mass, groups, by))
        for how, groups in (("robot", keys), ("maker", makers))
    }
    scored = {how: fold_error(e) for how, e in errors.items() if np.isfinite(e).any()}
    return replace(law, held_out=scored)


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


if __name__ == "__main__":
    write()
