"""The robot in the browser, its shadow and the floor; only meshes that changed are sent."""

from __future__ import annotations

from typing import Any

import mujoco
import numpy as np
import viser
from numpy.typing import NDArray

from draft.model import Model, pose
from draft.studio.skins import Color, Skin, hit, outline, skins
from draft.values import Array

GHOST: Color = (217, 102, 31)
_GHOST_OPACITY = 0.22
# Position of the sun, which is far away: its rays are parallel.
_SUN = (1.4, -1.6, 4.0)
# The shadow is a flat mesh just above the floor: viser's shadow maps would draw the robot three
# more times per frame, which a browser without a GPU does in software.
_SHADOW: Color = (158, 163, 170)
_ABOVE = 0.002  # height of the shadow above the floor [m]


class RobotMesh:
    """One robot below a node of the scene, with its shadow on the floor unless it is a ghost.

    Attributes:
        model: the robot that is shown; None for none.
        base: height of the frame of its trunk above the floor [m]; 0 for a fixed base.
        extent: diagonal of its bounding box in the last pose [m].
    """

    def __init__(self, scene: viser.SceneApi, name: str, ghost: bool = False) -> None:
        self._scene, self._name, self._ghost = scene, name, ghost
        self._skins: dict[Color, Skin] = {}
        self._handles: dict[Color, viser.MeshHandle] = {}
        self._data: mujoco.MjData | None = None
        self._outline: Skin | None = None
        self._shadow: viser.MeshHandle | None = None
        self.model: Model | None = None
        self.base, self.extent = 0.0, 1.0

    def show(self, model: Model | None, angles: Array) -> None:
        """Show a robot on the floor.

        Args:
            model: the robot; None removes what is shown.
            angles: joint positions [rad or m], shape (joints,).
        """
        self.load(model)
        if model is None or self._data is None:
            self._remove(set(self._handles))
            if self._shadow is not None:
                self._shadow.remove()
                self._shadow = None
            return
        data = self._data
        pose.put(model.mujoco, data, angles)
        points = np.concatenate([skin.placed(data) for skin in self._skins.values()])
        self.base = -float(points[:, 2].min()) if model.design.floating else 0.0
        self.extent = float(np.linalg.norm(np.ptp(points, axis=0)))
        data.xpos[1:, 2] += self.base
        self.place(data)

    def load(self, model: Model | None) -> None:
        """Use the shapes of a robot from the next pose on."""
        if model is not self.model:
            self.model = model
            self._skins = skins(model) if model is not None else {}
            self._outline = outline(model) if model is not None and not self._ghost else None
            self._data = mujoco.MjData(model.mujoco) if model is not None else None

    def place(self, data: mujoco.MjData, origin: Array | None = None) -> None:
        """Place every body as in a state.

        Args:
            data: state of the robot.
            origin: position that becomes the origin of the scene [m], shape (3,).
        """
        self._remove(self._handles.keys() - self._skins.keys())
        for color, skin in self._skins.items():
            vertices, handle = skin.placed(data), self._handles.get(color)
            if origin is not None:
                vertices -= origin.astype(np.float32)
            if handle is None or len(handle.vertices) != len(vertices):
                self._add(color, vertices, skin.faces)
            elif not np.array_equal(handle.vertices, vertices):
                handle.vertices = vertices
        self._cast(data, origin)

    def hit(self, origin: Array, direction: Array) -> int | None:
        """Body that a ray of the scene meets first; None if it meets none."""
        shown = [color for color in self._skins if color in self._handles]
        vertices = [self._handles[color].vertices.astype(float) for color in shown]
        return hit([self._skins[color] for color in shown], vertices, origin, direction)

    def _cast(self, data: mujoco.MjData, origin: Array | None) -> None:
        """Draw the shadow that the sun casts of a state."""
        if self._outline is None:
            return
        vertices = shadow(self._outline.placed(data))
        if origin is not None:
            vertices -= origin.astype(np.float32)
        if self._shadow is not None and len(self._shadow.vertices) != len(vertices):
            self._shadow.remove()
            self._shadow = None
        if self._shadow is None:
            # Flat shading gives all of it one colour; its lower faces would have another.
            self._shadow = self._scene.add_mesh_simple(
                f"{self._name}/shadow",
                vertices,
                self._outline.faces,
                color=_SHADOW,
                flat_shading=True,
                cast_shadow=False,
                receive_shadow=False,
            )
        elif not np.array_equal(self._shadow.vertices, vertices):
            self._shadow.vertices = vertices

    def _add(self, color: Color, vertices: NDArray[np.float32], faces: NDArray[np.uint32]) -> None:
        style: dict[str, Any] = {"color": color}
        if self._ghost:
            style = {"color": GHOST, "opacity": _GHOST_OPACITY}
        self._handles[color] = self._scene.add_mesh_simple(
            f"{self._name}/{bytes(color).hex()}",
            vertices,
            faces,
            cast_shadow=False,
            receive_shadow=False,
            **style,
        )

    def _remove(self, colors: set[Color]) -> None:
        for color in colors:
            self._handles.pop(color).remove()


def shadow(points: NDArray[np.float32]) -> NDArray[np.float32]:
    """Project points along the rays of the sun to just above the floor [m], shape (n, 3)."""
    x, y, z = _SUN
    flat = points.copy()
    flat[:, :2] -= points[:, 2:] * (x / z, y / z)
    flat[:, 2] = _ABOVE
    return flat


def surroundings(scene: viser.SceneApi) -> viser.GridHandle:
    """Add floor and light: two lamps without shadow maps, which are fast without a GPU too.

    Returns:
        The floor, whose lines repeat every metre.
    """
    scene.set_up_direction("+z")
    scene.configure_default_lights(enabled=False, cast_shadow=False)
    scene.configure_environment_map(None)
    scene.add_light_hemisphere(
        "/sky", sky_color=(255, 255, 255), ground_color=(176, 182, 190), intensity=1.9
    )
    scene.add_light_directional(
        "/sun", color=(255, 255, 255), intensity=1.7, position=_SUN, cast_shadow=False
    )
    return scene.add_grid(
        "/floor",
        infinite_grid=True,
        cell_size=0.25,
        section_size=1.0,
        cell_color=(225, 228, 232),
        section_color=(206, 211, 217),
        plane_color=(241, 243, 245),
        plane_opacity=1.0,
        fade_distance=12.0,
        shadow_opacity=0.0,
    )
