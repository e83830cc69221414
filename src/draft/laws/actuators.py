"""Actuator laws: mass, size and rotor inertia of real modules of a given torque.

Two sets of laws are fitted to the same rows: `paper`, the forms of arXiv 2609.38405, and `draft`,
Draft's own forms with smaller errors on held-out vendors (docs/actuator-trends.md). Coefficients,
scores and bands come from `draft.fitting.actuators.catalogue_refit`.
"""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import lru_cache, partial
from pathlib import Path
from typing import Any

from draft.errors import DraftError, Location, Problem
from draft.extensions import Registry
from draft.files import Readable
from draft.laws.catalogue import MODULE
from draft.laws.law import Law
from draft.laws.limits import limits
from draft.values import Value, power

FILE = Path(__file__).resolve().parent / "data" / "actuator_trends.json"
SETS = ("draft", "paper")
DEFAULT = "draft"
# Reduction from which modules are of the high-ratio kind, strain-wave gears almost all of them. The
# peak torque that their vendors print is mostly a momentary limit of the gear, so their rated
# torque is another share of it.
HIGH_RATIO = 50.0
# Law of the rated torque of these modules; that of the others is `rated_torque`.
HIGH_RATIO_RATED = "rated_torque_high_ratio"
# Law of the corner speed, of `draft.laws.limits`.
CORNER = "corner"
RATED = ("rated_torque", HIGH_RATIO_RATED)


@dataclass(frozen=True, slots=True)
class Laws:
    """A set of laws that were fitted together.

    Attributes:
        name: "draft", "paper" or the name of the coefficients file.
        trends: laws by quantity. `radius` and `length` follow from volume and aspect ratio;
            `rotor_inertia` is scored through predicted sizes, `rotor_inertia_of_size` at the
            module's own.
        correlation: correlation over the modules of the errors of two laws, by their quantities,
            each at the module's own inputs. Pairs that no module has are missing.
        kind: family of actuators that they are of, "module" or "servo".
    """

    name: str
    trends: Mapping[str, Law]
    correlation: Mapping[tuple[str, str], float]
    kind: str = MODULE

    def law(self, quantity: str) -> Law:
        """Law of a name; that of the corner speed is the same in every set."""
        return limits().corner if quantity == CORNER else self.trends[quantity]

    def error(self, quantity: str) -> Law:
        """Law with the error band of a quantity whose inputs are known."""
        return self.trends.get(f"{quantity}_of_size") or self.law(quantity)


def radius(volume: Value, aspect_ratio: Value) -> Value:
    """Radius of a cylinder [m], from its volume [m3] and its length over diameter."""
    return power(volume / (2 * math.pi * aspect_ratio), 1 / 3)


ACTUATOR_LAWS: Registry[Callable[[], Laws]] = Registry("set of actuator laws")


def actuator_laws(function: Callable[[], Laws]) -> Callable[[], Laws]:
    """Register a function as a set of actuator laws, for `trends` in parameters.yaml.

    The set has the name of the function. It is that of a coefficients file, by `read_laws`, or a
    shipped one of which some laws are replaced:

        @actuator_laws
        def light() -> Laws:
            \"\"\"Modules of 0.8 times the mass.\"\"\"
            trends = dict(laws("draft").trends)
            return replace(laws("draft"), trends=trends | {"mass": trends["mass"].scaled(0.8)})

    Raises:
        DraftError: a set of this name exists already.
    """
    ACTUATOR_LAWS.add(function.__name__, function, function.__module__)
    return function


def laws(name: str = DEFAULT) -> Laws:
    """Set of laws by its name: "draft", "paper" or one of an extension.

    Raises:
        DraftError: the function of an extension fails.
    """
    return _made(name, ACTUATOR_LAWS[name])


@lru_cache(maxsize=8)
def _made(name: str, function: Callable[[], Laws]) -> Laws:
    with ACTUATOR_LAWS.calls(name, "correct it, or write another one for 'trends'"):
        made = function()
        needed = _shipped()[DEFAULT]["laws"].keys()
        if not isinstance(made, Laws) or needed - made.trends.keys():
            raise TypeError(f"it does not give Laws with the trends {', '.join(needed)}")
        return replace(made, name=name)


@lru_cache(maxsize=8)
def read_laws(path: Readable) -> Laws:
    """Read the set `draft` of a coefficients file written by `draft trends fit`.

    Raises:
        DraftError: it cannot be read, or is not a coefficients file.
    """
    try:
        return laws_of(path.name, json.loads(path.read_bytes())[DEFAULT])
    except OSError as error:
        cause = f"cannot be read: {(error.strerror or str(error)).lower()}"
    except (ValueError, KeyError, TypeError, AttributeError):
        cause = "holds no actuator trends"
    remedy = "write one with 'draft trends fit'"
    raise DraftError(Problem(cause, Location(str(path)), remedy))


@lru_cache(maxsize=1)
def _shipped() -> dict[str, Any]:
    return json.loads(FILE.read_text(encoding="utf-8"))


def _of_record(name: str) -> Laws:
    return laws_of(name, _shipped()[name])


for _name in SETS:
    ACTUATOR_LAWS.add(_name, partial(_of_record, _name), __name__)


def laws_of(name: str, record: dict[str, Any]) -> Laws:
    """Set of laws from a record of a coefficients file."""
    names, matrix = record["correlation"]["quantities"], record["correlation"]["matrix"]
    # A catalogue of one's own may state too few rated torques to fit these laws.
    shipped = {key: _shipped()[DEFAULT]["laws"][key] for key in RATED}
    return Laws(
        name,
        {key: Law.read(key, law) for key, law in {**shipped, **record["laws"]}.items()},
        {(a, b): matrix[i][k] for i, a in enumerate(names) for k, b in enumerate(names)},
    )
