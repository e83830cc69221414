"""What looks wrong in a table of actuators: slips of units, copies, and rows out of the ordinary.

Each row is held against what other modules of its torque, speed and reduction have. A number that
is far off, and would be ordinary if it had been entered in another unit or for the other side of
the reduction, is such a slip; one that no slip explains is implausible. Known slips: grams for
kilograms, rpm for rad/s, the motor's speed for the output's, the inertia seen at the output for the
rotor's, a radius for a diameter, centimetres or metres for millimetres.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass

from draft.errors import Location
from draft.laws.actuators import Laws, laws
from draft.laws.catalogue import Part
from draft.laws.table import RPM

# Folds from the trend beyond which a row is questioned, a little above the widest of the shipped
# rows: 2.5, 2.8, 4.3, 1.6 and 1.6.
LIMITS = {"mass": 3.0, "no_load_speed": 3.0, "rotor_inertia": 5.0, "radius": 1.7, "length": 2.0}
# Slips whose factors are closer than this cannot be told apart; all are named.
ALIKE = 2.5
WORDS = {
    "mass": ("mass", "kg", 1.0),
    "no_load_speed": ("no-load speed", "rad/s", 1.0),
    "rotor_inertia": ("rotor inertia", "kg m2", 1.0),
    "radius": ("diameter", "mm", 2000.0),
    "length": ("length", "mm", 1000.0),
}


@dataclass(frozen=True, slots=True)
class Doubt:
    """Something that looks wrong with a row.

    Attributes:
        kind: "unit_slip", "duplicate", "implausible", or "contradicted" by a source that the row
            names.
        name: module.
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
    """A slip of a quantity: by which factor it is off, and how to mend it."""

    quantity: str
    factor: Callable[[Part], float]
    words: str


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
    """Everything that looks wrong in a catalogue, in its order."""
    parts = list(parts)
    doubts = [*_copies(parts), *(doubt for part in parts for doubt in _row(part, laws()))]
    order = {part.name: i for i, part in enumerate(parts)}
    return sorted(doubts, key=lambda doubt: order[doubt.name])


def _copies(parts: list[Part]) -> Iterable[Doubt]:
    """Rows that say the same as an earlier one."""
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
            yield Doubt("duplicate", part.name, part.where, text, "take one of them out")


def _row(part: Part, trusted: Laws) -> Iterable[Doubt]:
    """Hold one row against the trends."""
    if part.doubt:
        remedy = "compare with the maker's current datasheet; the row is used as it is"
        yield Doubt("contradicted", part.name, part.where, part.doubt, remedy)
    if part.rated_torque is not None and part.rated_torque > part.peak_torque:
        text = f"rated torque {part.rated_torque:g} N m is above the peak {part.peak_torque:g}"
        yield Doubt("implausible", part.name, part.where, text, "look at its source")
    for quantity, usual in _usual(part, trusted).items():
        published = getattr(part, quantity)
        off = math.log(published / usual)
        if abs(off) <= math.log(LIMITS[quantity]):
            continue
        words, unit, factor = WORDS[quantity]
        text = f"{words} {published * factor:.4g} {unit}, where such modules have about "
        text += f"{usual * factor:.3g}"
        slips = _explain(part, quantity, off)
        if slips:
            remedy = "perhaps " + "; or ".join(slips)
            yield Doubt("unit_slip", part.name, part.where, text, remedy)
        else:
            yield Doubt("implausible", part.name, part.where, text, "look at its source")


def _explain(part: Part, quantity: str, off: float) -> list[str]:
    """The slips that would bring a deviation inside its limit: the best, and those like it."""
    gaps = {
        slip.words: abs(off - math.log(slip.factor(part)))
        for slip in SLIPS
        if slip.quantity == quantity and slip.factor(part) != 1.0
    }
    best = min(gaps.values(), default=math.inf)
    if best > math.log(LIMITS[quantity]):
        return []
    return [words for words, gap in gaps.items() if gap <= best + math.log(ALIKE)]


def _usual(part: Part, trusted: Laws) -> dict[str, float]:
    """What modules like this one have, from numbers of its that are not themselves in question."""
    trends = trusted.trends
    usual = {"mass": float(trends["mass"](part.peak_torque))}
    if part.gear_ratio is None:
        return usual
    usual["no_load_speed"] = float(trends["gear_ratio"].inverse(part.gear_ratio))
    volume = float(trends["volume"](part.peak_torque, part.gear_ratio))
    aspect = float(trends["aspect_ratio"](part.gear_ratio))
    usual["radius"] = (volume / (2 * math.pi * aspect)) ** (1 / 3)
    usual["length"] = 2 * aspect * usual["radius"]
    if part.rotor_inertia is not None and not part.small_geared_inrunner:
        sizes = {"mass": usual["mass"], "radius": usual["radius"], "gear_ratio": part.gear_ratio}
        rotor = trends["rotor_inertia"]
        usual["rotor_inertia"] = float(rotor(*(sizes[name] for name in rotor.inputs)))
    return usual
