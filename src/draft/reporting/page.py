"""Page of a report: one HTML file that contains its styles, scripts and data."""

from __future__ import annotations

import json
from collections.abc import Sequence
from functools import partial
from html import escape
from importlib.metadata import version
from importlib.resources import files
from typing import TYPE_CHECKING, Any

from draft.drawing import inlined, modules
from draft.explore.comparison_tables import section as comparison_section
from draft.extras import missing, own_version
from draft.reporting import dots, plots, scene3d, tables, torque_speed
from draft.reporting.subjects import Subject, comparison, table
from draft.reporting.tables import Html, text
from draft.webpage import webpage

if TYPE_CHECKING:
    from draft.browser.robots import PageRobot
    from draft.explore.comparison import DesignComparison
    from draft.learn.policy.gait import Gait


def page(subjects: Sequence[Subject]) -> str:
    """Return the report as the text of one HTML file.

    Raises:
        DraftError: the extra `report` is not installed.
    """
    library = plotly()
    figures: dict[str, Any] = {}
    compared = comparison(subjects)
    live = [subject.live for subject in subjects if subject.live is not None]
    scene = None if live else scene3d.figure(subjects)
    makers = (
        *(partial(_robots, live, scene), _overview, partial(_comparison, compared)),
        *(_masses, _actuators, _findings, _metrics, _parameters),
    )
    sections = [section for make in makers if (section := make(subjects, figures))]
    title = _title(subjects)
    body = "\n".join(
        [
            _header(subjects, title),
            f"<main>{''.join(sections)}</main>",
            _json("draft-report", table(subjects, compared)),
            _json("draft-figures", figures),
            "" if scene is None else _json("draft-robots", scene),
        ]
    )
    scripts = [library, f"\n{_asset('page.js')}"]
    if scene is None:
        return webpage(title, _asset("page.css"), body, scripts, frames=bool(live))
    drawing = {**modules(), "draft/robots": _asset("robots.js")}
    drawing = {name: inlined(script) for name, script in drawing.items()}
    scripts.append('import("draft/robots");')
    return webpage(title, _asset("page.css"), body, scripts, modules=drawing)


def plotly() -> str:
    """Text of Plotly's script.

    Raises:
        DraftError: the extra `report` is not installed.
    """
    try:
        script = files("plotly") / "package_data" / "plotly.min.js"
        return script.read_text(encoding="utf-8").replace("</script", "<\\/script")
    except (ImportError, OSError):
        raise missing("plotly", "report") from None


def _asset(name: str) -> str:
    return (files("draft.reporting") / name).read_text(encoding="utf-8")


def _json(name: str, data: Any) -> str:
    """Element with data for scripts; no text in it can end the element."""
    content = json.dumps(data, separators=(",", ":"), allow_nan=False)
    for character in "<>&":
        content = content.replace(character, f"\\u{ord(character):04x}")
    return f'<script type="application/json" id="{name}">{content}</script>'


def _title(subjects: Sequence[Subject]) -> str:
    robots = list(dict.fromkeys(subject.design.name for subject in subjects))
    if len(robots) == 1 and [subject.title for subject in subjects] != robots:
        return f"{robots[0]}: {', '.join(subject.title for subject in subjects)}"
    return ", ".join(subject.title for subject in subjects)


def _header(subjects: Sequence[Subject], title: str) -> str:
    docs = dict.fromkeys(subject.design.spec.doc for subject in subjects if subject.design.spec.doc)
    about = "".join(f"<p>{escape(doc)}</p>" for doc in docs)
    versions = f"Draft {own_version()}, MuJoCo {version('mujoco')}"
    return (
        f'<header><h1>{escape(title)}</h1>{about}<p class="made">{escape(versions)}. '
        "SI units. Bands hold 90 % of real machines.</p></header>"
    )


def _section(name: str, title: str, *content: str) -> str:
    return f'<section id="{name}"><h2>{escape(title)}</h2>{"".join(content)}</section>\n'


def _plot(name: str, figure: Any, figures: dict[str, Any], caption: str) -> str:
    """Element for a figure; its data is added to `figures`."""
    figures[name] = figure
    height = int(figure["layout"]["height"])
    return (
        f'<figure><div class="plot" id="plot-{name}" style="height:{height}px" role="img" '
        f'aria-label="{escape(caption)}"></div><figcaption>{escape(caption)}</figcaption></figure>'
    )


def _robots(
    live: Sequence[PageRobot],
    scene: dict[str, Any] | None,
    subjects: Sequence[Subject],
    figures: dict[str, Any],
) -> str:
    """Robots of the report: under live physics, recorded, or in their home poses."""
    if live:
        from draft.browser.page import single_page  # Reports without live physics do not need it.

        inside = escape(single_page(live))
        frame = (
            f'<iframe class="live" title="Robots under live physics" srcdoc="{inside}"></iframe>'
        )
        return _section("robots", "Robots", frame, _walks(subjects, controls=False))
    if scene is None:
        return ""
    walking = any(scene3d.walks(subject) for subject in subjects)
    what = "Robots" if walking else "Home poses"
    caption = f"{what} at one scale, on squares of {scene['square']:g} m. Drag to turn."
    if walking:
        caption += f" Each walks on the spot over marks that are {scene3d.MARK:g} m apart."
    view = (
        f'<figure><div id="robots-view" role="img" aria-label="{escape(caption)}"></div>'
        f"<figcaption>{escape(caption)}</figcaption></figure>"
    )
    return _section("robots", "Robots", view, _walks(subjects, walking))


