"""Forms that were tried for the actuator laws, scored on vendors and families held out.

`python -m docs.actuator_forms` writes the tables of docs/actuator-trends.md; a test holds them
against this code.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np

from draft.fitting.actuators import catalogue_holdout as holdout
from draft.fitting.actuators import recipes
from draft.fitting.actuators.catalogue_rows import Mask, Rows, rows_of
from draft.fitting.actuators.recipes import DRAFT, PAPER, Recipe
from draft.fitting.forms import Form
from draft.fitting.scores import fold_error
from draft.laws.actuators import laws
from draft.laws.catalogue import catalogue
from draft.laws.law import evaluate
from draft.values import Array

FILE = Path(__file__).parent / "actuator-trends.md"
QUANTITIES = ("mass", "volume", "aspect_ratio", "radius", "length", "gear_ratio", "rotor_inertia")
T, W, N, A = "peak_torque", "no_load_speed", "gear_ratio", "aspect_ratio"


def power(quantity: str, *inputs: str) -> Recipe:
    """A power law by least squares."""
    return Recipe(quantity, inputs, recipes.least_squares)


def sums(quantity: str, inputs: tuple[str, ...], form: Form) -> Recipe:
    """A sum of terms."""
    return Recipe(quantity, inputs, form.fit, form.reciprocal)


def shipped(quantity: str) -> Recipe:
    """The recipe of Draft's own set."""
    return next(recipe for recipe in DRAFT if recipe.quantity == quantity)


def published(quantity: str) -> Recipe:
    """The recipe of the published set."""
    return next(recipe for recipe in PAPER if recipe.quantity == quantity)


_MASS = Form(((1 / 3,), (1.0,)), (0.12, 0.0067))
_VOLUME = Form(((0.5, -0.5), (0.75, 0.0)), (8e-5, 1.2e-5))
_SPEED = Form(((-1.0,),), (290.0,))
# quantity -> words -> recipe; the published form first, the shipped one second.
TRIED: dict[str, dict[str, Recipe]] = {
    "mass": {
        "**paper**: tau^p": published("mass"),
        "**draft**: a tau^(1/3) + b tau": shipped("mass"),
        "the same by least squares": sums("mass", (T,), replace(_MASS, robust=False)),
        "a tau^(1/2) + b tau": sums("mass", (T,), replace(_MASS, exponents=((0.5,), (1.0,)))),
        "a + b tau^p": sums("mass", (T,), Form(((0.0,), (None,)), (0.18, 0.024, 0.83))),
        "a (tau/N)^(1/2) + b tau: motor and gears": sums(
            "mass", (T, N), Form(((0.5, -0.5), (1.0, 0.0)), (0.2, 0.009))
        ),
        "tau^p N^q": power("mass", T, N),
        "tau^p w^q": power("mass", T, W),
        "tau^p N^q w^s": power("mass", T, N, W),
        "tau^p, own length / diameter": power("mass", T, A),
    },
    "volume": {
        "**paper**: tau^p N^q": published("volume"),
        "**draft**: a (tau/N)^(1/2) + b tau^(3/4)": shipped("volume"),
        "the same by least squares": sums("volume", (T, N), replace(_VOLUME, robust=False)),
        "a (tau/N)^(3/4) + b tau": sums(
            "volume", (T, N), Form(((0.75, -0.75), (1.0, 0.0)), (1e-4, 3e-6))
        ),
        "(a tau^(1/2) + b tau) N^(-1/6), the exponent seen in all rows": sums(
            "volume", (T, N), Form(((0.5, -1 / 6), (1.0, -1 / 6)), (6e-5, 4e-6))
        ),
        "tau^p": power("volume", T),
        "tau^p w^q": power("volume", T, W),
        "tau^p N^q w^s": power("volume", T, N, W),
        "tau^p N^q, own length / diameter": power("volume", T, N, A),
    },
    "aspect_ratio": {
        "**paper**: tau^p N^q": published("aspect_ratio"),
        "**draft**: 1 / (a + b/N)": shipped("aspect_ratio"),
        "N^q": power("aspect_ratio", N),
        "tau^p w^q": power("aspect_ratio", T, W),
        "tau^p N^q w^s": power("aspect_ratio", T, N, W),
    },
    "gear_ratio": {
        "**paper**: w^p, fitted as w over N": published("gear_ratio"),
        "**draft**: k / w": shipped("gear_ratio"),
        "the same by least squares": sums("gear_ratio", (W,), replace(_SPEED, robust=False)),
        "w^p, fitted as N over w": power("gear_ratio", W),
        "w^p tau^q": power("gear_ratio", W, T),
        "tau^q / w": sums("gear_ratio", (W, T), Form(((-1.0, None),), (350.0, -0.06))),
    },
    "rotor_inertia": {
        "**paper**: k r^4": published("rotor_inertia"),
        "**draft**: k m r^2 N^q": shipped("rotor_inertia"),
        "the same, robust": sums(
            "rotor_inertia",
            ("mass", "radius", N),
            Form(((1.0, 2.0, None),), (0.2, -0.4), False, True),
        ),
        "k r^4, with Draft's volume": published("rotor_inertia"),
        "r^p": power("rotor_inertia", "radius"),
        "r^p m^q N^s": power("rotor_inertia", "mass", "radius", N),
        "k m r^2": sums("rotor_inertia", ("mass", "radius"), Form(((1.0, 2.0),), (0.05,))),
        "tau^p N^q, without sizes": power("rotor_inertia", T, N),
        "tau^p N^q w^s, without sizes": power("rotor_inertia", T, N, W),
    },
}


