"""Numbers of a written spec: rounded, named, and with the range that makes sense."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
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
# Dimensions of a chain: the name asked for, the parameter that was made, its value.
Record = list[tuple[str, str, float]]
LOWEST, HIGHEST = 0.4, 2.5
# Difference of lengths that are meant to be alike: a share, and the least difference [m].
SAME, LEAST_GAP = 0.02, 0.003


def tidy(value: float, digits: int = 5) -> float:
    """Number to so many decimals, without a negative zero."""
    return float(round(float(value), digits)) + 0.0


def vector(values: Iterable[float], digits: int = 5) -> list[Value]:
    """List of tidy numbers."""
    return [tidy(value, digits) for value in values]


def direction(values: Iterable[float], digits: int = 6) -> Value:
    """x, -y and the like where a unit vector is one, else its components to so many decimals."""
    rounded = tuple(tidy(value, digits) for value in values)
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


@dataclass(frozen=True, slots=True)
class Deviation:
    """Difference between a dimension and that of the chain's counterpart.

    Attributes:
        name: parameter of the counterpart.
        own: parameter with the offset, or with the value where it is no longer shared.
        shared: whether both use `name`, the second with an offset.
        value: this dimension less the counterpart's [m].
    """

    name: str
    own: str
    shared: bool
    value: float


@dataclass
class Parameters:
    """The parameters of a written spec, in order.

    Attributes:
        unique: source of names.
        table: parameters by name.
        deviations: dimensions in which chains differ from their counterparts.
        digits: decimals of lengths, where a caller does not say [m].
    """

    unique: Unique
    table: dict[str, Parameter] = field(default_factory=dict)
    deviations: list[Deviation] = field(default_factory=list)
    digits: int = 5
    _record: Record | None = None
    _known: dict[tuple[str, int], list[tuple[str, float]]] = field(default_factory=dict)
    _asked: Counter[str] = field(default_factory=Counter)
    _side: str = ""

    @contextmanager
    def chain(self, side: str = "", counterparts: Sequence[Record] = ()) -> Iterator[Record]:
        """Record the dimensions that are added within, and share those of counterparts.

        Args:
            side: prefix of the dimensions in which this chain differs, such as "right_".
            counterparts: what earlier uses of this method gave for the chain's counterparts.

        Yields:
            The record of this chain, filled in on the way.
        """
        before = self._record, self._known, self._asked, self._side
        self._record, self._known, self._asked, self._side = [], {}, Counter(), side
        for one in counterparts:
            seen: Counter[str] = Counter()
            for asked, name, value in one:
                self._known.setdefault((asked, seen[asked]), []).append((name, value))
                seen[asked] += 1
        try:
            yield self._record
        finally:
            self._record, self._known, self._asked, self._side = before

    @contextmanager
    def recording(self) -> Iterator[Record]:
        """Record the dimensions that are added within, besides any other record."""
        before = self._record
        own: Record = []
        self._record = own
        try:
            yield own
        finally:
            self._record = before
            if before is not None:
                before.extend(own)

    def add(
        self, name: str, value: float, doc: str, digits: int | None = None, unit: str = "m"
    ) -> str:
        """Add a length [m] or a quantity in another unit.

        Returns:
            The parameter that was made. In a chain with a counterpart whose dimension is equal
            within the tolerance: the counterpart's parameter, plus an offset where they differ.
        """
        digits = self.digits if digits is None else digits
        value = tidy(value, digits)
        others = self._known.get((name, self._asked[name]))
        self._asked[name] += 1
        if others:
            near = min(others, key=lambda one: abs(one[1] - value))
            return self._against(near, name, value, doc, digits, unit)
        made = self._make(name, value, doc, unit)
        self._note(name, made, value)
        return made

    def value(self, text: str) -> float:
        """Value of what `add` returned."""
        return sum(self.table[name].value for name in text.split(" + "))

    def _note(self, asked: str, name: str, value: float) -> None:
        if self._record is not None:
            self._record.append((asked, name, value))

    def _make(
        self, name: str, value: float, doc: str, unit: str, ends: tuple[float, float] | None = None
    ) -> str:
        name = self.unique(name)
        if ends is None:
            low, high = sorted((tidy(LOWEST * value, 4), tidy(HIGHEST * value, 4)))
            ends = low, high
        self.table[name] = Parameter(value, unit, ends, doc)
        return name

    def _against(
        self, known: tuple[str, float], asked: str, value: float, doc: str, digits: int, unit: str
    ) -> str:
        """Dimension of a chain whose counterpart has one of the same name."""
        shared, other = known
        gap = tidy(value - other, digits)
        if abs(gap) > tolerance(other, unit):
            made = self._make(f"{self._side}{asked}", value, doc, unit)
            self._note(asked, made, value)
            self.deviations.append(Deviation(shared, made, False, gap))
            return made
        self._note(asked, shared, other)
        if gap == 0:
            return shared
        most = tidy(max(tolerance(other, unit), abs(gap)), digits)
        text = f"{doc.rstrip('.')}, less {shared}."
        made = self._make(f"{self._side}{shared}_offset", gap, text, unit, (-most, most))
        self.deviations.append(Deviation(shared, made, True, gap))
        return f"{shared} + {made}"

    def place(
        self, name: str, at: Iterable[float], doc: str, mirrored: Iterable[float] = (1, 1, 1)
    ) -> list[Value]:
        """Add the components of a point that are not zero, as `name_x` and so on.

        Args:
            name: what to name them after.
            at: the point [m].
            doc: description of the point.
            mirrored: -1 where the counterpart's component has the opposite sign.
        """
        found: list[Value] = []
        for letter, value, sign in zip("xyz", at, mirrored, strict=True):
            if abs(tidy(value)) < 1e-4:
                found.append(tidy(value, self.digits))
                continue
            made = self.add(f"{name}_{letter}", sign * value, f"{doc}, along {letter}.")
            found.append(made if sign > 0 else f"-({made})" if " " in made else f"-{made}")
        return found


def tolerance(value: float, unit: str = "m") -> float:
    """Largest difference between two sides of a robot that are meant to be alike."""
    least = LEAST_GAP if unit == "m" else 0.0
    return max(SAME * abs(value), least)


def grouped(expression: str) -> str:
    """An expression that may be a factor of another."""
    return f"({expression})" if " " in expression else expression