def _walks(subjects: Sequence[Subject], controls: bool) -> str:
    """Controls of the recorded gaits, and a line about each; "" for a report without gaits."""
    known = [(subject, subject.gait) for subject in subjects if subject.gait is not None]
    if not known:
        return ""
    bar = (
        '<div class="walk"><button type="button" id="walk-play">Play</button>'
        '<label for="walk-speed">speed</label><input type="range" id="walk-speed" min="0.1" '
        'max="2" step="0.1" value="1"><output id="walk-shown" for="walk-speed">1.0 ×</output></div>'
    )
    lines = "".join(f"<li>{tables.titled(subject)} {_walk(gait)}</li>" for subject, gait in known)
    return f'{bar if controls else ""}<ul class="gaits">{lines}</ul>'


def _walk(gait: Gait) -> str:
    """How a design walks, or why it stands and what to do about it."""
    note = f"; {escape(gait.note)}" if gait.note else ""
    if gait.walks:
        return f"walks at {gait.speed:.2f} m/s; asked for {gait.command:.2f} m/s{note}"
    command = f"; to train a policy for it: <code>{escape(gait.remedy)}</code>"
    remedy = command if gait.remedy else ""
    return f"stands: {escape(gait.reason)}{note}{remedy}"


def _overview(subjects: Sequence[Subject], figures: dict[str, Any]) -> str:
    return _section("overview", "Overview", tables.overview(subjects))


def _comparison(
    compared: DesignComparison | None, subjects: Sequence[Subject], figures: dict[str, Any]
) -> str:
    """Why the designs differ, and what limits each."""
    if compared is None:
        return ""
    found = comparison_section(compared)
    shares = [
        f"<p>{text(one)}</p>" if isinstance(one, str) else tables.plain(one) for one in found.shares
    ]
    if len(shares) > 1:
        shares = [_details("Shares of the numbers that differ", Html("".join(shares)))]
    alone = "".join(f"<li>{text(line)}</li>" for line in found.alone)
    return _section(
        "comparison",
        "Comparison",
        tables.plain(found.summary, "words"),
        *shares,
        tables.plain(found.limits, "words") if found.limits.rows else "",
        f"<ul>{alone}</ul>" if alone else "",
        _details("All metrics, with these probabilities", tables.plain(found.metrics)),
    )


def _masses(subjects: Sequence[Subject], figures: dict[str, Any]) -> str:
    plot = _plot("masses", plots.masses(subjects), figures, "Mass of each design by part.")
    own = tables.own_parts(subjects)
    parts = "" if own is None else f"<h3>Parts of your own</h3>{own}"
    return _section("mass", "Mass", plot, tables.masses(subjects), parts)


def _actuators(subjects: Sequence[Subject], figures: dict[str, Any]) -> str:
    if not any(subject.design.actuators for subject in subjects):
        return ""
    trends = (
        "The actuator classes of the designs over the modules of the catalogue, with the law that "
        "sizes them; bars are the 90 % bands of the classes."
    )
    curves = (
        "Peak torque over speed at the joint: a straight line from standstill to no load, or from "
        "the corner speed of a class that states one."
    )
    lines = plots.curves(subjects)
    return _section(
        "actuators",
        "Actuators",
        tables.actuators(subjects),
        _plot("trends", plots.trends(subjects), figures, trends),
        f'<figure class="curves">{torque_speed.key(lines)}'
        f"{torque_speed.plot(lines, size=(480, 220))}"
        f"<figcaption>{escape(curves)}</figcaption></figure>",
        _details("Laws behind these numbers", tables.laws(subjects)),
    )


def _findings(subjects: Sequence[Subject], figures: dict[str, Any]) -> str:
    return _section("findings", "Findings", tables.findings(subjects))


def _metrics(subjects: Sequence[Subject], figures: dict[str, Any]) -> str:
    found = tables.metrics(subjects)
    if found is None:
        return ""
    return _section("metrics", "Metrics", _dots(subjects, dots.metrics(subjects)), found)


def _dots(subjects: Sequence[Subject], rows: Sequence[dots.Row]) -> str:
    """Dot plot of the quantities that differ between the designs; "" if there are none."""
    if not rows:
        return ""
    best = "; the better one in bold" if any(row.better for row in rows) else ""
    caption = f"One scale per row, from the smallest to the largest value of the designs{best}."
    plot = dots.plot(subjects, rows)
    return f"<figure>{plot}<figcaption>{escape(caption)}</figcaption></figure>"


def _parameters(subjects: Sequence[Subject], figures: dict[str, Any]) -> str:
    differ, every = tables.parameters(subjects)
    if differ is None:
        content = every if len(subjects) == 1 else _details("All parameters", every)
        return _section("parameters", "Parameters", content)
    plot = _dots(subjects, dots.parameters(subjects))
    every = _details("All parameters", every)
    return _section("parameters", "Parameters that differ", plot, differ, every)


def _details(title: str, content: Html) -> str:
    return f"<details><summary>{text(title)}</summary>{content}</details>"
