"""The first picture of README and site: sliders change a robot, which walks on.

python -m docs.animation   # docs/images/draft.webp

Every frame is a design, resolved and compiled, that a shipped policy drives as in the studio; the
mass and the verdict that are drawn are those of the design.
"""

# pyright: reportAttributeAccessIssue=false
# (MuJoCo's compiled modules carry no types.)
from __future__ import annotations

import textwrap
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import matplotlib as mpl
import numpy as np
from PIL import Image, ImageDraw, ImageFont

import draft
from draft.offscreen import prefer_offscreen

prefer_offscreen()  # before MuJoCo is imported

import mujoco  # noqa: E402

from draft.learn.policy.validity import fit  # noqa: E402
from draft.learn.policy.walk import Walk  # noqa: E402
from draft.model.model import preview  # noqa: E402
from draft.model.picture import FLOOR, Pixels, exhibit, render, stage  # noqa: E402
from draft.studio import plots  # noqa: E402
from draft.studio.walker import SKILL  # noqa: E402
from draft.values import Array, scalar  # noqa: E402

PICTURE = Path(__file__).resolve().parent / "images" / "draft.webp"
ROBOT = "quadruped"
SIZE = (720, 460)
PANEL = 116  # height of the sliders and numbers [px]
RATE = 12.5  # frames per second
SPEED = 0.8  # commanded [m/s]
VIEW = (112, -11)  # azimuth and elevation of the camera [deg]
DISTANCE, FIELD_OF_VIEW, HEIGHT = 4.1, 20.0, 0.33  # [m], [deg], height of what it looks at [m]
EXTENT = 2.6  # of the scene, for its shadows [m]
LAG = 0.4  # time constant of the camera's position [s]
CELL = 0.5  # distance of the lines on the floor [m]
LINE, LINE_WIDTH = (0.86, 0.875, 0.89), 0.008  # their colour, width [m]
QUALITY = 62  # of WebP


@dataclass(frozen=True)
class Slider:
    """A slider: its unit, ends and step, and its positions at some times [s]."""

    unit: str
    low: float
    high: float
    step: float
    keys: tuple[tuple[float, float], ...]

    def value(self, time: float) -> float:
        """Value at a time [s], with an eased motion between two positions, to a whole step."""
        times, values = zip(*self.keys, strict=True)
        k = int(np.clip(np.searchsorted(times, time, "right") - 1, 0, len(times) - 2))
        share = min(max((time - times[k]) / (times[k + 1] - times[k]), 0.0), 1.0)
        eased = share * share * (3 - 2 * share)
        between = values[k] + eased * (values[k + 1] - values[k])
        return round(round(between / self.step) * self.step, 6)


# Thighs beyond the surveyed ones are a warning; the torque then exceeds that of every module of
# such a reduction, and the design is refused.
SLIDERS = {
    "thigh_length": Slider(
        "m",
        0.2,
        0.5,
        0.01,
        ((0.6, 0.25), (2.4, 0.42), (3.0, 0.42), (4.4, 0.3), (7.0, 0.3), (7.8, 0.25)),
    ),
    "actuators.leg.peak_torque": Slider(
        "N m", 40, 180, 2, ((4.6, 72), (5.7, 150), (6.5, 150), (7.2, 72))
    ),
}
SECONDS = 8.0


@dataclass(frozen=True)
class Frame:
    """Numbers of one frame.

    Attributes:
        values: changed values of the robot by name.
        mass: mass of this design [kg].
        accepted: whether the design filter accepts it.
        severity: severity of its first finding, errors first; "" for none.
        finding: text of that finding.
    """

    values: dict[str, float]
    mass: float
    accepted: bool
    severity: str
    finding: str


def frames() -> list[Frame]:
    """Numbers of all frames."""
    times = np.arange(round(SECONDS * RATE)) / RATE
    return [frame(**{k: s.value(t) for k, s in SLIDERS.items()}) for t in times.tolist()]


def frame(**values: float) -> Frame:
    """Numbers of the robot with some values."""
    design = _model(tuple(values.items())).design
    found = sorted(design.findings, key=lambda finding: finding.severity != "error")
    severity, text = (found[0].severity, found[0].message) if found else ("", "")
    return Frame(values, scalar(design.mass), bool(design.accepted), severity, text)


def walk(shown: Sequence[Frame]) -> Iterator[Walk]:
    """Walk under one policy through the bodies of all frames, and yield the state at each."""
    model = _model(tuple(shown[0].values.items()))
    walking = Walk(model, fit(model, SKILL), (SPEED, 0.0, 0.0))
    walking.advance(3.0)  # to an even gait
    last = model
    for one in shown:
        model = _model(tuple(one.values.items()))
        if model is not last:
            walking.swap(model, fit(model, SKILL))
            last = model
        walking.advance(1 / RATE)
        yield walking


