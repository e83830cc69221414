"""Laws of what a machine can sustain, fitted to shipped tables of public data.

The tables are in `draft/fitting/data`; each row names its source. Every law is scored on a module,
vendor or robot that it was not fitted to. `write` writes the file of coefficients, and a test
proves that it is what this code gives.
"""

from __future__ import annotations

import csv
import math
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from draft.fitting import coefficients, scores
from draft.fitting.least_squares import least_squares
from draft.laws.catalogue import catalogue
from draft.laws.law import Law, Term
from draft.laws.limits import FILE
from draft.values import Array

DATA = Path(__file__).resolve().parent / "data"
STALL, CONTINUOUS = "stall", "continuous"
Fit = Callable[[Array, Array], Term]


class Points(NamedTuple):
    """Points that a law is fitted to: inputs and outputs, shape (n,), and what is held out."""

    x: Array
    y: Array
    group: Sequence[str]


def laws() -> dict[str, Law]:
    """Fit every law."""
    overload, corners, batteries, standing = (
        table(name)
        for name in ("overload_times", "torque_speed_corners", "legged_batteries", "standing_power")
    )
    stall_share = _stall_share(overload)
    share = stall_share.coefficient
    heat = "time = {:.4g} excess_heat^{:.3f}, excess_heat = (torque / continuous torque)^2 - 1"
    return {
        "stalled": fitted_law(
            "stalled",
            "s",
            heat + ", stalled: continuous = " + f"{share:.3f} rated",
            ("excess_heat", "1"),
            _overload(overload, stalled=True, share=share),
            power_law,
            ("module", "draft/fitting/data/overload_times.csv"),
        ),
        "rotating": fitted_law(
            "rotating",
            "s",
            heat + ", turning: continuous = rated",
            ("excess_heat", "1"),
            _overload(overload, stalled=False, share=1.0),
            power_law,
            ("module", "draft/fitting/data/overload_times.csv"),
        ),
        "stall_share": stall_share,
        "corner": fitted_law(
            "corner",
            "rad/s",
            "corner_speed = {:.3f} no_load_speed",
            ("no_load_speed", "rad/s"),
            _columns(corners, "no_load_speed_rad_s", "corner_speed_rad_s", _vendor, "use_in_stats"),
            _median_ratio,
            ("vendor", "draft/fitting/data/torque_speed_corners.csv"),
        ),
        "specific_energy": fitted_law(
            "specific_energy",
            "Wh",
            "energy = {:.4g} battery mass",
            ("battery_mass", "kg"),
            _columns(batteries, "battery_mass_kg", "battery_energy_wh", _maker),
            _median_ratio,
            ("maker", "draft/fitting/data/legged_batteries.csv"),
        ),
        "battery_share": fitted_law(
            "battery_share",
            "kg",
            "battery mass = {:.4g} robot mass",
            ("robot_mass", "kg"),
            _columns(batteries, "robot_mass_kg", "battery_mass_kg", _maker),
            _median_ratio,
            ("maker", "draft/fitting/data/legged_batteries.csv"),
        ),
        "energy_share": fitted_law(
            "energy_share",
            "Wh",
            "energy = {:.4g} robot mass",
            ("robot_mass", "kg"),
            _columns(batteries, "robot_mass_kg", "battery_energy_wh", _maker),
            _median_ratio,
            ("maker", "draft/fitting/data/legged_batteries.csv"),
        ),
        "electronics_power": fitted_law(
            "electronics_power",
            "W",
            "power of electronics = {:.4g} robot mass",
            ("robot_mass", "kg"),
            _columns(standing, "robot_mass_kg", "standing_power_w", _maker),
            _median_ratio,
            ("maker", "draft/fitting/data/standing_power.csv"),
        ),
    }


def write(path: Path = FILE) -> None:
    """Write the file of coefficients; errors as `draft.files.write`."""
    coefficients.write(path, records())


def records() -> dict[str, Any]:
    """Content of the file of coefficients."""
    return coefficients.rounded({name: law.record() for name, law in laws().items()})


def table(name: str) -> list[dict[str, str]]:
    """Rows of a shipped table of `draft/fitting/data`."""
    with (DATA / f"{name}.csv").open(newline="", encoding="utf-8") as file:
        return list(csv.DictReader(file))


