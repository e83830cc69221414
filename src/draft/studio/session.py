"""What one person does in the studio, without a browser: values, undo, named designs."""

# pyright: reportAttributeAccessIssue=false
# (MuJoCo's compiled modules carry no types.)
from __future__ import annotations

import math
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path

import mujoco

from draft.design import Design, resolve
from draft.errors import DraftError, Problem, ResolveError
from draft.model.mjcf import robot_xml
from draft.spec.expressions import parse
from draft.studio import fields
from draft.studio.library import Library, Setting, check_name

# Changes of one field that follow each other within this time are one step of undo [s].
GESTURE = 1.0
_DEEPEST = 1000


@dataclass(frozen=True)
class Point:
    """A place that undo returns to: the loaded design, and what was changed of it.

    Attributes:
        base: name of the loaded design; "" for the values in parameters.yaml.
        values: what differs from it.
    """

    base: str = ""
    values: Mapping[str, Setting] = field(default_factory=dict)


@dataclass(frozen=True)
class Drawn:
    """A design and MuJoCo's model of it, which need not have passed the design filter."""

    design: Design
    robot: mujoco.MjModel


class Session:
    """One browser tab's state.

    Attributes:
        library: named designs, shared by all tabs.
        point: what is loaded and changed.
        origin: the loaded design without changes.
        good: the last design that could be drawn.
        pinned: a design to compare with.
        message: why the last wish was not met; "" where it was.
    """

    def __init__(
        self, library: Library, base: str = "", clock: Callable[[], float] = time.monotonic
    ) -> None:
        self.library = library
        self.point = Point(base)
        self.origin = self.good = self._draw(self.point)
        self.pinned: Drawn | None = None
        self.message = ""
        self._past: list[Point] = []
        self._future: list[Point] = []
        self._clock = clock
        self._last: tuple[str, float] = ("", -math.inf)

    @property
    def design(self) -> Design:
        """The last design that could be drawn."""
        return self.good.design

    @property
    def title(self) -> str:
        """Name of the loaded design."""
        return self.point.base or "default"

    def can_undo(self) -> bool:
        """Whether there is a step back."""
        return bool(self._past)

    def can_redo(self) -> bool:
        """Whether there is a step forward."""
        return bool(self._future)

    def value(self, name: str, of: Design | None = None) -> Setting:
        """Value of a parameter, or of `actuators.CLASS.QUANTITY`, in SI units."""
        design = of or self.design
        if not name.startswith("actuators."):
            return design.parameters[name]  # type: ignore[return-value]
        _, actuator, quantity = name.split(".")
        return getattr(design.actuators[actuator], quantity)

    def _known(self, name: str) -> bool:
        return name in fields.names(self.library.spec)

    def changed(self) -> dict[str, Setting]:
        """Fields that differ from the loaded design, each with that design's value."""
        return {name: self.value(name, self.origin.design) for name in self.point.values}

    def set(self, name: str, value: Setting) -> bool:
        """Change one field; the loaded design's own value takes the change away.

        Returns:
            Whether it could be done; if not, `message` says why and all is as it was.
        """
        values = dict(self.point.values)
        values[name] = value
        if self._known(name) and _same(value, self.value(name, self.origin.design)):
            del values[name]
        if values == self.point.values:
            self.message = ""
            return True
        last, when = self._last
        now = self._clock()
        goes_on = last == name and now - when < GESTURE
        done = self._go(Point(self.point.base, values), remember=not goes_on)
        if done:
            self._last = (name, now)
        return done

    def set_text(self, name: str, text: str) -> bool:
        """Change one field to what was typed: a number, arithmetic, or a part's name.

        Nothing typed puts the loaded design's value back. Typed text is read by Draft's own
        parser; it never runs.
        """
        text = text.strip()
        if not text:
            return self.reset(name)
        try:
            number = float(text)
        except ValueError:
            number = math.nan
        if math.isfinite(number):
            return self.set(name, number)
        try:
            if not name.endswith(".like"):
                parse(text)
        except DraftError as error:
            self.message = str(error)
            return False
        return self.set(name, text)

    def reset(self, name: str) -> bool:
        """Take a change back."""
        values = {key: value for key, value in self.point.values.items() if key != name}
        return self._step(Point(self.point.base, values))

    def reset_all(self) -> bool:
        """Take all changes back."""
        return self._step(Point(self.point.base))

    def load(self, name: str) -> bool:
        """Load a named design; "" loads the values in parameters.yaml."""
        return self._step(Point(name))

    def undo(self) -> bool:
        """One step back."""
        return self._travel(self._past, self._future)

    def redo(self) -> bool:
        """One step forward."""
        return self._travel(self._future, self._past)

    def pin(self) -> None:
        """Keep the design of now to compare with."""
        self.pinned = self.good

    def unpin(self) -> None:
        """Compare with nothing."""
        self.pinned = None

    def save(self, name: str) -> Path | None:
        """Save the design of now under a name, and go on from it.

        Returns:
            The file; None where it could not be done, and `message` says why.
        """
        try:
            path = self.library.save(name, self._table(self.point), self.point.base)
        except DraftError as error:
            self.message = str(error)
            return None
        self._step(Point(name))
        return path

    def export(self, name: str, folder: Path) -> Path | None:
        """Write the model's folder, `folder`/`name`.

        Returns:
            The folder; None where it could not be done, and `message` says why.
        """
        try:
            check_name(name)
            path = self.design.build().save(folder / name)
        except DraftError as error:
            self.message = str(error)
            return None
        self.message = ""
        return path

    def _step(self, point: Point) -> bool:
        return self._go(point, remember=point != self.point)

    def _go(self, point: Point, remember: bool) -> bool:
        """Move to a point, if it can be drawn."""
        try:
            drawn = self._draw(point)
            origin = self.origin if point.base == self.point.base else self._draw(Point(point.base))
        except DraftError as error:
            self.message = str(error)
            return False
        if remember:
            self._past = [*self._past, self.point][-_DEEPEST:]
            self._future = []
        self._last = ("", -math.inf)
        self.point, self.good, self.message = point, drawn, ""
        self.origin = origin if point.values else drawn
        return True

    def _travel(self, source: list[Point], target: list[Point]) -> bool:
        if not source:
            return False
        here, future, past = self.point, self._future, self._past
        if not self._go(source[-1], remember=False):
            return False
        self._future, self._past = future, past
        source.pop()
        target.append(here)
        return True

    def _table(self, point: Point) -> dict[str, Setting]:
        base = self.library.read(point.base).values if point.base else {}
        return {**base, **point.values}

    def _draw(self, point: Point) -> Drawn:
        """Resolve a point and load it into MuJoCo, also where the design filter refuses it.

        Raises:
            DraftError: it gives no robot.
        """
        label = "_".join([point.base, *["custom"] * bool(point.values)]).strip("_") or "default"
        design = resolve(self.library.spec, self._table(point), label=label, places={})
        for finding in design.findings:
            if finding.id == "not_physical":
                raise ResolveError(Problem(finding.message, None, "change it back"))
        try:
            return Drawn(design, mujoco.MjModel.from_xml_string(robot_xml(design)))
        except ValueError as error:
            cause = f"MuJoCo does not accept this: {' '.join(str(error).split())}"
            raise ResolveError(Problem(cause, None, "change it back")) from None


def _same(value: Setting, other: Setting) -> bool:
    if isinstance(value, float) and isinstance(other, (int, float)):
        return math.isclose(value, other, rel_tol=1e-9)
    return value == other
