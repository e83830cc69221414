"""Sizing of actuator classes: all quantities from the stated ones."""

from __future__ import annotations

import math
from collections.abc import Collection, Iterable, Mapping
from dataclasses import dataclass, replace

import numpy as np

from draft.errors import Location, Problem, ResolveError
from draft.laws import actuators as law
from draft.laws.actuators import Laws
from draft.laws.catalogue import SERVO, Part
from draft.laws.limits import copper_loss
from draft.laws.quantities import CORNER, QUANTITIES, TREND, Identity, Quantities
from draft.laws.servos import usual_face_ratio
from draft.laws.torque_speed import Line, stall_torque, torque_speed
from draft.spec.primitives.shape import ShapePart
from draft.values import (
    Value,
    brief,
    every,
    exp,
    log,
    maximum,
    minimum,
    some,
    sqrt,
    where,
)

PI = math.pi
DRIVE = ("peak_torque", "no_load_speed", "gear_ratio", "peak_power")
ENVELOPE = ("radius", "length", "aspect_ratio")


@dataclass(frozen=True, slots=True)
class Origin:
    """Origin of a number.

    Attributes:
        kind: "stated", "trend", "derived" (an identity such as N^2 J) or "catalogue".
        detail: the law, identity or part, as text.
        trend: name of the trend that predicts it; None without one.
        inputs: names of the quantities that it depends on.
        other_trend: trend that predicts it for the others of N designs; None without one.
    """

    kind: str
    detail: str = ""
    trend: str | None = None
    inputs: tuple[str, ...] = ()
    other_trend: str | None = None

    @property
    def trends(self) -> tuple[str, ...]:
        """Names of the trends that predict it."""
        return tuple(name for name in (self.trend, self.other_trend) if name is not None)


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class Actuator(Quantities):
    """A sized actuator class; each number is a float or an array of shape (N,).

    Torque and speed are at the output, rotor inertia on the motor side. Units: N m, rad/s, W, kg,
    m3, m, kg m2, N m s/rad. `laws` are those used for sizing; `part` is the catalogue part that it
    starts from, and `like` its name; `shape` is a part of one's own in place of its solid.

    It is a linear motor whose current is limited: up to `corner_speed` it has its peak torque, and
    from there the torque falls to zero at the no-load speed. The corner is 0 unless one is stated:
    then the line starts at standstill.
    """

    name: str
    part: Part | None
    origins: Mapping[str, Origin]
    laws: Laws
    shape: ShapePart | None = None

    def __repr__(self) -> str:
        shown = ("peak_torque", "no_load_speed", "gear_ratio", "mass")
        units = (QUANTITIES[name].table_unit or ": 1" for name in shown)
        numbers = (
            f"{brief(getattr(self, name))} {unit}" for name, unit in zip(shown, units, strict=True)
        )
        return f"Actuator('{self.name}', {', '.join(numbers)})"

    @property
    def like(self) -> str | None:
        """Name of the catalogue part that it starts from; None for none."""
        return self.part.name if self.part is not None else None

    @property
    def kind(self) -> str:
        """Family whose laws size it: "module" or "servo"."""
        return self.laws.kind

    @property
    def quantities(self) -> tuple[str, ...]:
        """Names of the numbers that it states or a law gives, in the order of the table.

        Without those of a corner, if it has none.
        """
        return tuple(
            name
            for name, one in QUANTITIES.items()
            if name in self.origins or one.default is not None
        )

    @property
    def has_corner(self) -> bool:
        """Whether any design has full peak torque beyond standstill."""
        return some(self.corner_speed > 0)

    @property
    def stall_torque(self) -> Value:
        """Torque of the motor at standstill without its current limit [N m]; at least the peak."""
        if not self.has_corner:
            return self.peak_torque
        return stall_torque(self.peak_torque, self.no_load_speed, self.corner_speed)

    @property
    def copper_loss(self) -> Value:
        """Heat of the motor per torque squared [W/(N m)^2], see `draft.laws.limits`."""
        line = self.peak_torque, self.no_load_speed, self.corner_speed
        return copper_loss(*line, self.rated_torque, self.surface)

    @property
    def is_box(self) -> bool:
        """Whether it is a box, as servos are; else a cylinder."""
        return self.kind == SERVO

    @property
    def longest(self) -> Value:
        """Longest edge of its box, or of the box around its cylinder [m]."""
        across = self.height if self.is_box else 2.0 * self.radius
        return maximum(across, self.length)

    @property
    def surface(self) -> Value:
        """Surface of its box or cylinder [m2]."""
        if self.is_box:
            around = self.width + self.height
            return 2.0 * (self.width * self.height + around * self.length)
        return 2.0 * PI * self.radius * (self.radius + self.length)

    def through(self, ratio: Value, efficiency: Value) -> Actuator:
        """The actuator as a joint sees it behind a transmission.

        Torques grow by ratio and efficiency, speeds fall by the ratio, and inertia and viscous
        friction grow by its square. The weight of the module is where it is.

        Args:
            ratio: turns of the output per turn of the joint.
            efficiency: share of the torque that arrives.
        """
        gain = ratio * efficiency
        return replace(
            self,
            peak_torque=self.peak_torque * gain,
            rated_torque=self.rated_torque * gain,
            no_load_speed=self.no_load_speed / ratio,
            corner_speed=self.corner_speed / ratio,
            gear_ratio=self.gear_ratio * ratio,
            peak_power=self.peak_power * efficiency,
            armature=self.armature * ratio * ratio,
            friction_loss=self.friction_loss * ratio,
            damping=self.damping * ratio * ratio,
        )

    def available(self, speed: Value) -> Value:
        """Torque available at a speed in the direction of the torque [N m]; zero or more.

        Args:
            speed: speed at the output [rad/s], zero or more.
        """
        line = self.stall_torque * maximum(1.0 - speed / self.no_load_speed, 0.0)
        return minimum(self.peak_torque, line)

    def fastest(self, torque: Value) -> Value:
        """Highest speed at which a torque is available [rad/s]; 0 beyond the peak torque.

        Args:
            torque: torque at the output [N m], zero or more.
        """
        speed = self.no_load_speed * maximum(1.0 - torque / self.stall_torque, 0.0)
        return where(torque <= self.peak_torque, speed, 0.0) if self.has_corner else speed

    def torque_speed(self) -> Line:
        """Points of the line of torque over speed, as pairs of rad/s and N m, speeds rising."""
        return torque_speed(self.peak_torque, self.no_load_speed, self.corner_speed)


