"""Tab of the pinned design: why the design differs from it, and what limits both.

The comparison takes longer than a slider may wait, so a thread of its own makes it once the sliders
rest; until then the last one is pale.
"""

from __future__ import annotations

import threading
import time
from html import escape

import viser

from draft.errors import DraftError
from draft.explore.comparison import compare
from draft.explore.comparison_tables import LIMITED, Section, TextTable, section
from draft.metrics.registry import USUAL, of_spec
from draft.model import Model
from draft.studio.cards import card
from draft.studio.session import Session
from draft.studio.tasks import TaskThread

REST = 0.3  # Time without a change before designs are compared [s].
TITLES = ("pinned", "now")


class PinnedTab:
    """The tab, which is there while a design is pinned."""

    def __init__(self, panel: viser.PanelHandle, session: Session) -> None:
        """Prepare the tab, and start its thread."""
        self._panel, self._session = panel, session
        self._pair: tuple[Model, Model] | None = None
        self._tab: viser.GuiTabHandle | None = None
        self._html: viser.GuiHtmlHandle | None = None
        self._found = ""
        self._lock = threading.Lock()
        self._tasks = TaskThread(lambda: None, lambda: None)

    def close(self) -> None:
        """End the thread."""
        self._tasks.close()

    def refresh(self, gui: viser.GuiApi) -> None:
        """Show or remove the tab, and ask for a comparison of designs that changed."""
        pinned, shown = self._session.pinned, self._session.shown
        pair = None if pinned is None else (pinned, shown)
        with self._lock:
            if pair == self._pair:
                return
            before, self._pair = self._pair, pair
            if pair is None:
                if self._tab is not None:
                    self._tab.remove()
                self._tab = self._html = None
                return
            if before is None or before[0] is not pair[0]:
                self._found = card('<div class="mute">comparing …</div>')
            content = f'<div style="opacity:.45">{self._found}</div>'
            if self._html is None:
                self._tab = self._panel.add_tab("Pinned")
                with self._tab:
                    self._html = gui.add_html(content)
            elif self._html.content != content:
                self._html.content = content
        self._tasks.submit("compare", lambda: self._compare(pair))

    def _compare(self, pair: tuple[Model, Model]) -> None:
        """Compare two designs, unless another change comes first."""
        time.sleep(REST)
        if self._tasks.waits("compare"):
            return
        found = comparison_card(*pair)
        with self._lock:
            if self._pair == pair and self._html is not None:
                self._found = self._html.content = found


def comparison_card(pinned: Model, shown: Model) -> str:
    """The design beside the pinned one, as HTML."""
    designs = (pinned.design, shown.design)
    if designs[0] is designs[1]:
        return card('<div class="mute" id="ds-same">Change the design to compare it.</div>')
    try:
        of = tuple(of_spec(designs[0].spec, (*USUAL, *LIMITED)))
        found = section(compare(designs, of, names=TITLES))
    except DraftError as error:
        return card(f'<div class="mute">{escape(str(error))}</div>')
    return card(*_parts(found))


def _parts(found: Section) -> list[str]:
    alone = "".join(f"<li>{escape(line)}</li>" for line in found.alone)
    return [
        _summary(found.summary),
        "<h3>What limits</h3>",
        _limits(found.limits),
        f'<h3>Findings</h3><ul class="mute">{alone}</ul>' if alone else "",
    ]


def _summary(of: TextTable) -> str:
    """Value of each metric now and pinned, the probability, and the largest shares below."""
    rows = [_row("mute", "", "now", "pinned", "now better")]
    for name, unit, pinned, now, odds, shares in of.rows:
        title = f'{escape(name)} <span class="mute">{escape(unit)}</span>'
        rows.append(_row("", title, f"<b>{escape(now)}</b>", escape(pinned), escape(odds)))
        if shares:
            rows.append(f'<tr class="mute why"><td colspan="4">{escape(shares)}</td></tr>')
    return f'<table class="tight" id="ds-compared">{"".join(rows)}</table>'


def _row(kind: str, first: str, *cells: str) -> str:
    numbers = "".join(f'<td class="n">{cell}</td>' for cell in cells)
    return f'<tr class="{kind}"><td>{first}</td>{numbers}</tr>'


def _limits(of: TextTable) -> str:
    """What limits each capability now, and pinned where that is another limit."""
    limits: dict[str, dict[str, str]] = {}
    for name, design, _, limit, _ in of.rows:
        limits.setdefault(name, {})[design] = limit
    rows = []
    for name, own in limits.items():
        pinned, now = (escape(own.get(title, "-")) for title in TITLES)
        other = "" if now == pinned else f' <span class="mute">(pinned: {pinned})</span>'
        rows.append(f'<tr><td>{escape(name)}</td><td class="limit">{now}{other}</td></tr>')
    return f'<table class="tight">{"".join(rows)}</table>'
