"""The panels of one browser tab: the robot, its fields, its numbers."""

from __future__ import annotations

import itertools
import time
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import viser

from draft.studio import cards, fields, trend_cards
from draft.studio.controls import Controls, Handle
from draft.studio.drop import Drop
from draft.studio.scene3d import RobotMesh, surroundings
from draft.studio.session import Session
from draft.studio.tasks import TaskThread
from draft.values import Array, scalar

FIELDS_WIDTH, NUMBERS_WIDTH = 372, 332
DEFAULT = "default"
_FRAME = 1 / 30  # of a simulation [s]


class Panel:
    """One tab. All of it belongs to one client, so that tabs do not affect each other."""

    def __init__(
        self, client: viser.ClientHandle, session: Session, out: Path, report: str
    ) -> None:
        """Build the tab.

        Args:
            client: connection to the tab.
            session: state of the tab.
            out: folder that models are exported to.
            report: URL path of its report page.
        """
        self._client, self._session, self._out, self._report = client, session, out, report
        self._drop: Drop | None = None
        self._clock = time.monotonic()
        self._html: list[tuple[viser.GuiHtmlHandle, Callable[[], str]]] = []
        self._joints: dict[str, viser.GuiSliderHandle] = {}
        self._tasks = TaskThread(self.refresh, self._simulate)
        self._controls = Controls(client.gui, session, self._tasks)
        self._robot = RobotMesh(client.scene, "/robot")
        self._ghost = RobotMesh(client.scene, "/pinned", ghost=True)
        with client.atomic():
            surroundings(client.scene)
            self._build()
        self._tasks.submit("first", self._point_camera)

    def close(self) -> None:
        """End the thread of the tab."""
        self._tasks.close()

    def refresh(self) -> None:
        """Show the state of the session: the robot first, then the numbers that changed."""
        with self._client.atomic():
            if self._robot.model is not self._session.shown:
                self._drop = None
            if self._drop is None:
                angles = self._angles()
                self._robot.show(self._session.shown, angles)
                self._ghost.show(self._session.pinned, angles)
            self._controls.update_actuators()
            self._controls.refresh()
            self._design.options = (DEFAULT, *self._session.library.names())
            if not self._tasks.waits("design"):
                self._design.value = self._session.title
            for handle, render in self._html:
                content = render()
                if handle.content != content:
                    handle.content = content
        self._client.flush()

    def _build(self) -> None:
        gui = self._client.gui
        gui.set_panel_label("Draft studio")
        gui.configure_theme(show_logo=False, show_share_button=False, brand_color=(53, 97, 143))
        gui.main_panel.dock_right()
        gui.main_panel.set_width(FIELDS_WIDTH)
        self._build_numbers()
        self._show(lambda: cards.STYLE + cards.head(self._session))
        self._build_head()
        tabs = gui.add_tab_group()
        with tabs.add_tab("Shape"):
            self._controls.add_parameters()
            with gui.add_folder("derived", expand_by_default=False):
                self._show(lambda: cards.derived(self._session))
                self._controls.add_derived_resets()
        self._controls.actuator_tab = tabs.add_tab("Drive")
        self._controls.update_actuators()
        with tabs.add_tab("Pose"):
            self._build_poses()
        with tabs.add_tab("Expression"):
            self._build_expression()
        with tabs.add_tab("Save"):
            self._build_saving()

    def _build_numbers(self) -> None:
        panel = self._client.gui.add_panel()
        session = self._session
        with panel.add_tab("Overview"):
            self._show(lambda: cards.masses(session))
            self._show(lambda: cards.findings(session.design))
            self._show(lambda: trend_cards.torque_speed(session))
        with panel.add_tab("Actuators"):
            self._show(lambda: cards.actuators(session.design))
        with panel.add_tab("Trends"):
            self._show(lambda: trend_cards.trends(session))
        panel.dock_right()
        panel.set_width(NUMBERS_WIDTH)

    def _build_head(self) -> None:
        gui = self._client.gui
        names = [DEFAULT, *self._session.library.names()]
        self._design = gui.add_dropdown(
            "design", names, initial_value=self._session.title, hint="Load a named design."
        )
        self._on(
            self._design, "design", lambda name: self._session.load("" if name == DEFAULT else name)
        )
        steps = {
            "Undo": self._session.undo,
            "Redo": self._session.redo,
            "Reset all": self._session.reset_all,
        }
        buttons = gui.add_button_group("change", [*steps])
        self._on(buttons, "step", lambda step: steps[step]())
        hint = "Keep this design as a ghost to compare with."
        compare = gui.add_button_group("compare", ["Pin", "Unpin"], hint=hint)
        pins = {"Pin": self._session.pin, "Unpin": self._session.unpin}
        self._on(compare, "pin", lambda pin: pins[pin]())

    def _build_poses(self) -> None:
        gui = self._client.gui
        moves = gui.add_button_group("pose", ["Home", "Zero"])
        self._on(moves, "pose", lambda pose: self._set_joints(home=pose == "Home"))
        drops = gui.add_button_group("drop", ["Limp", "Held", "Stop"], hint="Drop the robot.")
        self._on(drops, "drop", self._start_drop)
        with gui.add_folder("joints"):
            for name, joint in self._session.design.joints.items():
                low, high = (scalar(x) for x in joint.range)
                slider = gui.add_slider(
                    f"{name} [{'m' if joint.slide else 'rad'}]",
                    min=low,
                    max=high,
                    step=0.01,
                    initial_value=min(max(scalar(joint.home), low), high),
                )
                self._joints[name] = slider
                self._on(slider, f"joint {name}", lambda _: self._stop_drop())
        self._homes = self._home()

    def _build_expression(self) -> None:
        gui, session = self._client.gui, self._session
        names = fields.names(session.library.spec)
        self._show(
            lambda: cards.plain(
                "Set any field, also a derived one: a number, or an expression of parameters and "
                "actuator values, such as 1.2 * thigh_length. Enter applies it; empty resets it."
            )
        )
        with gui.add_form(None) as form:
            field = gui.add_dropdown("field", names)
            value = gui.add_text("value", "")
        button = gui.add_button("Apply")

        def apply() -> None:
            session.set_text(field.value, value.value)

        async def submitted(_: viser.GuiEvent[Any]) -> None:
            self._tasks.submit(f"type {field.value}", apply)

        form.on_submit(submitted)
        button.on_click(submitted)

    def _build_saving(self) -> None:
        gui, session = self._client.gui, self._session
        name = gui.add_text("name", "my_design", hint="Letters, digits and _")
        hint = "Write over the design, or the model of this tab, that has the name."
        again = gui.add_checkbox("Replace", False, hint=hint)

        async def save(_: viser.GuiEvent[Any]) -> None:
            replace, again.value = again.value, False
            task = partial(session.save, name.value, replace)
            self._tasks.submit("save", lambda: self._notify(task(), "Saved"))

        async def export(_: viser.GuiEvent[Any]) -> None:
            replace, again.value = again.value, False
            task = partial(session.export, name.value, self._out, replace)
            self._tasks.submit("export", lambda: self._notify(task(), "Exported"))

        gui.add_button("Save as named design").on_click(save)
        gui.add_button("Export MuJoCo model", color="gray").on_click(export)
        self._show(
            lambda: cards.plain("") + cards.link(self._report, "Open the report in a new tab")
        )

    def _notify(self, path: Path | None, what: str) -> None:
        if path is not None:
            self._client.add_notification(what, str(path), auto_close_seconds=6, color="green")

    def _show(self, render: Callable[[], str]) -> None:
        """Add an HTML element that is updated whenever its content changes."""
        self._html.append((self._client.gui.add_html(render()), render))

    def _on(
        self,
        handle: Handle | viser.GuiButtonGroupHandle,
        key: str,
        action: Callable[[Any], object],
    ) -> None:
        """Call an action with the value of an element when the user changes or clicks it.

        A newer value replaces a waiting one; clicks are all carried out.
        """
        count = itertools.count()

        async def clicked(_: viser.GuiEvent[Any]) -> None:
            self._tasks.submit(f"{key} {next(count)}", partial(_call, action, handle.value))

        async def changed(event: viser.GuiEvent[Any]) -> None:
            if event.client_id is not None:  # a person's change, not one of `refresh`
                self._tasks.submit(key, partial(_call, action, handle.value))

        if isinstance(handle, viser.GuiButtonGroupHandle):
            handle.on_click(clicked)
        else:
            handle.on_update(changed)

    def _home(self) -> dict[str, float]:
        return {name: scalar(joint.home) for name, joint in self._session.design.joints.items()}

    def _set_joints(self, home: bool) -> None:
        self._drop = None
        for name, value in self._home().items():
            handle = self._joints[name]
            handle.value = min(max(value if home else 0.0, handle.min), handle.max)

    def _angles(self) -> Array:
        """Positions of the joints [rad or m]; a joint in its home pose follows a changed home."""
        homes = self._home()
        for name, value in homes.items():
            handle = self._joints[name]
            if value != self._homes[name] and abs(handle.value - self._homes[name]) < 0.006:
                handle.value = min(max(value, handle.min), handle.max)
        self._homes = homes
        return np.array([handle.value for handle in self._joints.values()])

    def _start_drop(self, how: str) -> None:
        self._stop_drop()
        if how != "Stop":
            self._robot.show(self._session.shown, self._angles())
            self._drop = Drop(self._session.shown, self._angles(), self._robot.base, how == "Held")
            self._clock = time.monotonic()

    def _stop_drop(self) -> None:
        self._drop = None

    def _simulate(self) -> float | None:
        """Show the next frame of a fall; returns the time until the next call [s]."""
        if self._drop is None or self._drop.over:
            return None
        now = time.monotonic()
        self._drop.advance(min(now - self._clock, 0.1))
        self._clock = now
        with self._client.atomic():
            self._robot.place(self._drop.data)
        self._client.flush()
        return _FRAME

    def _point_camera(self) -> None:
        """Place the camera so that it sees the whole robot."""
        self.refresh()
        size = self._robot.extent
        camera = self._client.camera
        camera.position = np.array([1.05, -1.2, 0.5]) * size
        camera.look_at = np.array([0.0, 0.0, 0.5 * self._robot.base])


def _call(action: Callable[[Any], object], value: Any) -> None:
    action(value)
