"""Small plots as SVG text: trends, shares of the mass, limits.

The layout is for a width of 300 pixels; all text from a spec is escaped.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from functools import lru_cache
from html import escape
from typing import NamedTuple

from draft.reporting.svg import GRID, document, path, short, text

OURS, THEIRS, LAW = "#d9661f", "#9aa5b1", "#35618f"
GOOD, BAD, WARN = "#2f855a", "#c0392b", "#b7791f"
PALETTE = ("#35618f", "#7fa6cf", "#4d5866", "#8d99a8", "#b9c2cd", "#5b8c85", "#a3c4bc", "#d9dee4")
WIDTH = 300
_LEFT, _RIGHT, _TOP, _BOTTOM = 38, 8, 8, 30


class Marker(NamedTuple):
    """Point of a design: position, label, and whether it is of the pinned design."""

    x: float
    y: float
    label: str
    pinned: bool = False


class Axes(NamedTuple):
    """Logarithmic axes: their ranges, and titles with units."""

    x: tuple[float, float]
    y: tuple[float, float]
    x_title: str
    y_title: str
    height: int = 170

    def place(self, x: float, y: float) -> tuple[float, float]:
        """Pixel of a point; points outside the ranges lie on the edge."""
        return (
            _LEFT + _along(x, self.x) * (WIDTH - _LEFT - _RIGHT),
            _TOP + (1 - _along(y, self.y)) * (self.height - _TOP - _BOTTOM),
        )


def trend(
    axes: Axes,
    cloud: tuple[tuple[float, float], ...],
    law: Callable[[float], float],
    folds: tuple[float, float],
    markers: Iterable[Marker],
) -> str:
    """Plot real modules, a trend with its bands of 50 and 90 %, and a design's actuators.

    Args:
        axes: the axes.
        cloud: points of the modules.
        law: the trend, from x to y.
        folds: factors from the trend to the ends of its bands of 50 and 90 %.
        markers: points of the actuators.
    """
    low, high = axes.x
    xs = [low * (high / low) ** (i / 24) for i in range(25)]
    ys = [law(x) for x in xs]
    parts = [_frame(axes)]
    for fold, tint in ((folds[1], "0.10"), (folds[0], "0.16")):
        above = [axes.place(x, y * fold) for x, y in zip(xs, ys, strict=True)]
        below = [axes.place(x, y / fold) for x, y in zip(xs, ys, strict=True)]
        d = path([*above, *reversed(below)])
        parts.append(f'<path d="{d}Z" fill="{LAW}" fill-opacity="{tint}"/>')
    line = path([axes.place(x, y) for x, y in zip(xs, ys, strict=True)])
    parts.append(_cloud(axes, cloud))
    parts.append(f'<path d="{line}" fill="none" stroke="{LAW}" stroke-width="1.5"/>')
    parts += _markers(axes, list(markers))
    return document(parts, WIDTH, axes.height)


def shares(parts: Sequence[tuple[str, float]]) -> str:
    """Plot a bar of shares in the colours of `PALETTE`."""
    total = sum(value for _, value in parts) or 1.0
    drawn, x = [], 0.0
    for k, (label, value) in enumerate(parts):
        wide = WIDTH * value / total
        drawn.append(
            f'<rect x="{x:.1f}" width="{max(wide - 1, 0.5):.1f}" height="14" rx="1" '
            f'fill="{PALETTE[k % len(PALETTE)]}"><title>{escape(label)}</title></rect>'
        )
        x += wide
    return document(drawn, WIDTH, 14)


def limit(value: float, low: float, high: float, color: str, unit: str = "") -> str:
    """Plot a value over the allowed range."""
    near = min(x for x in (value, low or value) if x > 0) if value > 0 else 0.0
    far = max(value, high)
    narrow = near > 0 and far / near < 30
    start, stop = (0.0, 1.15 * far) if narrow or near <= 0 else (near / 1.3, far * 1.3)
    span: tuple[float, float] = (start, stop)

    def at(x: float) -> float:
        share = (x - start) / (stop - start) if narrow or near <= 0 else _along(x, span)
        return min(max(share, 0.0), 1.0) * (WIDTH - 2) + 1

    a, b, v = at(low) if low > 0 else 1.0, at(high), at(value)
    words = [text(b, 31, short(high), "end" if b > 60 else "start")]
    if low > 0:
        words.append(text(a, 31, short(low), "start" if b - a > 50 else "end"))
    side = "end" if v > WIDTH - 60 else "start" if v < 60 else "middle"
    label = f"{short(value)} {unit}".strip()
    return document(
        [
            f'<rect y="14" width="{WIDTH}" height="6" rx="3" fill="{GRID}"/>',
            f'<rect x="{a:.1f}" y="14" width="{max(b - a, 1):.1f}" height="6" rx="1" '
            f'fill="{GOOD}" fill-opacity="0.45"/>',
            f'<path d="M{v:.1f} 11v12" stroke="{color}" stroke-width="3"/>',
            text(v, 9, label, side, color),
            *words,
        ],
        WIDTH,
        34,
    )


@lru_cache(maxsize=32)
def _cloud(axes: Axes, cloud: tuple[tuple[float, float], ...]) -> str:
    """All modules as one path of dots, which a browser draws faster than many circles."""
    dots = "".join("M{:.1f} {:.1f}h0".format(*axes.place(x, y)) for x, y in cloud)
    return (
        f'<path d="{dots}" stroke="{THEIRS}" stroke-width="4" stroke-linecap="round" '
        'stroke-opacity="0.75"/>'
    )


@lru_cache(maxsize=32)
def _frame(axes: Axes) -> str:
    bottom = axes.height - _BOTTOM
    parts = []
    for x in _ticks(axes.x):
        px, _ = axes.place(x, axes.y[0])
        parts.append(f'<path d="M{px:.1f} {_TOP}V{bottom}" stroke="{GRID}"/>')
        parts.append(text(px, bottom + 12, short(x), "middle"))
    for y in _ticks(axes.y):
        _, py = axes.place(axes.x[0], y)
        parts.append(f'<path d="M{_LEFT} {py:.1f}H{WIDTH - _RIGHT}" stroke="{GRID}"/>')
        parts.append(text(_LEFT - 5, py + 3, short(y), "end"))
    parts.append(text((_LEFT + WIDTH - _RIGHT) / 2, axes.height - 4, axes.x_title, "middle"))
    parts.append(text(_LEFT + 5, _TOP + 9, axes.y_title, "start"))
    return "".join(parts)


def _markers(axes: Axes, markers: list[Marker]) -> list[str]:
    drawn: list[str] = []
    labels: list[tuple[float, float]] = []
    for x, y, label, pinned in sorted(markers, key=lambda marker: not marker.pinned):
        px, py = axes.place(x, y)
        fill = "none" if pinned else OURS
        ring = THEIRS if pinned else "#fff"
        drawn.append(
            f'<circle cx="{px:.1f}" cy="{py:.1f}" r="5.5" fill="{fill}" stroke="{ring}" '
            f'stroke-width="1.5"/>'
        )
        if not pinned:
            left = px > WIDTH - 80
            at = py + 4
            # A label that would cover another one moves below it.
            while any(abs(x - px) < 70 and abs(y - at) < 11 for x, y in labels):
                at += 11
            labels.append((px, at))
            side = "end" if left else "start"
            words = text(px + (-9 if left else 9), at, label, side, OURS, "600")
            drawn.append(f'<g stroke="#fff" stroke-width="3" paint-order="stroke">{words}</g>')
    return drawn


def _ticks(of: tuple[float, float]) -> list[float]:
    """Powers of ten, and their double and fivefold on axes of few decades."""
    first, last = math.floor(math.log10(of[0])), math.ceil(math.log10(of[1]))
    steps = (1, 2, 5) if last - first <= 2 else (1,)
    found = [k * 10.0**d for d in range(first, last + 1) for k in steps]
    return [x for x in found if of[0] * 0.999 <= x <= of[1] * 1.001]


def _along(x: float, of: tuple[float, float]) -> float:
    """Position of a number along a logarithmic axis, from 0 to 1."""
    share = math.log(max(x, 1e-300) / of[0]) / math.log(of[1] / of[0])
    return min(max(share, 0.0), 1.0)
