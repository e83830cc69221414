"""Fits of the laws of the two sets, and their predictions for modules.

Set `paper`: the forms of arXiv 2609.38405, actuator trends, by ordinary least squares of
logarithms. Set `draft`: Draft's own forms; docs/actuator-trends.md explains the choice.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from draft.fitting import least_squares as ols
from draft.fitting.actuators.catalogue_rows import Mask, Rows
from draft.fitting.forms import Form
from draft.laws.actuators import HIGH_RATIO_RATED, RATED
from draft.laws.law import Term, evaluate
from draft.laws.quantities import QUANTITIES
from draft.values import Array

LN_2PI = float(np.log(2 * np.pi))
Fits = dict[str, tuple[Term, ...]]
Logs = dict[str, Array]


@dataclass(frozen=True)
class Recipe:
    """Quantity, inputs and fitting function of one law.

    Attributes:
        quantity: quantity that the law predicts.
        inputs: quantities that the law depends on.
        fit: terms from logarithms of inputs, shape (n, k), and of the quantity, shape (n,).
        reciprocal: whether the law is one over the sum of its terms.
        source: source of the law; "" for that of its set.
    """

    quantity: str
    inputs: tuple[str, ...]
    fit: Callable[[Array, Array], tuple[Term, ...]]
    reciprocal: bool = False
    source: str = ""

    @property
    def unit(self) -> str:
        """SI unit of the quantity; the rated torque has two laws."""
        return QUANTITIES["rated_torque" if self.quantity in RATED else self.quantity].unit


def least_squares(inputs: Array, output: Array) -> tuple[Term, ...]:
    """Fit one term by ordinary least squares of logarithms."""
    intercept, *exponents = ols.least_squares(inputs, output)
    return (Term(float(np.exp(intercept)), tuple(map(float, exponents))),)


def _inverse_law(inputs: Array, output: Array) -> tuple[Term, ...]:
    """Regress the input on the output and invert: N is the choice, and w follows from it."""
    intercept, slope = ols.least_squares(output[:, None], inputs[:, 0])
    return (Term(float(np.exp(-intercept / slope)), (float(1 / slope),)),)


def form(*exponents: tuple[float | None, ...], start: tuple[float, ...], **more: bool) -> Form:
    """A sum of terms with some given exponents, see `draft.fitting.forms.Form`."""
    return Form(exponents, start, **more)


PEAK_TORQUE = Recipe("peak_torque", ("no_load_speed", "gear_ratio"), least_squares)
_RATED_SOURCE = "fitted to the catalogue's rated torques; docs/limits.md"
# A motor heats with the square of its torque and cools through its surface, so modules of any size
# are rated at about one share of their peak: a free exponent errs no less on vendors held out.
# Modules of high ratio have another share: their peak is mostly a momentary limit of the gear.
_RATED = (
    Recipe("rated_torque", ("peak_torque",), form((1.0,), start=(0.34,)).fit, source=_RATED_SOURCE),
    Recipe(
        HIGH_RATIO_RATED, ("peak_torque",), form((1.0,), start=(0.25,)).fit, source=_RATED_SOURCE
    ),
)

PAPER = (
    Recipe("mass", ("peak_torque",), least_squares),
    Recipe("volume", ("peak_torque", "gear_ratio"), least_squares),
    Recipe("aspect_ratio", ("peak_torque", "gear_ratio"), least_squares),
    Recipe("gear_ratio", ("no_load_speed",), _inverse_law),
    PEAK_TORQUE,
    # Similar rotors of one density; k is the geometric mean of J / r^4.
    Recipe("rotor_inertia", ("radius",), form((4.0,), start=(27.0,), robust=False).fit),
    *_RATED,
)
DRAFT = (
    # A part that grows with torque (magnets, gears), and one that varies little (housing, bearings,
    # electronics).
    Recipe("mass", ("peak_torque",), form((1 / 3,), (1.0,), start=(0.12, 0.0067)).fit),
    # The motor, by the torque before the reduction, and the gears, by the torque after it.
    Recipe(
        "volume",
        ("peak_torque", "gear_ratio"),
        form((0.5, -0.5), (0.75, 0.0), start=(8e-5, 1.2e-5)).fit,
    ),
    # A larger reduction adds length, up to a limit.
    Recipe(
        "aspect_ratio",
        ("gear_ratio",),
        form((0.0,), (-1.0,), start=(0.9, 7.6), reciprocal=True).fit,
        reciprocal=True,
    ),
    # The motors of all modules have about the same no-load speed.
    Recipe("gear_ratio", ("no_load_speed",), form((-1.0,), start=(290.0,)).fit),
    PEAK_TORQUE,
    # The rotor's share of m r^2 falls as the gears take up more of the module.
    Recipe(
        "rotor_inertia",
        ("mass", "radius", "gear_ratio"),
        form((1.0, 2.0, None), start=(0.2, -0.4), robust=False).fit,
    ),
    *_RATED,
)
SETS = {"draft": DRAFT, "paper": PAPER}


def fit_all(recipes: tuple[Recipe, ...], rows: Rows, train: Mask, mass_train: Mask) -> Fits:
    """Fit every law of a set.

    Args:
        recipes: the set.
        rows: the catalogue.
        train: rows to fit to; each law omits those without its inputs or quantity.
        mass_train: rows to fit the mass to; only this law needs no reduction.
    """
    fits: Fits = {}
    for recipe in recipes:
        chosen = mass_train if recipe.quantity == "mass" else train & rows.geared
        chosen = chosen & rows.has(recipe.quantity, *recipe.inputs)
        if recipe.quantity in RATED and not chosen.any():
            continue
        inputs = rows.inputs(recipe.inputs)[chosen]
        fits[recipe.quantity] = recipe.fit(inputs, rows.log[recipe.quantity][chosen])
    return fits


def predict_all(recipes: tuple[Recipe, ...], fits: Fits, rows: Rows, test: Mask) -> Logs:
    """Predict the quantities of some modules, as logarithms, from torque, speed and reduction.

    Where the set has a law of the rotor, `rotor_inertia` uses the predicted mass and radius, and
    `rotor_inertia_of_size` the module's own.
    """
    actual = {quantity: rows.log[quantity][test] for quantity in rows.log}
    predicted: Logs = {}
    for recipe in recipes:
        if recipe.quantity != "rotor_inertia" and recipe.quantity in fits:
            predicted[recipe.quantity] = _ln(recipe, fits, actual)
    predicted["radius"] = (predicted["volume"] - LN_2PI - predicted["aspect_ratio"]) / 3
    predicted["length"] = predicted["radius"] + predicted["aspect_ratio"] + float(np.log(2))
    for rotor in (recipe for recipe in recipes if recipe.quantity == "rotor_inertia"):
        predicted["rotor_inertia_of_size"] = _ln(rotor, fits, actual)
        sizes = {quantity: predicted[quantity] for quantity in ("mass", "radius")}
        predicted["rotor_inertia"] = _ln(rotor, fits, actual | sizes)
    return predicted


def _ln(recipe: Recipe, fits: Fits, logs: Logs) -> Array:
    inputs = [np.exp(logs[name]) for name in recipe.inputs]
    value = evaluate(fits[recipe.quantity], recipe.reciprocal, inputs)
    return np.log(np.broadcast_to(value, inputs[0].shape))
