"""State of one tab of the studio, without the browser: values, undo, named designs."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path

from draft.design import Design, resolve
from draft.errors import DraftError, ResolveError
from draft.model import Model
from draft.model.model import preview
from draft.spec.expressions import parse
from draft.spec.relative import merged, spelled_out
from draft.studio import fields
from draft.studio.library import ASK, DEFAULT, Library, Setting, check_name
from draft.values import scalar

# Changes of one field within this time of each other are one step of undo [s].
GESTURE = 1.0
_MAX_UNDO = 1000


@dataclass(frozen=True)
class Point:
    """A point in the history of undo: the loaded design and the changes to it.

    Attributes:
        base: name of the loaded design; "" for the values in parameters.yaml.
        values: changed values by name.
        loaded: values of the design when it was loaded, by name: its file may change later, as by
            another tab. A session reads them where they are None.
    """

    base: str = ""
    values: Mapping[str, Setting] = field(default_factory=dict)
    loaded: Mapping[str, Setting] | None = None

    @property
    def origin(self) -> Point:
        """The loaded design without changes."""
        return replace(self, values={})


class Session:
    """State of one browser tab.

    Models here need not have passed the design filter.

    Attributes:
        library: named designs, shared by all tabs.
        point: the loaded design and the changes to it.
        origin: model of the loaded design without changes.
        shown: model of the last design that could be compiled.
        pinned: model to compare with; None for none.
        message: why the last change failed; "" if it did not.
    """

    def __init__(
        self,
        library: Library,
        begin: Point = Point(),
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self.library = library
        self.point = begin if begin.loaded is not None else self._load(begin.base, begin.values)
        self.origin = self.shown = self._compile(self.point.origin)
        if begin.values:
            self.shown = self._compile(self.point)
        self.pinned: Model | None = None
        self.message = ""
        self._past: list[Point] = []
        self._exported: set[Path] = set()
        self._future: list[Point] = []
        self._clock = clock
        self._last: tuple[str, float] = ("", -math.inf)

    @property
    def design(self) -> Design:
        """The last design that could be compiled."""
        return self.shown.design

    @property
    def title(self) -> str:
        """Name of the loaded design."""
        return self.point.base or DEFAULT

    def value(self, name: str, of: Design | None = None) -> Setting:
        """Value of a parameter, or of `actuators.CLASS.QUANTITY`, in SI units."""
        design = of or self.design
        if not name.startswith("actuators."):
            return scalar(design.parameters[name])
        _, actuator, quantity = name.split(".")
        return getattr(design.actuators[actuator], quantity)

    def changed(self) -> dict[str, Setting]:
        """Values of the loaded design, by name, of the fields that differ from it."""
        return {name: self.value(name, self.origin.design) for name in self.point.values}

    def set(self, name: str, value: Setting) -> bool:
        """Change one field; the value of the loaded design removes the change.

        Returns:
            Whether it succeeded; if not, `message` says why and the state is unchanged.
        """
        return self.set_all({name: value}, name)

    def set_all(self, changes: Mapping[str, Setting], gesture: str) -> bool:
        """Change several fields at once, as `set`.

        Args:
            changes: values by name.
            gesture: changes of one gesture within a second of each other are one step of undo.
        """
        values = {**self.point.values, **changes}
        known = fields.names(self.library.spec)
        for name, value in changes.items():
            if name in known and _same(value, self.value(name, self.origin.design)):
                del values[name]
        if values == self.point.values:
            self.message = ""
            return True
        last, when = self._last
        now = self._clock()
        continues = last == gesture and now - when < GESTURE
        done = self._move_to(replace(self.point, values=values), remember=not continues)
        if done:
            self._last = (gesture, now)
        return done

    def set_text(self, name: str, text: str) -> bool:
        """Change one field to typed text: a number, an expression, or the name of a part.

        Empty text restores the value of the loaded design. `*1.2` scales the present value. Text is
        parsed by Draft and never run.
        """
        text = str(spelled_out(name, text.strip()))
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
            value = merged(self.point.values, {name: text})[name]
        except DraftError as error:
            self.message = str(error)
            return False
        return self.set(name, value)

    def reset(self, name: str) -> bool:
        """Remove the change of one field."""
        values = {key: value for key, value in self.point.values.items() if key != name}
        return self._step(replace(self.point, values=values))

    def reset_all(self) -> bool:
        """Remove all changes."""
        return self._step(self.point.origin)

    def load(self, name: str) -> bool:
        """Load a named design; "" loads the values in parameters.yaml."""
        try:
            point = self._load(name)
        except DraftError as error:
            self.message = str(error)
            return False
        return self._step(point)

    def undo(self) -> bool:
        """Go one step back."""
        return self._step_along(self._past, self._future)

    def redo(self) -> bool:
        """Go one step forward."""
        return self._step_along(self._future, self._past)

    def pin(self) -> None:
        """Keep the current design to compare with."""
        self.pinned = self.shown

    def unpin(self) -> None:
        """Drop the pinned design."""
        self.pinned = None

    def save(self, name: str, replace: bool = False) -> Path | None:
        """Save the current design under a name, and load it.

        Args:
            name: name of the design.
            replace: whether a design of this name may be replaced.

        Returns:
            The file; None if it failed, and `message` says why.
        """
        try:
            path = self.library.save(name, self._values(self.point), replace)
        except DraftError as error:
            self.message = str(error)
            return None
        self.load(name)
        return path

    def export(self, name: str, folder: Path, replace: bool = False) -> Path | None:
        """Write the model's folder, `folder`/`name`.

        Args:
            name: name of the model's folder.
            folder: folder of all exported models.
            replace: whether a model that this session wrote may be replaced; others are kept.

        Returns:
            The folder; None if it failed, and `message` says why.
        """
        path = folder / name
        try:
            check_name(name)
            own = path in self._exported
            if path.exists() and not (own and replace):
                remedy = ASK if own else "choose another name"
                raise DraftError(f"'{path}' exists already; it is kept", remedy)
            model = self.design.build()
            self.library.writes.count()
            path = model.save(path)
            self._exported.add(path)
        except DraftError as error:
            self.message = str(error)
            return None
        self.message = ""
        return path

    def _step(self, point: Point) -> bool:
        return self._move_to(point, remember=point != self.point)

    def _move_to(self, point: Point, remember: bool) -> bool:
        """Move to a point, if its design can be compiled."""
        try:
            model = self._compile(point)
            same = point.origin == self.point.origin
            origin = self.origin if same else self._compile(point.origin)
        except DraftError as error:
            self.message = str(error)
            return False
        if remember:
            self._past = [*self._past, self.point][-_MAX_UNDO:]
            self._future = []
        self._last = ("", -math.inf)
        self.point, self.shown, self.message = point, model, ""
        self.origin = origin if point.values else model
        return True

    def _step_along(self, source: list[Point], target: list[Point]) -> bool:
        if not source:
            return False
        here, future, past = self.point, self._future, self._past
        if not self._move_to(source[-1], remember=False):
            return False
        self._future, self._past = future, past
        source.pop()
        target.append(here)
        return True

    def _load(self, name: str, values: Mapping[str, Setting] | None = None) -> Point:
        """Point of a named design as its file is now, with changes.

        Raises:
            DraftError: there is no such design, or its file is invalid.
        """
        return Point(name, values or {}, dict(self.library.read(name).values) if name else {})

    def _values(self, point: Point) -> dict[str, Setting]:
        return merged(point.loaded or {}, point.values)

    def _compile(self, point: Point) -> Model:
        """Resolve and compile the design of a point, also if the design filter refuses it.

        Raises:
            DraftError: the values give no robot.
        """
        label = "_".join([point.base, *["custom"] * bool(point.values)]).strip("_") or DEFAULT
        design = resolve(self.library.spec, self._values(point), label=label, places={})
        for finding in design.findings:
            if finding.id == "not_physical":
                raise ResolveError(finding.message, "undo the change")
        return preview(design)


def _same(value: Setting, other: Setting) -> bool:
    if isinstance(value, float) and isinstance(other, (int, float)):
        return math.isclose(value, other, rel_tol=1e-9)
    return value == other
