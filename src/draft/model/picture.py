"""Pictures of robots, drawn by MuJoCo's renderer without a display.

A picture is the mean of many renderings with slightly different lamps, which gives soft shadows.
Without a screen, the environment variable MUJOCO_GL must be `egl` or `osmesa` before MuJoCo is
imported.
"""

from __future__ import annotations

import os
import struct
import warnings
import zlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import mujoco
import numpy as np
from numpy.typing import NDArray

from draft.errors import DraftError, Problem
from draft.model.model import Model
from draft.values import Array, scalar

Pixels = NDArray[np.uint8]

FLOOR = (0.955, 0.96, 0.965)
# Light on a horizontal face from all directions, and from the lamp of each rendering. Their sum is
# 1, so that the floor has the colour of the background and no horizon is visible.
AMBIENT = 0.42
LAMP = 1.0 - AMBIENT
# In half of the renderings the lamp is near one direction, which gives the shadows; in the others
# it is anywhere in the sky, which gives the ambient occlusion.
LIGHTS = 80
DIRECTION = np.array([-0.6, 0.4])
LAMP_SIZE, SKY_SIZE = 0.16, 0.9
# Size of the shadow map and samples per pixel of a quick picture.
QUICK = (1536, 4)
FIELD_OF_VIEW = 16  # [deg]
MARGIN = 1.08
# Azimuth and elevation of the camera [deg], in MuJoCo's convention.
View = tuple[float, float]
# Why MuJoCo cannot draw in this process. A second attempt after GLFW failed aborts the process.
_failures: list[str] = []


@dataclass(frozen=True)
class Exhibit:
    """A robot in a picture.

    Attributes:
        robot: the robot, on a floating base.
        base: name of the joint of the floating base.
        height: height of the base's frame above the floor [m].
        home: joint positions by name [rad or m]; joints without one are at zero.
        place: position on the floor [m].
        yaw: rotation about the vertical [rad].
    """

    robot: mujoco.MjSpec
    base: str
    height: float
    home: Mapping[str, float]
    place: tuple[float, float] = (0.0, 0.0)
    yaw: float = 0.0


def exhibit(model: Model, place: tuple[float, float] = (0.0, 0.0), yaw: float = 0.0) -> Exhibit:
    """Exhibit of a model in its home pose, standing on the floor."""
    design = model.design
    home = {name: scalar(joint.home) for name, joint in design.joints.items()}
    height = scalar(design.lowest(home=True))
    robot = mujoco.MjSpec.from_string(model.xml)
    return Exhibit(robot, "floating_base", height, home, place, yaw)


def draw(
    exhibits: Sequence[Exhibit],
    view: View,
    size: tuple[int, int],
    lights: int = LIGHTS,
    flat: bool = False,
    quick: bool = False,
) -> Pixels:
    """Render exhibits in their home poses, shape (height, width, 3).

    Args:
        exhibits: the robots.
        view: azimuth and elevation of the camera [deg].
        size: width and height [pixels].
        lights: half the number of renderings.
        flat: whether to draw without perspective.
        quick: whether to draw coarser shadows and edges, in a third of the time.

    Raises:
        DraftError: MuJoCo cannot draw on this machine.
    """
    model, data = stage(exhibits)
    if quick:
        model.vis.quality.shadowsize, model.vis.quality.offsamples = QUICK
    model.vis.global_.offwidth, model.vis.global_.offheight = size
    camera = _camera(model, data, view, size, flat)
    # The headlight reaches the floor at an angle; the ambient light compensates for it.
    slant = 0.25 * np.sin(np.radians(-view[1]))
    model.vis.headlight.diffuse = [0.25] * 3
    model.vis.headlight.ambient = [AMBIENT - slant] * 3
    total = np.zeros((size[1], size[0], 3))
    rays = _rays(lights)
    with open_renderer(model, size) as renderer:
        for ray in rays:
            model.light_dir[0] = ray / np.linalg.norm(ray)
            # The position of a directional lamp only sets where shadows are drawn.
            model.light_pos[0] = camera.lookat - model.stat.extent * ray
            model.light_diffuse[0] = LAMP * np.linalg.norm(ray)
            mujoco.mj_forward(model, data)
            renderer.update_scene(data, camera)
            total += renderer.render()
    return (total / len(rays) + 0.5).astype(np.uint8)


def open_renderer(model: mujoco.MjModel, size: tuple[int, int]) -> mujoco.Renderer:
    """Open MuJoCo's renderer.

    Args:
        model: the model; `vis.global_` must allow the size.
        size: width and height [pixels].

    Raises:
        DraftError: MuJoCo cannot draw on this machine.
    """
    if not _failures:
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")  # of GLFW, less precise than the error below
                return mujoco.Renderer(model, size[1], size[0])
        except Exception as error:  # the backends of MuJoCo raise different types
            _failures.append(" ".join(str(error).split())[:200])
    backend = os.environ.get("MUJOCO_GL") or "unset"
    cause = f"MuJoCo cannot draw on this machine (MUJOCO_GL is {backend}): {_failures[0]}"
    remedy = "without a screen, set MUJOCO_GL=egl or osmesa (Debian: libegl1 or libosmesa6)"
    raise DraftError(Problem(cause, None, remedy))


