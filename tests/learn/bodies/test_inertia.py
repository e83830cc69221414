"""Inertia errors: their ranges, their distribution, and that robots stay physical."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import mujoco
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from draft.errors import DraftError
from draft.laws.residuals import residuals
from draft.learn.bodies import inertia
from draft.learn.bodies.inertia import GROUPS, PAPER, Change, Draw, Extent, Links
from draft.model.texts import Text
from tests.learn.small import member

DESIGNS = ("cheetah", "bear", "giraffe")
DRAWS = 10_000
NONE = Extent((1.0, 1.0), (1.0, 1.0), (0.0, 0.0), (0.0, 0.0), (0.0, 0.0))
IDENTITY = dict.fromkeys(GROUPS, NONE)


def drawn(source: str = "survey", count: int = DRAWS, seed: int = 0) -> Draw:
    return inertia.draw(inertia.extents(source), count, np.random.default_rng(seed))


def first(count: int) -> Any:
    """Individuals of the first design."""
    return np.zeros(count, dtype=np.int64)


class Bodies:
    """Bodies as MuJoCo writes them, changed by a draw: leading axes (draws, bodies)."""

    def __init__(self, model: Any, change: Change) -> None:
        self.mass = model.body_mass[1:] * change.mass
        self.moments = model.body_inertia[1:] * change.inertia[..., None]
        self.centre = model.body_ipos[1:] + change.shift


def pseudo(mass: Any, centre: Any, moments: Any, axes: Any) -> Any:
    """Pseudo-inertia from mass, centre of mass and principal moments with their axes."""
    second = np.einsum(
        "...ij,...j,...kj->...ik", axes, moments.sum(-1, keepdims=True) / 2 - moments, axes
    )
    found = np.zeros((*np.shape(mass), 4, 4))
    found[..., :3, :3] = (
        second + mass[..., None, None] * centre[..., :, None] * centre[..., None, :]
    )
    found[..., :3, 3] = found[..., 3, :3] = mass[..., None] * centre
    found[..., 3, 3] = mass
    return found


def wholes(model: Any, bodies: Any) -> dict[int, tuple[Any, Any, Any]]:
    """Mass, centre and radius of gyration of what is welded together; joints at zero."""
    data = mujoco.MjData(model)
    data.qpos[:], data.qpos[3] = 0.0, 1.0
    mujoco.mj_kinematics(model, data)
    found = {}
    for root in sorted(set(model.body_weldid[1:].tolist())):
        ids = np.flatnonzero(model.body_weldid[1:] == root)
        turn, origin = data.xmat[1:][ids].reshape(-1, 3, 3), data.xpos[1:][ids]
        at = origin + np.einsum("bij,...bj->...bi", turn, bodies.centre[..., ids, :])
        mass = bodies.mass[..., ids]
        total = mass.sum(-1)
        centre = (mass[..., None] * at).sum(-2) / total[..., None]
        about = ((at - centre[..., None, :]) ** 2).sum(-1)
        square = (bodies.moments[..., ids, :].sum(-1) / 2 + mass * about).sum(-1) / total
        found[root] = total, centre, np.sqrt(square)
    return found


@pytest.fixture(scope="module", params=DESIGNS)
def design(request: pytest.FixtureRequest) -> tuple[Any, Links]:
    """A design's model, and where its links are."""
    model = mujoco.MjModel.from_xml_string(member(request.param).xml)
    return model, inertia.links([member(request.param)])


def test_the_twins_ranges_span_the_residuals_of_go2_and_b2() -> None:
    found = inertia.extents("twins")
    assert tuple(found) == GROUPS
    go2, b2 = (residuals()[name].groups for name in ("go2", "b2"))
    for group, extent in found.items():
        a, b = go2[group], b2[group]
        assert extent.mass == (min(a.mass, b.mass), max(a.mass, b.mass))
        assert set(extent.gyration) == {a.gyration, b.gyration}
        for axis, name in enumerate(("fore", "outboard", "up")):
            assert set(getattr(extent, name)) == {a.com_shift[axis], b.com_shift[axis]}
            assert getattr(extent, name)[0] <= getattr(extent, name)[1]


def test_the_survey_widens_the_ranges_to_all_surveyed_quadrupeds_and_no_humanoid() -> None:
    found = inertia.extents("survey")
    dogs = {
        name: real.groups
        for name, real in residuals().items()
        if name.startswith("survey/") and real.population == "quadruped"
    }
    assert len(dogs) == 20
    for group in GROUPS:
        masses = [g[group].mass for g in dogs.values() if group in g]
        assert found[group].mass == (min(masses), max(masses))
    twins = inertia.extents("twins")
    assert all(found[group].mass[1] > twins[group].mass[1] for group in GROUPS)


