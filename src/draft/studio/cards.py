"""Cards of the studio as HTML; all text from users and files is escaped."""

from __future__ import annotations

from html import escape

from draft.design import Design, Finding
from draft.design.bands import actuator_bands
from draft.design.findings import grouped
from draft.design.report import actuator_rows, mass_parts
from draft.design.widened import band
from draft.reporting.svg import short
from draft.studio import fields, plots
from draft.studio.allowed_range import allowed
from draft.studio.session import Session
from draft.values import scalar

# Besides the cards, the style makes rows and folders of viser's elements so low that ten sliders
# fit in a window of 800 pixels, and gives the fields two thirds of the column until its divider
# is dragged.
STYLE = """<style>
.ds{font:13px/1.45 system-ui,sans-serif;color:#1f2933;padding:0 12px 6px}
.ds-svg{display:block;width:100%;height:auto;margin:4px 0 2px;overflow:visible}
.ds-svg text{font:10.5px system-ui,sans-serif;font-variant-numeric:tabular-nums}
.ds h3{font-size:12px;font-weight:600;color:#66727f;margin:14px 0 4px;
border-bottom:1px solid #e7eaee}
.ds h3:first-child{margin-top:4px}
.ds table{width:100%;border-collapse:collapse;font-variant-numeric:tabular-nums;font-size:12px}
.ds td{padding:1px 0;vertical-align:baseline}
.ds td.n{text-align:right;white-space:nowrap;padding-left:8px}
.ds .tight td{white-space:nowrap;font-size:11px;letter-spacing:-.1px}
.ds .tight td.n{padding-left:4px}
.ds .mute{color:#66727f}
.ds tr.why td{white-space:normal;padding:0 0 3px 8px;line-height:1.2}
.ds td.limit{white-space:normal;padding-left:8px}
.ds ul{margin:0;padding-left:16px}
.ds .big{font-size:26px;font-weight:600;line-height:1.2;font-variant-numeric:tabular-nums}
.ds .row{display:flex;justify-content:space-between;align-items:baseline;gap:8px}
.ds .chip{font-size:12px;font-weight:600;padding:1px 9px;border-radius:9px;white-space:nowrap}
.ds .key{display:inline-block;width:9px;height:9px;border-radius:2px;margin-right:6px}
.ds .note{border-left:3px solid;padding:4px 0 4px 9px;margin:7px 0;overflow-wrap:anywhere}
.ds .note b{display:block}
.ds code{font:11.5px ui-monospace,monospace;background:#f1f3f5;padding:0 3px;border-radius:3px;
overflow-wrap:anywhere}
.ds a{color:#35618f}
p:has(>label){letter-spacing:0!important;font-size:12.5px!important;line-height:1.3!important}
div:has(>p>label){width:9.3em!important}
div:has(>div>p>label){padding-right:4px}
div:has(>p>label:empty){display:none}
.mantine-Paper-root:has(>.mantine-Paper-root) div:has(>p>label:empty){display:block}
div:has(>div>div>p>label),div:has(>div>label){padding-bottom:2px!important}
div:has(>div>div>p>label:empty){padding-bottom:10px!important}
.mantine-Paper-root:has(>.mantine-Paper-root) div:has(>div>div>p>label:empty){
padding-bottom:2px!important}
.mantine-Paper-root:has(>.mantine-Paper-root) div:has(>p>label:empty)+div button{height:15px;
border:0;font-size:11px}
.mantine-Paper-root:has(>.mantine-Paper-root){border-width:1px 0 0;margin:9px 4px 0!important;
padding-bottom:0}
.mantine-Paper-root>.mantine-Paper-root{font-size:12px;font-weight:600;color:#66727f}
.mantine-Paper-root>.mantine-Paper-root~div>div>div{padding-top:4px!important}
[style^="flex: 0.5 1 "]:has(#ds-mass){flex-grow:1!important}
</style>"""
_HEADING = '<tr class="mute"><td></td><td></td><td class="n">90 % band</td></tr>'
COLORS = {"error": plots.BAD, "warning": plots.WARN}


def head(session: Session) -> str:
    """Name, mass with its band, verdict, and the message of a change that failed."""
    design = session.design
    low, high = band(design)
    word, color, tint = "accepted", plots.GOOD, "#e4f3ea"
    if not design.accepted:
        word, color, tint = "refused", plots.BAD, "#fbe6e3"
    count = len(session.point.values)
    changes = f" · {count} changed" if count else ""
    parts = [
        f'<div class="row"><span><b>{escape(design.name)}</b> '
        f'<span class="mute">{escape(session.title)}{changes}</span></span>'
        f'<span class="chip" id="ds-verdict" style="color:{color};background:{tint}">{word}</span>'
        "</div>",
        f'<div class="row"><span class="big" id="ds-mass">{design.mass:.2f} kg</span>'
        f'<span class="mute">90 % band {low:.1f} – {high:.1f} kg</span></div>',
        _pinned(session),
    ]
    if session.message:
        parts.append(
            f'<div class="note" id="ds-message" style="border-color:{plots.BAD};'
            f'background:#fdf1ef"><b style="color:{plots.BAD}">Not applied</b>'
            f"{_lines(session.message)}"
            '<div class="mute">The last valid robot is shown.</div></div>'
        )
    return card(*parts)


