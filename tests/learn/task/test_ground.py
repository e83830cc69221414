"""The height map against MuJoCo's own rays."""

from __future__ import annotations

from typing import Any

import mujoco
import numpy as np
import pytest

pytest.importorskip("mjlab")
import torch

from tests.learn.task.states import place, stand, turn

PITCH, TOP = 0.025, 20.0
FIELDS = ("slope", "slope_pit", "rough", "waves")


def rays(env: Any, xy: np.ndarray) -> np.ndarray:
    """Heights [m] that downward rays hit, of the ground alone."""
    model: Any = env.sim.mj_model
    data: Any = mujoco.MjData(model)
    # The robot out of the way; its geoms need not be told apart then.
    data.qpos[:3] = (0, 0, -500)
    mujoco.mj_kinematics(model, data)
    down, hit = np.array([0.0, 0.0, -1.0]), np.zeros(1, dtype=np.int32)
    found = []
    for x, y in xy:
        start = np.array([x, y, TOP])
        far = mujoco.mj_ray(model, data, start, down, None, 1, -1, hit)  # type: ignore[attr-defined]
        found.append(TOP - far if far >= 0 else np.nan)
    return np.array(found)


def mapped(env: Any, xy: np.ndarray) -> np.ndarray:
    points = torch.tensor(xy, dtype=torch.float32)
    return env.scene["ground"].ground(points).numpy()


def patch(env: Any, row: int, name: str) -> np.ndarray:
    """Middle of a patch in the plane."""
    generator = env.scene.terrain.cfg.terrain_generator
    column, columns = list(generator.sub_terrains).index(name), len(generator.sub_terrains)
    return np.array([(row - 4.5) * 8.0, (column - (columns - 1) / 2) * 8.0])


def inside(rng: np.random.Generator, n: int, half: float = 3.9) -> np.ndarray:
    return rng.uniform(-half, half, (n, 2))


def centres(xy: np.ndarray) -> np.ndarray:
    """The middle of the map's cell of each point."""
    return (np.floor(xy / PITCH) + 0.5) * PITCH


@pytest.mark.parametrize("stage", ["base", "terrain"])
@pytest.mark.parametrize("name", ["flat", "stairs", "stairs_pit"])
def test_boxes_are_met_exactly(request: pytest.FixtureRequest, stage: str, name: str) -> None:
    env = request.getfixturevalue(stage)
    rng = np.random.default_rng(0)
    for row in (0, 4, 9):
        xy = patch(env, row, name) + inside(rng, 150)
        np.testing.assert_allclose(mapped(env, xy), rays(env, xy), atol=1e-5)


@pytest.mark.parametrize("stage", ["base", "terrain"])
@pytest.mark.parametrize("name", FIELDS)
def test_a_height_field_is_met_in_the_middle_of_a_cell_and_within_half_a_cell_times_its_slope(
    request: pytest.FixtureRequest, stage: str, name: str
) -> None:
    env = request.getfixturevalue(stage)
    rng = np.random.default_rng(1)
    for row in (0, 5, 9):
        xy = patch(env, row, name) + inside(rng, 150)
        # Both halves of a field's cell: it is split along the diagonal that MuJoCo takes.
        middle = centres(xy)
        np.testing.assert_allclose(mapped(env, middle), rays(env, middle), atol=1e-4)
        # The map has the height in the middle of a cell: half a cell away at most, along x and
        # along y, each times the steepest slope of the patch along that axis.
        bound = PITCH / 2 * sum(_steepest(env, patch(env, row, name)))
        assert np.abs(mapped(env, xy) - rays(env, xy)).max() <= bound + 1e-4


def _steepest(env: Any, middle: np.ndarray) -> tuple[float, float]:
    """Steepest slopes along x and y of the height field about a point."""
    model = env.sim.mj_model
    (geom,) = (
        g
        for g in range(model.ngeom)
        if model.geom_type[g] == mujoco.mjtGeom.mjGEOM_HFIELD
        and np.abs(model.geom_pos[g][:2] - middle).max() < 1
    )
    field = model.geom_dataid[geom]
    rows, columns = model.hfield_nrow[field], model.hfield_ncol[field]
    start = model.hfield_adr[field]
    heights = model.hfield_data[start : start + rows * columns].reshape(rows, columns)
    half_x, half_y, top, _ = model.hfield_size[field]
    along_x = np.abs(np.diff(heights, axis=1)).max() * top / (2 * half_x / (columns - 1))
    along_y = np.abs(np.diff(heights, axis=0)).max() * top / (2 * half_y / (rows - 1))
    return float(along_x), float(along_y)


