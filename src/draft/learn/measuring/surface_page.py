"""Page of a surface: linked maps of the plane, with all numbers of the design under the pointer."""

from __future__ import annotations

import json
import math
import textwrap
from collections.abc import Mapping, Sequence
from html import escape
from importlib.resources import files
from typing import TYPE_CHECKING, Any

import numpy as np

from draft.drawing import geoms, inlined, modules, packed
from draft.errors import ModelError, counted
from draft.metrics.capabilities import MEASURED, Capability
from draft.model.model import preview
from draft.model.scene import home
from draft.plotting import COLORS
from draft.values import Array, brief
from draft.webpage import webpage

if TYPE_CHECKING:
    from draft.learn.measuring.surface import Surface

_WIDTH, _HEIGHT = 420, 300  # Of a map's plane, in units of its picture.
_LEFT, _TOP, _RIGHT, _BOTTOM = 58, 8, 92, 44  # Margins: ticks, bar of colours.
_REFUSED, _FELL, _INK = "#d9d9d9", "#ffffff", "#57606a"
_BAR = 24  # Steps of a bar of colours.
_TICKS = 5
_VARYING = ("geom_size", "geom_pos", "geom_quat", "mesh_vert")
_MOST_DRAWN = 400  # Designs, of some 6 kB each.
_KEY = 64  # Height of an entry of the key of joints.


def page(found: Surface, command: str, studio: str = "") -> str:
    """Text of the page, which needs no network.

    Args:
        found: the surface.
        command: command that made it.
        studio: command that lets the varied robot walk, up to the values it adds; "" for none.
    """
    measured = sum(not text for text in found.refusal)
    outside = sum(
        not text and not inside
        for text, inside in zip(found.refusal, found.learned.inside, strict=True)
    )
    maps = [_numbers(found, *row) for row in MEASURED.items()] + [_limits(found)]
    body = (
        f"<main><h1>{escape(found.robot)}: what its bodies can do</h1>"
        f"<p>{counted(len(found.refusal), 'design')}, {measured} measured, "
        f"{len(found.refusal) - measured} refused or unable to walk (grey), {outside} outside the "
        "policy's region of validity (crosses). White: no speed at which 80 % stay up. Point at a "
        f"design; click to keep it.</p><p><code>{escape(command)}</code></p>"
        f'<div class="maps">{"".join(maps)}</div>'
        '<aside><div id="robot"></div><div id="design" aria-live="polite">'
        "<p>Point at a design.</p></div></aside></main>"
    )
    data = {"DESIGNS": _rows(found, studio), "BODIES": _bodies(found)}
    texts = {name: json.dumps(rows, allow_nan=False) for name, rows in data.items()}
    constants = [f"const {name} = {text};" for name, text in texts.items()]
    style, script, robot = (
        (files("draft.learn.measuring") / name).read_text(encoding="utf-8")
        for name in ("surface_page.css", "surface_page.js", "surface_robot.js")
    )
    scripts = ["\n".join(constants).replace("<", "\\u003c") + f"\n{script}"]
    used = {**modules(), "draft/surface": robot}
    return webpage(
        f"{found.robot}: surface",
        style,
        body,
        [*scripts, 'import("draft/surface");'],
        modules={name: inlined(text) for name, text in used.items()},
    )


def _bodies(found: Surface) -> dict[str, Any] | None:
    """Geoms of the first body that has a model, and what differs in each design in its home pose.

    None for a surface of so many designs that the page would be too large.
    """
    count = len(found.refusal)
    if count > _MOST_DRAWN:
        return None
    first: dict[str, Any] = {}
    rows: list[dict[str, str] | None] = []
    for i in range(count):
        try:
            model = preview(found.designs[i])
        except ModelError:
            rows.append(None)
            continue
        first = first or geoms(model.mujoco)
        data = home(model.design, model.mujoco)
        parts = [getattr(model.mujoco, name) for name in _VARYING] + [data.xpos, data.xquat]
        rows.append(packed(np.concatenate([part.ravel() for part in parts]), "f4"))
    return {"geoms": first, "names": [*_VARYING, "xpos", "xquat"], "rows": rows}


def _rows(found: Surface, studio: str) -> list[dict[str, object]]:
    """What is shown of each design: rows of name and text, and its command."""
    one = found.learned
    first, second = (grid.ravel() for grid in np.meshgrid(*found.values, indexing="ij"))
    rows: list[dict[str, object]] = []
    for i, refusal in enumerate(found.refusal):
        values = dict(zip(found.axes, (f"{first[i]:.4g}", f"{second[i]:.4g}"), strict=True))
        texts = [
            [name, f"{value} {unit}".strip()]
            for (name, value), unit in zip(values.items(), found.units, strict=True)
        ]
        texts.append(["mass", f"{brief(float(found.mass[i]))} kg"])
        if refusal:
            texts.append(["refused", refusal.replace("_", " ")])
        else:
            error = one.top_speed_error[i]
            known = {"top_speed": f" ± {error:.2f}"} if math.isfinite(error) else {}
            texts += [
                [line.label, _text(getattr(one, name)[i], line.unit) + known.get(name, "")]
                for name, line in MEASURED.items()
            ]
            texts += [
                ["nearest its limit", one.limiting[i] or "-"],
                ["region of validity", "inside" if one.inside[i] else "outside"],
            ]
        chosen = " ".join(f"{name}={value}" for name, value in values.items())
        rows.append({"rows": texts, "command": f"{studio} {chosen}" if studio else ""})
    return rows


def _text(value: float, unit: str) -> str:
    return f"{value:.2f} {unit if unit != '1' else ''}".strip() if math.isfinite(value) else "none"