def main() -> None:
    """Draw and write the animation."""
    shown = frames()
    camera: np.ndarray | None = None
    pictures = []
    for one, walking in zip(shown, walk(shown), strict=True):
        at = walking.data.qpos[:2].copy()
        camera = at if camera is None else camera + (at - camera) / (LAG * RATE) + _pace(walking)
        scene = _scene(_model(tuple(one.values.items())), walking.data.qpos, camera)
        picture = Image.new("RGB", SIZE, "white")
        picture.paste(Image.fromarray(scene), (0, 0))
        _panel(picture, one)
        pictures.append(picture)
    first, *others = pictures
    first.save(
        PICTURE,
        save_all=True,
        append_images=others,
        duration=round(1000 / RATE),
        loop=0,
        quality=QUALITY,
        method=6,
    )
    print(f"{PICTURE}  {len(pictures)} frames, {PICTURE.stat().st_size // 1000} kB")


def _pace(walking: Walk) -> np.ndarray:
    """Motion of the camera per frame that keeps up with the commanded speed [m]."""
    return 0.8 * SPEED / RATE * np.array(walking.heading)


@cache
def _model(values: tuple[tuple[str, float], ...]) -> draft.Model:
    return preview(draft.load(ROBOT).resolve(dict(values)))


def _scene(model: draft.Model, qpos: np.ndarray, at: np.ndarray) -> Pixels:
    """Render a robot on the floor, shape (height, width, 3)."""
    compiled, data = stage([exhibit(model)])
    data.qpos[:] = qpos
    mujoco.mj_forward(compiled, data)
    compiled.vis.global_.fovy = FIELD_OF_VIEW
    camera = mujoco.MjvCamera()
    camera.lookat[:] = (*at, HEIGHT)
    camera.distance, camera.azimuth, camera.elevation = DISTANCE, *VIEW
    compiled.stat.extent = EXTENT
    compiled.stat.center[:] = camera.lookat
    return render(compiled, data, camera, (SIZE[0], SIZE[1] - PANEL), _lines)


def _lines(places: Array) -> Array:
    """Colours of a floor with lines, which show that the robot moves.

    Each pixel has the share of the lines in it, so that lines fade where they are far away.
    """
    sizes = [np.abs(np.gradient(places, axis=axis)) for axis in (0, 1)]
    size = np.clip(np.maximum(*sizes), 1e-6, CELL)
    beside = np.abs(places - CELL * np.round(places / CELL))
    low = np.maximum(beside - size / 2, -LINE_WIDTH / 2)
    high = np.minimum(beside + size / 2, LINE_WIDTH / 2)
    shares = np.clip((high - low) / size, 0.0, 1.0)
    share = np.nan_to_num(1 - (1 - shares).prod(axis=-1, keepdims=True))
    return share * np.subtract(LINE, FLOOR) + FLOOR


def _font(size: int, bold: bool = False) -> ImageFont.FreeTypeFont:
    name = "DejaVuSans-Bold.ttf" if bold else "DejaVuSans.ttf"
    return ImageFont.truetype(Path(mpl.get_data_path()) / "fonts" / "ttf" / name, size)


def _panel(picture: Image.Image, shown: Frame) -> None:
    """Draw sliders, mass and verdict below the robot."""
    draw = ImageDraw.Draw(picture)
    top, ink, accent = SIZE[1] - PANEL, "#1f2933", "#35618f"
    draw.line((0, top, SIZE[0], top), "#d8dee4")
    for k, (name, slider) in enumerate(SLIDERS.items()):
        y = top + 34 + 46 * k
        draw.text((18, y - 9), name.split(".")[-1], ink, _font(14))
        value = shown.values[name]
        low, high = 146, 312
        at = low + (high - low) * (value - slider.low) / (slider.high - slider.low)
        draw.rounded_rectangle((low, y - 2, high, y + 2), 2, "#d8dee4")
        draw.rounded_rectangle((low, y - 2, at, y + 2), 2, accent)
        draw.ellipse((at - 8, y - 8, at + 8, y + 8), accent, "white", 2)
        words = f"{value:.2f}" if slider.step < 1 else f"{value:.0f}"
        draw.text((326, y - 9), f"{words} {slider.unit}", ink, _font(14, bold=True))
    draw.text((430, top + 12), f"{shown.mass:.1f} kg", ink, _font(26, bold=True))
    word, color, tint = "accepted", plots.GOOD, "#e4f3ea"
    if not shown.accepted:
        word, color, tint = "refused", plots.BAD, "#fbe6e3"
    draw.rounded_rectangle((600, top + 14, 702, top + 40), 13, tint)
    draw.text((651, top + 27), word, color, _font(14, bold=True), anchor="mm")
    told = {"": plots.GOOD, "warning": plots.WARN, "error": plots.BAD}[shown.severity]
    text = f"{shown.severity}: {shown.finding}" if shown.severity else "no findings"
    lines = textwrap.wrap(text, 42, max_lines=3, placeholder=" …")
    for k, line in enumerate(lines):
        draw.text((431, top + 54 + 18 * k), line, told, _font(12))


if __name__ == "__main__":
    main()
