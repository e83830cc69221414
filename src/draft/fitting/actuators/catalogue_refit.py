"""Fit of the actuator trends to the catalogue, and the coefficients file that Draft ships.

`draft trends fit` writes the file; a test checks that the shipped one is reproduced.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from draft.fitting import coefficients, scores
from draft.fitting.actuators import catalogue_holdout as holdout
from draft.fitting.actuators.catalogue_rows import Rows, rows_of
from draft.fitting.actuators.recipes import SETS, Logs, Recipe, fit_all, predict_all
from draft.laws.actuators import FILE, RATED
from draft.laws.catalogue import Part, catalogue
from draft.laws.law import Law, Term
from draft.laws.quantities import QUANTITIES

SOURCES = {
    "draft": "fitted to the catalogue's modules; forms of docs/actuator-trends.md",
    "paper": "fitted to the catalogue's modules; forms of arXiv 2609.38405, actuator trends",
}
# Formula of quantities that follow from others.
DERIVED = {
    "radius": "r = (V / (2 pi a))^(1/3)",
    "length": "l = 2 a r",
    "rotor_inertia_of_size": "rotor_inertia at the module's own sizes",
}
# Least number of vendors for a band that is itself set on vendors held out.
_VENDORS = 3
_FRACTIONS = {1 / 3: "(1/3)", 0.5: "(1/2)", -0.5: "(-1/2)", 0.75: "(3/4)"}


def actuator_trends(parts: Iterable[Part] | None = None) -> dict[str, Any]:
    """Fit both sets of laws; returns the content of the coefficients file.

    Args:
        parts: the catalogue; the shipped one where None.
    """
    rows = rows_of(catalogue().values() if parts is None else parts)
    return {name: fit_set(name, recipes, rows, SOURCES[name]) for name, recipes in SETS.items()}


def write(path: Path = FILE, trends: Mapping[str, object] | None = None) -> None:
    """Write a coefficients file atomically; errors as `draft.files.write`."""
    coefficients.write(path, actuator_trends() if trends is None else trends)


def fit_set(name: str, recipes: tuple[Recipe, ...], rows: Rows, origin: str) -> dict[str, object]:
    """Fit a set of laws; returns its record for a coefficients file.

    Args:
        name: name of the set.
        recipes: the laws.
        rows: the modules.
        origin: source of laws whose recipe states none.
    """
    recipes = tuple(recipe for recipe in recipes if _fittable(recipe, rows))
    everything = np.ones(len(rows.name), dtype=bool)
    fits = fit_all(recipes, rows, everything, rows.geared)
    held_out = {
        "row": holdout.held_out(recipes, rows, range(len(rows.name))),
        "vendor": holdout.held_out(recipes, rows, rows.vendor, mass_from_all=True),
        "family": holdout.held_out(recipes, rows, rows.family),
    }
    errors = {key: holdout.errors(rows, predicted) for key, predicted in held_out.items()}
    in_sample = holdout.errors(rows, predict_all(recipes, fits, rows, everything))
    covered = holdout.coverage(recipes, rows)
    laws = [_law(recipe, fits[recipe.quantity], rows) for recipe in recipes]
    for quantity, formula in DERIVED.items():
        if quantity not in in_sample:
            continue
        unit = QUANTITIES[quantity.removesuffix("_of_size")].unit
        laws.append(Law(quantity, unit, formula, (), (), (), 0, {}, {}, ""))
    sources = {recipe.quantity: recipe.source for recipe in recipes if recipe.source}
    records = {}
    for law in laws:
        scored = _scored(law, rows, in_sample, errors, covered)
        source = sources.get(law.name, origin)
        records[law.name] = replace(scored, source=source).record()
    correlation = _correlation(recipes, errors["vendor"])
    return coefficients.rounded({"laws": records, "correlation": correlation})


def _fittable(recipe: Recipe, rows: Rows) -> bool:
    """Whether the rows suffice for a law: a rated torque needs three vendors to hold out."""
    known = rows.geared & rows.has(recipe.quantity, *recipe.inputs)
    vendors = {vendor for vendor, has in zip(rows.vendor, known, strict=True) if has}
    return recipe.quantity not in RATED or len(vendors) >= _VENDORS


def _law(recipe: Recipe, terms: tuple[Term, ...], rows: Rows) -> Law:
    """Law without its scores."""
    used = rows.geared & rows.has(recipe.quantity, *recipe.inputs)
    values = {x: np.exp(rows.log[x][used]) for x in recipe.inputs}
    return Law(
        name=recipe.quantity,
        unit=recipe.unit,
        formula=f"{recipe.quantity} = {_formula(recipe, terms)}",
        inputs=recipe.inputs,
        input_units=tuple(QUANTITIES[x].unit for x in recipe.inputs),
        terms=terms,
        n=0,
        ranges={x: (float(v.min()), float(v.max())) for x, v in values.items()},
        held_out={},
        source="",
        reciprocal=recipe.reciprocal,
    )


def _formula(recipe: Recipe, terms: tuple[Term, ...]) -> str:
    products = []
    for term in terms:
        factors = [f"{term.factor:.4g}"]
        for name, exponent in zip(recipe.inputs, term.exponents, strict=True):
            if exponent == 1:
                factors.append(name)
            elif exponent != 0:
                decimal = f"{exponent:g}" if exponent == round(exponent) else f"{exponent:.3f}"
                factors.append(f"{name}^{_FRACTIONS.get(exponent, decimal)}")
        products.append(" ".join(factors))
    text = " + ".join(products)
    return f"1 / ({text})" if recipe.reciprocal else text


def _scored(
    law: Law,
    rows: Rows,
    in_sample: Logs,
    errors: dict[str, Logs],
    covered: dict[tuple[str, float], holdout.Coverage],
) -> Law:
    """Law with its in-sample and held-out scores, and its bands."""
    quantity = law.name
    known = ~np.isnan(in_sample[quantity])
    # The in-sample score of the rotor's law is at the modules' own sizes, to which it is fitted.
    own = "rotor_inertia_of_size" if quantity == "rotor_inertia" else quantity
    inside = in_sample[own][known]
    vendor_out = errors["vendor"][quantity]
    return replace(
        law,
        n=int(known.sum()),
        held_out={key: scores.fold_error(error[quantity]) for key, error in errors.items()},
        fold=scores.fold_error(inside),
        r_squared=scores.r_squared(inside, rows.log[quantity.removesuffix("_of_size")][known]),
        fold_50=scores.fold(vendor_out, 0.5),
        fold_90=scores.fold(vendor_out, 0.9),
        coverage_50=covered[quantity, 0.5].overall,
        coverage_90=covered[quantity, 0.9].overall,
    )


def _correlation(recipes: tuple[Recipe, ...], errors: Logs) -> dict[str, object]:
    """Correlation of the errors of the laws over modules of held-out vendors.

    Rated torques are known for fewer modules: each of their pairs is over the modules that have
    both, and 0 for the two kinds of rated torque, which no module has.
    """
    names = [recipe.quantity for recipe in recipes]
    columns = {name: errors.get(f"{name}_of_size", errors[name]) for name in names}
    known = ~np.isnan(np.sum([columns[name] for name in names if name not in RATED], axis=0))
    matrix = np.eye(len(names))
    for i, a in enumerate(names):
        for k, b in enumerate(names[:i]):
            both = known
            if a in RATED or b in RATED:
                both = ~np.isnan(columns[a] + columns[b])
            if both.any():
                matrix[i, k] = matrix[k, i] = np.corrcoef(columns[a][both], columns[b][both])[0, 1]
    return {"quantities": names, "matrix": matrix.tolist()}