def test_the_published_ranges_are_those_of_the_released_code_and_others_are_unknown() -> None:
    assert (PAPER["trunk"].mass, PAPER["shank"].up) == ((1.007, 1.360), (-0.0095, 0.0278))
    assert inertia.extents("paper") == PAPER
    with pytest.raises(DraftError, match=r"no inertia errors called 'twin'\n.*twins.*paper"):
        inertia.extents("twin")


@pytest.mark.parametrize("source", inertia.SOURCES)
def test_draws_stay_within_their_ranges_and_fill_them(source: str) -> None:
    found, ranges = drawn(source), inertia.extents(source)
    for i, group in enumerate(GROUPS):
        columns = (found.mass[:, i], found.gyration[:, i], *found.shift[:, i].T)
        for column, (low, high) in zip(columns, ranges[group], strict=True):
            assert column.min() >= low - 1e-12
            assert column.max() <= high + 1e-12
            assert np.ptp(column) >= 0.99 * (high - low)


def test_mass_ratios_are_uniform_in_their_logarithm() -> None:
    found, ranges = drawn(), inertia.extents("survey")
    for i, group in enumerate(GROUPS):
        for ratios, (low, high) in zip(
            (found.mass[:, i], found.gyration[:, i]), ranges[group][:2], strict=True
        ):
            share = np.sort(np.log(ratios / low) / np.log(high / low))
            steps = np.arange(1, DRAWS + 1) / DRAWS
            # Kolmogorov and Smirnov; the chance of more is 1e-4 for each, the seed is fixed.
            assert np.abs(share - steps).max() < 2.22 / DRAWS**0.5
            # Uniform in the ratio itself would be far off.
            plain = np.sort((ratios - low) / (high - low))
            if high / low > 2:
                assert np.abs(plain - steps).max() > 10 / DRAWS**0.5


def test_draws_of_groups_and_errors_are_independent() -> None:
    found = drawn()
    table = np.concatenate([found.mass, found.gyration, found.shift.reshape(DRAWS, -1)], axis=1)
    correlation = np.corrcoef(table.T) - np.eye(table.shape[1])
    assert np.abs(correlation).max() < 5 / DRAWS**0.5


def test_the_same_seed_draws_the_same_and_another_does_not() -> None:
    one, same, other = drawn(seed=3), drawn(seed=3), drawn(seed=4)
    for a, b, c in zip(one, same, other, strict=True):
        np.testing.assert_array_equal(a, b)
        assert not np.isclose(a, c).all()
    assert len(np.unique(one.mass[:, 0])) == DRAWS


def test_groups_follow_the_joint_above_and_motors_the_link_that_they_are_fixed_to() -> None:
    found = inertia.links([member()])
    group = {name: GROUPS[i] for name, i in zip(found.names, found.group, strict=True)}
    side = dict(zip(found.names, found.side[0], strict=True))
    assert group.pop("trunk") == "trunk"
    expected = {
        "hip_housing": "trunk",
        "abduction": "hip_link",
        "lateral_thigh": "thigh",
        "upper_leg": "thigh",
        "lower_leg": "shank",
    }
    for name, found_group in group.items():
        leg, _, link = name.partition("_")
        assert found_group == expected[link]
        right = leg.endswith("R") and link != "hip_housing"
        assert side[name] == (-1.0 if right else 1.0)


def test_no_error_changes_nothing(design: tuple[Any, Links]) -> None:
    model, links = design
    none = inertia.draw(IDENTITY, 3, np.random.default_rng(0))
    found = Bodies(model, inertia.change(links, first(3), none))
    for ours, theirs in zip(
        (found.mass, found.moments, found.centre),
        (model.body_mass, model.body_inertia, model.body_ipos),
        strict=True,
    ):
        np.testing.assert_allclose(ours, np.stack([theirs[1:]] * 3), rtol=0, atol=1e-12)


def test_what_is_welded_together_has_the_drawn_mass_gyration_and_shift(
    design: tuple[Any, Links],
) -> None:
    check_wholes(*design)


def test_shifts_are_along_the_trunks_axes_however_a_bodys_own_are_turned() -> None:
    xml = member().xml
    for i, name in enumerate(("FL_upper_leg", "RR_abduction", "FR_hip_housing")):
        xml = xml.replace(f'name="{name}" pos', f'name="{name}" euler="0.3 -0.8 {i + 1}" pos')
    turned = replace(member(), text=Text(xml))
    links = inertia.links([turned])
    assert len(np.unique(links.turn[0], axis=0)) == 4
    check_wholes(mujoco.MjModel.from_xml_string(xml), links)


