"""Fit the actuator trends to the catalogue and write the coefficients that the package ships.

`python -m draft.trends.refit` rewrites the file; a test proves that it is what this code gives.
"""

from __future__ import annotations

import json
import os
from collections.abc import Callable
from typing import Any

import numpy as np

from draft.trends import fitting
from draft.trends.actuators import FILE
from draft.trends.catalogue import Part, catalogue

Array = fitting.Array
SOURCE = "fitted to the catalogue's modules; forms of arXiv 2609.38405, actuator trends"


def actuator_trends() -> dict[str, Any]:
    """Fit every actuator trend; the result is what the coefficients file holds."""
    parts = list(catalogue().values())
    geared = [part for part in parts if part.gear_ratio is not None]
    torque = _column(geared, lambda part: part.peak_torque)
    speed = _column(geared, lambda part: part.no_load_speed)
    ratio = _column(geared, lambda part: part.gear_ratio)
    both = np.column_stack([torque, ratio])
    volume = _column(geared, lambda part: part.volume)
    aspect = _column(geared, lambda part: part.aspect_ratio)
    radius = np.cbrt(
        fitting.leave_one_out(both, volume) / (2 * np.pi * fitting.leave_one_out(both, aspect))
    )
    return {
        "mass": _power_law(
            "mass", "kg", ["peak_torque"], torque[:, None], _column(geared, lambda p: p.mass)
        ),
        "volume": _power_law("volume", "m3", ["peak_torque", "gear_ratio"], both, volume),
        "aspect_ratio": _power_law(
            "aspect_ratio", "1", ["peak_torque", "gear_ratio"], both, aspect
        ),
        "gear_ratio": _gear_law(speed, ratio),
        "peak_torque": _power_law(
            "peak_torque",
            "N m",
            ["no_load_speed", "gear_ratio"],
            np.column_stack([speed, ratio]),
            torque,
        ),
        "radius": _derived(
            "m",
            "r = (V / (2 pi a))^(1/3)",
            radius,
            _column(geared, lambda part: part.radius),
        ),
        "length": _derived(
            "m",
            "l = 2 a r",
            2 * fitting.leave_one_out(both, aspect) * radius,
            _column(geared, lambda part: part.length),
        ),
        "rotor_inertia": _rotor_law(geared, radius),
    }


def write() -> None:
    """Write the coefficients file, whole or not at all."""
    temporary = FILE.with_suffix(".tmp")
    temporary.write_text(json.dumps(actuator_trends(), indent=2) + "\n", encoding="utf-8")
    os.replace(temporary, FILE)


def _column(parts: list[Part], read: Callable[[Part], float | None]) -> Array:
    return np.array([read(part) for part in parts], dtype=np.float64)


def _power_law(name: str, unit: str, names: list[str], inputs: Array, y: Array) -> dict[str, Any]:
    """Fit y = c x1^e1 x2^e2 ... with its in-sample and held-out scores."""
    coefficients = fitting.fit(inputs, y)
    residual = np.log(y / fitting.predict(coefficients, inputs))
    held_out = fitting.leave_one_out(inputs, y)
    terms = " ".join(f"{x}^{e:.3f}" for x, e in zip(names, coefficients[1:], strict=True))
    return _record(
        unit,
        f"{name} = {np.exp(coefficients[0]):.4g} {terms}",
        float(np.exp(coefficients[0])),
        dict(zip(names, map(float, coefficients[1:]), strict=True)),
        len(y),
        fitting.r_squared(fitting.predict(coefficients, inputs), y),
        fitting.gmfe(held_out, y),
        float(np.std(residual, ddof=inputs.shape[1] + 1)),
        dict(zip(names, ([float(c.min()), float(c.max())] for c in inputs.T), strict=True)),
    )


def _gear_law(speed: Array, ratio: Array) -> dict[str, Any]:
    """Regress ln w on ln N and invert: N is what a designer chooses and w what follows."""

    def inverse(n: Array, w: Array, at: Array) -> Array:
        intercept, slope = fitting.fit(n[:, None], w)
        return np.exp((np.log(at) - intercept) / slope)

    held_out = np.empty_like(ratio)
    for i in range(len(ratio)):
        keep = np.arange(len(ratio)) != i
        held_out[i] = inverse(ratio[keep], speed[keep], speed[i : i + 1])[0]
    predicted = inverse(ratio, speed, speed)
    intercept, slope = fitting.fit(ratio[:, None], speed)
    coefficient, exponent = float(np.exp(-intercept / slope)), float(1 / slope)
    return _record(
        "1",
        f"gear_ratio = {coefficient:.4g} no_load_speed^{exponent:.3f}",
        coefficient,
        {"no_load_speed": exponent},
        len(ratio),
        fitting.r_squared(predicted, ratio),
        fitting.gmfe(held_out, ratio),
        float(np.std(np.log(ratio / predicted), ddof=2)),
        {"no_load_speed": [float(speed.min()), float(speed.max())]},
    )


def _rotor_law(geared: list[Part], radius: Array) -> dict[str, Any]:
    """Fit J = k r^4: similar rotors of one density; k is the geometric mean of J / r^4.

    Held out through the predicted radius, which is what a design has.
    """
    used = [
        i
        for i, part in enumerate(geared)
        if part.rotor_inertia is not None and not part.small_geared_inrunner
    ]
    own = _column([geared[i] for i in used], lambda part: part.radius)
    inertia = _column([geared[i] for i in used], lambda part: part.rotor_inertia)
    logs = np.log(inertia / own**4)
    held_out_k = np.exp((logs.sum() - logs) / (len(logs) - 1))
    k = float(np.exp(logs.mean()))
    return _record(
        "kg m2",
        f"rotor_inertia = {k:.4g} radius^4",
        k,
        {"radius": 4.0},
        len(used),
        fitting.r_squared(k * own**4, inertia),
        fitting.gmfe(held_out_k * radius[used] ** 4, inertia),
        float(np.std(logs, ddof=1)),
        {"radius": [float(own.min()), float(own.max())]},
    )


def _derived(unit: str, formula: str, held_out: Array, published: Array) -> dict[str, Any]:
    """Score a size that follows from volume and aspect ratio, both held out."""
    residual = np.log(published / held_out)
    return _record(
        unit,
        formula,
        1.0,
        {},
        len(published),
        fitting.r_squared(held_out, published),
        fitting.gmfe(held_out, published),
        float(np.std(residual)),
        {},
    )


def _record(
    unit: str,
    formula: str,
    coefficient: float,
    exponents: dict[str, float],
    n: int,
    r2: float,
    held_out: float,
    sigma: float,
    ranges: dict[str, list[float]],
) -> dict[str, Any]:
    def digits(value: float) -> float:
        return float(f"{value:.10g}")

    return {
        "unit": unit,
        "formula": formula,
        "coefficient": digits(coefficient),
        "exponents": {name: digits(value) for name, value in exponents.items()},
        "n": n,
        "r_squared": digits(r2),
        "leave_one_out": digits(held_out),
        "sigma_log": digits(sigma),
        "ranges": {name: [digits(x) for x in pair] for name, pair in ranges.items()},
        "source": SOURCE,
    }


if __name__ == "__main__":
    write()
