"""Videos of a simulation, drawn by MuJoCo's renderer, and the frames of its film strip."""

from __future__ import annotations

import contextlib
import copy
from collections.abc import Callable, Generator, Iterator, Sequence
from pathlib import Path
from typing import Protocol

import mujoco
import numpy as np
from imageio_ffmpeg import write_frames
from numpy.typing import NDArray

from draft.files import new_file
from draft.learn.bodies.legged import LeggedRobot
from draft.learn.policy import strip as strips
from draft.learn.policy.play_options import Command
from draft.learn.policy.playback import Outcome
from draft.model.picture import axes, corners, disc, open_renderer

Pixels = NDArray[np.uint8]
Sink = Generator[None, Pixels | None, None]  # imageio's: takes frames by `send`.
SIZE = (960, 540)
_RATE = 25.0  # Frames per second.
_DISTANCE, AZIMUTH, _ELEVATION = 3.6, 128.0, -15.0  # Distance per reach of the feet; [deg].
_FIELD_OF_VIEW = 38.0  # [deg]
_LAG = 0.25  # Time constant of the camera's position [s].
_PACE = 0.5  # Time constant of the camera's speed, so that it keeps up with a fast robot [s].
_SIGHT = 7.0  # Radius of the ground that is drawn, in distances of the camera.
_SUNS, _SUN_SIZE = 12, 0.12  # Suns of a picture of a strip, and the radius of their directions.
_HIDDEN = 3  # Group of geoms that is not drawn.


class Filmable(Protocol):
    """A running policy that can be filmed."""

    @property
    def member(self) -> LeggedRobot:
        """Numbers of the design."""
        ...

    @property
    def period(self) -> float:
        """Time between two actions [s]."""
        ...

    @property
    def command(self) -> Command:
        """Commanded vx, vy [m/s], wz [rad/s]."""
        ...

    def scene(self) -> tuple[mujoco.MjModel, str]:
        """Return the model, dressed by `scenery`, and the prefix of robots' names."""
        ...

    def poses(self) -> NDArray[np.float64]:
        """Return the present positions `qpos` of each robot, shape (robots, nq)."""
        ...

    def steps(self, seconds: float) -> int:
        """Return the number of actions in a time [s]."""
        ...

    def play(self, seconds: float, report: Callable[[int], None]) -> Outcome:
        """Run the policy, and call `report` with the number of actions done, from 0 on."""
        ...