class _Sizer:
    """Sizes one class; keeps each number and its origin."""

    def __init__(
        self,
        stated: Mapping[str, Value],
        part: Part | None,
        laws: Laws,
        errors: Mapping[str, Value],
    ) -> None:
        self.value: dict[str, Value] = dict(stated)
        self.origin: dict[str, Origin] = dict.fromkeys(stated, _STATED)
        self.part = part
        self.laws = laws
        self.errors = errors

    def has(self, *names: str) -> bool:
        return all(name in self.value for name in names)

    def follow(self, laws: Iterable[tuple[str, Identity]]) -> None:
        """Use each identity whose inputs are known, for a quantity that is not."""
        for name, one in laws:
            if name not in self.value and self.has(*one.inputs):
                self.value[name] = one.value(*(self.value[each] for each in one.inputs))
                self.origin[name] = Origin("derived", one.text, None, one.inputs)

    def measured(self, name: str) -> None:
        """Use the value of the part."""
        if self.part is not None and name not in self.value:
            self.value[name] = getattr(self.part, name)
            self.origin[name] = Origin("catalogue", self.part.name)

    def rated(self) -> None:
        """Use the trend of the rated torque for modules of this kind of reduction."""
        if self.has("rated_torque"):
            return None
        high = self.value["gear_ratio"] >= law.HIGH_RATIO
        if not some(high):
            return self.trend("rated_torque")
        self.trend("rated_torque", law.HIGH_RATIO_RATED)
        if every(high):
            return None
        above, of_above = self.value.pop("rated_torque"), self.origin.pop("rated_torque")
        self.trend("rated_torque")
        of_below = self.origin["rated_torque"]
        self.value["rated_torque"] = where(high, above, self.value["rated_torque"])
        if of_above.trend is not None:
            detail = f"{of_below.detail}; from a reduction of {law.HIGH_RATIO:g}, {of_above.detail}"
            self.origin["rated_torque"] = replace(
                of_below, detail=detail, other_trend=of_above.trend
            )
        return None

    def trend(self, name: str, law_name: str = "") -> None:
        """Use the trend; with a part, the part's value times the ratio of the trend.

        Args:
            name: the quantity.
            law_name: its law; "" for the law of its name.
        """
        if name in self.value:
            return
        inverted = name in _INVERSE
        trend = self.laws.law(law_name or _INVERSE.get(name, name))
        error = self.errors.get(trend.name, 0.0)
        inputs = (_INVERSE[name],) if inverted else trend.inputs
        call = trend.inverse if inverted else trend
        arguments = [self.value[i] for i in inputs]
        part = self.part
        own = getattr(part, name) if part else None
        if part is None or own is None:
            formula = f"inverse of {trend.formula}" if inverted else trend.formula
            if some(error != 0.0):
                # The law errs, so that its inverse is that at a smaller value.
                fold = exp(error)
                value = call(arguments[0] / fold) if inverted else call(*arguments) * fold
            else:
                value = call(*arguments)
            self.value[name] = value
            self.origin[name] = Origin("trend", formula, trend.name, inputs)
            return
        reference = [self.part_value(part, i) for i in inputs]
        if all(np.all(a == b) for a, b in zip(arguments, reference, strict=True)):
            self.value[name] = own
            self.origin[name] = Origin("catalogue", part.name)
        else:
            ratio = call(*arguments) / call(*reference)
            self.value[name] = own * ratio * self._error_factor(trend.name, ratio)
            detail = f"{part.name}, deviation by {trend.formula}"
            self.origin[name] = Origin("trend", detail, trend.name, inputs)

    def _error_factor(self, quantity: str, ratio: Value) -> Value:
        """Error factor of a law that predicts only the effect of a deviation from a part.

        Two modules of one vendor and family that differ by 10 to 25 % scatter about the law almost
        as much as unrelated ones, so the error grows to its full size over the first 10 %.
        """
        error = self.errors.get(quantity, 0.0)
        return exp(error * minimum(1.0, abs(log(ratio)) / _FULL)) if some(error != 0.0) else 1.0

    def part_value(self, part: Part, quantity: str) -> Value:
        """Value of a part, or that of the trend if the vendor does not publish it."""
        own = getattr(part, quantity)
        return self.laws.trends["gear_ratio"](part.no_load_speed) if own is None else own


