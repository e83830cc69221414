"""Check of a table of actuators for unit errors, duplicates and implausible numbers.

Each row is compared with the trends of modules of its torque, speed and reduction. A number far
from the trend that would be plausible in another unit, or on the other side of the reduction, is a
unit slip; any other is implausible. Known slips: grams for kilograms, rpm for rad/s, the motor's
speed for the output's, the inertia at the output for the rotor's, a radius for a diameter,
centimetres or metres for millimetres.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass

from draft.errors import Location
from draft.laws.actuators import laws
from draft.laws.catalogue import Part
from draft.laws.law import Law
from draft.laws.table import RPM

# Fold errors beyond which a row is reported, a little above the largest of the shipped rows: 2.5,
# 2.8, 4.3, 1.6 and 1.6.
LIMITS = {"mass": 3.0, "no_load_speed": 3.0, "rotor_inertia": 5.0, "radius": 1.7, "length": 2.0}
# Slips whose factors differ by less than this cannot be distinguished; all are reported.
ALIKE = 2.5
# Name in messages, unit, and factor from SI to that unit.
LABELS = {
    "mass": ("mass", "kg", 1.0),
    "no_load_speed": ("no-load speed", "rad/s", 1.0),
    "rotor_inertia": ("rotor inertia", "kg m2", 1.0),
    "radius": ("diameter", "mm", 2000.0),
    "length": ("length", "mm", 1000.0),
}


@dataclass(frozen=True, slots=True)
class Doubt:
    """A suspicious row.

    Attributes:
        kind: "unit_slip", "duplicate", "implausible", or "contradicted" by a source that the row
            names.
        name: name of the module.
        where: file and line.
        text: what looks wrong, with the numbers.
        remedy: what to do about it.
    """

    kind: str
    name: str
    where: Location
    text: str
    remedy: str

    def record(self) -> dict[str, object]:
        """Plain data for JSON."""
        return {
            "kind": self.kind,
            "name": self.name,
            "file": self.where.file,
            "line": self.where.line,
            "text": self.text,
            "remedy": self.remedy,
        }


@dataclass(frozen=True, slots=True)
class Slip:
    """A unit slip: the quantity, the factor between wrong and right, and the likely cause."""

    quantity: str
    factor: Callable[[Part], float]
    cause: str


SLIPS = (
    Slip("mass", lambda part: 1000.0, "grams, not kilograms"),
    Slip("no_load_speed", lambda part: 1 / RPM, "rpm, not rad/s"),
    Slip(
        "no_load_speed", lambda part: part.gear_ratio or 1.0, "the motor's speed, not the output's"
    ),
    Slip(
        "no_load_speed",
        lambda part: (part.gear_ratio or 1.0) / RPM,
        "the motor's speed in rpm, not the output's in rad/s",
    ),
    Slip(
        "rotor_inertia",
        lambda part: (part.gear_ratio or 1.0) ** 2,
        "the inertia at the output, not the rotor's: divide by the reduction squared",
    ),
    Slip("rotor_inertia", lambda part: 1e4, "kg cm2, not kg m2"),
    Slip("rotor_inertia", lambda part: 1e7, "g cm2, not kg m2"),
    Slip("rotor_inertia", lambda part: 1e9, "g mm2, not kg m2"),
    Slip("radius", lambda part: 0.5, "a radius, not a diameter"),
    Slip("radius", lambda part: 0.1, "centimetres, not millimetres"),
    Slip("radius", lambda part: 0.001, "metres, not millimetres"),
    Slip("length", lambda part: 0.1, "centimetres, not millimetres"),
    Slip("length", lambda part: 0.001, "metres, not millimetres"),
)


def check(parts: Iterable[Part]) -> list[Doubt]:
    """Suspicious rows of a catalogue, in its order."""
    parts = list(parts)
    doubts = [*_copies(parts), *(doubt for part in parts for doubt in _row(part, laws().trends))]
    order = {part.name: i for i, part in enumerate(parts)}
    return sorted(doubts, key=lambda doubt: order[doubt.name])


def _copies(parts: list[Part]) -> Iterable[Doubt]:
    """Rows with the same numbers as an earlier one."""
    first: dict[tuple[object, ...], Part] = {}
    for part in parts:
        numbers = (
            part.peak_torque,
            part.no_load_speed,
            part.gear_ratio,
            part.mass,
            part.radius,
            part.length,
        )
        same = first.setdefault(numbers, part)
        if same is not part:
            text = f"has the numbers of '{same.name}' at {same.where}"
            yield Doubt("duplicate", part.name, part.where, text, "remove one of them")


def _row(part: Part, trends: Mapping[str, Law]) -> Iterable[Doubt]:
    """Compare one row with the trends."""
    if part.doubt:
        remedy = "compare with the maker's current datasheet; the row is used as it is"
        yield Doubt("contradicted", part.name, part.where, part.doubt, remedy)
    if part.rated_torque is not None and part.rated_torque > part.peak_torque:
        text = f"rated torque {part.rated_torque:g} N m is above the peak {part.peak_torque:g}"
        yield Doubt("implausible", part.name, part.where, text, "check its source")
    for quantity, expected in _expected(part, trends).items():
        published = getattr(part, quantity)
        error = math.log(published / expected)
        if abs(error) <= math.log(LIMITS[quantity]):
            continue
        label, unit, factor = LABELS[quantity]
        text = f"{label} {published * factor:.4g} {unit}, where such modules have about "
        text += f"{expected * factor:.3g}"
        slips = _causes(part, quantity, error)
        if slips:
            remedy = "perhaps " + "; or ".join(slips)
            yield Doubt("unit_slip", part.name, part.where, text, remedy)
        else:
            yield Doubt("implausible", part.name, part.where, text, "check its source")


def _causes(part: Part, quantity: str, error: float) -> list[str]:
    """Causes of the slips that explain an error: the best one, and those like it."""
    gaps = {
        slip.cause: abs(error - math.log(slip.factor(part)))
        for slip in SLIPS
        if slip.quantity == quantity and slip.factor(part) != 1.0
    }
    best = min(gaps.values(), default=math.inf)
    if best > math.log(LIMITS[quantity]):
        return []
    return [cause for cause, gap in gaps.items() if gap <= best + math.log(ALIKE)]


def _expected(part: Part, trends: Mapping[str, Law]) -> dict[str, float]:
    """Expected quantities of a module [SI], from its torque and reduction alone."""
    expected = {"mass": float(trends["mass"](part.peak_torque))}
    if part.gear_ratio is None:
        return expected
    expected["no_load_speed"] = float(trends["gear_ratio"].inverse(part.gear_ratio))
    volume = float(trends["volume"](part.peak_torque, part.gear_ratio))
    aspect = float(trends["aspect_ratio"](part.gear_ratio))
    expected["radius"] = (volume / (2 * math.pi * aspect)) ** (1 / 3)
    expected["length"] = 2 * aspect * expected["radius"]
    if part.rotor_inertia is not None and not part.small_geared_inrunner:
        sizes = expected | {"gear_ratio": part.gear_ratio}
        rotor = trends["rotor_inertia"]
        expected["rotor_inertia"] = float(rotor(*(sizes[name] for name in rotor.inputs)))
    return expected
