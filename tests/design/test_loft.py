"""A lofted trunk has the volume, centre of mass and inertia of its mesh, exactly."""

from __future__ import annotations

import math

import numpy as np
import pytest
import trimesh
from hypothesis import given
from hypothesis import strategies as st

from draft.errors import ResolveError
from draft.spec.primitives.loft import Loft, Pair, area, crossing, loft, rectangle, triangulate
from tests.helpers import robot

axes = st.sampled_from("xyz")
seeds = st.integers(0, 2**32 - 1)
lengths = st.floats(0.02, 2.0)
kinds = st.sampled_from(["convex", "concave", "chamfered", "mixed"])


def _polygon(rng: np.random.Generator, corners: int, concave: bool) -> list[Pair]:
    """A star-shaped polygon about the origin; on a circle where it must be convex."""
    # Jittered angles below half a turn apart: any radii give a simple polygon.
    turn = 2 * np.pi / corners
    angles = turn * (np.arange(corners) + rng.uniform(-0.2, 0.2, corners))
    radii = rng.uniform(0.05, 0.3, corners) if concave else np.full(corners, rng.uniform(0.05, 0.3))
    return [
        (float(r * np.cos(a)), float(r * np.sin(a))) for r, a in zip(radii, angles, strict=True)
    ]


def _sections(rng: np.random.Generator, kind: str, count: int) -> list[list[Pair]]:
    corners = int(rng.integers(3, 12))
    found: list[list[Pair]] = []
    for _ in range(count):
        if kind in ("chamfered", "mixed"):
            w, h, c = rng.uniform(0.05, 0.5), rng.uniform(0.05, 0.5), rng.uniform(0.01, 0.49)
            found.append(rectangle(w, h, c))
            if kind == "mixed" and rng.random() < 0.5:
                found[-1] = _polygon(rng, 8, True)
        else:
            found.append(_polygon(rng, corners, kind == "concave"))
        dx, dy = rng.uniform(-0.1, 0.1, 2)
        found[-1] = [(x + dx, y + dy) for x, y in found[-1]]
    return found


def _random(axis: str, seed: int, count: int, kind: str, scale: float = 1.0) -> Loft:
    rng = np.random.default_rng(seed)
    places = np.cumsum(rng.uniform(0.02, 0.3, count)) - 0.4
    sections = _sections(rng, kind, count)
    grown = [[(x * scale, y * scale) for x, y in section] for section in sections]
    places = [float(place * scale) for place in places]
    return loft(axis, list(places), grown, convex=kind in ("convex", "chamfered"))


def _mesh(solid: Loft) -> trimesh.Trimesh:
    return trimesh.Trimesh(solid.vertices, solid.faces(), process=False)


@given(axes, seeds, st.integers(2, 6), kinds)
def test_mass_properties_are_those_that_trimesh_finds_for_the_mesh(
    axis: str, seed: int, count: int, kind: str
) -> None:
    solid = _random(axis, seed, count, kind)
    mesh = _mesh(solid)
    assert mesh.is_watertight
    assert mesh.is_winding_consistent
    assert mesh.volume > 0  # its triangles look outwards
    size = mesh.extents.max()
    assert solid.volume == pytest.approx(mesh.volume, rel=1e-9)
    assert solid.com == pytest.approx(mesh.center_mass, rel=1e-9, abs=1e-9 * size)
    scale = np.abs(mesh.moment_inertia).max()
    assert solid.inertia == pytest.approx(mesh.moment_inertia, rel=1e-9, abs=1e-9 * scale)


@given(axes, seeds, st.integers(2, 6), kinds)
def test_no_mass_property_depends_on_the_way_the_caps_are_cut(
    axis: str, seed: int, count: int, kind: str
) -> None:
    solid = _random(axis, seed, count, kind)
    ears = Loft(solid.vertices, solid.sections, solid.corners, convex=False)
    fans = Loft(solid.vertices, solid.sections, solid.corners, convex=True)
    assert _mesh(ears).volume == pytest.approx(_mesh(fans).volume, rel=1e-9)


@given(axes, seeds, st.integers(2, 4), kinds, st.floats(0.1, 10))
def test_growing_a_trunk_by_lambda_grows_volume_cubed_and_inertia_to_the_fifth(
    axis: str, seed: int, count: int, kind: str, scale: float
) -> None:
    small, large = _random(axis, seed, count, kind), _random(axis, seed, count, kind, scale)
    assert large.volume == pytest.approx(scale**3 * small.volume, rel=1e-9)
    assert large.com == pytest.approx(scale * small.com, rel=1e-9, abs=1e-12 * scale)
    bound = 1e-9 * np.abs(large.inertia).max()
    assert large.inertia == pytest.approx(scale**5 * small.inertia, rel=1e-9, abs=bound)


@given(axes, lengths, lengths, lengths, st.integers(2, 5))
def test_a_box_has_the_textbook_volume_and_inertia(
    axis: str, along: float, first: float, second: float, count: int
) -> None:
    places = [float(x) for x in np.linspace(0.1, 0.1 + along, count)]
    solid = loft(axis, list(places), [rectangle(first, second, None)] * count, convex=True)
    order = {"x": (0, 1, 2), "y": (1, 2, 0), "z": (2, 0, 1)}[axis]
    size, com = np.empty(3), np.zeros(3)
    size[list(order)] = along, first, second
    com[order[0]] = 0.1 + along / 2
    volume = along * first * second
    inertia = np.diag(volume / 12 * (size @ size - size**2))
    assert solid.volume == pytest.approx(volume)
    assert solid.com == pytest.approx(com, abs=1e-12)
    assert solid.inertia == pytest.approx(inertia, rel=1e-9, abs=1e-9 * inertia.max())