class Film:
    """A camera that follows the first robot; the others are drawn too."""

    def __init__(self, player: Filmable, size: tuple[int, int], azimuth: float = AZIMUTH) -> None:
        """Open a renderer.

        Args:
            player: the running policy.
            size: width and height [pixels].
            azimuth: of the camera; 90 looks at the right side of a robot that faces x [deg].

        Raises:
            DraftError: MuJoCo cannot draw on this machine.
        """
        self._player, member = player, player.member
        model, prefix = player.scene()
        # The changes below are for pictures only.
        self._model = copy.copy(model)
        self._data = mujoco.MjData(self._model)
        self._trunk = self._model.body(prefix + member.trunk).id
        self._sun = self._model.light("draft_sun").id
        self._distance = _DISTANCE * self._reach(member.home, [prefix + n for n in member.feet])
        self._prepare(size)
        self._camera = mujoco.MjvCamera()
        self._camera.distance = self._distance
        self._camera.azimuth, self._camera.elevation = azimuth, _ELEVATION
        self._drop = 0.18 * member.height
        self._at: NDArray[np.float64] | None = None
        self._speed, self._last = np.zeros(3), np.zeros(3)
        self._options = mujoco.MjvOption()
        self._options.sitegroup[:] = 0
        self._renderer = open_renderer(self._model, size)

    def frame(self, seconds: float) -> Pixels:
        """Draw the present state, shape (height, width, 3).

        Args:
            seconds: time since the last frame [s].
        """
        self._pose(self._player.poses()[0])
        self._follow(seconds)
        return self._draw().copy()

    def _draw(self) -> Pixels:
        """Draw all robots where they are, shape (height, width, 3)."""
        first, *others = self._player.poses()
        self._pose(first)
        renderer = self._renderer
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
        return renderer.render()

    def shot(self, time: float) -> strips.Shot:
        """Draw the last frame again for a film strip, with soft shadows.

        Args:
            time: its time [s].
        """
        model, camera = self._model, self._camera
        sun = model.light_dir[self._sun].copy()
        height, width = model.vis.global_.offheight, model.vis.global_.offwidth
        total = np.zeros((height, width, 3))
        for x, y in _SUN_SIZE * disc(_SUNS):
            self._shine(sun + np.array([x, y, 0.0]))
            total += self._draw()
        self._shine(sun)
        self._pose(self._player.poses()[0])
        own = model.body_rootid[model.geom_bodyid] == model.body_rootid[self._trunk]
        seen = corners(model, self._data, own) - camera.lookat
        right, up, ahead = axes((camera.azimuth, camera.elevation)) @ seen.T
        scale = height / 2 / np.tan(np.radians(_FIELD_OF_VIEW) / 2) / (ahead + camera.distance)
        x, y = width / 2 + scale * right, height / 2 - scale * up
        box = (float(x.min()), float(y.min()), float(x.max()), float(y.max()))
        place = self._data.xpos[self._trunk, :2].copy()
        return strips.Shot((total / _SUNS).astype(np.uint8), box, time, place)

    def _shine(self, direction: NDArray[np.float64]) -> None:
        """Turn the sun; shadows are drawn around the point below it."""
        model = self._model
        model.light_dir[self._sun] = direction / np.linalg.norm(direction)
        model.light_pos[self._sun] = (
            self._camera.lookat - 2 * self._distance * model.light_dir[self._sun]
        )

    def close(self) -> None:
        """Release the renderer."""
        self._renderer.close()

    def _reach(self, home: Sequence[float], feet: Sequence[str]) -> float:
        """Distance from the trunk's origin to the furthest foot in the home pose [m]."""
        self._data.qpos[7:] = home
        mujoco.mj_kinematics(self._model, self._data)
        trunk = self._data.xpos[self._trunk]
        return max(float(np.linalg.norm(self._data.site(n).xpos - trunk)) for n in feet)

    def _prepare(self, size: tuple[int, int]) -> None:
        """Set field of view, clipping, shadows and fog; MuJoCo counts most of them in extents."""
        model, d = self._model, self._distance
        model.stat.extent = d
        visual = model.vis
        visual.global_.offwidth, visual.global_.offheight = size
        visual.global_.fovy = _FIELD_OF_VIEW
        visual.map.znear, visual.map.zfar = 0.02, 400  # as in `draft.model.picture`
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
        """Move camera, sun and the drawn part of the ground smoothly with the robot."""
        now = self._data.xpos[self._trunk].copy()
        now[2] -= self._drop
        at = self._at
        if at is None or np.linalg.norm(now - at) > self._distance / 2:
            # The first frame, or the robot fell and restarted.
            at, self._speed, self._last = now, np.zeros(3), now
        pace = (1.0 - np.exp(-seconds / _PACE)) / seconds if seconds else 0.0
        self._speed = self._speed + pace * (now - self._last - self._speed * seconds)
        self._speed[2] = 0.0
        ahead = at + self._speed * seconds
        share = 1.0 - np.exp(-seconds / np.array([_LAG, _LAG, 2 * _LAG]))
        at = ahead + share * (now - ahead)
        self._at, self._last = at, now
        self._camera.lookat[:] = at
        model = self._model
        self._shine(model.light_dir[self._sun])
        ids = self._ground
        away = np.abs(model.geom_pos[ids, :2] - at[:2]) - _half_sides(model, ids)
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
    player: Filmable, seconds: float, path: Path, strip: Path | None = None, pictures: int = 6
) -> Outcome:
    """Play a policy and film it.

    Args:
        player: the running policy.
        seconds: duration [s].
        path: MP4 file to write.
        strip: PNG file to write, with the last frames cut to the robot; None for none.
        pictures: number of frames in the strip.

    Raises:
        DraftError: MuJoCo cannot draw here, a file cannot be written, or `player.play` fails.
    """
    period = player.period
    every = max(1, round(1.0 / (_RATE * period)))
    frames = player.steps(seconds) // every
    pace = every * period
    wanted = {every * i for i in strips.moments(frames, pictures, pace)}
    kept: list[strips.Shot] = []
    with (
        contextlib.closing(Film(player, SIZE)) as camera,
        video(path, SIZE, 1.0 / pace) as sink,
    ):

        def shoot(step: int) -> None:
            if step % every == 0:
                sink.send(camera.frame(pace))
                if strip is not None and step in wanted:
                    kept.append(camera.shot(step * period))

        outcome = player.play(seconds, shoot)
    if strip is not None:
        strips.save(strip, kept)
    return outcome


@contextlib.contextmanager
def video(path: Path, size: tuple[int, int], rate: float) -> Iterator[Sink]:
    """Write a video, whole or not at all: `send` frames to the generator that is yielded.

    Args:
        path: MP4 file to write.
        size: width and height of the frames [pixels], both even.
        rate: frames per second [1/s].

    Raises:
        DraftError: it cannot be written.
    """
    with new_file(path, keep_suffix=True) as temporary:
        sink = write_frames(
            str(temporary),
            size,
            fps=rate,  # type: ignore[arg-type]  # Untyped: pyright takes the default's type.
            quality=7,
            macro_block_size=2,
            ffmpeg_log_level="error",
        )
        sink.send(None)
        with contextlib.closing(sink):
            yield sink
