"""The report of a tab's design as a page of its own, for reading and printing."""

from __future__ import annotations

from html import escape

from draft.explore.studio import cards, trend_cards
from draft.explore.studio.session import Session

_STYLE = """<style>
body{margin:32px auto;max-width:960px;padding:0 16px;background:#fff}
.sheet{columns:2 320px;column-gap:40px}
.ds{break-inside:avoid}
h1{font:600 20px system-ui,sans-serif;color:#1f2933;padding:0 12px}
</style>"""


def report_page(session: Session) -> str:
    """HTML of the whole report."""
    design = session.design
    title = escape(f"{design.name}, {design.label}")
    parts = [
        cards.head(session),
        _parameters(session),
        cards.masses(session),
        cards.findings(design),
        trend_cards.torque_speed(session),
        cards.actuators(design),
        trend_cards.trends(session),
    ]
    return (
        '<!doctype html><html lang="en"><meta charset="utf-8">'
        f"<title>{title}</title>{_STYLE}{cards.STYLE}"
        f'<h1>{title}</h1><div class="sheet">{"".join(parts)}</div></html>'
    )


def _parameters(session: Session) -> str:
    changed = session.changed()
    rows = []
    for name, parameter in session.library.spec.parameters.items():
        value = float(session.design.parameters[name])  # type: ignore[arg-type]
        mark = "● " if name in changed else ""
        unit = "" if parameter.unit == "1" else parameter.unit
        rows.append(
            f"<tr><td>{mark}{escape(name)}</td>"
            f'<td class="n">{value:.4g} <span class="mute">{escape(unit)}</span></td>'
            f'<td class="mute" style="padding-left:12px">{escape(parameter.doc)}</td></tr>'
        )
    return f'<div class="ds"><h3>Parameters</h3><table>{"".join(rows)}</table></div>'
