"""Figures of a study: each panel alone, for papers, and combined ones, for a page of Markdown."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial
from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING

from draft.files import write
from draft.learn.task.stages import STAGES
from draft.plotting import COLUMN
from draft.study.report import curves, learning, plane
from draft.study.report.occupancy import TESTS, Utilisation
from draft.study.report.records import Study

if TYPE_CHECKING:
    from matplotlib.figure import Figure

# Colours of the palette of a picture.
TINTS = 128
# Skill test -> panels of its curves.
CURVES = {
    "speed": ("speed", "survival", "efficiency"),
    "stairs": ("stairs", "ascent", "descent"),
    "push": ("push",),
}


@dataclass(frozen=True)
class Drawing:
    """A figure that is still to be drawn.

    Attributes:
        name: name of its files.
        section: name of its section on the page; empty for none.
        words: description for those who do not see it.
        make: draws it.
        caption: caption on the page.
    """

    name: str
    section: str
    words: str
    make: Callable[[], Figure]
    caption: str = ""


def single(study: Study, used: Utilisation) -> Iterator[Drawing]:
    """Yield a figure of each panel, and one of all curves."""
    shown = [name for name in curves.PANELS if curves.has(study, name)]
    for name in shown:
        make, caption = partial(curves.figure, study, [name]), curves.PANELS[name].caption
        yield Drawing(f"curve_{name}", "curves", caption, make, caption)
    if len(shown) > 1:
        yield Drawing("capability", "", "", partial(curves.figure, study, shown))
    names = set[str]()
    for test in TESTS:
        for design, use in plane.shown(study, used, test).items():
            title = study.titles[design]
            name = f"occupancy_{test}_" + "".join(c if c.isalnum() else "_" for c in title)
            while name in names:
                name += "_"
            names.add(name)
            make = partial(plane.figure, study, test, {design: use}, COLUMN)
            words = f"{title}, {test}: torque and speed of the joints"
            yield Drawing(name, "utilisation", words, make)
    drawn = learning.lines(study)
    for stage in STAGES:
        for name in learning.quantities(drawn, stage):
            words = f"{learning.SHOWN[name][0]} of stage {stage} over iterations"
            make = partial(learning.figure, drawn, stage, [name])
            yield Drawing(f"training_{stage}_{name}", "training", words, make)


def combined(study: Study, used: Utilisation) -> Iterator[Drawing]:
    """Yield a figure of the panels of each skill test and stage."""
    for test, panels in CURVES.items():
        known = [name for name in panels if curves.has(study, name)]
        if known:
            words = f"Capability by level: {test}"
            caption = " ".join(curves.PANELS[name].caption for name in known)
            make = partial(curves.figure, study, known)
            yield Drawing(f"curves_{test}", "curves", words, make, caption)
    for test in TESTS:
        if found := plane.shown(study, used, test):
            make = partial(plane.figure, study, test, found, 1.5 * COLUMN)
            words = f"Torque and speed: {test}"
            yield Drawing(f"occupancy_{test}", "utilisation", words, make)
    drawn = learning.lines(study)
    for stage in STAGES:
        if names := learning.quantities(drawn, stage):
            make = partial(learning.figure, drawn, stage, names)
            yield Drawing(f"training_{stage}", "training", f"Training: stage {stage}", make)


def shrink(path: Path, width: int | None = None, tints: int = TINTS) -> None:
    """Write a PNG again with a palette, which takes about a third.

    Args:
        path: the PNG.
        width: largest width [pixels]; None to keep it.
        tints: number of colours.
    """
    from PIL import Image

    with Image.open(path) as picture:
        image = picture.convert("RGB")
    if width is not None and image.width > width:
        image = image.resize((width, round(image.height * width / image.width)))
    data = BytesIO()
    image.quantize(tints).save(data, "PNG", optimize=True)
    write(path, data.getvalue())