@given(axes, lengths, lengths, st.floats(0.1, 0.9))
def test_a_frustum_has_the_textbook_volume(
    axis: str, along: float, side: float, taper: float
) -> None:
    sections = [rectangle(side, side, None), rectangle(taper * side, taper * side, None)]
    solid = loft(axis, [0.0, along], sections, convex=True)
    expected = along * side**2 * (1 + taper + taper**2) / 3
    assert solid.volume == pytest.approx(expected)


@given(seeds, seeds, kinds)
def test_a_trunk_turned_from_x_to_y_to_z_is_the_same_solid(
    seed: int, other: int, kind: str
) -> None:
    count = 2 + other % 4
    x, y, z = (_random(axis, seed, count, kind) for axis in "xyz")
    for turned, shift in ((y, 1), (z, 2)):
        assert turned.volume == pytest.approx(x.volume, rel=1e-12)
        assert turned.com == pytest.approx(np.roll(x.com, shift), abs=1e-12)
        rolled = np.roll(x.inertia, (shift, shift), axis=(0, 1))
        assert turned.inertia == pytest.approx(rolled, abs=1e-12)


@given(axes, seeds, st.integers(1, 4), st.integers(2, 4), st.booleans())
def test_many_trunks_at_once_are_the_same_as_one_by_one(
    axis: str, seed: int, n: int, count: int, concave: bool
) -> None:
    rng = np.random.default_rng(seed)
    steps = rng.uniform(0.02, 0.3, (count, n)).cumsum(axis=0)
    shapes = np.array([[_polygon(rng, 7, concave) for _ in range(n)] for _ in range(count)])
    together = [[(c[:, 0], c[:, 1]) for c in np.moveaxis(s, 1, 0)] for s in shapes]
    whole = loft(axis, list(steps), together, convex=False)
    for i in range(n):
        own: list[list[Pair]] = [[(float(x), float(y)) for x, y in s[i]] for s in shapes]
        one = loft(axis, [float(s[i]) for s in steps], own, convex=False)
        assert np.asarray(whole.volume)[i] == pytest.approx(one.volume, rel=1e-12)
        assert whole.com[:, i] == pytest.approx(one.com, abs=1e-12)
        bound = 1e-11 * np.abs(one.inertia).max()
        assert whole.inertia[:, :, i] == pytest.approx(one.inertia, abs=bound)


def test_no_trunk_of_thousands_is_left_out() -> None:
    widths = np.linspace(0.1, 1.0, 5000)
    section = rectangle(widths, 0.5, 0.25)
    solid = loft("x", [0.0, 0.4], [section, section], convex=True)
    cut = 0.25 * np.minimum(widths, 0.5)
    assert solid.volume == pytest.approx(0.4 * (0.5 * widths - 2 * cut**2), rel=1e-12)


@given(seeds, st.integers(3, 24))
def test_triangles_cover_a_polygon_once(seed: int, corners: int) -> None:
    polygon = np.array(_polygon(np.random.default_rng(seed), corners, concave=True))
    triangles = triangulate(polygon)
    assert triangles.shape == (corners - 2, 3)
    assert set(triangles.ravel()) == set(range(corners))
    parts = [area([tuple(polygon[i]) for i in triangle]) for triangle in triangles]
    # None is turned over, so that the sum of the areas is the area covered.
    assert min(parts) > -1e-12
    assert sum(parts) == pytest.approx(area([tuple(p) for p in polygon]), rel=1e-9)


@given(seeds, st.integers(3, 12))
def test_the_area_of_a_polygon_changes_sign_with_its_direction(seed: int, corners: int) -> None:
    polygon = _polygon(np.random.default_rng(seed), corners, concave=True)
    assert area(polygon) > 0
    assert area(polygon[::-1]) == pytest.approx(-area(polygon))
    assert crossing(polygon) == (False, None)


def test_a_bow_tie_is_found_to_cross_itself() -> None:
    assert crossing([(0, 0), (1, 1), (1, 0), (0, 1)]) == (True, (0, 2))
    assert crossing([(0, 0), (1, 0), (1, 1), (0, 1)]) == (False, None)
    x = np.array([1.0, 0.0])
    crossed, edges = crossing([(0, 0), (1, 1 - x), (1, x), (0, 1)])
    assert list(np.asarray(crossed)) == [False, True]
    assert edges == (0, 2)


@given(lengths, lengths, st.floats(0, 0.49))
def test_a_chamfer_takes_four_corners_off_a_rectangle(
    width: float, height: float, chamfer: float
) -> None:
    corners = rectangle(width, height, chamfer)
    cut = chamfer * min(width, height)
    assert area(corners) == pytest.approx(width * height - 2 * cut**2)
    assert math.isclose(max(float(x) for x, _ in corners), width / 2)


def test_a_polygon_counted_from_another_corner_is_refused_because_the_loft_would_twist() -> None:
    square = [[-0.1, -0.1], [0.1, -0.1], [0.1, 0.1], [-0.1, 0.1]]
    straight = [{"at": -0.1, "rectangle": [0.2, 0.2]}, {"at": 0.1, "polygon": square}]
    assert robot(root={"sections": straight}).resolve().trunk.loft.volume == pytest.approx(0.008)
    turned = [straight[0], {"at": 0.1, "polygon": square[2:] + square[:2]}]
    with pytest.raises(ResolveError, match=r"twists.*\n.*at corner 3"):
        robot(root={"sections": turned}).resolve()
