"""Film strips: pictures of a robot in motion at one scale, a moment apart."""

from __future__ import annotations

import io
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw, ImageFont

from draft.files import write

Pixels = NDArray[np.uint8]
# Time from one picture to the next [s]: a stride takes several, and the ground moves by less than
# one of its squares.
INTERVAL = 0.12
_MARGIN = 0.08  # Around the robot, of its size.
_GAP = 6  # [pixels]
BAND = 34  # Height of the band for the text below a picture [pixels].
_SMALL, _LARGE = 10, 24  # Sizes of the text [pixels]; it takes most of a picture's width.
_INK = (60, 60, 60)


@dataclass(frozen=True)
class Shot:
    """A picture of a robot.

    Attributes:
        pixels: the picture, shape (height, width, 3).
        box: left, top, right and bottom of the robot in it [pixels].
        time: when it was taken [s].
        place: where the robot was on the ground [m], shape (2,).
    """

    pixels: Pixels
    box: tuple[float, float, float, float]
    time: float
    place: NDArray[np.float64]


def moments(frames: int, pictures: int, pace: float) -> list[int]:
    """Frames of a film that a strip shows: the last, an interval apart.

    Args:
        frames: number of the last frame, from 0.
        pictures: number of pictures.
        pace: time from one frame to the next [s].
    """
    step = max(1, min(round(INTERVAL / pace), frames // max(1, pictures - 1)))
    return [frames - i * step for i in reversed(range(pictures)) if frames >= i * step]


def draw(shots: Sequence[Shot]) -> Pixels:
    """Cut shots to the robot, one window for all, and lay them out with time and distance.

    Robots that are wider than tall take two rows.
    """
    height, width, _ = shots[0].pixels.shape
    left, top = np.min([shot.box[:2] for shot in shots], axis=0)
    right, bottom = np.max([shot.box[2:] for shot in shots], axis=0)
    margin = _MARGIN * max(right - left, bottom - top)
    low = np.floor((left - margin, top - margin)).clip(min=0).astype(int)
    high = np.ceil((right + margin, bottom + margin)).clip(max=(width, height)).astype(int)
    wide, tall = (high - low).clip(min=1)
    rows = 2 if wide > tall and len(shots) > 3 else 1
    columns = -(-len(shots) // rows)
    size = (columns * (wide + _GAP) - _GAP, rows * (tall + BAND))
    sheet = Image.new("RGB", (int(size[0]), int(size[1])), "white")
    pen, font = (
        ImageDraw.Draw(sheet),
        ImageFont.load_default(float(np.clip(wide / 9, _SMALL, _LARGE))),
    )
    for i, shot in enumerate(shots):
        row, column = divmod(i, columns)
        x, y = int(column * (wide + _GAP)), int(row * (tall + BAND))
        cut = shot.pixels[low[1] : low[1] + tall, low[0] : low[0] + wide]
        sheet.paste(Image.fromarray(cut), (x, y))
        away = float(np.linalg.norm(shot.place - shots[0].place))
        words = f"{shot.time - shots[0].time:.2f} s, {away:.2f} m"
        pen.text((x + 2, y + int(tall) + 3), words, _INK, font)
    return np.asarray(sheet)


def save(path: Path, shots: Sequence[Shot]) -> None:
    """Write shots as PNG.

    Raises:
        DraftError: it cannot be written.
    """
    data = io.BytesIO()
    Image.fromarray(draw(shots)).save(data, "PNG", optimize=True)
    write(path, data.getvalue())
