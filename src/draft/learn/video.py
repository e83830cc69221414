"""Pictures of a simulation by MuJoCo's own renderer, made to videos and strips."""

# pyright: reportAttributeAccessIssue=false
# (MuJoCo's compiled modules carry no types.)
from __future__ import annotations

import contextlib
import copy
import io
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
from imageio_ffmpeg import write_frames
from numpy.typing import NDArray
from PIL import Image

from draft.files import new_file, write
from draft.learn.playing import Outcome, Player
from draft.model.picture import open_renderer

Pixels = NDArray[np.uint8]
SIZE = (960, 540)
_RATE = 25.0  # Frames per second.
_DISTANCE, _AZIMUTH, _ELEVATION = 3.6, 128.0, -15.0  # Distance per reach of the feet.
_FIELD_OF_VIEW = 38.0  # [deg]
_LAG = 0.25  # In which the camera answers to a step aside [s].
_PACE = 0.5  # In which it takes up the robot's speed, so that a fast one does not run away [s].
_SIGHT = 7.0  # Ground is drawn this far, in distances of the camera.
_HIDDEN = 3  # Group of geoms that is not drawn.


class Film:
    """A camera that follows the first robot; the others are seen too."""

    def __init__(self, player: Player, size: tuple[int, int]) -> None:
        """Open a renderer.

        Args:
            player: what is filmed.
            size: width and height [pixels].

        Raises:
            DraftError: MuJoCo cannot draw on this machine.
        """
        self._player, member = player, player.member
        model, prefix = player.scene()
        # What is changed below is for pictures only.
        self._model = copy.copy(model)
        self._data = mujoco.MjData(self._model)
        self._trunk = self._model.body(prefix + member.trunk).id
        self._sun = self._model.light("draft_sun").id
        feet = [prefix + name for name in member.feet]
        self._distance = _DISTANCE * self._reach(member.home, feet)
        self._prepare(size)
        self._camera = mujoco.MjvCamera()
        self._camera.distance = self._distance
        self._camera.azimuth, self._camera.elevation = _AZIMUTH, _ELEVATION
        self._drop = 0.18 * member.height
        self._at: Any = None
        self._speed, self._seen = np.zeros(3), np.zeros(3)
        self._options = mujoco.MjvOption()
        self._options.sitegroup[:] = 0
        self._renderer = open_renderer(self._model, size)

    def frame(self, seconds: float) -> Pixels:
        """A picture of this moment, shape (height, width, 3).

        Args:
            seconds: since the last one.
        """
        first, *others = self._player.poses()
        self._pose(first)
        self._follow(seconds)
        renderer: Any = self._renderer
        renderer.update_scene(self._data, self._camera, self._options)
        renderer.scene.flags[mujoco.mjtRndFlag.mjRND_FOG] = True
        for pose in others:
            self._pose(pose)
            mujoco.mjv_addGeoms(
                self._model,
                self._data,
                self._options,
                mujoco.MjvPerturb(),
                mujoco.mjtCatBit.mjCAT_DYNAMIC.value,
                renderer.scene,
            )
        return renderer.render().copy()

    def close(self) -> None:
        """Let go of the renderer."""
        self._renderer.close()

    def _reach(self, home: Sequence[float], feet: Sequence[str]) -> float:
        """Distance of the trunk's origin and the furthest foot in the home pose [m]."""
        self._data.qpos[7:] = home
        mujoco.mj_kinematics(self._model, self._data)
        places = [self._data.site(name).xpos for name in feet]
        trunk = self._data.xpos[self._trunk]
        return float(max(np.linalg.norm(place - trunk) for place in places))

    def _prepare(self, size: tuple[int, int]) -> None:
        """Measures of the picture: MuJoCo counts most of them in extents."""
        model, d = self._model, self._distance
        model.stat.extent = d
        visual = model.vis
        visual.global_.offwidth, visual.global_.offheight = size
        visual.global_.fovy = _FIELD_OF_VIEW
        visual.map.znear, visual.map.zfar = 0.02, 4 * _SIGHT
        visual.map.shadowclip = 1.2
        visual.map.fogstart, visual.map.fogend = 0.35 * _SIGHT, 0.95 * _SIGHT
        ground = np.flatnonzero(model.geom_bodyid == model.body("terrain").id)
        self._ground = ground[model.geom_type[ground] != mujoco.mjtGeom.mjGEOM_PLANE]

    def _pose(self, qpos: NDArray[np.float64]) -> None:
        self._data.qpos[:] = qpos
        mujoco.mj_kinematics(self._model, self._data)
        mujoco.mj_comPos(self._model, self._data)
        mujoco.mj_camlight(self._model, self._data)

    def _follow(self, seconds: float) -> None:
        """Move camera, sun and seen ground with the robot, smoothly."""
        now = self._data.xpos[self._trunk].copy()
        now[2] -= self._drop
        if self._at is None or np.linalg.norm(now - self._at) > self._distance / 2:
            # It begins, or it fell and started anew.
            self._at, self._speed, self._seen = now, np.zeros(3), now
        pace = (1.0 - np.exp(-seconds / _PACE)) / seconds if seconds else 0.0
        self._speed = self._speed + pace * (now - self._seen - self._speed * seconds)
        self._speed[2] = 0.0
        ahead = self._at + self._speed * seconds
        share = 1.0 - np.exp(-seconds / np.array([_LAG, _LAG, 2 * _LAG]))
        self._at, self._seen = ahead + share * (now - ahead), now
        self._camera.lookat[:] = self._at
        model = self._model
        # Shadows are drawn around the place that the sun stands above.
        model.light_pos[self._sun] = self._at - 2 * self._distance * model.light_dir[self._sun]
        self._data.light_xpos[self._sun] = model.light_pos[self._sun]
        ids = self._ground
        away = np.abs(model.geom_pos[ids, :2] - self._at[:2]) - _half_sides(model, ids)
        far = np.linalg.norm(away.clip(min=0.0), axis=1) > _SIGHT * self._distance
        model.geom_group[ids] = np.where(far, _HIDDEN, 0)


