"""Fit of the structure trends to the table of segments, and the coefficients file of Draft.

`draft survey fit` and `python -m draft.fitting.structure.survey_refit` write the file; a test
checks that the shipped one is reproduced.
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
from draft.fitting.structure import calibrated, centres, feet, fits, whole
from draft.fitting.structure import survey_holdout as holdout
from draft.fitting.structure.attribution import Machine, Piece, machines
from draft.fitting.structure.robots import robots as known
from draft.fitting.structure.survey_published import classes, printed
from draft.laws.law import Law, Term
from draft.laws.structure import FILE, USES, Centre
from draft.laws.survey import FILE as ROWS
from draft.laws.survey import read
from draft.values import Array

SOURCE = f"{fits.SOURCE}; allometry from its released data"
RELEASED = "released data of arXiv 2609.38405, structure trends"
SIZE = {"humanoid": "vertical span of the joint frames", "quadruped": whole.SIZE}
FEWEST = 5
Fitter = Callable[[Array, Array], Array]


def structure_trends(
    rows: Path = ROWS, without: Collection[str] = (), of: Collection[str] = tuple(SIZE)
) -> dict[str, Any]:
    """Fit every structure trend; returns the content of the coefficients file.

    Args:
        rows: table of segments.
        without: keys of robots that are held out.
        of: populations whose trends are fitted; the ends of limbs have one law for all.

    Raises:
        DescriptionError: the table cannot be read, has fewer than five robots of a population, or
            lacks a robot that is to be held out.
    """
    surveyed = machines(read(rows))
    for key in without:
        if key not in (keys := [robot.key for robot in surveyed]):
            cause = f"there is no robot '{key}' to hold out"
            raise DescriptionError(
                Problem(cause, Location(str(rows)), suggest(key, keys, "robots"))
            )
    surveyed = [robot for robot in surveyed if robot.key not in without]
    populations = {name: [robot for robot in surveyed if robot.population == name] for name in SIZE}
    for name, robots in populations.items():
        if len(robots) < FEWEST:
            cause = f"{len(robots)} {name}s are too few to fit"
            raise DescriptionError(Problem(cause, Location(str(rows)), f"at least {FEWEST}"))
    table: dict[str, Any] = {"source": SOURCE}
    for name, robots in populations.items():
        table[name] = _population(name, robots) if name in of else {}
    known_feet = [foot for foot in feet.feet() if foot.used and foot.key not in without]
    keys = [foot.key for foot in known_feet]
    end = _held_out(feet.fit(known_feet), *feet.columns(known_feet), keys, fits.proportional)
    table["quadruped"]["end"] = {**end.record(), **feet.quartiles(known_feet)}
    if "quadruped" in of:
        people, quadrupeds = populations["humanoid"], populations["quadruped"]
        across = holdout.across(people, quadrupeds, holdout.published)
        table["quadruped"]["held_out"]["by_humanoid_trends"] = across.fold
    return rounded(table)


def write(
    rows: Path = ROWS,
    file: Path = FILE,
    uses: str | None = None,
) -> None:
    """Write the coefficients file atomically.

    Args:
        rows: table of segments.
        file: file to write.
        uses: law of the trunk of robots with this file; None for the shipped file, where each robot
            names its own.

    Raises:
        DraftError: as `structure_trends`, or the file cannot be written.
    """
    table = structure_trends(rows)
    coefficients.write(file, table if uses is None else {USES: uses, **table})


def _population(name: str, robots: Sequence[Machine]) -> dict[str, object]:
    """Record of the trends of one population."""
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
        "calibrated": calibrated.fit(robots).record(),
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
    """Record of the law of a class, with constant mass per metre outside its range."""
    keys = [piece.row.robot for piece in pieces]
    scored = _held_out(law, *fits.columns(pieces), keys, by)
    return replace(scored, beyond="proportional").record()


def _trunk(robots: Sequence[Machine]) -> Law:
    """Fit the mass of trunks, proportional to volume."""
    pieces = fits.solid(fits.trunks(robots))
    volume = np.array([piece.row.box_volume for piece in pieces])
    mass = np.array([piece.structure for piece in pieces])
    law = fits.law("trunk", fits.proportional(volume[:, None], mass), volume, mass, fits.VOLUME)
    return _held_out(law, volume, mass, [piece.row.robot for piece in pieces], fits.proportional)


def _allometry(name: str) -> Law:
    """Law of the mass of a whole robot over its size, from the released data; not fitted here."""
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
        source=RELEASED,
        sigma_log=figures["sigma_log"],
    )


def _held_out(law: Law, x: Array, mass: Array, keys: Sequence[str], by: Fitter) -> Law:
    """Law with its fold errors on held-out robots and makers.

    Rows without enough others to fit to are skipped; an error without any row is omitted.

    Args:
        law: the law.
        x: its input, shape (n,).
        mass: mass that it predicts [kg], shape (n,).
        keys: robot of each row.
        by: function that fits it.
    """
    table = known()
    makers = [table[key].maker if key in table else key for key in keys]
    errors = {
        key: np.log(mass / least_squares.leave_group_out(x[:, None], mass, groups, by))
        for key, groups in (("robot", keys), ("maker", makers))
    }
    scores = {key: fold_error(error) for key, error in errors.items() if np.isfinite(error).any()}
    return replace(law, held_out=scores)


def measured_centres(robots: Sequence[Machine]) -> dict[str, Centre]:
    """Structural centres of the classes of one population, shipped or not."""
    makers = {robot.key: maker for robot, maker in zip(robots, _makers(robots), strict=True)}
    return centres.centres(robots, makers)


def _scores(robots: Sequence[Machine]) -> dict[str, float | int]:
    """Fold errors of total mass on held-out robots and makers."""
    methods = {
        "paper": holdout.published,
        "draft": whole.by_legs,
        "calibrated": calibrated.by_both,
    }
    makers = _makers(robots)
    return {
        "n": len(robots),
        **{key: holdout.leave_one_out(robots, method).fold for key, method in methods.items()},
        "median_alone": holdout.leave_one_out(robots, holdout.population_median).fold,
        **{
            f"{key}_maker_out": holdout.leave_group_out(robots, makers, method).fold
            for key, method in methods.items()
        },
    }


def _makers(robots: Sequence[Machine]) -> list[str]:
    table = known()
    return [table[robot.key].maker if robot.key in table else robot.key for robot in robots]


if __name__ == "__main__":
    write()
