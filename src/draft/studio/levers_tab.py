"""Tab of the levers: the metric whose effects sliders show, one that is held, one to reach."""

from __future__ import annotations

import time
from typing import Any

import viser

from draft.errors import DraftError
from draft.explore.nearest import Solution
from draft.explore.sensitivity import closed_metrics, stated_numbers
from draft.studio import cards
from draft.studio.levers import NOTHING, Levers, between, to_target
from draft.studio.session import Session
from draft.studio.tasks import TaskThread

_FRAMES, _PAUSE = 12, 0.04  # Of the way to a solution [s].
_REACH = "reach"  # Gesture of it: one step of undo.


class LeversTab:
    """The tab's elements, and what they do."""

    def __init__(
        self, gui: viser.GuiApi, session: Session, tasks: TaskThread, levers: Levers
    ) -> None:
        """Add the elements."""
        self._session, self._tasks, self._levers = session, tasks, levers
        self._message = ""
        names = [NOTHING, *closed_metrics(session.design.spec, ())]
        numbers = [NOTHING, *stated_numbers(session.design)]
        self._metric = gui.add_dropdown(
            "effect on", names, hint="Sliders show what a step of each does to this metric."
        )
        self._held = gui.add_dropdown("hold", names, hint="This metric stays while sliders move.")
        self._follower = gui.add_dropdown(
            "by", numbers, hint="The number that follows, so that the metric stays."
        )
        self._target = gui.add_text(
            "target", "", hint='A number for the metric of "effect on", such as 0.5 or <= 30.'
        )
        button = gui.add_button("Reach", hint="Go to the nearest design that meets the target.")
        for handle in (self._metric, self._held, self._follower):
            handle.on_update(self._chosen)
        button.on_click(self._asked)

    def told(self) -> str:
        """What the last move or target did, as HTML."""
        words = self._message or self._levers.told
        return cards.plain(words, "ds-levers") if words else ""

    async def _chosen(self, event: viser.GuiEvent[Any]) -> None:
        if event.client_id is not None:
            self._tasks.submit("levers", self._choose)

    def _choose(self) -> None:
        def picked(handle: viser.GuiDropdownHandle[str]) -> str:
            return "" if handle.value == NOTHING else handle.value

        levers = self._levers
        levers.metric, levers.held = picked(self._metric), picked(self._held)
        levers.follower, levers.told, self._message = picked(self._follower), "", ""
        if levers.held and not levers.follower:
            levers.told = f"choose the number that holds {levers.held}"

    async def _asked(self, event: viser.GuiEvent[Any]) -> None:
        if event.client_id is not None:
            self._tasks.submit(_REACH, self._reach)

    def _reach(self) -> None:
        """Go to the nearest design that meets the target."""
        metric, design = self._levers.metric, self._session.design
        if not metric:
            self._message = 'choose a metric at "effect on" first'
            return
        try:
            found = to_target(design, metric, self._target.value)
        except DraftError as error:
            self._message = str(error)
            return
        self._message = _words(metric, found)
        if found.conflict is not None or not found.moved:
            return
        # All frames are one gesture, and so one step of undo.
        for k in range(1, _FRAMES + 1):
            share = k / _FRAMES
            self._session.set_all(between(found, share * share * (3 - 2 * share)), _REACH)
            self._tasks.shows()
            time.sleep(_PAUSE)


def _words(metric: str, found: Solution) -> str:
    if found.conflict is not None:
        return f"no design of these ranges reaches it: {'; '.join(found.conflict.misses)}"
    if not found.moved:
        return f"{metric} is there already"
    names = ", ".join(one.name for one in found.moved[:4])
    more = f" and {len(found.moved) - 4} more" if len(found.moved) > 4 else ""
    return f"reached by {names}{more}: {100 * found.change:.2g} % of the ranges"
