"""Published figures of the actuator trends, beside those of the shipped tables.

Source: arXiv 2609.38405, actuator trends, and figures that its authors state about them.
"""

from __future__ import annotations

import math
from collections import Counter
from dataclasses import replace

from draft.fitting import least_squares as ols
from draft.fitting import scores
from draft.fitting.actuators.catalogue_rows import Rows, rows_of
from draft.fitting.actuators.recipes import SETS, fit_all, predict_all
from draft.fitting.printed import Figure
from draft.laws.actuators import laws
from draft.laws.catalogue import aspect_range, catalogue
from draft.laws.law import Law

_HELD_OUT = (
    ("row", "error, row held out"),
    ("vendor", "error, vendor held out"),
    ("family", "error, family held out"),
)
# Printed figures by quantity: R2, and errors with a row and with a vendor held out.
_SCORES = {
    "gear_ratio": ("0.89", "1.33", None),
    "mass": ("0.90", "1.28", "1.31"),
    "volume": ("0.87", "1.30", None),
    "radius": (None, "1.12", None),
    "length": (None, "1.14", None),
    "rotor_inertia": (None, "1.56", None),
    "aspect_ratio": ("0.64", "1.19", None),
}
_ROTOR_R2 = (
    "at the modules' own radius, as the law is fitted; through the predicted radius it is {:.3f}. "
    "The print does not say which it gives, and neither is called the same"
)
# Figures that the text gives with fewer digits than the released data: exponents with three
# decimals, and coefficients of four digits or more.
_DECIMALS, _DIGITS = 3, 4
_BOTH_HELD_OUT = (
    "volume and aspect ratio both held out; with the part's own aspect ratio, 1.09: a third of the "
    "volume's error, because of the cube root"
)


def figures() -> list[Figure]:
    """All published figures of the actuator trends, from the shipped tables and coefficients."""
    rows = rows_of(catalogue().values())
    found = [
        *_catalogue(),
        *_reduction(rows),
        *_scores("gear_ratio"),
        *_power_law("mass", {"coefficient": "0.0653", "peak_torque": "0.666"}),
        *_scores("mass"),
        *_volume(rows),
        *_scores("volume"),
        *_scores("radius", _BOTH_HELD_OUT),
        *_scores("length", _BOTH_HELD_OUT),
        *_rotor(rows),
        *_scores("rotor_inertia"),
        *_power_law(
            "aspect_ratio", {"coefficient": "0.401", "peak_torque": "-0.098", "gear_ratio": "0.316"}
        ),
        *_scores("aspect_ratio"),
    ]
    return [replace(figure, released=_is_released(figure)) for figure in found]


def _is_released(figure: Figure) -> bool:
    """Whether a figure of a law has more digits than the paper's text."""
    text = (figure.printed or "").lstrip("-")
    if "exponent" in figure.name:
        return len(text.partition(".")[2]) >= _DECIMALS
    return "coefficient" in figure.name and len(text.replace(".", "").lstrip("0")) >= _DIGITS


def _catalogue() -> list[Figure]:
    parts = catalogue().values()
    families = Counter(part.family for part in parts)
    printed = {"QDD": "33", "MidGear": "33", "HighGR": "48"}
    low, high = aspect_range()
    return [
        Figure("catalogue", "modules", "114", len(parts)),
        *(Figure("catalogue", f"{f} modules", n, families[f]) for f, n in printed.items()),
        Figure("catalogue", "lowest length / diameter", "0.28", low),
        Figure(
            "catalogue",
            "highest length / diameter",
            "1.69",
            math.ceil(100 * high) / 100,
            note=f"{high:.4f}, rounded outwards",
        ),
    ]


def _paper(quantity: str) -> Law:
    return laws("paper").trends[quantity]


def _power_law(quantity: str, printed: dict[str, str]) -> list[Figure]:
    law = _paper(quantity)
    fitted = {"coefficient": law.coefficient, **law.exponents}
    names = {x: x if x == "coefficient" else f"exponent of {x.replace('_', ' ')}" for x in printed}
    return [
        Figure(quantity, "rows", "103", law.n),
        *(Figure(quantity, names[x], text, fitted[x]) for x, text in printed.items()),
    ]