def _pinned(session: Session) -> str:
    if session.pinned is None:
        return ""
    other = session.pinned.design
    difference = scalar(session.design.mass) - scalar(other.mass)
    return (
        f'<div class="mute" id="ds-pinned">pinned: {escape(other.label)}, {other.mass:.2f} kg '
        f"({difference:+.2f} kg now)</div>"
    )


def findings(design: Design) -> str:
    """Findings in colour, errors first, each with its limit and how to allow it."""
    found = grouped(design.findings)
    words = "No findings: the design is within all limits." if not found else ""
    empty = f'<div style="color:{plots.GOOD}">{words}</div>' if words else ""
    return card("<h3>Findings</h3>", empty, *(_finding(f, design) for f in found))


def _finding(finding: Finding, design: Design) -> str:
    color = COLORS[finding.severity]
    span = allowed(finding, design)
    bar = ""
    if span is not None:
        bar = plots.limit(float(finding.value or 0.0), *span, color, finding.unit)
    allow = ""
    if finding.remedy:
        entry = escape(f"{finding.id}:{finding.where}")
        allow = (
            f'<div class="mute">To allow it, add <code>{entry}</code> to <code>allow</code> in '
            "parameters.yaml</div>"
        )
    if finding.allowed:
        allow = f'<div class="mute">allowed by <code>{escape(finding.allowed)}</code></div>'
    return (
        f'<div class="note" style="border-color:{color}"><b style="color:{color}">'
        f"{finding.severity}: {escape(finding.id.replace('_', ' '))}</b>"
        f'{escape(finding.message)}{bar}<div class="mute">limit from: {escape(finding.source)}'
        f"</div>{allow}</div>"
    )


def masses(session: Session) -> str:
    """Mass of each part, as a bar and a table."""
    design = session.design
    rows = mass_parts(design)
    before = dict(mass_parts(session.pinned.design)) if session.pinned else {}
    lines = []
    for k, (label, mass) in enumerate(rows):
        color = plots.PALETTE[k % len(plots.PALETTE)]
        other = f'<td class="n mute">{before[label]:.2f}</td>' if label in before else ""
        lines.append(
            f'<tr><td><span class="key" style="background:{color}"></span>{escape(label)}</td>'
            f'<td class="n">{mass:.2f} kg</td>'
            f'<td class="n mute">{100 * mass / scalar(design.mass):.0f} %</td>{other}</tr>'
        )
    return card("<h3>Mass</h3>", plots.shares(rows), f"<table>{''.join(lines)}</table>")


def actuators(design: Design) -> str:
    """Every number of each actuator class, with its origin and band."""
    parts = []
    for name, actuator in design.actuators.items():
        bands = actuator_bands(actuator)
        rows = []
        for key, quantity in actuator_rows([actuator]).items():
            factor = quantity.factor
            value = scalar(getattr(actuator, key)) * factor
            origin = actuator.origins.get(key)
            kind = origin.kind if origin else "stated"
            band = ""
            if key in bands:
                low, high = (scalar(x) * factor for x in bands[key])
                band = f"{low:.2g}–{high:.2g}" if high < 10 else f"{short(low)}–{short(high)}"
            hint = escape(origin.detail if origin else "", quote=True)
            rows.append(
                f'<tr title="{hint}"><td>{quantity.label} <span class="mute">{kind}</span></td>'
                f'<td class="n">{short(value)} <span class="mute">'
                f"{quantity.table_unit}</span></td>"
                f'<td class="n mute">{band}</td></tr>'
            )
        like = f' <span class="mute">like {escape(actuator.like)}</span>' if actuator.like else ""
        head = f"<h3>Actuator {escape(name)}{like}</h3>"
        parts.append(f"{head}<table class='tight'>{_HEADING}{''.join(rows)}</table>")
    return card(*parts)


def derived(session: Session) -> str:
    """Derived parameters: value, expression, description."""
    changed = session.changed()
    rows = []
    for text in fields.derived(session.library.spec):
        value = scalar(session.design.parameters[text.name])
        mark = "● " if text.name in changed else ""
        rows.append(
            f'<tr title="{escape(text.doc, quote=True)}"><td>{mark}{escape(text.name)}<br>'
            f'<code>{escape(text.text)}</code></td><td class="n">{value:.4g} '
            f'<span class="mute">{escape(text.unit)}</span></td></tr>'
        )
    return card(f"<table>{''.join(rows)}</table>")


def plain(text: str, name: str = "") -> str:
    """A card of plain text, with a name in the page; empty text gives none."""
    named = f' id="{name}"' if name else ""
    return card(f'<div class="mute"{named}>{_lines(text)}</div>') if text else ""


def link(path: str, text: str) -> str:
    """A link to a page of the studio, in a new tab."""
    return card(f'<a href="{escape(path, quote=True)}" target="_blank">{escape(text)}</a>')


def _lines(text: str) -> str:
    return "<br>".join(escape(line.strip()) for line in text.splitlines())


def card(*parts: str) -> str:
    """Card of the panel from parts in HTML."""
    return f'<div class="ds">{"".join(parts)}</div>'