def _half_sides(model: mujoco.MjModel, geoms: NDArray[np.int64]) -> NDArray[np.float64]:
    """Half sides of the ground's geoms along x and y [m], shape (geoms, 2)."""
    sides = model.geom_size[geoms, :2].copy()
    for row, geom in enumerate(geoms):
        if model.geom_type[geom] == mujoco.mjtGeom.mjGEOM_HFIELD:
            sides[row] = model.hfield_size[model.geom_dataid[geom], :2]
    return sides


def film(
    player: Player, seconds: float, path: Path, strip: Path | None = None, pictures: int = 6
) -> Outcome:
    """Play a policy before the camera.

    Args:
        player: the policy.
        seconds: for how long.
        path: of the MP4.
        strip: of a PNG with some pictures side by side; None for none.
        pictures: how many.

    Raises:
        DraftError: MuJoCo cannot draw on this machine, a file cannot be written, or see
            `Player.play`.
    """
    period = player.period
    every = max(1, round(1.0 / (_RATE * period)))
    frames = player.steps(seconds) // every
    wanted = {every * round(i * frames / (pictures - 1)) for i in range(pictures)}
    kept: list[Pixels] = []
    with (
        contextlib.closing(Film(player, SIZE)) as camera,
        video(path, SIZE, 1.0 / (every * period)) as sink,
    ):

        def shoot(step: int) -> None:
            if step % every == 0:
                pixels = camera.frame(every * period)
                sink.send(pixels)
                if step in wanted:
                    kept.append(pixels)

        outcome = player.play(seconds, shoot)
    if strip is not None:
        write_strip(strip, kept)
    return outcome


@contextlib.contextmanager
def video(path: Path, size: tuple[int, int], rate: Any) -> Iterator[Any]:
    """Write a video whole or not at all; frames go to what this gives, by `send`.

    Args:
        path: of the MP4.
        size: width and height of the frames [pixels], both even.
        rate: frames per second.

    Raises:
        DraftError: it cannot be written.
    """
    with new_file(path, keep_suffix=True) as temporary:
        sink = write_frames(
            str(temporary),
            size,
            fps=rate,
            quality=7,
            macro_block_size=2,
            ffmpeg_log_level="error",
        )
        sink.send(None)
        with contextlib.closing(sink):
            yield sink


def write_strip(path: Path, frames: list[Pixels]) -> None:
    """Write the middles of some frames side by side, as PNG.

    Raises:
        DraftError: it cannot be written.
    """
    height, width, _ = frames[0].shape
    side = min(width, round(0.95 * height))
    left, top = (width - side) // 2, height // 8  # Much of the top is sky.
    middles = [frame[top:, left : left + side] for frame in frames]
    data = io.BytesIO()
    Image.fromarray(np.hstack(middles)).save(data, "PNG", optimize=True)
    write(path, data.getvalue())