_STATED = Origin("stated")
# Deviation from a part, as |ln ratio|, above which the error of a law has its full size.
_FULL = 0.1
# Quantities predicted by the inverse of the law of another one, which is their only input.
_INVERSE = {"no_load_speed": "gear_ratio"}


def size(
    name: str,
    stated: Mapping[str, Value],
    part: Part | None,
    where: Location | None = None,
    laws: Laws | None = None,
    errors: Mapping[str, Value] | None = None,
    by_trend: Collection[str] = (),
) -> Actuator:
    """Size an actuator class.

    Args:
        name: name of the class.
        stated: stated quantities by name, in SI units; they are not changed.
        part: catalogue part whose measured values apply unless another value is stated.
        where: place of the class in its file.
        laws: the trends; None for the shipped ones.
        errors: assumed ln(true / predicted) by law.
        by_trend: quantities that follow a trend only if asked to: "corner_speed", or none.

    Raises:
        ResolveError: fewer than two of torque, speed, reduction and power are stated, or all three
            of radius, length and aspect ratio; or torque or speed is to follow from the power of a
            motor with a corner.
    """
    if all(quantity in stated for quantity in ENVELOPE):
        raise ResolveError(
            Problem(
                f"actuator '{name}' states {', '.join(ENVELOPE)}: any two determine the third",
                where,
                "remove one of them",
            )
        )
    drawn = {k: x for k, x in stated.items() if QUANTITIES[k].default is None}
    sizer = _Sizer(drawn, part, laws or law.laws(), errors or {})
    _drive(sizer, name, where, by_trend)
    sizer.rated()
    _envelope(sizer)
    _edges(sizer)
    for quantity, line in QUANTITIES.items():
        if isinstance(line.law, Identity):
            sizer.follow([(quantity, line.law)])
        elif line.law == TREND:
            sizer.trend(quantity)
        elif line.default is not None:
            sizer.value[quantity] = stated.get(quantity, line.default)
    return Actuator(
        name=name,
        part=part,
        origins=sizer.origin,
        laws=sizer.laws,
        shape=None,
        **sizer.value,
    )


