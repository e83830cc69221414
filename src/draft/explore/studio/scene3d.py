"""The robot in a browser: few meshes, of which only those that changed are sent."""

# pyright: reportAttributeAccessIssue=false
# (MuJoCo's compiled modules carry no types.)
from __future__ import annotations

from typing import Any

import mujoco
import numpy as np
import viser

from draft.explore.studio.session import Drawn
from draft.explore.studio.shapes import Color, Mesh, meshes

GHOST: Color = (217, 102, 31)


class Picture:
    """One robot below a node of a scene: a frame for each body, meshes below it.

    Attributes:
        drawn: the robot that is shown; None where none is.
        base: height of its trunk's frame above the floor [m].
    """

    def __init__(self, scene: viser.SceneApi, name: str, ghost: bool = False) -> None:
        self._scene, self._name, self._ghost = scene, name, ghost
        self._frames: list[viser.FrameHandle] = []
        self._handles: dict[tuple[int, Color], viser.MeshHandle] = {}
        self._meshes: dict[tuple[int, Color], Mesh] = {}
        self._data: mujoco.MjData | None = None
        self.drawn: Drawn | None = None
        self.base = 0.0

    def show(self, drawn: Drawn | None) -> None:
        """Send what has changed since; `None` shows nothing."""
        if drawn is self.drawn:
            return
        self.drawn = drawn
        robot = drawn.robot if drawn is not None else None
        self._data = mujoco.MjData(robot) if robot is not None else None
        new = meshes(robot) if robot is not None else {}
        self._bodies(robot.nbody if robot is not None else 0)
        for key in self._handles.keys() - new.keys():
            self._handles.pop(key).remove()
        for key, mesh in new.items():
            self._update(key, mesh)
        self._meshes = new

    def pose(self, angles: np.ndarray) -> None:
        """Put the joints at these values [rad or m], and the lowest point on the floor."""
        if self.drawn is None or self._data is None:
            return
        data = self._data
        data.qpos[:3], data.qpos[3:7] = 0.0, (1, 0, 0, 0)
        data.qpos[7:] = angles
        mujoco.mj_kinematics(self.drawn.robot, data)
        self.base = -self._lowest(data)
        data.xpos[1:, 2] += self.base
        self.place(data)

    def place(self, data: mujoco.MjData) -> None:
        """Put every body where a state has it."""
        for body, frame in enumerate(self._frames):
            position, quaternion = data.xpos[body], data.xquat[body]
            if not np.allclose(frame.position, position, atol=1e-6):
                frame.position = position
            if not np.allclose(frame.wxyz, quaternion, atol=1e-6):
                frame.wxyz = quaternion

    def extent(self) -> float:
        """Diagonal of the robot where it stands [m]."""
        data = self._data
        if data is None:
            return 1.0
        points = np.concatenate(
            [
                mesh.vertices @ data.xmat[body].reshape(3, 3).T + data.xpos[body]
                for (body, _), mesh in self._meshes.items()
            ]
        )
        return float(np.linalg.norm(np.ptp(points, axis=0)))

    def _lowest(self, data: mujoco.MjData) -> float:
        return min(
            float((mesh.vertices @ data.xmat[body].reshape(3, 3)[2]).min() + data.xpos[body, 2])
            for (body, _), mesh in self._meshes.items()
        )

    def _bodies(self, count: int) -> None:
        for k in range(len(self._frames), count):
            self._frames.append(self._scene.add_frame(f"{self._name}/b{k}", show_axes=False))
        while len(self._frames) > count:
            self._frames.pop().remove()
            # A frame takes the meshes below it along.
            gone = [key for key in self._handles if key[0] >= len(self._frames)]
            for key in gone:
                self._handles.pop(key)

    def _update(self, key: tuple[int, Color], mesh: Mesh) -> None:
        handle, old = self._handles.get(key), self._meshes.get(key)
        if handle is None or old is None or len(old.faces) != len(mesh.faces):
            body, color = key
            style: dict[str, Any] = {"color": GHOST, "opacity": 0.22} if self._ghost else {}
            self._handles[key] = self._scene.add_mesh_simple(
                f"{self._name}/b{body}/m{bytes(color).hex()}",
                mesh.vertices,
                mesh.faces,
                **{"color": color, "side": "double", "cast_shadow": not self._ghost, **style},
            )
        elif not np.array_equal(old.vertices, mesh.vertices):
            handle.vertices = mesh.vertices


def surroundings(scene: viser.SceneApi) -> None:
    """Floor and light."""
    scene.set_up_direction("+z")
    scene.add_grid(
        "/floor",
        infinite_grid=True,
        cell_size=0.1,
        section_size=1.0,
        cell_color=(228, 231, 235),
        section_color=(200, 205, 211),
        fade_distance=12.0,
        shadow_opacity=0.25,
    )
