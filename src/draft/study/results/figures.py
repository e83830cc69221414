"""Figures of the results page: those of the report, combined."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING

from draft.files import write
from draft.study.report import curves, learning, plane
from draft.study.report.occupancy import BATTERIES, Utilisation
from draft.study.report.records import Study

if TYPE_CHECKING:
    from matplotlib.figure import Figure

DPI = 160
# Colours of the palette of a picture.
TINTS = 128
# Battery -> panels of its curves.
CURVES = {
    "speed": ("speed", "survival", "efficiency"),
    "stairs": ("stairs", "ascent", "descent"),
    "push": ("push",),
}


def makers(study: Study, used: Utilisation) -> dict[str, Callable[[], Figure]]:
    """Return makers of the figures that the results have values for, by name."""
    found: dict[str, Callable[[], Figure]] = {}
    for battery, panels in CURVES.items():
        known = [name for name in panels if curves.has(study, name)]
        if len(known) > 1:
            found[f"curves_{battery}"] = partial(curves.together, study, known)
        elif known:
            found[f"curves_{battery}"] = curves.makers(study)[f"curve_{known[0]}"]
    for battery in BATTERIES:
        if plane.shown(study, used, battery):
            found[f"occupancy_{battery}"] = partial(plane.together, study, used, battery)
    drawn = learning.lines(study)
    for stage in learning.stages(study):
        found[f"training_{stage}"] = partial(learning.together, drawn, stage)
    return found


def shrink(path: Path, width: int | None = None) -> None:
    """Write a PNG again with a palette, which takes about a third.

    Args:
        path: the PNG.
        width: largest width [pixels]; None to keep it.
    """
    from PIL import Image

    with Image.open(path) as picture:
        image = picture.convert("RGB")
    if width is not None and image.width > width:
        image = image.resize((width, round(image.height * width / image.width)))
    data = BytesIO()
    image.quantize(TINTS).save(data, "PNG", optimize=True)
    write(path, data.getvalue())