def _drive(s: _Sizer, name: str, where: Location | None, by_trend: Collection[str] = ()) -> None:
    """Derive torque, speed, reduction and power from any two of them, and the corner."""
    given = [quantity for quantity in DRIVE if s.has(quantity)]
    cornered = CORNER in by_trend or s.has(CORNER)
    if cornered and "peak_power" in given and not s.has("peak_torque", "no_load_speed"):
        raise ResolveError(
            Problem(
                f"actuator '{name}' states {CORNER}, and its torque or speed would follow from "
                "peak_power, which holds for a straight line",
                where,
                "state peak_torque, and no_load_speed or gear_ratio, in place of peak_power",
            )
        )
    if s.part is not None:
        _drive_of_part(s, s.part, given)
    elif len(given) < 2:
        raise ResolveError(
            Problem(
                f"actuator '{name}' states {given[0] if given else 'nothing'}; two of "
                f"{', '.join(DRIVE)} are needed",
                where,
                "state another one, or start from a part with 'like: NAME'",
            )
        )
    s.follow(_OF_POWER)
    if s.has("gear_ratio"):
        s.trend("no_load_speed")
    s.trend("gear_ratio")
    s.follow(_OF_POWER)
    s.trend("peak_torque")
    if cornered:
        s.trend(CORNER, law.CORNER)
    else:
        s.value[CORNER] = 0.0
    s.follow({"peak_power": _CORNERED if cornered else _STRAIGHT}.items())


def _peak_power(torque: Value, speed: Value, corner: Value) -> Value:
    """Largest power of a motor with a corner [W]: there, or at half of the no-load speed."""
    early = torque * speed / (4 * (1 - minimum(corner / speed, 0.5)))
    return where(2 * corner <= speed, early, torque * corner)


def _drive_of_part(s: _Sizer, part: Part, given: list[str]) -> None:
    """Use the part for quantities that are neither stated nor follow from a stated power."""
    if "peak_power" in given:
        follows = "no_load_speed" if "peak_torque" in given else "peak_torque"
    else:
        follows = ""
    for quantity in ("peak_torque", "no_load_speed", "gear_ratio"):
        if quantity != follows and getattr(part, quantity) is not None:
            s.measured(quantity)


_OF_POWER = (
    ("peak_torque", Identity("4 P / w", ("peak_power", "no_load_speed"), lambda p, w: 4 * p / w)),
    ("no_load_speed", Identity("4 P / tau", ("peak_power", "peak_torque"), lambda p, t: 4 * p / t)),
)
_STRAIGHT = Identity("tau w / 4", ("peak_torque", "no_load_speed"), lambda t, w: t * w / 4)
_CORNERED = Identity(
    "largest tau w of the line", ("peak_torque", "no_load_speed", CORNER), _peak_power
)
# Sizes of the enclosing cylinder, in the order in which they are tried.
_ASPECT = "aspect_ratio", Identity("l / 2r", ("length", "radius"), lambda h, r: h / (2 * r))
_LENGTH = "length", Identity("2 a r", ("aspect_ratio", "radius"), lambda a, r: 2 * a * r)
_CYLINDER = (
    *(_ASPECT, _LENGTH),
    ("radius", Identity("l / 2a", ("length", "aspect_ratio"), lambda h, a: h / (2 * a))),
    ("volume", Identity("pi r^2 l", ("radius", "length"), lambda r, h: PI * r * r * h)),
    ("length", Identity("V / pi r^2", ("volume", "radius"), lambda v, r: v / (PI * r * r))),
    ("radius", Identity("(V / pi l)^(1/2)", ("volume", "length"), lambda v, h: sqrt(v / (PI * h)))),
    ("radius", Identity("(V / 2 pi a)^(1/3)", ("volume", "aspect_ratio"), law.radius)),
    *(_LENGTH, _ASPECT),
)


def _envelope(s: _Sizer) -> None:
    """Derive volume, aspect ratio, radius and length; any of them may be stated."""
    s.follow(_CYLINDER)
    if s.has("volume"):
        return
    s.trend("volume")
    if not (s.has("radius") or s.has("length")):
        s.trend("aspect_ratio")
        if s.origin["aspect_ratio"].kind == s.origin["volume"].kind == "catalogue":
            s.measured("radius")
            s.measured("length")
    s.follow(_CYLINDER)


def _edges(s: _Sizer) -> None:
    """Derive the edges across the axis; only those of a box have an origin of their own."""
    radius = s.value["radius"]
    if s.laws.kind != SERVO:
        s.value["width"] = s.value["height"] = 2.0 * radius
        return
    own = s.part.face_ratio if s.part is not None else None
    ratio = usual_face_ratio() if own is None else own
    of_radius = s.origin["radius"]
    printed = own is not None and of_radius.kind == "catalogue"
    for edge, share in (("width", 1.0 / ratio), ("height", ratio)):
        s.value[edge] = math.sqrt(PI * share) * radius
        s.origin[edge] = of_radius if printed else Origin("derived", _FACE, None, ("radius",))


# The longer edge is the usual multiple of the shorter one, or that of the part.
_FACE = "width height = pi r^2"