def _scores(quantity: str, note: str = "") -> list[Figure]:
    """R2 and held-out errors, printed and of the shipped laws."""
    paper, draft = _paper(quantity), laws("draft").trends[quantity]
    r_squared, row, vendor = _SCORES[quantity]
    figures = []
    if r_squared is not None:
        figures.append(Figure(quantity, "R2", r_squared, paper.r_squared, draft.r_squared))
    for (key, name), printed in zip(_HELD_OUT, (row, vendor, None), strict=True):
        values = paper.held_out[key], draft.held_out[key]
        figures.append(Figure(quantity, name, printed, *values, note=note if key == "row" else ""))
    return figures


def _reduction(rows: Rows) -> list[Figure]:
    law = _paper("gear_ratio")
    geared = rows.geared
    intercept, slope = ols.least_squares(
        rows.inputs(["gear_ratio"])[geared], rows.log["no_load_speed"][geared]
    )
    return [
        Figure("gear_ratio", "rows", "103", law.n),
        Figure("gear_ratio", "coefficient", "327", law.coefficient),
        Figure("gear_ratio", "exponent of speed", "-1.066", law.exponents["no_load_speed"]),
        Figure("gear_ratio", "speed's coefficient", "228.5", math.exp(intercept)),
        Figure("gear_ratio", "speed's exponent of reduction", "-0.938", slope),
    ]


def _volume(rows: Rows) -> list[Figure]:
    law = _paper("volume")
    geared = rows.geared
    inputs = rows.inputs(["peak_torque", "gear_ratio"])[geared]
    # sigma = tau / (N 2 pi r^2 l), the stress of the motor.
    stress = inputs[:, 0] - inputs[:, 1] - rows.log["volume"][geared] - math.log(2)
    sigma, torque, ratio = ols.least_squares(inputs, stress)
    printed = {"peak_torque": "0.700", "gear_ratio": "-0.167"}
    return [
        Figure("volume", "rows", "103", law.n),
        Figure("volume", "one over the coefficient", "23948", 1 / law.coefficient),
        *(
            Figure("volume", f"exponent of {x.replace('_', ' ')}", text, law.exponents[x])
            for x, text in printed.items()
        ),
        Figure("volume", "stress: coefficient", "11974", math.exp(sigma)),
        Figure("volume", "stress: exponent of torque", "0.300", torque),
        Figure("volume", "stress: exponent of reduction", "-0.833", ratio),
    ]


def _r_squared_of_rotor(rows: Rows) -> float:
    """Share of the variance of ln J explained through the predicted radius, by the paper's laws."""
    known = rows.geared & rows.has("rotor_inertia")
    fits = fit_all(SETS["paper"], rows, rows.geared, rows.geared)
    said = predict_all(SETS["paper"], fits, rows, known)["rotor_inertia"]
    log = rows.log["rotor_inertia"][known]
    return scores.r_squared(log - said, log)


def _rotor(rows: Rows) -> list[Figure]:
    law = _paper("rotor_inertia")
    used = rows.geared & rows.has("rotor_inertia")
    free = ols.least_squares(rows.inputs(["radius"])[used], rows.log["rotor_inertia"][used])
    through = _r_squared_of_rotor(rows)
    paper, draft = (laws(name).trends["rotor_inertia_of_size"] for name in ("paper", "draft"))
    return [
        Figure("rotor_inertia", "rows", "88", law.n),
        Figure("rotor_inertia", "coefficient", "27.2", law.coefficient),
        Figure("rotor_inertia", "exponent if it is free", "4.02", float(free[1])),
        Figure(
            "rotor_inertia",
            "R2",
            "0.84",
            paper.r_squared,
            draft.r_squared,
            _ROTOR_R2.format(through),
        ),
        Figure("rotor_inertia", "R2 through the predicted radius", None, through),
        Figure(
            "rotor_inertia",
            "error at own sizes, row held out",
            "1.44",
            paper.held_out["row"],
            draft.held_out["row"],
        ),
        Figure(
            "rotor_inertia",
            "error at own sizes, vendor held out",
            None,
            paper.held_out["vendor"],
            draft.held_out["vendor"],
        ),
    ]
