"""Sliders for the values of a design, with a mark and a reset where a value is changed."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import AbstractContextManager, nullcontext
from typing import Any, NamedTuple

import viser

from draft.studio import fields
from draft.studio.fields import NO_PART, Slider
from draft.studio.levers import Levers
from draft.studio.library import Setting
from draft.studio.session import Session
from draft.studio.tasks import TaskThread
from draft.values import scalar

MARK = "● "
OPEN = 10  # folders below so many sliders are collapsed
Handle = viser.GuiSliderHandle[float] | viser.GuiDropdownHandle[str]


class Control(NamedTuple):
    """A field in the browser: what it sets, its element, and its reset button."""

    slider: Slider
    handle: Handle
    reset: viser.GuiButtonGroupHandle


class Controls:
    """All fields of one tab.

    Attributes:
        tab: context in which folders of actuator classes are added.
    """

    def __init__(
        self, gui: viser.GuiApi, session: Session, tasks: TaskThread, levers: Levers
    ) -> None:
        self._gui, self._session, self._tasks, self._levers = gui, session, tasks, levers
        self._effects: dict[str, str] = {}
        self.tab: AbstractContextManager[object] = nullcontext()
        self._controls: dict[str, Control] = {}
        self._values: dict[str, Setting] = {}
        self._folders: dict[str, tuple[tuple[str, ...], viser.GuiFolderHandle]] = {}
        self._resets: dict[str, viser.GuiButtonGroupHandle] = {}

    def add_parameters(self) -> None:
        """Add sliders of the stated parameters, in groups."""
        for group, parameters in fields.groups(self._session.library.spec).items():
            with self._folder(group):
                for parameter in parameters:
                    value = scalar(self._session.value(parameter.name))
                    self._slider(fields.slider(parameter, value))

    def update_actuators(self) -> None:
        """Add a folder per actuator class: sliders of its stated quantities, and its part.

        A class is rebuilt when the design states other quantities of it than before.
        """
        for name, actuator in self._session.design.actuators.items():
            sliders = [
                *fields.stated(self._session.design, name),
                *fields.frictions(self._session.design, name),
            ]
            stated = tuple(slider.name for slider in sliders)
            if name in self._folders:
                if self._folders[name][0] == stated:
                    continue
                self._folders[name][1].remove()
                self._forget(f"actuators.{name}.")
            with self.tab:
                folder = self._folder(f"actuator {name}", name in self._folders)
            with folder:
                self._part(name, actuator.like)
                for slider in sliders:
                    self._slider(slider)
            self._folders[name] = (stated, folder)

    def _folder(self, title: str, used: bool = False) -> viser.GuiFolderHandle:
        """Add a folder, collapsed if it lies below many sliders and is not in use already."""
        opened = used or len(self._controls) < OPEN
        return self._gui.add_folder(title, expand_by_default=opened)

    def add_derived_resets(self) -> None:
        """Add a reset for each derived parameter, visible while it is overridden."""
        for text in fields.derived(self._session.library.spec):
            self._resets[text.name] = self._reset(text.name)

    def refresh(self) -> None:
        """Update values, marks and resets from the session."""
        changed = self._session.changed()
        self._effects = self._levers.effects(self._session.design)
        for name, control in self._controls.items():
            marked = name in changed
            self._mark(control, marked, changed.get(name))
            # A field keeps a value that failed, next to the message that says why.
            if not self._session.message and not self._tasks.waits(name):
                self._update(name, control)
        for name, button in self._resets.items():
            button.visible = name in changed

    def _update(self, name: str, control: Control) -> None:
        value = self._session.value(name)
        if value == self._values.get(name):
            return
        self._values[name] = value
        handle = control.handle
        if isinstance(handle, viser.GuiDropdownHandle):
            handle.value = str(value or NO_PART)
            return
        number = scalar(value)
        handle.min = min(handle.min, number)
        handle.max = max(handle.max, number)
        handle.value = number

    def _mark(self, control: Control, marked: bool, before: Setting) -> None:
        effect = self._effects.get(control.slider.name, "")
        label = (MARK if marked else "") + _label(control.slider) + (f"  {effect}" * bool(effect))
        if control.handle.label != label:
            control.handle.label = label
        if control.reset.visible != marked:
            control.reset.visible = marked
        if marked:
            shown = f"{before:.4g}" if isinstance(before, (int, float)) else before or NO_PART
            text = f"reset to {shown} {control.slider.unit}".strip()
            if control.reset.options != (text,):
                control.reset.options = (text,)

    def _slider(self, slider: Slider) -> None:
        value = scalar(self._session.value(slider.name))
        handle = self._gui.add_slider(
            _label(slider),
            min=min(slider.low, value),
            max=max(slider.high, value),
            step=slider.step,
            initial_value=value,
            hint=f"{slider.name}: {slider.doc} {slider.low:g} to {slider.high:g} "
            f"{slider.unit}".strip(),
        )
        self._add(slider, handle, lambda: float(handle.value), value)

    def _part(self, actuator: str, like: str | None) -> None:
        name = f"actuators.{actuator}.like"
        options = fields.parts(self._session.library.spec)
        handle = self._gui.add_dropdown(
            "like",
            options,
            initial_value=like or NO_PART,
            hint="A catalogue module; its measured values hold unless another value is stated.",
        )
        part = Slider(name, "like", "", 0, 0, 1, "")
        self._add(part, handle, lambda: None if handle.value == NO_PART else handle.value, like)

    def _add(
        self, slider: Slider, handle: Handle, read: Callable[[], Setting], value: Setting
    ) -> None:
        name = slider.name
        self._controls[name] = Control(slider, handle, self._reset(name))
        self._values[name] = value

        def apply() -> None:
            self._values[name] = now = read()
            if isinstance(now, float):
                moved = self._levers.moved(self._session.design, name, now)
                self._session.set_all(moved, name)
            else:
                self._session.set(name, now)

        async def moved(event: viser.GuiEvent[Any]) -> None:
            if event.client_id is not None:
                self._tasks.submit(name, apply)

        handle.on_update(moved)

    def _reset(self, name: str) -> viser.GuiButtonGroupHandle:
        button = self._gui.add_button_group("", [f"reset {name}"], visible=False)

        def apply() -> None:
            self._session.reset(name)

        async def clicked(_: viser.GuiEvent[Any]) -> None:
            self._tasks.submit(f"reset {name}", apply)

        button.on_click(clicked)
        return button

    def _forget(self, prefix: str) -> None:
        for name in [name for name in self._controls if name.startswith(prefix)]:
            del self._controls[name], self._values[name]


def _label(slider: Slider) -> str:
    return f"{slider.label} [{slider.unit}]" if slider.unit else slider.label
