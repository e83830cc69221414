"""Pictures of the shipped robots, for the README and for a look from every side.

    python -m docs.pictures                 # docs/images/quadrupeds.png and robots.png
    python -m docs.pictures --sides out     # every robot and design from four sides

MuJoCo's own renderer draws them, without a display. Shadows are soft because a picture is the mean
of many, each lit from a little elsewhere.
"""

# pyright: reportAttributeAccessIssue=false
# (MuJoCo's compiled modules carry no types.)
from __future__ import annotations

import argparse
import ctypes.util
import os
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

# MuJoCo reads this when it is imported.
if sys.platform == "linux" and not (os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY")):
    os.environ.setdefault("MUJOCO_GL", "egl" if ctypes.util.find_library("EGL") else "osmesa")

import mujoco
import numpy as np
from numpy.typing import NDArray
from PIL import Image

import draft
from draft.spec.load import shipped

Array = NDArray[np.float64]
Pixels = NDArray[np.uint8]

IMAGES = Path(__file__).resolve().parent / "images"
FLOOR = (0.955, 0.96, 0.965)
# Light on a horizontal face from everywhere, and from the one lamp of each rendering; their sum is
# 1, so that the floor looks like the background and no horizon shows.
AMBIENT = 0.42
LAMP = 1.0 - AMBIENT
# The lamp is at about one place for half of the renderings, which gives the shadow, and all over
# the sky for the others, which gives the shade under things.
LIGHTS = 80
DIRECTION = np.array([-0.6, 0.4])
LAMP_SIZE, SKY_SIZE = 0.16, 0.9
FIELD_OF_VIEW = 16  # [deg]
MARGIN = 1.08
# A robot of a row turns this far from the camera [rad], and stands this far from the next [m].
TURN = 0.80
GAP = 0.10
# Camera's azimuth and elevation [deg], as MuJoCo counts them.
View = tuple[float, float]
ROW: View = (180, -12)
SIDES: dict[str, View] = {
    "front": (180, 0),
    "side": (90, 0),
    "top": (90, -90),
    "corner": (135, -20),
}


@dataclass(frozen=True)
class Exhibit:
    """A model at a place on the floor [m], turned about the vertical [rad]."""

    model: draft.Model
    place: tuple[float, float]
    yaw: float


def main(arguments: Sequence[str] | None = None) -> None:
    """Draw the pictures."""
    parser = argparse.ArgumentParser(
        prog="python -m docs.pictures", description="Draw the shipped robots."
    )
    parser.add_argument(
        "--sides", type=Path, help="draw each robot from four sides, to this folder"
    )
    options = parser.parse_args(arguments)
    if options.sides is not None:
        sides(options.sides)
        return
    quadruped = draft.load("quadruped")
    designs = [quadruped.resolve(name) for name in ("cheetah", "bear", "giraffe")]
    row([design.build() for design in designs], IMAGES / "quadrupeds.png")
    robots = [draft.load(name).resolve() for name in ("hopper", "quadruped", "humanoid")]
    row([design.build() for design in robots], IMAGES / "robots.png", (1200, 800))


def row(models: Sequence[draft.Model], path: Path, size: tuple[int, int] = (1600, 800)) -> None:
    """Draw models side by side on one floor, at true relative size."""
    edge = 0.0
    exhibits = []
    for model in models:
        stage = _stage([Exhibit(model, (0, 0), TURN)])
        y = _points(*stage)[:, 1]
        exhibits.append(Exhibit(model, (0, edge - y.min()), TURN))
        edge += np.ptp(y) + GAP
    _save(draw(exhibits, ROW, size), path)


def sides(folder: Path) -> None:
    """Draw every shipped robot and design from the front, the side, the top and a corner."""
    for name in shipped():
        spec = draft.load(name)
        for label in (None, *spec.designs):
            model = spec.resolve(label or {}).build()
            views = [
                draw([Exhibit(model, (0, 0), 0)], view, (800, 800), 12, flat=side != "corner")
                for side, view in SIDES.items()
            ]
            sheet = np.vstack([np.hstack(views[:2]), np.hstack(views[2:])])
            _save(sheet, folder / (f"{name}_{label}.png" if label else f"{name}.png"))


def draw(
    exhibits: Sequence[Exhibit],
    view: View,
    size: tuple[int, int],
    lights: int = LIGHTS,
    flat: bool = False,
) -> Pixels:
    """Render exhibits in their home poses, shape (height, width, 3).

    Args:
        exhibits: what stands where.
        view: azimuth and elevation of the camera [deg].
        size: width and height [pixels].
        lights: half the number of renderings that make the picture.
        flat: without perspective.
    """
    model, data = _stage(exhibits)
    model.vis.global_.offwidth, model.vis.global_.offheight = size
    camera = _camera(model, data, view, size, flat)
    # The camera's own light reaches the floor at a slant; the ambient light makes up for it.
    slant = 0.25 * np.sin(np.radians(-view[1]))
    model.vis.headlight.diffuse = [0.25] * 3
    model.vis.headlight.ambient = [AMBIENT - slant] * 3
    total = np.zeros((size[1], size[0], 3))
    rays = _rays(lights)
    with mujoco.Renderer(model, size[1], size[0]) as renderer:
        for ray in rays:
            model.light_dir[0] = ray / np.linalg.norm(ray)
            # Its place matters for the shadows only: they are drawn around where it points.
            model.light_pos[0] = camera.lookat - model.stat.extent * ray
            model.light_diffuse[0] = LAMP * np.linalg.norm(ray)
            mujoco.mj_forward(model, data)
            renderer.update_scene(data, camera)
            total += renderer.render()
    return (total / len(rays) + 0.5).astype(np.uint8)


def _rays(count: int) -> Array:
    """Where the lamp shines in each rendering, one down, shape (2 count, 3)."""
    shadow = DIRECTION + LAMP_SIZE * _disc(count)
    shade = 0.4 * DIRECTION + SKY_SIZE * _disc(count)
    return np.insert(np.vstack([shadow, shade]), 2, -1.0, axis=1)


def _disc(count: int) -> Array:
    """Points spread evenly over the unit disc, shape (count, 2): the seeds of a sunflower."""
    k = np.arange(count) + 0.5
    angle = np.pi * (3 - np.sqrt(5)) * k
    return np.sqrt(k / count)[:, None] * np.stack([np.cos(angle), np.sin(angle)], axis=1)


def _stage(exhibits: Sequence[Exhibit]) -> tuple[mujoco.MjModel, mujoco.MjData]:
    """Put exhibits on a floor, in their home poses."""
    spec = mujoco.MjSpec()
    _surroundings(spec)
    for i, exhibit in enumerate(exhibits):
        robot = mujoco.MjSpec.from_string(exhibit.model.xml)
        spec.attach(robot, prefix=f"{i}_", frame=spec.worldbody.add_frame())
    model = spec.compile()
    data = mujoco.MjData(model)
    for i, exhibit in enumerate(exhibits):
        design, (x, y), half = exhibit.model.design, exhibit.place, exhibit.yaw / 2
        height = float(design.lowest(home=True))  # type: ignore[arg-type]
        base = data.joint(f"{i}_floating_base")
        base.qpos[:] = (x, y, height, np.cos(half), 0, 0, np.sin(half))
        for name, joint in design.joints.items():
            data.joint(f"{i}_{name}").qpos[0] = joint.home
    mujoco.mj_forward(model, data)
    return model, data


def _surroundings(spec: mujoco.MjSpec) -> None:
    """A floor and a background of one colour, and one lamp."""
    visual = spec.visual
    visual.quality.shadowsize = 4096
    visual.quality.offsamples = 8
    visual.map.haze = 0.0
    visual.map.shadowclip = 1.0
    visual.map.zfar = 400  # also scales what keeps a face from shadowing itself
    visual.rgba.haze = [*FLOOR, 1]
    visual.headlight.specular = [0.0] * 3
    spec.add_texture(
        name="sky",
        type=mujoco.mjtTexture.mjTEXTURE_SKYBOX,
        builtin=mujoco.mjtBuiltin.mjBUILTIN_FLAT,
        rgb1=FLOOR,
        rgb2=FLOOR,
        width=16,
        height=16,
    )
    world = spec.worldbody
    spec.add_material(name="floor", rgba=[*FLOOR, 1], specular=0, shininess=0)
    world.add_geom(name="floor", type=mujoco.mjtGeom.mjGEOM_PLANE, size=[0, 0, 1], material="floor")
    world.add_light(
        type=mujoco.mjtLightType.mjLIGHT_DIRECTIONAL,
        specular=[0.12] * 3,
        castshadow=True,
    )


def _camera(
    model: mujoco.MjModel, data: mujoco.MjData, view: View, size: tuple[int, int], flat: bool
) -> mujoco.MjvCamera:
    """A camera that sees everything but the floor, in the middle of the picture."""
    azimuth, elevation = np.radians(view)
    right = np.array([np.sin(azimuth), -np.cos(azimuth), 0])
    flatly = np.array([np.cos(azimuth), np.sin(azimuth), 0])
    ahead = np.cos(elevation) * flatly + np.sin(elevation) * np.array([0, 0, 1])
    axes = np.array([right, np.cross(right, ahead), ahead])
    points = _points(model, data) @ axes.T
    middle = (points.min(axis=0) + points.max(axis=0)) / 2
    points -= middle
    aspect = np.array([size[0] / size[1], 1.0])
    distance = 10.0
    model.vis.global_.orthographic = flat
    if flat:
        model.vis.global_.fovy = 2 * MARGIN * float((points[:, :2] / aspect).max())
    else:
        model.vis.global_.fovy = FIELD_OF_VIEW
        distance, shift = _step_back(points, aspect)
        middle[:2] += shift
    camera = mujoco.MjvCamera()
    camera.lookat = middle @ axes
    camera.azimuth, camera.elevation = view
    camera.distance = distance
    # Shadows and clipping are measured in extents.
    model.stat.extent = float(np.linalg.norm(np.ptp(points, axis=0)))
    model.stat.center = camera.lookat
    return camera


def _step_back(points: Array, aspect: Array) -> tuple[float, Array]:
    """How far a camera must stand, and how far aside [m], to see points in its own axes.

    Near points look larger, so that the middle of the picture is not the middle of the points.
    """
    slope = np.tan(np.radians(FIELD_OF_VIEW) / 2) * aspect / MARGIN
    shift, distance = np.zeros(2), 1.0
    for _ in range(10):
        across = points[:, :2] - shift
        distance = float((np.abs(across) / slope - points[:, 2:]).max())
        seen = across / (distance + points[:, 2:])
        shift += (seen.min(axis=0) + seen.max(axis=0)) / 2 * distance
    return distance, shift


def _points(model: mujoco.MjModel, data: mujoco.MjData) -> Array:
    """Corners of the box around every geom but the floor, shape (points, 3) [m]."""
    signs = np.array([(a, b, c) for a in (1, -1) for b in (1, -1) for c in (1, -1)])
    found = []
    for i in range(model.ngeom):
        if model.geom_type[i] != mujoco.mjtGeom.mjGEOM_PLANE:
            box, frame = model.geom_aabb[i], data.geom_xmat[i].reshape(3, 3)
            found.append(data.geom_xpos[i] + (box[:3] + signs * box[3:]) @ frame.T)
    return np.vstack(found)


def _save(pixels: Pixels, path: Path) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    Image.fromarray(pixels).save(path, optimize=True)
    print(f"{path}  {path.stat().st_size // 1000} kB")


if __name__ == "__main__":
    main()