def check_wholes(model: Any, links: Links) -> None:
    """Mass, radius of gyration and centre of all that is welded together change as drawn."""
    draws = drawn(count=200)
    none = inertia.draw(IDENTITY, 200, np.random.default_rng(0))
    before = wholes(model, Bodies(model, inertia.change(links, first(200), none)))
    after = wholes(model, Bodies(model, inertia.change(links, first(200), draws)))
    assert len(before) == 13
    for root, (mass, centre, gyration) in after.items():
        i, side = links.group[root - 1], links.side[0, root - 1]
        np.testing.assert_allclose(mass / before[root][0], draws.mass[:, i], rtol=1e-12)
        np.testing.assert_allclose(gyration / before[root][2], draws.gyration[:, i], rtol=1e-6)
        shift = draws.shift[:, i] * [1.0, side, 1.0] * links.length[0]
        np.testing.assert_allclose(centre - before[root][1], shift, rtol=0, atol=1e-9)


@settings(max_examples=50)
@given(seed=st.integers(0, 2**32 - 1))
def test_random_bodies_stay_physical_and_follow_the_pseudo_inertia(seed: int) -> None:
    rng = np.random.default_rng(seed)
    bodies = 6
    mass, centre = rng.uniform(0.01, 50, bodies), rng.normal(size=(bodies, 3))
    # Second moments of any size and shape: a body's extent may be nil along an axis or two.
    second = rng.uniform(0, 1, (bodies, 3)) ** 8 * mass[:, None]
    moments = second.sum(1, keepdims=True) - second
    axes = np.linalg.qr(rng.normal(size=(bodies, 3, 3)))[0]
    turn, arm = np.linalg.qr(rng.normal(size=(bodies, 3, 3)))[0], rng.normal(size=(bodies, 3))
    side = rng.choice([-1.0, 1.0], bodies)
    group = rng.integers(0, len(GROUPS), bodies)
    length = rng.uniform(0.1, 2)
    links = Links(("",) * bodies, group, side[None], turn[None], arm[None], np.array([length]))
    draws = drawn(count=200, seed=seed)
    found = inertia.change(links, first(200), draws)
    new = mass * found.mass, centre + found.shift, moments * found.inertia[..., None]
    # The same through the 4 x 4 pseudo-inertia, in each body's axes.
    gyration = draws.gyration[:, group]
    outward = draws.shift[:, group] * length
    outward[..., 1] *= side
    middle = centre - np.einsum("bji,bj->bi", turn, arm)
    transform = np.zeros((200, bodies, 4, 4))
    transform[..., :3, :3] = gyration[..., None, None] * np.eye(3)
    transform[..., :3, 3] = np.einsum("bji,nbj->nbi", turn, outward)
    transform[..., :3, 3] += (1 - gyration)[..., None] * middle
    transform[..., 3, 3] = 1.0
    before = pseudo(mass, centre, moments, axes)
    moved = transform @ before @ transform.swapaxes(-1, -2)
    expected = draws.mass[:, group, None, None] * moved
    ours = pseudo(*new, axes)
    scale = np.abs(expected).max(axis=(-1, -2), keepdims=True)
    np.testing.assert_allclose(ours / scale, expected / scale, atol=1e-12)
    check_physical(new[0], new[2], new[1], axes)


def check_physical(mass: Any, moments: Any, centre: Any, axes: Any) -> None:
    """Masses positive, triangle inequalities, pseudo-inertia positive semidefinite."""
    assert (mass > 0).all()
    assert (moments >= 0).all()
    largest, total = moments.max(-1), moments.sum(-1)
    assert (2 * largest <= total * (1 + 1e-12)).all()
    # About the centre of mass J is diag(second moments, mass); about the origin a congruence.
    own = pseudo(mass, np.zeros_like(centre), moments, axes)
    least, most = np.linalg.eigvalsh(own[..., :3, :3])[..., [0, -1]].T
    assert (least >= -1e-12 * most).all()
    values = np.linalg.eigvalsh(pseudo(mass, centre, moments, axes))
    assert (values[..., 0] >= -1e-12 * values[..., -1]).all()


def test_each_individual_is_of_its_own_design() -> None:
    words = np.array([0, 1, 2, 1, 0])
    links = inertia.links([member(word) for word in DESIGNS])
    draws = drawn(count=5)
    found = inertia.change(links, words, draws)
    for i, word in enumerate(words):
        alone = inertia.links([member(DESIGNS[word])])
        one = Draw(*(values[i : i + 1] for values in draws))
        for ours, theirs in zip(found, inertia.change(alone, first(1), one), strict=True):
            np.testing.assert_allclose(ours[i], theirs[0], atol=1e-15)


def test_designs_with_other_bodies_are_refused() -> None:
    text = Text(member().xml.replace("FL_hip_housing", "FL_other"))
    odd = replace(member(), name="odd", text=text)
    with pytest.raises(DraftError, match="odd has other bodies than"):
        inertia.links([member(), odd])
