"""Actuator laws: mass, size and rotor inertia of real modules of a given torque.

Two sets of laws are fitted to the same rows: `paper`, the forms of arXiv 2609.38405, and `draft`,
Draft's own forms with smaller errors on held-out vendors (docs/actuator-trends.md). Coefficients,
scores and bands come from `draft.fitting.actuators.refit`.
"""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any

from draft.errors import DraftError, Location, Problem
from draft.laws.law import Law
from draft.values import Value, power

FILE = Path(__file__).resolve().parent / "data" / "actuator_trends.json"
SETS = ("draft", "paper")
DEFAULT = "draft"


@dataclass(frozen=True, slots=True)
class Laws:
    """A set of laws that were fitted together.

    Attributes:
        name: "draft", "paper" or the name of the coefficients file.
        trends: laws by quantity. `radius` and `length` follow from volume and aspect ratio;
            `rotor_inertia` is scored through predicted sizes, `rotor_inertia_of_size` at the
            module's own.
        correlation: correlation over the modules of the errors of two laws, by their quantities.
    """

    name: str
    trends: Mapping[str, Law]
    correlation: Mapping[tuple[str, str], float]

    def error(self, quantity: str) -> Law:
        """Law with the error band of a quantity whose inputs are known."""
        return self.trends.get(f"{quantity}_of_size", self.trends[quantity])


def radius(volume: Value, aspect_ratio: Value) -> Value:
    """Radius of a cylinder [m], from its volume [m3] and its length over diameter."""
    return power(volume / (2 * math.pi * aspect_ratio), 1 / 3)


@lru_cache(maxsize=8)
def laws(name: str = DEFAULT) -> Laws:
    """Shipped set of laws, "draft" or "paper"."""
    return _laws(name, _shipped()[name])


@lru_cache(maxsize=8)
def read_laws(path: Path) -> Laws:
    """Read the set `draft` of a coefficients file written by `draft trends fit --out`.

    Raises:
        DraftError: it cannot be read, or is not a coefficients file.
    """
    try:
        return _laws(path.name, json.loads(path.read_text(encoding="utf-8"))[DEFAULT])
    except OSError as error:
        cause = f"cannot be read: {(error.strerror or str(error)).lower()}"
    except (ValueError, KeyError, TypeError, AttributeError):
        cause = "holds no actuator trends"
    remedy = "write one: draft trends fit --catalogue YOURS.csv --out FILE"
    raise DraftError(Problem(cause, Location(str(path)), remedy))


@lru_cache(maxsize=1)
def _shipped() -> dict[str, Any]:
    return json.loads(FILE.read_text(encoding="utf-8"))


def _laws(name: str, record: dict[str, Any]) -> Laws:
    names, matrix = record["correlation"]["quantities"], record["correlation"]["matrix"]
    return Laws(
        name,
        {quantity: Law.read(quantity, law) for quantity, law in record["laws"].items()},
        {(a, b): matrix[i][k] for i, a in enumerate(names) for k, b in enumerate(names)},
    )