def _numbers(found: Surface, name: str, one: Capability) -> str:
    """Map of a number, with a bar of its colours."""
    from matplotlib import colormaps
    from matplotlib.colors import to_hex

    values: Array = getattr(found.learned, name)
    known = values[np.isfinite(values)]
    low, high = (float(known.min()), float(known.max())) if len(known) else (0.0, 1.0)
    span = (high - low) or 1.0
    shades = colormaps["viridis"]

    def color(value: float) -> str:
        return to_hex(shades((value - low) / span))

    fills = [color(float(value)) if np.isfinite(value) else _FELL for value in values]
    left = _LEFT + _WIDTH + 16
    step = _HEIGHT / _BAR
    bar = [
        f'<rect x="{left}" y="{_TOP + _HEIGHT - (k + 1) * step:.1f}" width="14" '
        f'height="{step + 0.5:.1f}" fill="{color(low + span * (k + 0.5) / _BAR)}"/>'
        for k in range(_BAR)
    ]
    bar += [
        f'<text x="{left + 20}" y="{y:.1f}" dominant-baseline="middle">{brief(value)}</text>'
        for value, y in ((low, _TOP + _HEIGHT - 4), (high, _TOP + 6))
    ]
    return _map(found, f"{one.title[0].upper()}{one.title[1:]}: {one.text}", fills, "".join(bar))


def _limits(found: Surface) -> str:
    """Map of the joint nearest its limit, with a key."""
    names = sorted({text for text in found.learned.limiting if text})
    colors = {name: COLORS[i % len(COLORS)] for i, name in enumerate(names)}
    fills = [colors.get(text, _FELL) for text in found.learned.limiting]
    left = _LEFT + _WIDTH + 12
    key = [
        f'<rect x="{left}" y="{_TOP + _KEY * i}" width="12" height="12" fill="{color}"/>'
        + "".join(
            f'<text x="{left}" y="{_TOP + _KEY * i + 25 + 13 * k}">{escape(word)}</text>'
            for k, word in enumerate(textwrap.wrap(name, 12))
        )
        for i, (name, color) in enumerate(colors.items())
    ]
    return _map(found, "Joint nearest its limit at top speed", fills, "".join(key))


def _map(found: Surface, title: str, fills: Sequence[str], key: str) -> str:
    """One map: a cell per design, its axes, and a key beside it."""
    columns, rows = (len(values) for values in found.values)
    wide, high = _WIDTH / columns, _HEIGHT / rows
    cells = []
    for i, (fill, refusal) in enumerate(zip(fills, found.refusal, strict=True)):
        x, y = _LEFT + (i // rows) * wide, _TOP + _HEIGHT - (i % rows + 1) * high
        shade = _REFUSED if refusal else fill
        cells.append(
            f'<rect data-i="{i}" x="{x:.2f}" y="{y:.2f}" width="{wide:.2f}" height="{high:.2f}" '
            f'fill="{shade}"/>'
        )
        if not refusal and not found.learned.inside[i]:
            a, b, size = x + wide / 2, y + high / 2, min(wide, high) / 6
            cells.append(
                f'<path d="M{a - size:.2f} {b - size:.2f}l{2 * size:.2f} {2 * size:.2f}m0 '
                f'{-2 * size:.2f}l{-2 * size:.2f} {2 * size:.2f}" stroke="#000" '
                'stroke-width="0.8" pointer-events="none"/>'
            )
    size = f"{_LEFT + _WIDTH + _RIGHT} {_TOP + _HEIGHT + _BOTTOM}"
    return (
        f'<figure><figcaption>{escape(title)}</figcaption><svg viewBox="0 0 {size}" role="img" '
        f'aria-label="{escape(title)}">{"".join(cells)}{_axes(found)}{key}'
        '<rect class="mark" fill="none" stroke="#d1242f" stroke-width="2" '
        'pointer-events="none" visibility="hidden"/></svg></figure>'
    )


def _axes(found: Surface) -> str:
    """Frame, ticks and names of the axes."""
    names = [
        axis.rpartition(".")[2].replace("_", " ") + (f" [{unit}]" if unit else "")
        for axis, unit in zip(found.axes, found.units, strict=True)
    ]
    parts = [
        f'<rect x="{_LEFT}" y="{_TOP}" width="{_WIDTH}" height="{_HEIGHT}" fill="none" '
        f'stroke="{_INK}"/>'
    ]
    for i, text in _ticks(found.values[0]).items():
        x = _LEFT + (i + 0.5) * _WIDTH / len(found.values[0])
        parts.append(f'<text x="{x:.1f}" y="{_TOP + _HEIGHT + 15}" class="x">{text}</text>')
    for i, text in _ticks(found.values[1]).items():
        y = _TOP + _HEIGHT - (i + 0.5) * _HEIGHT / len(found.values[1])
        parts.append(f'<text x="{_LEFT - 6}" y="{y:.1f}" class="y">{text}</text>')
    middle = _LEFT + _WIDTH / 2
    parts.append(
        f'<text x="{middle}" y="{_TOP + _HEIGHT + 34}" class="x">{escape(names[0])}</text>'
    )
    parts.append(
        f'<text transform="translate(13 {_TOP + _HEIGHT / 2}) rotate(-90)" class="x">'
        f"{escape(names[1])}</text>"
    )
    return "".join(parts)


def _ticks(values: Array) -> Mapping[int, str]:
    """Texts of some values, by their place."""
    places = np.unique(np.linspace(0, len(values) - 1, min(_TICKS, len(values))).round())
    return {int(i): f"{values[int(i)]:.3g}" for i in places}
