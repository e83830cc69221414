"""Plot of torque over speed for the pages of reports and of the studio."""

from __future__ import annotations

from collections.abc import Sequence
from html import escape
from typing import NamedTuple

from draft.design.actuators import Actuator
from draft.reporting.svg import GRID, INK, document, path, round_up, short, text
from draft.values import scalar

_LEFT, _RIGHT, _TOP, _BOTTOM = 38, 8, 8, 30
Point = tuple[float, float]


class Curve(NamedTuple):
    """Line of an actuator class; a named one has its name at it, and is tinted below."""

    name: str
    actuator: Actuator
    color: str
    dashes: str = "none"
    named: bool = False

    @property
    def line(self) -> list[Point]:
        """Points of the line as rad/s and N m, from standstill to no load."""
        return [(scalar(speed), scalar(torque)) for speed, torque in self.actuator.torque_speed()]

    def svg(self, points: Sequence[Point], title: str = "") -> str:
        """The line through points of the picture."""
        width = 2 if self.named else 1.5
        return (
            f'<path d="{path(points)}" fill="none" stroke="{self.color}" stroke-width="{width}" '
            f'stroke-dasharray="{self.dashes}"><title>{escape(title)}</title></path>'
        )


def plot(
    curves: Sequence[Curve],
    dots: Sequence[tuple[float, float, str]] = (),
    size: tuple[int, int] = (300, 150),
) -> str:
    """Plot torque [N m] over speed [rad/s] as SVG.

    Args:
        curves: a line per actuator class.
        dots: speed and torque of joints, and a label for those that stand out.
        size: width and height of the picture [px].
    """
    points = [point for curve in curves for point in curve.line] or [(1.0, 1.0)]
    right, top = (round_up(max(values)) for values in zip(*points, strict=True))
    end, bottom = size[0] - _RIGHT, size[1] - _BOTTOM

    def place(speed: float, torque: float) -> Point:
        """Pixel of a point; points beyond the axes lie on their ends."""
        across, up = min(speed / right, 1.0), min(torque / top, 1.0)
        return _LEFT + (end - _LEFT) * across, bottom - (bottom - _TOP) * up

    parts = []
    for k in range(5):
        speed, torque = right * k / 4, top * k / 4
        x, y = place(speed, torque)
        parts.append(f'<path d="M{_LEFT} {y:.1f}H{end}M{x:.1f} {_TOP}V{bottom}" stroke="{GRID}"/>')
        parts.append(text(_LEFT - 5, y + 3, short(torque), "end"))
        parts.append(text(x, bottom + 12, short(speed), "middle"))
    for k, curve in enumerate(curves):
        line = [place(*point) for point in curve.line]
        if curve.named:
            area = f'd="{path(line)}H{_LEFT}Z" fill="{curve.color}" fill-opacity="0.08"'
            share = 0.4 + 0.08 * (k % 4)  # Names of lines that cross are apart.
            x, y = (a + share * (b - a) for a, b in zip(*line[-2:], strict=True))
            parts.append(f"<path {area}/>")
            parts.append(text(x + 7, y - 4, curve.name, "start", curve.color, "600"))
        tip = ", ".join(f"{short(torque)} N m at {short(of)} rad/s" for of, torque in curve.line)
        parts.append(curve.svg(line, f"{curve.name}: {tip}"))
    for speed, torque, label in sorted(dots, key=lambda dot: dot[2]):
        parts.append(_dot(*place(speed, torque), label, left=speed > right / 2))
    parts.append(text((_LEFT + end) / 2, size[1] - 4, "speed [rad/s]", "middle"))
    parts.append(text(end - 5, _TOP + 11, "torque [N m]", "end"))
    return document(parts, *size)


def key(curves: Sequence[Curve]) -> str:
    """Names of the curves with a sample of each line, as HTML."""
    drawn = ((curve, curve.svg([(0, 4), (28, 4)])) for curve in curves)
    items = (
        f'<li><svg width="28" height="8">{line}</svg>{escape(c.name)}</li>' for c, line in drawn
    )
    return f'<ul class="key">{"".join(items)}</ul>'


def _dot(x: float, y: float, label: str, left: bool) -> str:
    """Dot of a joint; a large one with its label."""
    place = f'cx="{x:.1f}" cy="{y:.1f}"'
    if not label:
        return f'<circle {place} r="2.5" fill="{INK}" fill-opacity="0.35"/>'
    words = text(x + (-8 if left else 8), y + 4, label, "end" if left else "start", INK)
    halo = f'<g stroke="#fff" stroke-width="3" paint-order="stroke">{words}</g>'
    return f'<circle class="ds-dot" {place} r="5" fill="{INK}" stroke="#fff"/>{halo}'
