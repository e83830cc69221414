"""Pictures of robots, drawn by MuJoCo's renderer without a display.

A picture is the mean of some renderings with slightly different lamps, which gives soft shadows on
the robots, and cameras, which gives smooth edges. The floor is a plane of one colour with the shade
of `draft.model.shade`, which comes from many more lamps.

Without a screen, the environment variable MUJOCO_GL must be `egl` or `osmesa` before MuJoCo is
imported.
"""

from __future__ import annotations

import os
import struct
import warnings
import zlib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import mujoco
import numpy as np
from numpy.typing import NDArray

from draft.errors import DraftError
from draft.model.mjcf import FLOATING
from draft.model.model import Model
from draft.model.shade import Shade, shade
from draft.values import Array, scalar

Pixels = NDArray[np.uint8]

FLOOR = (0.955, 0.96, 0.965)
# No robot has this colour: pixels of it show the floor.
_EMPTY = (1.0, 0.0, 1.0)
# Light on a horizontal face from all directions, and from the lamps. Their sum is 1, so that the
# floor has the colour of the background and no horizon is visible.
AMBIENT = 0.42
LAMP = 1.0 - AMBIENT
# Half of the lamps are near one direction, which gives the shadows; the others are anywhere in the
# sky, which gives the ambient occlusion. Lamps of one half: on the floor, and on the robots.
FLOOR_LAMPS, LAMPS = 100, 14
# Lamps of one rendering: OpenGL has eight, and MuJoCo takes one of them.
TOGETHER = 4
# Details of the shade on the floor, per extent of the robots.
FINENESS = 270
DIRECTION = np.array([-0.6, 0.4])
LAMP_SIZE, SKY_SIZE = 0.16, 0.9
FIELD_OF_VIEW = 16  # [deg]
MARGIN = 1.08
GAP = 0.15  # between exhibits of a row [m]
# Azimuth and elevation of the camera [deg], in MuJoCo's convention.
View = tuple[float, float]
# Colours [0 to 1], shape (..., 3), of places on the floor [m], shape (..., 2); NaN for none there.
Paint = Callable[[Array], Array]
# Why MuJoCo cannot draw in this process. A second attempt after GLFW failed aborts the process.
_failures: list[str] = []