def forms_table(rows: Rows, quantity: str) -> str:
    """Held-out errors of each form of a quantity."""
    lines = ["| form | vendor | mean of vendors | family |", "|---|---|---|---|"]
    for words, recipe in TRIED[quantity].items():
        vendor = _errors(words, recipe, rows, rows.vendor)
        family = _errors(words, recipe, rows, rows.family)
        lines.append(
            f"| {words} | {fold_error(vendor):.3f} | {_by_vendor(rows, vendor):.3f} | "
            f"{fold_error(family):.3f} |"
        )
    for words, predict in OTHER.get(quantity, {}).items():
        vendor = rows.log[quantity] - _other(rows, quantity, predict)
        lines.append(f"| {words} | {fold_error(vendor):.3f} | {_by_vendor(rows, vendor):.3f} | |")
    return "\n".join(lines)


def nested_table(rows: Rows) -> str:
    """Error where the form is chosen without the vendor too: by hold-outs among the others."""
    lines = [
        "| quantity | paper | form chosen without the vendor | forms chosen |",
        "|---|---|---|---|",
    ]
    vendors = np.array(rows.vendor)
    for quantity, tried in TRIED.items():
        named = {w: r for w, r in tried.items() if not re.search("own|with|seen", w)}
        error, chosen = np.full(len(vendors), np.nan), []
        outer = {w: _errors(w, r, rows, rows.vendor) for w, r in named.items()}
        for vendor in np.unique(vendors[rows.geared & rows.has(quantity)]):
            others = vendors != vendor
            inner = {w: _errors(w, r, rows, rows.vendor, others)[others] for w, r in named.items()}
            best = min(inner, key=lambda w, inner=inner: fold_error(inner[w]))
            chosen.append(best)
            error[~others] = outer[best][~others]
        paper = fold_error(outer[next(iter(named))])
        counts = ", ".join(f"{w} ({chosen.count(w)})" for w in dict.fromkeys(chosen))
        lines.append(f"| {_word(quantity)} | {paper:.3f} | {fold_error(error):.3f} | {counts} |")
    return "\n".join(lines)


def scores_table() -> str:
    """Shipped laws of both sets and their held-out errors."""
    lines = ["| quantity | set | law | row | vendor | family |", "|---|---|---|---|---|---|"]
    for quantity in QUANTITIES:
        for name in ("paper", "draft"):
            law = laws(name).trends[quantity]
            lines.append(
                f"| {_word(quantity) if name == 'paper' else ''} | {name} | {law.formula} | "
                f"{law.held_out['row']:.3f} | {law.held_out['vendor']:.3f} | "
                f"{law.held_out['family']:.3f} |"
            )
    return "\n".join(lines)


def coverage_table(rows: Rows) -> str:
    """Share of each vendor's modules inside 90 % bands that were set without it."""
    covered = holdout.coverage(DRAFT, rows)
    head = " | ".join(_word(quantity) for quantity in QUANTITIES)
    lines = [f"| vendor | modules | {head} |", "|---" * (len(QUANTITIES) + 2) + "|"]
    for vendor in sorted(set(np.array(rows.vendor)[rows.geared]), key=str.lower):
        count = sum(v == vendor and g for v, g in zip(rows.vendor, rows.geared, strict=True))
        cells = [covered[quantity, 0.9].by_vendor.get(vendor) for quantity in QUANTITIES]
        text = " | ".join("" if cell is None else f"{100 * cell:.0f}" for cell in cells)
        lines.append(f"| {vendor} | {count} | {text} |")
    for share in holdout.SHARES[::-1]:
        shares = (f"**{100 * covered[q, share].overall:.0f}**" for q in QUANTITIES)
        lines.append(f"| all, {share:.0%} band | {rows.geared.sum()} | {' | '.join(shares)} |")
    folds = " | ".join(f"{laws().trends[quantity].band(0.9):.2f}" for quantity in QUANTITIES)
    return "\n".join([*lines, f"| 90 % fold | | {folds} |"])


def text(document: str) -> str:
    """A document with its tables written anew, each after its mark."""
    rows = rows_of(catalogue().values())
    tables: dict[str, Callable[[], str]] = {
        "scores": scores_table,
        "nested": lambda: nested_table(rows),
        "coverage": lambda: coverage_table(rows),
        **{f"forms {q}": lambda q=q: forms_table(rows, q) for q in TRIED},
    }
    for mark, table in tables.items():
        pattern = rf"<!-- {mark} -->\n\n(\|.*\n)*\n?"
        made = f"<!-- {mark} -->\n\n{table()}\n\n"
        document = re.sub(pattern, lambda _, made=made: made, document)
    return document


