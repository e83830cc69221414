"""Ground: patches of mjlab's terrain generator, and a map of its heights that replaces rays.

The ground does not move, so its heights are sampled on a grid once and looked up. The result is
that of downward rays that hit the ground only, never the robot's own legs.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, Literal, TypedDict

import mujoco
import numpy as np
import torch
from mjlab.sensor.sensor import Sensor, SensorCfg
from mjlab.terrains import (
    BoxFlatTerrainCfg,
    BoxInvertedPyramidStairsTerrainCfg,
    BoxPyramidStairsTerrainCfg,
    HfPyramidSlopedTerrainCfg,
    HfRandomUniformTerrainCfg,
    HfWaveTerrainCfg,
    TerrainEntityCfg,
)
from mjlab.terrains.terrain_generator import (
    SubTerrainCfg,
    TerrainGeneratorCfg,
    TerrainGeometry,
    TerrainOutput,
)

from draft.learn.task.config import Config
from draft.learn.task.groups import Climbing, Ground
from draft.learn.task.scan import scan_points

if TYPE_CHECKING:
    from mjlab.entity import Entity
    from mjlab.envs import ManagerBasedRlEnv

_BOX = mujoco.mjtGeom.mjGEOM_BOX
_DEPTH = 1.0  # Thickness of slabs [m].
_GREY = (0.5, 0.5, 0.5, 1.0)


@dataclass(kw_only=True)
class RisingRoughCfg(HfRandomUniformTerrainCfg):
    """Random heights that grow with the difficulty; those of mjlab do not."""

    def function(
        self,
        difficulty: float,
        spec: mujoco.MjSpec,
        rng: np.random.Generator,
    ) -> TerrainOutput:
        """Add the geometry of a patch to a scene."""
        low, high = self.noise_range
        # At least one step above the smallest height, or there is nothing to draw from.
        top = max(low + difficulty * (high - low), low + self.noise_step)
        return HfRandomUniformTerrainCfg.function(
            replace(self, noise_range=(low, top)), difficulty, spec, rng
        )


@dataclass(kw_only=True)
class SlabStairsCfg(BoxPyramidStairsTerrainCfg):
    """mjlab's pyramid of stairs, made of stacked slabs, with a quarter of the geoms.

    Every geom of the ground costs time at every physics step, wherever the robot is.
    """

    def function(
        self, difficulty: float, spec: mujoco.MjSpec, rng: np.random.Generator
    ) -> TerrainOutput:
        """Add the geometry of a patch to a scene."""
        low, high = self.step_height_range
        step = low + difficulty * (high - low)
        inside = self.size[0] - 2 * self.border_width
        count = max(0, int((inside - self.platform_width) / (2 * self.step_width)))
        body, middle = spec.body("terrain"), self.size[0] / 2
        sides = [self.size[0], *(inside - 2 * k * self.step_width for k in range(count + 1))]
        slabs = [
            body.add_geom(
                type=_BOX,
                pos=(middle, middle, k * step - _DEPTH / 2),
                size=(side / 2, side / 2, _DEPTH / 2),
            )
            for k, side in enumerate(sides)
        ]
        return TerrainOutput(
            origin=np.array([middle, middle, (count + 1) * step]),
            geometries=[TerrainGeometry(geom=slab, color=_GREY) for slab in slabs],
        )


def uneven(
    config: Config, shares: Literal["ground", "terrain"], foot_radius: float, seed: int
) -> TerrainEntityCfg:
    """Configuration of uneven ground.

    Args:
        config: the numbers.
        shares: group of numbers with the shares of the kinds of ground.
        foot_radius: radius of the largest foot [m]; cells of height fields have at least twice
            this side.
        seed: seed of the random patches.
    """
    ground = config.ground
    mix: Ground | Climbing = config.terrain if shares == "terrain" else ground
    generator = TerrainGeneratorCfg(
        seed=seed,
        curriculum=True,
        size=(ground.patch, ground.patch),
        border_width=ground.border,
        num_rows=ground.rows,
        sub_terrains=_patches(ground, mix, max(0.1, 2 * foot_radius)),
        add_lights=True,
    )
    return TerrainEntityCfg(
        terrain_type="generator",
        terrain_generator=generator,
        max_init_terrain_level=mix.start_rows - 1,
    )


class _Stairs(TypedDict):
    """Numbers that both kinds of stairs share."""

    step_height_range: tuple[float, float]
    step_width: float
    platform_width: float
    border_width: float


class _Slopes(TypedDict):
    """Numbers that both kinds of slopes share."""

    proportion: float
    slope_range: tuple[float, float]
    platform_width: float
    border_width: float
    horizontal_scale: float


def _patches(ground: Ground, mix: Ground | Climbing, cell: float) -> dict[str, SubTerrainCfg]:
    """Configurations of the kinds of patches with a share above zero."""
    stairs = _Stairs(
        step_height_range=mix.step,
        step_width=ground.tread,
        platform_width=ground.platform,
        border_width=ground.rim,
    )
    slopes = _Slopes(
        proportion=mix.slopes / 2,
        slope_range=ground.slope,
        platform_width=2.0,
        border_width=0.25,
        horizontal_scale=cell,
    )
    patches: dict[str, SubTerrainCfg] = {
        "flat": BoxFlatTerrainCfg(proportion=mix.flat),
        "stairs": SlabStairsCfg(proportion=mix.stairs * (1 - mix.pits), **stairs),
        "stairs_pit": BoxInvertedPyramidStairsTerrainCfg(
            proportion=mix.stairs * mix.pits, **stairs
        ),
        "slope": HfPyramidSlopedTerrainCfg(**slopes),
        "slope_pit": HfPyramidSlopedTerrainCfg(**slopes, inverted=True),
        "rough": RisingRoughCfg(
            proportion=mix.rough,
            noise_range=mix.roughness,
            noise_step=0.02,
            border_width=0.25,
            horizontal_scale=cell,
        ),
        "waves": HfWaveTerrainCfg(
            proportion=mix.waves,
            amplitude_range=mix.wave,
            num_waves=4,
            border_width=0.25,
            horizontal_scale=cell,
        ),
    }
    return {name: patch for name, patch in patches.items() if patch.proportion > 0}


@dataclass
class HeightMapCfg(SensorCfg):
    """Configuration of the heights of the ground around the robot.

    Attributes:
        extent: sides of the mapped rectangle about the world's origin [m], outside of which the
            ground is at zero; None for a plane at zero, without a map.
        pitch: grid of the map [m].
        entity: name of the robot.
        trunk: name of its trunk's body.
        feet: names of its feet's sites.
        size: sides of the scan, along the trunk's heading and across [m].
        grid: distance between two points of the scan [m].
        reach: largest value of the scan [m].
        ring: radius of the points around a foot [m].
        foot_reach: largest height of a foot [m].
    """

    extent: tuple[float, float] | None
    pitch: float
    entity: str
    trunk: str
    feet: tuple[str, ...]
    size: tuple[float, float]
    grid: float
    reach: float
    ring: float
    foot_reach: float

    def build(self) -> HeightMap:
        """Build the sensor."""
        return HeightMap(self)


class HeightMap(Sensor["HeightMap"]):
    """Heights of the ground at the present positions of the robots."""

    def __init__(self, cfg: HeightMapCfg) -> None:
        super().__init__()
        self.cfg = cfg

    def edit_spec(self, scene_spec: mujoco.MjSpec, entities: dict[str, Entity]) -> None:
        """Add nothing to the scene."""

    def initialize(self, mj_model: mujoco.MjModel, model: Any, data: Any, device: str) -> None:
        """Map the ground of the compiled scene."""
        cfg, prefix = self.cfg, f"{self.cfg.entity}/"
        self._sim = data
        self._trunk = mj_model.body(prefix + cfg.trunk).id
        self._feet = torch.tensor([mj_model.site(prefix + n).id for n in cfg.feet], device=device)
        points = scan_points(cfg.size, cfg.grid).astype(np.float32)
        self._offsets = torch.from_numpy(points).to(device)
        corners = torch.tensor([[0, 0], [1, 0], [0, 1], [-1, 0], [0, -1]], dtype=torch.float32)
        self._ring = (cfg.ring * corners).to(device)
        spread = self._offsets.square().sum(0)
        self._slopes = self._offsets / spread
        self._map: torch.Tensor | None = None
        self._at: tuple[torch.Tensor, torch.Tensor] | None = None
        if cfg.extent is not None:
            heights = height_map(mj_model, cfg.extent, cfg.pitch)
            self._map = torch.from_numpy(heights).to(device)
            # From world positions to rows and columns.
            self._shift = torch.tensor(cfg.extent, device=device) / (2 * cfg.pitch) + 1.0
            self._last = torch.tensor(heights.shape, dtype=torch.int32, device=device) - 1

    @property
    def data(self) -> HeightMap:
        """The sensor itself: each quantity is computed when its method is called."""
        return self

    def _compute_data(self) -> HeightMap:
        return self

    def ground(self, xy: torch.Tensor) -> torch.Tensor:
        """Look up the height of the ground.

        Args:
            xy: positions in the world [m], shape (..., 2).

        Returns:
            Heights [m], shape (...).
        """
        if self._map is None:
            return torch.zeros_like(xy[..., 0])
        # Clamping comes last, as positions of a world may be infinite.
        cell = (xy / self.cfg.pitch).add_(self._shift).int().clamp_(min=0).minimum(self._last)
        at = cell[..., 0] * self._map.shape[1] + cell[..., 1]
        return self._map.view(-1).index_select(0, at.view(-1)).view(at.shape)

    def scan(self) -> torch.Tensor:
        """Height of the trunk's origin above the points of the scan [m], shape (worlds, points)."""
        z = self._sim.xpos[:, self._trunk, 2:3]
        reach = self.cfg.reach
        if self._map is None:
            return z.clamp(-reach, reach).expand(-1, len(self._offsets))
        return (z - self._below()).clamp_(-reach, reach)

    def height(self) -> torch.Tensor:
        """Height of the trunk's origin above the ground below it [m], shape (worlds,)."""
        position = self._sim.xpos[:, self._trunk]
        return position[:, 2] - self.ground(position[:, :2])

    def feet(self) -> torch.Tensor:
        """Heights of the feet's sites above the highest ground near them [m], (worlds, feet)."""
        position = self._sim.site_xpos[:, self._feet]
        if self._map is None:
            return position[..., 2].clamp(0.0, self.cfg.foot_reach)
        near = self.ground(position[:, :, None, :2] + self._ring).amax(-1)
        return (position[..., 2] - near).clamp(0.0, self.cfg.foot_reach)

    def normal(self) -> torch.Tensor:
        """Unit normal of the plane that best fits the scan, in the world, shape (worlds, 3).

        Least squares of height over the grid, which has a closed form for a symmetric grid.
        """
        worlds = self._sim.xpos.shape[0]
        up = torch.zeros(worlds, 3, device=self._offsets.device)
        up[:, 2] = 1.0
        if self._map is None:
            return up
        slope = self._below() @ self._slopes
        cos, sin = self._heading()
        up[:, 0] = -(cos * slope[:, 0] - sin * slope[:, 1])
        up[:, 1] = -(sin * slope[:, 0] + cos * slope[:, 1])
        return up / up.norm(dim=1, keepdim=True)

    def _below(self) -> torch.Tensor:
        """Heights of the ground at the points of the scan [m], shape (worlds, points).

        Actor, critic and reward use them in the same state; they are looked up once per state.
        """
        if self._offsets.is_cuda:  # Where comparing states costs more than looking up.
            return self.ground(self._points())
        pose = self._sim.xpos[:, self._trunk], self._sim.xmat[:, self._trunk, :, 0]
        if self._at is None or not all(map(torch.equal, pose, self._at)):
            self._heights = self.ground(self._points())
            self._at = (pose[0].clone(), pose[1].clone())
        return self._heights

    def _points(self) -> torch.Tensor:
        """Points of the scan in the world, shape (worlds, points, 2)."""
        cos, sin = self._heading()
        x, y = self._offsets[:, 0], self._offsets[:, 1]
        turned = torch.stack(
            (
                cos[:, None] * x - sin[:, None] * y,
                sin[:, None] * x + cos[:, None] * y,
            ),
            dim=-1,
        )
        return self._sim.xpos[:, self._trunk, None, :2] + turned

    def _heading(self) -> tuple[torch.Tensor, torch.Tensor]:
        """Cosine and sine of the trunk's yaw."""
        forward = self._sim.xmat[:, self._trunk, :, 0]
        length = forward[:, :2].norm(dim=1).clamp(min=1e-6)
        return forward[:, 0] / length, forward[:, 1] / length