def _rays(count: int) -> Array:
    """Direction of the lamp in each rendering, with -1 along z, shape (2 count, 3)."""
    shadow = DIRECTION + LAMP_SIZE * _disc(count)
    shade = 0.4 * DIRECTION + SKY_SIZE * _disc(count)
    return np.insert(np.vstack([shadow, shade]), 2, -1.0, axis=1)


def _disc(count: int) -> Array:
    """Points spread evenly over the unit disc (Vogel's spiral), shape (count, 2)."""
    k = np.arange(count) + 0.5
    angle = np.pi * (3 - np.sqrt(5)) * k
    return np.sqrt(k / count)[:, None] * np.stack([np.cos(angle), np.sin(angle)], axis=1)


def stage(exhibits: Sequence[Exhibit]) -> tuple[mujoco.MjModel, mujoco.MjData]:
    """Compile a scene of exhibits on a floor, in their home poses."""
    spec = mujoco.MjSpec()
    _surroundings(spec)
    for i, shown in enumerate(exhibits):
        spec.attach(shown.robot.copy(), prefix=f"{i}_", frame=spec.worldbody.add_frame())
    model = spec.compile()
    data = mujoco.MjData(model)
    for i, shown in enumerate(exhibits):
        (x, y), half = shown.place, shown.yaw / 2
        base = data.joint(f"{i}_{shown.base}")
        base.qpos[:] = (x, y, shown.height, np.cos(half), 0, 0, np.sin(half))
        for name, angle in shown.home.items():
            data.joint(f"{i}_{name}").qpos[0] = angle
    mujoco.mj_forward(model, data)
    return model, data


def _surroundings(spec: mujoco.MjSpec) -> None:
    """Add a floor and a background of the same colour, and one lamp."""
    visual = spec.visual
    visual.quality.shadowsize = 4096
    visual.quality.offsamples = 8
    visual.map.haze = 0.0
    visual.map.shadowclip = 1.0
    visual.map.zfar = 400  # also scales the offset that keeps a face from shadowing itself
    visual.rgba.haze[:] = [*FLOOR, 1]
    visual.headlight.specular[:] = 0.0
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
    """Camera with all shapes except the floor in the centre of the picture."""
    azimuth, elevation = np.radians(view)
    right = np.array([np.sin(azimuth), -np.cos(azimuth), 0])
    flatly = np.array([np.cos(azimuth), np.sin(azimuth), 0])
    ahead = np.cos(elevation) * flatly + np.sin(elevation) * np.array([0, 0, 1])
    axes = np.array([right, np.cross(right, ahead), ahead])
    seen = corners(model, data) @ axes.T
    middle = (seen.min(axis=0) + seen.max(axis=0)) / 2
    seen -= middle
    aspect = np.array([size[0] / size[1], 1.0])
    distance = 10.0
    model.vis.global_.orthographic = flat
    if flat:
        model.vis.global_.fovy = 2 * MARGIN * float((seen[:, :2] / aspect).max())
    else:
        model.vis.global_.fovy = FIELD_OF_VIEW
        distance, shift = _step_back(seen, aspect)
        middle[:2] += shift
    camera = mujoco.MjvCamera()
    camera.lookat = middle @ axes
    camera.azimuth, camera.elevation = view
    camera.distance = distance
    # Shadows and clipping are relative to the extent.
    model.stat.extent = float(np.linalg.norm(np.ptp(seen, axis=0)))
    model.stat.center = camera.lookat
    return camera


def _step_back(points: Array, aspect: Array) -> tuple[float, Array]:
    """Distance and lateral shift of a camera that fits points into the picture [m].

    The points are in the axes of the camera. Because of the perspective, the centre of the picture
    is not the centre of the points.
    """
    slope = np.tan(np.radians(FIELD_OF_VIEW) / 2) * aspect / MARGIN
    shift, distance = np.zeros(2), 1.0
    for _ in range(10):
        across = points[:, :2] - shift
        distance = float((np.abs(across) / slope - points[:, 2:]).max())
        seen = across / (distance + points[:, 2:])
        shift += (seen.min(axis=0) + seen.max(axis=0)) / 2 * distance
    return distance, shift


def corners(model: mujoco.MjModel, data: mujoco.MjData) -> Array:
    """Corners of the bounding boxes of all geoms except the floor [m], shape (points, 3)."""
    signs = np.array([(a, b, c) for a in (1, -1) for b in (1, -1) for c in (1, -1)])
    points = []
    for i in range(model.ngeom):
        if model.geom_type[i] != mujoco.mjtGeom.mjGEOM_PLANE:
            box, frame = model.geom_aabb[i], data.geom_xmat[i].reshape(3, 3)
            points.append(data.geom_xpos[i] + (box[:3] + signs * box[3:]) @ frame.T)
    return np.vstack(points)


def png(pixels: Pixels) -> bytes:
    """Encode a picture of shape (height, width, 3) as PNG, with zlib alone."""
    height, width, _ = pixels.shape
    rows = np.zeros((height, 1 + 3 * width), np.uint8)
    rows[:, 1:] = pixels.reshape(height, -1)
    parts = (
        (b"IHDR", struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0)),
        (b"IDAT", zlib.compress(rows.tobytes(), 6)),
        (b"IEND", b""),
    )
    encoded = b"\x89PNG\r\n\x1a\n"
    for kind, content in parts:
        check = struct.pack(">I", zlib.crc32(kind + content))
        encoded += struct.pack(">I", len(content)) + kind + content + check
    return encoded
