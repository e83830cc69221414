"""The panels of one browser tab: the robot, its fields, its numbers."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import viser

from draft.learn.policy.reduced import AnyPolicy
from draft.serving.gamepad import Gamepad
from draft.studio import cards, fields, live_cards, trend_cards
from draft.studio.bindings import Element, on, on_key
from draft.studio.controls import Controls
from draft.studio.drop import Drop
from draft.studio.levers import Levers
from draft.studio.levers_tab import LeversTab
from draft.studio.library import DEFAULT
from draft.studio.pinned_tab import PinnedTab
from draft.studio.scene3d import RobotMesh, surroundings
from draft.studio.session import Session
from draft.studio.tasks import TaskThread
from draft.studio.walk_controls import WalkControls
from draft.studio.walker import Walker
from draft.values import Array, scalar

WIDTH = 384  # of the panels, which leave 70 % of a window of 1280 pixels to the robot
LINK_WIDTH = 300  # of the panel of a clicked link
_FRAME = 1 / 30  # of a simulation [s]
# While sliders move, they show the walking robot, and frames between them are fewer: a browser
# without a GPU draws each of them for as long as a person waits for the slider [s].
_MOVING, _FRAME_MOVING = 0.6, 0.25
_CARDS = 0.2  # time between two updates of the cards of a walking robot [s]
_LAST = 1e9  # order of a folder below all others, also below those that are added later
_GRID = 1.0  # distance after which the lines of the floor repeat [m]


class Panel:
    """One tab. All of it belongs to one client, so that tabs do not affect each other."""

    def __init__(
        self,
        client: viser.ClientHandle,
        session: Session,
        out: Path,
        report: str,
        walk: bool = False,
        policies: Sequence[AnyPolicy] = (),
    ) -> None:
        """Build the tab.

        Args:
            client: connection to the tab.
            session: state of the tab.
            out: folder that models are exported to.
            report: URL path of its report page.
            walk: whether the robot walks at once.
            policies: policies to walk with before those that ship.
        """
        self._client, self._session, self._out, self._report = client, session, out, report
        self._drop: Drop | None = None
        self._clock = self._told = self._drawn = self._refreshed = time.monotonic()
        self._walker = Walker(policies)
        self._at_once = walk
        self._link: int | None = None
        self._live: list[tuple[viser.GuiHtmlHandle, Callable[[], str]]] = []
        self._html: list[tuple[viser.GuiHtmlHandle, Callable[[], str]]] = []
        self._joints: dict[str, viser.GuiSliderHandle] = {}
        self._tasks = TaskThread(self.refresh, self._simulate)
        self._levers = Levers()
        self._pull: LeversTab | None = None
        self._pinned: PinnedTab | None = None
        self._controls = Controls(client.gui, session, self._tasks, self._levers)
        self._walking = WalkControls(client.gui, self._walker, self._tasks, self._set_walking)
        self._robot = RobotMesh(client.scene, "/robot")
        self._ghost = RobotMesh(client.scene, "/pinned", ghost=True)
        try:
            with client.atomic():
                self._floor = surroundings(client.scene)
                self._build()
                for name, key, action in (
                    ("Undo", "cmd/ctrl", session.undo),
                    ("Redo", "cmd/ctrl+shift", session.redo),
                ):
                    on_key(client.gui, self._tasks, name, "Z", action, key)
        except BaseException:
            self.close()  # Nobody else knows of its thread.
            raise
        self._tasks.submit("first", self._point_camera)
        if walk:
            self._tasks.submit("walk", lambda: self._set_walking(True))

    @property
    def gamepad(self) -> Gamepad:
        """The gamepad that steers the walking robot of this tab."""
        return self._walking.gamepad

    def close(self) -> None:
        """End the thread of the tab, and with it the walk."""
        self._tasks.close()
        if self._pinned is not None:
            self._pinned.close()

    def refresh(self) -> None:
        """Show the state of the session: the robot first, then the numbers that changed."""
        with self._client.atomic():
            if self._robot.model is not self._session.shown:
                self._drop = None
            self._walker.follow(self._session.shown)
            if self._walker.walk is not None:
                self._robot.load(self._session.shown)
                self._ghost.show(None, np.zeros(0))
                self._place_walking()
            elif self._drop is None:
                angles = self._angles()
                self._robot.show(self._session.shown, angles)
                self._ghost.show(self._session.pinned, angles)
            self._controls.update_actuators()
            self._controls.refresh()
            self._walking.refresh()
            if self._pinned is not None:
                self._pinned.refresh(self._client.gui)
            self._design.options = (DEFAULT, *self._session.library.names())
            if not self._tasks.waits("design"):
                self._design.value = self._session.title
            if self._walker.walk is None or time.monotonic() - self._refreshed > _MOVING:
                self._update(self._html)
            else:  # those that are live follow with the next frame, or later while a stick moves
                self._update([shown for shown in self._html if shown not in self._live])
                if time.monotonic() - self._told > _MOVING:
                    self._told = time.monotonic()
                    self._update(self._live)
        self._client.flush()
        self._drawn = self._refreshed = time.monotonic()

    def _update(self, shown: list[tuple[viser.GuiHtmlHandle, Callable[[], str]]]) -> None:
        """Send the HTML elements whose content has changed."""
        for handle, render in shown:
            content = render()
            if handle.content != content:
                handle.content = content

    def _build(self) -> None:
        gui = self._client.gui
        gui.set_panel_label("Draft studio")
        gui.configure_theme(show_logo=False, show_share_button=False, brand_color=(53, 97, 143))
        gui.main_panel.dock_right()
        gui.main_panel.set_width(WIDTH)
        self._build_numbers()
        scene = self._client.scene

        @scene.on_click()
        def _(event: viser.SceneClickEvent) -> None:
            ray = np.array(event.ray_origin), np.array(event.ray_direction)
            self._tasks.submit("pick", partial(self._pick, *ray))

        self._show(lambda: cards.STYLE + cards.head(self._session))
        self._build_head()
        self._show(self._levers_card)
        tabs = gui.add_tab_group()
        self._controls.tab = tabs.add_tab("Parameters")
        with self._controls.tab:
            self._controls.add_parameters()
            with gui.add_folder("derived", order=_LAST, expand_by_default=False):
                self._show(lambda: cards.derived(self._session))
                self._controls.add_derived_resets()
        self._controls.update_actuators()
        with tabs.add_tab("Levers"):
            self._pull = LeversTab(gui, self._session, self._tasks, self._levers)
        with tabs.add_tab("Pose"):
            self._build_poses()
        with tabs.add_tab("Expression"):
            self._build_expression()
        with tabs.add_tab("Save"):
            self._build_saving()

    def _build_numbers(self) -> None:
        panel = self._client.gui.add_panel()
        session = self._session
        if self._at_once:  # The first tab is the one that is open.
            with panel.add_tab("Walk"):
                self._build_walk()
        with panel.add_tab("Overview"):
            self._show(lambda: cards.masses(session))
            self._show(lambda: cards.findings(session.design))
            self._show(lambda: trend_cards.torque_speed(session))
        if not self._at_once:
            with panel.add_tab("Walk"):
                self._build_walk()
        with panel.add_tab("Actuators"):
            self._show(lambda: cards.actuators(session.design))
        with panel.add_tab("Trends"):
            self._show(lambda: trend_cards.trends(session))
        self._pinned = PinnedTab(panel, session)
        panel.dock_below(self._client.gui.main_panel)

    def _levers_card(self) -> str:
        return "" if self._pull is None else self._pull.told()

    def _build_walk(self) -> None:
        self._walking.add_switch()
        self._show(lambda: live_cards.walking(self._walker), live=True)
        self._walking.add_commands()
        self._show(lambda: live_cards.region(self._walker))
        self._show(self._loads_card, live=True)

    def _loads_card(self) -> str:
        if self._walker.walk is None:
            return ""
        return trend_cards.torque_speed(self._session, self._walker.loads())

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
            "Pin": self._session.pin,
            "Unpin": self._session.unpin,
        }
        hint = "Pin keeps this design as a ghost to compare with."
        buttons = gui.add_button_group("", [*steps], hint=hint)
        self._on(buttons, "step", lambda step: steps[step]())

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
                self._on(slider, f"joint {name}", lambda _: self._stop_simulation())
        self._homes = self._home()

    def _build_expression(self) -> None:
        gui, session = self._client.gui, self._session
        names = fields.names(session.library.spec)
        self._show(
            lambda: cards.plain(
                "Set any field, also a derived one: a number, or an expression of parameters and "
                "actuator values, such as 1.2 * thigh_length; *1.2 scales the present value. Enter "
                "applies it; empty resets it."
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

    def _show(self, render: Callable[[], str], live: bool = False) -> None:
        """Add an HTML element that is updated whenever its content changes.

        Args:
            render: gives its content.
            live: whether it also changes while the robot walks.
        """
        shown = (self._client.gui.add_html(render()), render)
        self._html.append(shown)
        if live:
            self._live.append(shown)

    def _on(self, handle: Element, key: str, action: Callable[[Any], object]) -> None:
        on(self._tasks, handle, key, action)

    def _home(self) -> dict[str, float]:
        return {name: scalar(joint.home) for name, joint in self._session.design.joints.items()}

    def _set_joints(self, home: bool) -> None:
        self._stop_simulation()
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
        self._stop_simulation()
        if how != "Stop":
            self._robot.show(self._session.shown, self._angles())
            self._drop = Drop(self._session.shown, self._angles(), self._robot.base, how == "Held")
            self._clock = time.monotonic()

    def _stop_simulation(self) -> None:
        self._drop = None
        self._set_walking(False)

    def _set_walking(self, on: bool) -> None:
        self._drop = None
        if on:
            self._walker.start(self._session.shown)
        else:
            self._walker.stop()
            self._floor.position = (0.0, 0.0, 0.0)
        self._clock = time.monotonic()

    def _place_walking(self) -> None:
        """Show the walking robot in the middle of the scene; the floor moves below it."""
        walk = self._walker.walk
        if walk is None:
            return
        at = self._walker.place()
        self._robot.place(walk.data, at)
        x, y = (float(-value % _GRID) for value in at[:2])
        self._floor.position = (x, y, 0.0)

    def _simulate(self) -> float | None:
        """Show the next frame of a fall or a walk; returns the time until the next call [s]."""
        walking = self._walker.walk is not None
        if not walking and (self._drop is None or self._drop.over):
            return None
        now = time.monotonic()
        elapsed, self._clock = now - self._clock, now
        self._walker.advance(elapsed)
        if walking and now - self._refreshed < _MOVING and now - self._drawn < _FRAME_MOVING:
            return _FRAME
        self._drawn = now
        with self._client.atomic():
            if walking:
                self._place_walking()
                if now - self._told > _CARDS:
                    self._told = now
                    self._update(self._live)
            elif self._drop is not None:
                self._drop.advance(min(elapsed, 0.1))
                self._robot.place(self._drop.data)
        self._client.flush()
        return _FRAME

    def _link_card(self) -> str:
        if self._link is None or self._link >= len(self._session.design.bodies):
            return ""
        return live_cards.link(self._session.design, self._link)

    def _pick(self, origin: Array, direction: Array) -> None:
        """Choose the link that a ray of the scene meets."""
        body = self._robot.hit(origin, direction)
        if body is None:
            return
        if self._link is None:
            panel = self._client.gui.add_panel()
            with panel.add_tab("Link"):
                self._show(self._link_card)
            panel.float(x=12, y=12, width=LINK_WIDTH)
        self._link = body - 1

    def _point_camera(self) -> None:
        """Place the camera so that it sees the whole robot."""
        self.refresh()
        size = self._robot.extent
        camera = self._client.camera
        camera.position = np.array([0.9, -1.03, 0.45]) * size
        camera.look_at = np.array([0.0, 0.0, 0.5 * self._robot.base])
