"""Switch, sliders, keys and gamepad of the walking robot of one tab."""

from __future__ import annotations

import itertools
from collections.abc import Callable
from functools import partial

import viser

from draft.serving.gamepad import Gamepad, Sticks
from draft.studio.bindings import on, on_key
from draft.studio.tasks import TaskThread
from draft.studio.walker import Walker

_PUSH = 1.5  # velocity that a push adds at the start [m/s]
_NAMES = ("forward [m/s]", "left [m/s]", "turn left [rad/s]")


class WalkControls:
    """Elements of the tab that start, steer and push the robot.

    Attributes:
        gamepad: the gamepad of the tab, whose page the server answers.
    """

    def __init__(
        self,
        gui: viser.GuiApi,
        walker: Walker,
        tasks: TaskThread,
        switch: Callable[[bool], object],
    ) -> None:
        """Prepare the controls; `add_switch` and `add_commands` add them.

        Args:
            gui: elements of the tab.
            walker: the walking robot.
            tasks: thread of the tab.
            switch: called to start and stop the walk.
        """
        self._gui, self._walker, self._tasks, self._start = gui, walker, tasks, switch
        self.gamepad, self._pushes = Gamepad(self._lean), itertools.count()

    def add_switch(self) -> None:
        """Add the switch."""
        hint = "Let the robot walk with the policy that fits it best."
        self._switch = self._gui.add_checkbox("Walk", False, hint=hint)
        on(self._tasks, self._switch, "walk", self._start)

    def add_commands(self) -> None:
        """Add sliders and buttons, and bind the keys."""
        gui, walker = self._gui, self._walker
        self._sliders = [
            gui.add_slider(name, -most, most, step=0.05, initial_value=0.0)
            for name, most in zip(_NAMES, walker.most, strict=True)
        ]
        for slider in self._sliders:
            on(self._tasks, slider, "steer", lambda _: self._steer())
        self._size = gui.add_slider("push [m/s]", 0.2, 4.0, step=0.1, initial_value=_PUSH)
        pushes = gui.add_button_group("push", ["From the left", "From the right"])
        on(self._tasks, pushes, "push", lambda side: self._push(left=side == "From the right"))
        keys: dict[str, tuple[str, Callable[[], object]]] = {
            "Walk: faster": ("I", lambda: walker.nudge(forward=1)),
            "Walk: slower": ("K", lambda: walker.nudge(forward=-1)),
            "Walk: turn left": ("J", lambda: walker.nudge(turn=1)),
            "Walk: turn right": ("L", lambda: walker.nudge(turn=-1)),
            "Walk: to the left": ("U", lambda: walker.nudge(left=1)),
            "Walk: to the right": ("O", lambda: walker.nudge(left=-1)),
            "Walk: stand": ("M", lambda: walker.steer((0.0, 0.0, 0.0))),
            "Walk: push": ("P", lambda: self._push(left=True)),
        }
        for label, (key, action) in keys.items():
            on_key(gui, self._tasks, label, key, partial(self._press, action))
        gui.add_html(self.gamepad.frame)

    def refresh(self) -> None:
        """Show the state of the walking robot."""
        if self._switch.value != self._walker.on:
            self._switch.value = self._walker.on
        if not self._walker.on or self._tasks.waits("steer"):
            return
        limits = zip(self._sliders, self._walker.command, self._walker.most, strict=True)
        for slider, value, most in limits:
            if (slider.min, slider.max) != (-most, most):
                slider.min, slider.max = -most, most
            if slider.value != value:
                slider.value = value

    def _steer(self) -> None:
        vx, vy, wz = (slider.value for slider in self._sliders)
        self._walker.steer((vx, vy, wz))

    def _push(self, left: bool) -> None:
        self._walker.push(self._size.value, left)

    def _lean(self, sticks: Sticks) -> None:
        *shares, push = sticks
        self._tasks.submit("steer", partial(self._press, partial(self._walker.lean, *shares)))
        if push:  # a task of its own, which no newer one replaces
            task = partial(self._press, partial(self._push, left=push > 0))
            self._tasks.submit(f"push {next(self._pushes)}", task)

    def _press(self, action: Callable[[], object]) -> None:
        if self._walker.on:
            action()