def test_outside_the_patches_the_ground_is_at_zero(base: Any) -> None:
    rng = np.random.default_rng(3)
    ring = rng.uniform(0.1, 15, (40, 2)) * rng.choice([-1, 1], (40, 2))
    xy = ring + np.sign(ring) * np.array([40.0, 28.0])
    np.testing.assert_allclose(mapped(base, xy), 0.0)
    np.testing.assert_allclose(rays(base, xy), 0.0, atol=1e-5)


def test_a_robot_folded_over_itself_sees_the_ground_only(base: Any) -> None:
    robot = base.scene["robot"]
    joints = robot.data.default_joint_pos.clone()
    for _, pitch, knee in robot.cfg.members[0].leg_joints:
        joints[:, pitch], joints[:, knee] = 2.5, -2.8
    at = patch(base, 9, "stairs") + np.array([1.7125, 0.3125])
    # Upside down with its feet above its back, turned aside.
    for quat in (turn("z", 0.7), turn("x", 3.0)):
        place(base, (*at, 2.0), quat=quat, joints=joints)
        points = base.scene["ground"]._points()[0].numpy()
        scan = base.scene["ground"].scan()[0].numpy()
        assert scan.shape == (187,)
        known = centres(points)
        np.testing.assert_allclose(scan, 2.0 - rays(base, known), atol=1e-4)
        assert np.ptp(scan) > 0.1


def test_the_scan_is_a_grid_of_17_by_11_along_the_heading(base: Any) -> None:
    place(base, (0.3, 0.4, 2.0), quat=turn("z", 0.5))
    points = base.scene["ground"]._points()[0]
    cos, sin = np.cos(0.5), np.sin(0.5)
    around = points - torch.tensor([0.3, 0.4])
    along = around @ torch.tensor([[cos], [sin]], dtype=torch.float32)
    across = around @ torch.tensor([[-sin], [cos]], dtype=torch.float32)
    x = torch.linspace(-0.8, 0.8, 17).repeat(11)
    y = torch.linspace(-0.5, 0.5, 11).repeat_interleave(17)
    torch.testing.assert_close(along[:, 0], x, atol=1e-5, rtol=0)
    torch.testing.assert_close(across[:, 0], y, atol=1e-5, rtol=0)


def test_flat_ground_looks_nothing_up(flat: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    ground = flat.scene["ground"]
    assert ground._map is None

    def never(*_: Any) -> None:
        raise AssertionError

    monkeypatch.setattr(ground, "_points", never)
    monkeypatch.setattr(ground, "_heading", never)
    stand(flat, lift=0.2)
    z = flat.scene["robot"].height + 0.2
    torch.testing.assert_close(ground.scan(), z[:, None].expand(-1, 187))
    torch.testing.assert_close(ground.height(), z)
    assert (ground.feet() > 0).any()
    up = torch.tensor([0.0, 0.0, 1.0]).expand(flat.num_envs, 3)
    torch.testing.assert_close(ground.normal(), up)


def test_a_foot_reads_its_height_above_the_highest_of_five_points(base: Any) -> None:
    ground = base.scene["ground"]
    edge = patch(base, 9, "stairs") + np.array([1.5, 0.0])
    robot = base.scene["robot"]
    place(base, (*edge, 3.0))
    foot = robot.data.site_pos_w[:, robot.foot_sites[0]]
    out = np.array([0.01, 0.0])
    step = mapped(base, np.array([edge - out, edge + out]))
    assert step[0] - step[1] > 0.1
    # The foot just off the edge of the platform: within the ring, then beyond it.
    for off, near in ((1.5, step[0]), (4.0, step[1])):
        shift = torch.tensor([*(edge + off * out), float(near) + 0.3]) - foot[0]
        at = torch.tensor([*edge, 3.0]) + shift
        place(base, at)
        read = ground.feet()[0, 0]
        assert float(read) == pytest.approx(0.3, abs=1e-4)


def test_rough_ground_rises_with_the_row(terrain: Any) -> None:
    spans = []
    for row in (0, 4, 9):
        rng = np.random.default_rng(4)
        spans.append(np.ptp(mapped(terrain, patch(terrain, row, "rough") + inside(rng, 300, 3.5))))
    assert spans[0] < 0.06 < spans[1] < spans[2] <= 0.30