@dataclass(frozen=True)
class Exhibit:
    """A robot in a picture.

    Attributes:
        robot: the robot.
        base: name of the joint of its floating base; "" for a base that is bolted to the world.
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
    return Exhibit(robot, FLOATING if design.floating else "", height, home, place, yaw)


def row(models: Sequence[Model], yaw: float) -> list[Exhibit]:
    """Exhibits side by side along y, all turned by `yaw` [rad]."""
    edge, shown = 0.0, []
    for model in models:
        y = corners(*stage([exhibit(model, yaw=yaw)]))[:, 1]
        shown.append(exhibit(model, (0.0, edge - float(y.min())), yaw))
        edge += float(np.ptp(y)) + GAP
    return shown


def draw(
    exhibits: Sequence[Exhibit],
    view: View,
    size: tuple[int, int],
    flat: bool = False,
) -> Pixels:
    """Render exhibits in their home poses, shape (height, width, 3).

    Args:
        exhibits: the robots.
        view: azimuth and elevation of the camera [deg].
        size: width and height [pixels].
        flat: whether to draw without perspective.

    Raises:
        DraftError: MuJoCo cannot draw on this machine.
    """
    model, data = stage(exhibits)
    return render(model, data, _camera(model, data, view, size, flat), size)


def render(
    model: mujoco.MjModel,
    data: mujoco.MjData,
    camera: mujoco.MjvCamera,
    size: tuple[int, int],
    paint: Paint | None = None,
) -> Pixels:
    """Render a scene of `stage`, shape (height, width, 3).

    Args:
        model: the scene; its headlight, lamps and size of the buffer are changed.
        data: its poses.
        camera: the camera, not of MuJoCo's tracking kind.
        size: width and height [pixels].
        paint: colour of the floor where no shade is; None for one colour.

    Raises:
        DraftError: MuJoCo cannot draw on this machine.
    """
    model.vis.global_.offwidth, model.vis.global_.offheight = size
    sight = _Sight(model, camera, size)
    shades = shade(model, data, rays(FLOOR_LAMPS), model.stat.extent / FINENESS)
    # The headlight reaches the floor at an angle; the ambient light compensates for it.
    slant = 0.25 * np.sin(np.radians(-camera.elevation))
    model.vis.headlight.diffuse = [0.25] * 3
    model.vis.headlight.ambient = [AMBIENT - slant] * 3
    empty = np.round(255 * np.array(_EMPTY)).astype(np.uint8)
    total = np.zeros((size[1], size[0], 3))
    middle = camera.lookat.copy()
    floor = sight.floor(shades, paint)
    directions = rays(LAMPS)
    count = len(directions) // TOGETHER
    with open_renderer(model, size) as renderer:
        for i in range(count):
            for lamp, ray in enumerate(directions[i::count]):
                model.light_dir[lamp] = ray / np.linalg.norm(ray)
                # The position of a directional lamp only sets where shadows are drawn.
                model.light_pos[lamp] = middle - model.stat.extent * ray
                model.light_diffuse[lamp] = LAMP * np.linalg.norm(ray) / TOGETHER
            mujoco.mj_forward(model, data)
            # A part of a pixel to the side, another one each time.
            camera.lookat = middle + sight.pixel * sight.axes[:2].T @ disc(count)[i] / np.sqrt(2)
            renderer.update_scene(data, camera)
            pixels = renderer.render()
            seen = (pixels == empty).all(axis=2, keepdims=True)
            total += np.where(seen, floor, pixels)
    camera.lookat = middle
    return (total / count + 0.5).astype(np.uint8)


class _Sight:
    """Lines of sight of a camera."""

    def __init__(
        self, model: mujoco.MjModel, camera: mujoco.MjvCamera, size: tuple[int, int]
    ) -> None:
        """Take over a camera.

        Args:
            model: the scene, with its field of view.
            camera: the camera, aimed at the middle of the picture.
            size: width and height [pixels].
        """
        self._camera, self._size = camera, size
        self._flat = bool(model.vis.global_.orthographic)
        # Rows: to the right, up, and ahead.
        self.axes = axes((camera.azimuth, camera.elevation))
        fovy = model.vis.global_.fovy
        tall = fovy if self._flat else 2 * camera.distance * np.tan(np.radians(fovy) / 2)
        #: Size of a pixel at the middle of what is shown [m].
        self.pixel = float(tall) / size[1]

    def floor(self, shades: Shade, paint: Paint | None) -> Array:
        """Colour of the floor at each pixel [0 to 255], shape (height, width, 3)."""
        width, height = self._size
        across = (np.arange(width) + 0.5 - width / 2) * self.pixel
        up = (height / 2 - 0.5 - np.arange(height)) * self.pixel
        right, above, ahead = self.axes
        aim = across[None, :, None] * right + up[:, None, None] * above
        eye = self._camera.lookat - self._camera.distance * ahead
        if self._flat:
            start, along = eye + aim, np.broadcast_to(ahead, aim.shape)
        else:
            start, along = np.broadcast_to(eye, aim.shape), aim + self._camera.distance * ahead
        with np.errstate(divide="ignore", invalid="ignore"):
            far = -start[..., 2:] / along[..., 2:]
            places = np.where(far > 0, start + far * along, np.nan)[..., :2]
        light = 1 - LAMP * shades.at(places)
        color = np.array(FLOOR) if paint is None else paint(places)
        return 255 * color * light[..., None]


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
    raise DraftError(cause, remedy)


def rays(count: int) -> Array:
    """Direction of the lamp in each rendering, with -1 along z, shape (2 count, 3)."""
    shadow = DIRECTION + LAMP_SIZE * disc(count)
    shade = 0.4 * DIRECTION + SKY_SIZE * disc(count)
    return np.insert(np.vstack([shadow, shade]), 2, -1.0, axis=1)


def disc(count: int) -> Array:
    """Points spread evenly over the unit disc (Vogel's spiral), shape (count, 2)."""
    k = np.arange(count) + 0.5
    angle = np.pi * (3 - np.sqrt(5)) * k
    return np.sqrt(k / count)[:, None] * np.stack([np.cos(angle), np.sin(angle)], axis=1)


def stage(exhibits: Sequence[Exhibit]) -> tuple[mujoco.MjModel, mujoco.MjData]:
    """Compile a scene of exhibits, in their home poses on the floor z = 0."""
    spec = mujoco.MjSpec()
    _surroundings(spec)
    for i, shown in enumerate(exhibits):
        (x, y), half = shown.place, shown.yaw / 2
        frame = spec.worldbody.add_frame()
        if not shown.base:
            frame.pos[:] = x, y, 0.0
            frame.quat[:] = np.cos(half), 0, 0, np.sin(half)
        spec.attach(shown.robot.copy(), prefix=f"{i}_", frame=frame)
    model = spec.compile()
    data = mujoco.MjData(model)
    for i, shown in enumerate(exhibits):
        (x, y), half = shown.place, shown.yaw / 2
        if shown.base:
            base = data.joint(f"{i}_{shown.base}")
            base.qpos[:] = (x, y, shown.height, np.cos(half), 0, 0, np.sin(half))
        for name, angle in shown.home.items():
            data.joint(f"{i}_{name}").qpos[0] = angle
    mujoco.mj_forward(model, data)
    return model, data


def _surroundings(spec: mujoco.MjSpec) -> None:
    """Add a background where the floor will be, and the lamps of a rendering."""
    visual = spec.visual
    visual.quality.shadowsize = 2048
    visual.quality.offsamples = 0  # An edge would mix the background into the robot.
    visual.quality.numslices = visual.quality.numstacks = 64  # of round shapes
    visual.map.shadowclip = 1.0
    visual.map.zfar = 400  # also scales the offset that keeps a face from shadowing itself
    visual.headlight.specular[:] = 0.0
    spec.add_texture(
        name="sky",
        type=mujoco.mjtTexture.mjTEXTURE_SKYBOX,
        builtin=mujoco.mjtBuiltin.mjBUILTIN_FLAT,
        rgb1=_EMPTY,
        rgb2=_EMPTY,
        width=16,
        height=16,
    )
    for _ in range(TOGETHER):
        spec.worldbody.add_light(
            type=mujoco.mjtLightType.mjLIGHT_DIRECTIONAL,
            specular=[0.12 / TOGETHER] * 3,
            castshadow=True,
        )


def _camera(
    model: mujoco.MjModel, data: mujoco.MjData, view: View, size: tuple[int, int], flat: bool
) -> mujoco.MjvCamera:
    """Camera with all shapes in the centre of the picture."""
    own = axes(view)
    seen = corners(model, data) @ own.T
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
    camera.lookat = middle @ own
    camera.azimuth, camera.elevation = view
    camera.distance = distance
    # Shadows and clipping are relative to the extent.
    model.stat.extent = float(np.linalg.norm(np.ptp(seen, axis=0)))
    model.stat.center = camera.lookat
    return camera


def axes(view: View) -> Array:
    """Unit vectors to the right, up and ahead of a camera, shape (3, 3)."""
    azimuth, elevation = np.radians(view)
    right = np.array([np.sin(azimuth), -np.cos(azimuth), 0])
    flatly = np.array([np.cos(azimuth), np.sin(azimuth), 0])
    ahead = np.cos(elevation) * flatly + np.sin(elevation) * np.array([0, 0, 1])
    return np.array([right, np.cross(right, ahead), ahead])


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


def corners(
    model: mujoco.MjModel, data: mujoco.MjData, chosen: NDArray[np.bool_] | None = None
) -> Array:
    """Corners of the bounding boxes of geoms, except of planes [m], shape (points, 3).

    Args:
        model: the scene.
        data: its poses.
        chosen: whether to take each geom; None for all.
    """
    signs = np.array([(a, b, c) for a in (1, -1) for b in (1, -1) for c in (1, -1)])
    points = []
    for i in range(model.ngeom):
        plane = model.geom_type[i] == mujoco.mjtGeom.mjGEOM_PLANE
        if not plane and (chosen is None or chosen[i]):
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
