"""Parts of plots as SVG text, for pages; all text of a user is escaped."""

from __future__ import annotations

import math
from collections.abc import Sequence
from html import escape

INK, MUTED, GRID = "#1f2933", "#66727f", "#e7eaee"


def document(parts: Sequence[str], width: int, height: int) -> str:
    """SVG of a size [px] that fills its column."""
    return f'<svg viewBox="0 0 {width} {height}" class="ds-svg" role="img">{"".join(parts)}</svg>'


def text(
    x: float, y: float, words: str, anchor: str, color: str = MUTED, weight: str = "400"
) -> str:
    """Text at a point, which is its start, middle or end."""
    return (
        f'<text x="{x:.1f}" y="{y:.1f}" text-anchor="{anchor}" fill="{color}" '
        f'font-weight="{weight}">{escape(words)}</text>'
    )


def path(points: Sequence[tuple[float, float]]) -> str:
    """Data of a path along points."""
    return "M" + "L".join(f"{x:.1f} {y:.1f}" for x, y in points)


def short(x: float) -> str:
    """Text of a number with three digits; an exponent only for very large and small ones."""
    if x == 0:
        return "0"
    if abs(x) >= 1e4 or abs(x) < 1e-3:
        mantissa, _, exponent = f"{x:.1e}".partition("e")
        return f"{mantissa.removesuffix('.0')}e{int(exponent)}"
    return f"{x:.0f}" if abs(x) >= 1e3 else f"{x:.3g}"


def round_up(x: float) -> float:
    """Smallest round number not below x whose quarters are round too."""
    decade = 10.0 ** math.floor(math.log10(max(x, 1e-9)))
    return next(k * decade for k in (1, 1.2, 1.6, 2, 2.4, 3.2, 4, 6, 8, 10) if k * decade >= x)