def worlds_on(env: ManagerBasedRlEnv, kind: str) -> torch.Tensor | None:
    """Mask of the worlds on patches of a kind, shape (worlds,); None if there are no such patches.

    Args:
        env: the environment.
        kind: prefix of the names of the patches, such as "stairs".
    """
    terrain = env.scene.terrain
    if terrain is None or terrain.cfg.terrain_generator is None:
        return None
    patches = terrain.cfg.terrain_generator.sub_terrains
    columns = [i for i, name in enumerate(patches) if name.startswith(kind)]
    if not columns:
        return None
    return torch.isin(terrain.terrain_types, torch.tensor(columns, device=env.device))


def height_map(model: mujoco.MjModel, extent: tuple[float, float], pitch: float) -> np.ndarray:
    """Heights of the ground of a compiled scene on a grid.

    Args:
        model: the scene, its ground in a body `terrain` of upright boxes and height fields.
        extent: sides of the mapped rectangle about the origin [m].
        pitch: side of a cell [m]; edges of boxes at multiples of it are represented exactly.

    Returns:
        Heights [m] of the cells, shape (nx + 2, ny + 2), with a border of one cell at zero.
    """
    nx, ny = (round(side / pitch) for side in extent)
    heights = np.full((nx, ny), -np.inf, dtype=np.float32)
    body = model.body("terrain").id
    for i in np.flatnonzero(model.geom_bodyid == body):
        half = model.geom_size[i][:2]
        low = (model.geom_pos[i][:2] - half + np.array(extent) / 2) / pitch
        high = (model.geom_pos[i][:2] + half + np.array(extent) / 2) / pitch
        x0, y0 = np.clip(np.round(low).astype(int), 0, (nx, ny))
        x1, y1 = np.clip(np.round(high).astype(int), 0, (nx, ny))
        if x0 >= x1 or y0 >= y1:
            continue
        if model.geom_type[i] == _BOX:
            top = np.asarray(model.geom_pos[i][2] + model.geom_size[i][2])
        else:
            x = (np.arange(x0, x1) + 0.5 - low[0]) / (high[0] - low[0])
            y = (np.arange(y0, y1) + 0.5 - low[1]) / (high[1] - low[1])
            top = _hfield(model, int(i), x, y)
        heights[x0:x1, y0:y1] = np.maximum(heights[x0:x1, y0:y1], top)
    heights[np.isinf(heights)] = 0.0
    return np.pad(heights, 1)


def _hfield(model: mujoco.MjModel, geom: int, x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """Heights [m] of a height field at fractions of its sides; each cell has two triangles."""
    field = model.geom_dataid[geom]
    rows, columns = int(model.hfield_nrow[field]), int(model.hfield_ncol[field])
    start = int(model.hfield_adr[field])
    data = model.hfield_data[start : start + rows * columns].reshape(rows, columns)
    u, v = np.clip(x, 0, 1) * (columns - 1), np.clip(y, 0, 1) * (rows - 1)
    c = np.minimum(u.astype(int), columns - 2)[:, None]
    r = np.minimum(v.astype(int), rows - 2)[None, :]
    a, b = u[:, None] - c, v[None, :] - r
    h00, h10, h01, h11 = data[r, c], data[r, c + 1], data[r + 1, c], data[r + 1, c + 1]
    below = h00 + a * (h10 - h00) + b * (h11 - h10)
    above = h00 + b * (h01 - h00) + a * (h11 - h01)
    share = np.where(a > b, below, above)
    return model.geom_pos[geom][2] + share * model.hfield_size[field][2]
