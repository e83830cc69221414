"""Numbers of a written spec: rounded, named, and with the range that makes sense."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field

from draft.imports.names import Unique

# Value as YAML will have it: text (an expression or a word), number, list or mapping.
Value = str | float | bool | list["Value"] | dict[str, "Value"]
NAMED: dict[tuple[float, ...], str] = {
    (1.0, 0.0, 0.0): "x",
    (0.0, 1.0, 0.0): "y",
    (0.0, 0.0, 1.0): "z",
    (-1.0, 0.0, 0.0): "-x",
    (0.0, -1.0, 0.0): "-y",
    (0.0, 0.0, -1.0): "-z",
}
LOWEST, HIGHEST = 0.4, 2.5


def tidy(value: float, digits: int = 5) -> float:
    """Number to so many decimals, without a negative zero."""
    return float(round(float(value), digits)) + 0.0


def vector(values: Iterable[float], digits: int = 5) -> list[Value]:
    """List of tidy numbers."""
    return [tidy(value, digits) for value in values]


def direction(values: Iterable[float]) -> Value:
    """x, -y and the like where a unit vector is one, else its components to 1e-6."""
    rounded = tuple(tidy(value, 6) for value in values)
    named = NAMED.get(rounded)
    return named if named is not None else [*rounded]


def along(axis: Iterable[float], expression: str) -> list[Value]:
    """Expression times a unit vector: `[0, -(expression), 0]`."""
    found: list[Value] = []
    for x in axis:
        share = tidy(x, 6)
        if share == 0:
            found.append(0.0)
        elif abs(share) == 1:
            found.append(expression if share > 0 else f"-({expression})")
        else:
            found.append(f"{share:g} * ({expression})")
    return found


@dataclass(frozen=True, slots=True)
class Parameter:
    """One line of parameters.yaml."""

    value: float
    unit: str
    range: tuple[float, float]
    doc: str


@dataclass
class Parameters:
    """The parameters of a written spec, in order."""

    unique: Unique
    table: dict[str, Parameter] = field(default_factory=dict)

    def add(self, name: str, value: float, doc: str, digits: int = 5, unit: str = "m") -> str:
        """Add a length [m], or what else has a unit, and return the name that it got."""
        name, value = self.unique(name), tidy(value, digits)
        ends = sorted((tidy(LOWEST * value, 4), tidy(HIGHEST * value, 4)))
        self.table[name] = Parameter(value, unit, (ends[0], ends[1]), doc)
        return name

    def place(self, name: str, at: Iterable[float], doc: str) -> list[Value]:
        """Add the components of a point that are not zero, as `name_x` and so on."""
        found: list[Value] = []
        for letter, value in zip("xyz", at, strict=True):
            if abs(tidy(value)) < 1e-4:
                found.append(tidy(value))
            else:
                found.append(self.add(f"{name}_{letter}", value, f"{doc}, along {letter}."))
        return found