def _word(quantity: str) -> str:
    return quantity.replace("_", " ")


def _errors(
    words: str, recipe: Recipe, rows: Rows, groups: list[str], train: Mask | None = None
) -> Array:
    """ln(published / predicted) with groups held out; NaN where a row is not scored."""
    quantity = recipe.quantity
    if quantity == "rotor_inertia":
        base = PAPER if "paper" in words else DRAFT
        used = tuple(recipe if r.quantity == quantity else r for r in base)
        vendors = groups is rows.vendor
        said = holdout.held_out(used, rows, groups, train=train, mass_from_all=vendors)[quantity]
        return np.where(rows.geared, rows.log[quantity] - said, np.nan)
    labels = np.array(groups)
    usable = rows.has(quantity, *recipe.inputs)
    fitted = usable if quantity == "mass" and groups is rows.vendor else usable & rows.geared
    if train is not None:
        fitted = fitted & train
    scored = rows.geared & usable
    error = np.full(len(labels), np.nan)
    inputs, output = rows.inputs(recipe.inputs), rows.log[quantity]
    for label in np.unique(labels[scored]):
        held = labels == label
        terms = recipe.fit(inputs[fitted & ~held], output[fitted & ~held])
        columns = list(np.exp(inputs[held & scored]).T)
        value = evaluate(terms, recipe.reciprocal, columns)
        error[held & scored] = output[held & scored] - np.log(value)
    return error


def _by_vendor(rows: Rows, error: Array) -> float:
    """Error where each vendor counts once."""
    vendors = np.array(rows.vendor)
    known = ~np.isnan(error) & rows.geared
    means = [np.abs(error[known & (vendors == v)]).mean() for v in np.unique(vendors[known])]
    return float(np.exp(np.mean(means)))


# --- what is no sum of powers ----------------------------------------------------------------

Predict = Callable[[Rows, str, Mask], Array]


def _other(rows: Rows, quantity: str, predict: Predict) -> Array:
    """Predictions of ln(quantity) with each vendor held out."""
    vendors = np.array(rows.vendor)
    said = np.full(len(vendors), np.nan)
    for vendor in np.unique(vendors[rows.geared]):
        held = rows.geared & (vendors == vendor)
        said[held] = predict(rows, quantity, rows.geared & ~held & rows.has(quantity))[held]
    return said


def _quadratic(rows: Rows, quantity: str, train: Mask) -> Array:
    """A parabola in ln torque: not monotone."""
    x = rows.log[T]
    fitted = np.polyval(np.polyfit(x[train], rows.log[quantity][train], 2), x)
    return np.asarray(fitted, dtype=np.float64)


def _pooled(rows: Rows, quantity: str, train: Mask) -> Array:
    """An offset of each family, shrunk, blended by how the reduction belongs to a family."""
    n, families = rows.log[N], np.array(rows.family)
    weights = []
    for family in ("QDD", "MidGear", "HighGR"):
        own = n[train & (families == family)]
        width = max(own.std(), 0.15)
        weights.append(len(own) / width * np.exp(-0.5 * ((n - own.mean()) / width) ** 2))
    shares = np.array(weights).T / np.sum(weights, axis=0)[:, None]
    columns = np.column_stack([np.ones(len(n)), rows.log[T], shares])
    penalty = np.diag([0.0, 0.0, 3.0, 3.0, 3.0])
    x, y = columns[train], rows.log[quantity][train]
    return columns @ np.linalg.solve(x.T @ x + penalty, x.T @ y)


def _process(rows: Rows, quantity: str, train: Mask) -> Array:
    """A Gaussian process over ln torque, speed and reduction, with an offset of each vendor."""
    x = rows.inputs([T, W, N])
    x = x - np.nanmean(x, axis=0)
    near = 0.3 * np.exp(-0.5 * np.sum((x[:, None] - x[None]) ** 2, axis=2) / 9)
    kernel = near + 4 * (x @ x.T + 1)
    vendors = np.array(rows.vendor)
    noise = 0.04 * (vendors[:, None] == vendors[None]) + 0.06 * np.eye(len(vendors))
    middle = rows.log[quantity][train].mean()
    among = (kernel + noise)[train][:, train]
    inner = np.linalg.solve(among, rows.log[quantity][train] - middle)
    return middle + kernel[:, train] @ inner


_ANY = {
    "partial pooling: tau^p, an offset of each family": _pooled,
    "Gaussian process over tau, w and N": _process,
}
OTHER: dict[str, dict[str, Predict]] = {
    "mass": {"a parabola in ln tau (not monotone)": _quadratic, **_ANY},
    "volume": _ANY,
    "aspect_ratio": _ANY,
    "rotor_inertia": _ANY,
}


if __name__ == "__main__":
    FILE.write_text(text(FILE.read_text(encoding="utf-8")), encoding="utf-8")