def _columns(
    rows: list[dict[str, str]],
    x: str,
    y: str,
    group: Callable[[dict[str, str]], str],
    flag: str = "",
) -> Points:
    """Rows that state both columns, without those that the table excludes from statistics."""
    used = [row for row in rows if row[x] and row[y] and (not flag or row[flag] == "yes")]
    return Points(
        np.array([float(row[x]) for row in used]),
        np.array([float(row[y]) for row in used]),
        [group(row) for row in used],
    )


def _vendor(row: dict[str, str]) -> str:
    return row["name"].split()[0]


def _maker(row: dict[str, str]) -> str:
    return row["robot"].split()[0]


def _stall_share(rows: list[dict[str, str]]) -> Law:
    """Torque that a stalled module holds without end, over its rated torque in the catalogue."""
    held = [r for r in rows if r["condition"] == STALL and r["time_s"] == CONTINUOUS]
    points = Points(
        np.array([_rated(row["name"]) for row in held]),
        np.array([float(row["torque_nm"]) for row in held]),
        [row["name"] for row in held],
    )
    formula = "continuous torque at stall = {:.3f} rated_torque"
    inputs = ("rated_torque", "N m")
    source = ("module", "draft/fitting/data/overload_times.csv")
    return fitted_law("stall_share", "N m", formula, inputs, points, _median_ratio, source)


def _overload(rows: list[dict[str, str]], stalled: bool, share: float) -> Points:
    """Excess heat of each torque above the continuous one, and the time that it is held [s].

    The continuous torque is a share of the rated torque of the catalogue, as for a module of which
    no more is known. The stall tests of MyActuator do not end at a common temperature: not used.
    """
    x, y, group = [], [], []
    for row in rows:
        condition = row["condition"]
        fits = condition == STALL if stalled else condition.startswith("rotating")
        if not fits or row["time_s"] == CONTINUOUS:
            continue
        heat = (float(row["torque_nm"]) / (share * _rated(row["name"]))) ** 2 - 1
        if heat > 0:
            x.append(heat)
            y.append(float(row["time_s"]))
            group.append(row["name"])
    return Points(np.array(x), np.array(y), group)


def _rated(name: str) -> float:
    rated = catalogue()[name].rated_torque
    return math.nan if rated is None else rated


def power_law(x: Array, y: Array) -> Term:
    """Power law of least squares of the logarithms."""
    intercept, slope = least_squares(np.log(x)[:, None], np.log(y))
    return Term(float(np.exp(intercept)), (float(slope),))


def _median_ratio(x: Array, y: Array) -> Term:
    return Term(float(np.exp(np.median(np.log(y / x)))), (1.0,))


def fitted_law(
    name: str,
    unit: str,
    formula: str,
    inputs: tuple[str, str],
    points: Points,
    fit: Fit,
    held: tuple[str, str],
    page: str = "docs/limits.md",
) -> Law:
    """A fitted law; its errors and bands are those of held-out groups.

    Args:
        name: its name.
        unit: its SI unit.
        formula: text with places for the factor and the exponent.
        inputs: name and unit of the input.
        points: what it is fitted to.
        fit: the fit.
        held: what is held out, and the table of the points.
        page: page of the docs.
    """
    x, y, group = points
    term = fit(x, y)
    own = np.log(y / term([x]))
    labels = np.array(group)
    errors = np.full(len(y), np.nan)
    for label in np.unique(labels):
        out = labels == label
        errors[out] = np.log(y[out] / fit(x[~out], y[~out])([x[out]]))
    kind, table = held
    return Law(
        name=name,
        unit=unit,
        formula=formula.format(term.factor, *term.exponents),
        inputs=(inputs[0],),
        input_units=(inputs[1],),
        terms=(term,),
        n=len(y),
        ranges={inputs[0]: (float(x.min()), float(x.max()))},
        held_out={kind: scores.fold_error(errors)},
        source=f"{table}; {page}",
        fold=scores.fold_error(own),
        fold_50=scores.fold(errors, 0.5),
        fold_90=scores.fold(errors, 0.9),
    )
