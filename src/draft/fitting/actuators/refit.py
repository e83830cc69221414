"""Fit the actuator trends to the catalogue and write the coefficients that the package ships.

`draft trends fit` rewrites the file; a test proves that it is what this code gives.
"""

from __future__ import annotations

import json
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np

from draft import files
from draft.fitting import scores
from draft.fitting.actuators import holdout
from draft.fitting.actuators.recipes import SETS, Logs, Recipe, fit_all, predict_all
from draft.fitting.actuators.rows import Rows, rows_of
from draft.laws.actuators import FILE
from draft.laws.catalogue import Part, catalogue
from draft.laws.law import Term

SOURCES = {
    "draft": "fitted to the catalogue's modules; forms of docs/actuator-trends.md",
    "paper": "fitted to the catalogue's modules; forms of arXiv 2609.38405, actuator trends",
}
# Quantities that follow from others, and how.
DERIVED = {
    "radius": ("m", "r = (V / (2 pi a))^(1/3)"),
    "length": ("m", "l = 2 a r"),
    "rotor_inertia_of_size": ("kg m2", "rotor_inertia at the module's own sizes"),
}
_FRACTIONS = {1 / 3: "(1/3)", 0.5: "(1/2)", -0.5: "(-1/2)", 0.75: "(3/4)"}


def actuator_trends(parts: Iterable[Part] | None = None) -> dict[str, Any]:
    """Fit both sets of laws; the result is what the coefficients file holds.

    Args:
        parts: the catalogue; the shipped one where None.
    """
    rows = rows_of(catalogue().values() if parts is None else parts)
    return {name: _fit_set(name, recipes, rows) for name, recipes in SETS.items()}


def write(path: Path = FILE, trends: dict[str, Any] | None = None) -> None:
    """Write a coefficients file, whole or not at all; errors as `draft.files.write`."""
    text = json.dumps(actuator_trends() if trends is None else trends, indent=1)
    files.write(path, text + "\n")


def _fit_set(name: str, recipes: tuple[Recipe, ...], rows: Rows) -> dict[str, Any]:
    everything = np.ones(len(rows.name), dtype=bool)
    fits = fit_all(recipes, rows, everything, rows.geared)
    predicted = {
        "in_sample": predict_all(recipes, fits, rows, everything),
        "leave_one_out": holdout.held_out(recipes, rows, range(len(rows.name))),
        "leave_one_vendor_out": holdout.held_out(recipes, rows, rows.vendor, mass_from_all=True),
        "leave_one_family_out": holdout.held_out(recipes, rows, rows.family),
    }
    errors = {how: holdout.errors(rows, said) for how, said in predicted.items()}
    covered = holdout.coverage(recipes, rows)
    laws: dict[str, Any] = {}
    for recipe in recipes:
        law = _law(recipe, fits[recipe.quantity], rows)
        laws[recipe.quantity] = law | _scores(recipe.quantity, rows, errors, covered)
    for quantity, (unit, formula) in DERIVED.items():
        law = {"unit": unit, "formula": formula, "inputs": [], "terms": [], "reciprocal": False}
        laws[quantity] = law | {"ranges": {}} | _scores(quantity, rows, errors, covered)
    for law in laws.values():
        law["source"] = SOURCES[name]
    vendor_out = errors["leave_one_vendor_out"]
    return {"laws": laws, "correlation": _correlation(recipes, vendor_out)}


def _law(recipe: Recipe, terms: tuple[Term, ...], rows: Rows) -> dict[str, Any]:
    used = rows.geared & rows.has(recipe.quantity, *recipe.inputs)
    ranges = {x: np.exp(rows.log[x][used]) for x in recipe.inputs}
    return {
        "unit": recipe.unit,
        "formula": f"{recipe.quantity} = {_formula(recipe, terms)}",
        "inputs": list(recipe.inputs),
        "terms": [
            {"factor": _digits(t.factor), "exponents": [_digits(e) for e in t.exponents]}
            for t in terms
        ],
        "reciprocal": recipe.reciprocal,
        "ranges": {x: [_digits(v.min()), _digits(v.max())] for x, v in ranges.items()},
    }


def _formula(recipe: Recipe, terms: tuple[Term, ...]) -> str:
    written = []
    for term in terms:
        words = [f"{term.factor:.4g}"]
        for name, exponent in zip(recipe.inputs, term.exponents, strict=True):
            if exponent == 1:
                words.append(name)
            elif exponent != 0:
                whole = f"{exponent:g}" if exponent == round(exponent) else f"{exponent:.3f}"
                words.append(f"{name}^{_FRACTIONS.get(exponent, whole)}")
        written.append(" ".join(words))
    text = " + ".join(written)
    return f"1 / ({text})" if recipe.reciprocal else text


def _scores(
    quantity: str,
    rows: Rows,
    errors: dict[str, Logs],
    covered: dict[tuple[str, float], holdout.Coverage],
) -> dict[str, Any]:
    """In-sample and held-out scores of a quantity, and its bands."""
    inside = errors["in_sample"][quantity]
    known = ~np.isnan(inside)
    published = rows.log[quantity.removesuffix("_of_size")][known]
    # The rotor's fit is judged where it is made, at the modules' own sizes.
    if quantity == "rotor_inertia":
        inside = errors["in_sample"]["rotor_inertia_of_size"]
    vendor_out = errors["leave_one_vendor_out"][quantity]
    record: dict[str, Any] = {
        "n": int(known.sum()),
        "r_squared": _digits(scores.r_squared(inside[known], published)),
    }
    for how in ("leave_one_out", "leave_one_vendor_out", "leave_one_family_out"):
        record[how] = _digits(scores.fold_error(errors[how][quantity]))
    for share in holdout.SHARES:
        record[f"fold_{share * 100:.0f}"] = _digits(scores.fold(vendor_out, share))
        record[f"coverage_{share * 100:.0f}"] = _digits(covered[quantity, share].overall)
    return record


def _correlation(recipes: tuple[Recipe, ...], errors: Logs) -> dict[str, Any]:
    """Correlation of the laws' own errors over modules of held-out vendors."""
    names = [recipe.quantity for recipe in recipes]
    columns = [errors.get(f"{name}_of_size", errors[name]) for name in names]
    known = ~np.isnan(np.sum(columns, axis=0))
    matrix = np.atleast_2d(np.corrcoef([column[known] for column in columns]))
    return {"quantities": names, "matrix": [[_digits(x) for x in row] for row in matrix]}


def _digits(value: float) -> float:
    return float(f"{value:.10g}")
