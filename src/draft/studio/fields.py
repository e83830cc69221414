"""Fields that the studio shows for a spec: names, groups, ranges, steps; without the browser."""

from __future__ import annotations

import math
from typing import NamedTuple

from draft.design import Design
from draft.design.plan import plan
from draft.laws.catalogue import SERVO, catalogue, span
from draft.laws.quantities import QUANTITIES
from draft.spec import Spec
from draft.spec.schema import STATED
from draft.spec.spec import Parameter

# A slider of a stated actuator quantity goes from this share of its value to one over it.
_REACH = 1 / 3
NO_PART = "(none)"


class Slider(NamedTuple):
    """A number with bounds.

    Attributes:
        name: name of the field in a session.
        label: text in front of the slider.
        unit: SI unit; "" for none.
        low: smallest value.
        high: largest value.
        step: difference between two positions of the slider.
        doc: description, one sentence.
    """

    name: str
    label: str
    unit: str
    low: float
    high: float
    step: float
    doc: str


class Text(NamedTuple):
    """A derived number: shown as its expression, which typed text overrides."""

    name: str
    label: str
    unit: str
    text: str
    doc: str


def groups(spec: Spec) -> dict[str, list[Parameter]]:
    """Stated parameters by group: the first word of the name, where several share it."""
    stated = [p for p in spec.parameters.values() if p.value.constant is not None]
    firsts = [p.name.split("_")[0] for p in stated]
    found: dict[str, list[Parameter]] = {"general": []}
    for parameter, first in zip(stated, firsts, strict=True):
        group = first if firsts.count(first) > 1 else "general"
        found.setdefault(group, []).append(parameter)
    return {name: of for name, of in found.items() if of}


def names(spec: Spec) -> list[str]:
    """Names of all fields that can be set."""
    quantities = [f"actuators.{name}.{q}" for name in spec.actuators for q in (*STATED, "like")]
    return [*spec.parameters, *quantities]


def derived(spec: Spec) -> list[Text]:
    """Parameters that are given by an expression."""
    return [
        Text(p.name, p.name, _unit(p.unit), p.value.text, p.doc)
        for p in spec.parameters.values()
        if p.value.constant is None
    ]


def slider(parameter: Parameter, value: float) -> Slider:
    """Slider of a stated parameter, over its range or from a third to three times its value."""
    low, high = parameter.bounds or reach(value)
    return _slider(parameter.name, parameter.name, parameter.unit, low, high, parameter.doc)


def stated(design: Design, actuator: str) -> list[Slider]:
    """Sliders of the stated quantities of an actuator class, around their values."""
    sliders = []
    for quantity in STATED:
        origin = design.actuators[actuator].origins.get(quantity)
        if origin is None or origin.kind != "stated":
            continue
        value = float(getattr(design.actuators[actuator], quantity))
        low, high = reach(value)
        doc = QUANTITIES[quantity].text + _usual(quantity)
        name = f"actuators.{actuator}.{quantity}"
        sliders.append(_slider(name, quantity, QUANTITIES[quantity].unit, low, high, doc))
    return sliders


def frictions(design: Design, actuator: str) -> list[Slider]:
    """Sliders of friction loss and damping, which no trend gives."""
    sliders = []
    for quantity, one in QUANTITIES.items():
        if one.default is None:
            continue
        value = float(getattr(design.actuators[actuator], quantity))
        high = max(3 * value, 0.1 if quantity == "damping" else 1.0)
        name = f"actuators.{actuator}.{quantity}"
        sliders.append(_slider(name, quantity, one.unit, 0.0, _round_up(high), one.text))
    return sliders


def parts(spec: Spec) -> list[str]:
    """Options of the field `like`: none, parts of the catalogues, and those of the robot's own."""
    return [NO_PART, *catalogue(), *catalogue(SERVO), *(part.name for part in plan(spec).own)]


def reach(value: float) -> tuple[float, float]:
    """Range of a slider around a value, with ends of one digit."""
    if value == 0:
        return -1.0, 1.0
    low, high = sorted((value * _REACH, value / _REACH))
    return -_round_up(-low) if low < 0 else _round_down(low), _round_up(high) if high > 0 else 0.0


def _slider(name: str, label: str, unit: str, low: float, high: float, doc: str) -> Slider:
    step = 10.0 ** math.floor(math.log10((high - low) / 100))
    return Slider(name, label, _unit(unit), low, high, step, doc)


def _usual(quantity: str) -> str:
    """Range of a quantity over the catalogue's modules, as a sentence."""
    known = span(quantity)
    if known is None:
        return ""
    unit = QUANTITIES[quantity].unit
    return f" Catalogue modules: {known.low:.3g} to {known.high:.4g} {unit}."


def _unit(unit: str) -> str:
    return "" if unit == "1" else unit


def _round_up(x: float) -> float:
    """Smallest number of one digit that is not below x."""
    decade = 10.0 ** math.floor(math.log10(x))
    return float(f"{math.ceil(round(x / decade, 9)) * decade:.6g}")


def _round_down(x: float) -> float:
    """Largest number of one digit that is not above x."""
    decade = 10.0 ** math.floor(math.log10(x))
    return float(f"{math.floor(round(x / decade, 9)) * decade:.6g}")
