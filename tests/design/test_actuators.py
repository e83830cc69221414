"""An actuator class follows from any two of torque, speed, reduction and power."""

from __future__ import annotations

import itertools
import math
from collections.abc import Mapping

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from draft.design.actuators import DRIVE, Actuator, size
from draft.errors import ResolveError
from draft.laws.actuators import laws
from draft.laws.catalogue import catalogue

SETS = ("draft", "paper")
ENVELOPE = ("aspect_ratio", "radius", "length")
SIZES = ("mass", "volume", "radius", "length", "aspect_ratio", "rotor_inertia")
STATABLE = (*DRIVE, *ENVELOPE, "rated_torque", "mass", "rotor_inertia", "armature")
PAIRS = [tuple(sorted(pair)) for pair in itertools.combinations(DRIVE, 2)]
RANGES = {
    "peak_torque": (1.0, 1000.0),
    "rated_torque": (0.1, 300.0),
    "no_load_speed": (1.0, 100.0),
    "gear_ratio": (1.0, 160.0),
    "peak_power": (10.0, 5000.0),
    "aspect_ratio": (0.2, 2.0),
    "radius": (0.01, 0.2),
    "length": (0.01, 0.3),
    "mass": (0.05, 20.0),
    "rotor_inertia": (1e-6, 1e-2),
    "armature": (1e-4, 10.0),
}
PARTS = sorted(catalogue())
values = st.fixed_dictionaries({q: st.floats(*RANGES[q]) for q in STATABLE})
# Two of the drive, at most two of the envelope, any of the rest.
choices = st.tuples(
    st.sampled_from(PAIRS),
    st.lists(st.sampled_from(ENVELOPE), max_size=2, unique=True),
    st.lists(st.sampled_from(("rated_torque", "mass", "rotor_inertia", "armature")), unique=True),
).map(lambda three: [*three[0], *three[1], *three[2]])


def _check_identities(a: Actuator, stated: Mapping[str, object]) -> None:
    assert a.volume == pytest.approx(math.pi * a.radius**2 * a.length, rel=1e-12)
    assert a.aspect_ratio == pytest.approx(a.length / (2 * a.radius), rel=1e-12)
    assert a.peak_power == pytest.approx(a.peak_torque * a.no_load_speed / 4, rel=1e-12)
    if "armature" not in stated:
        assert a.armature == pytest.approx(a.gear_ratio**2 * a.rotor_inertia, rel=1e-12)


@given(values, choices)
def test_any_two_drive_quantities_give_all_the_rest(
    numbers: dict[str, float], chosen: list[str]
) -> None:
    stated = {name: numbers[name] for name in chosen}
    a = size("leg", stated, None)
    _check_identities(a, stated)
    for name in STATABLE:
        assert getattr(a, name) > 0
        assert (a.origins[name].kind == "stated") == (name in stated)
        assert name not in stated or getattr(a, name) == stated[name]


@given(values, choices, st.sampled_from(PARTS))
def test_a_class_like_a_part_keeps_what_is_stated_and_the_identities(
    numbers: dict[str, float], chosen: list[str], name: str
) -> None:
    stated = {name: numbers[name] for name in chosen}
    a = size("leg", stated, catalogue()[name])
    _check_identities(a, stated)
    assert {n: getattr(a, n) for n in stated} == stated


@given(st.floats(1, 500), st.floats(6, 160))
def test_any_two_numbers_of_an_ordinary_module_give_the_same_module(
    torque: float, ratio: float
) -> None:
    whole = size("leg", {"peak_torque": torque, "gear_ratio": ratio}, None)
    for pair in PAIRS:
        if pair != ("gear_ratio", "no_load_speed"):  # these leave the size open
            again = size("leg", {name: getattr(whole, name) for name in pair}, None)
            for quantity in (*DRIVE, *SIZES, "armature"):
                assert getattr(again, quantity) == pytest.approx(getattr(whole, quantity))


@given(st.floats(1, 80), st.floats(6, 160))
def test_speed_and_reduction_alone_get_the_usual_torque(speed: float, ratio: float) -> None:
    a = size("leg", {"no_load_speed": speed, "gear_ratio": ratio}, None)
    assert a.peak_torque == laws().trends["peak_torque"](speed, ratio)
    assert a.origins["peak_torque"].trend == "peak_torque"


@pytest.mark.parametrize("name", PARTS)
def test_a_class_like_a_part_has_exactly_the_parts_measured_values(name: str) -> None:
    part = catalogue()[name]
    a = size("leg", {}, part)
    for quantity in ("peak_torque", "no_load_speed", *SIZES):
        own = getattr(part, quantity)
        if own is not None:
            assert getattr(a, quantity) == own, quantity
            assert a.origins[quantity].kind == "catalogue", quantity
    assert part.gear_ratio in (None, a.gear_ratio)
    assert a.like == name


@given(st.sampled_from(PARTS), st.floats(0.2, 5.0), st.sampled_from(SETS))
def test_a_deviation_from_a_part_is_charged_by_the_trend_alone(
    name: str, factor: float, which: str
) -> None:
    part = catalogue()[name]
    a = size("leg", {"peak_torque": part.peak_torque * factor}, part, laws=laws(which))
    for quantity in ("mass", "volume", "aspect_ratio", "rotor_inertia"):
        own = getattr(part, quantity)
        if own is None:
            continue
        trend = laws(which).trends[quantity]
        now = trend(*(getattr(a, x) for x in trend.inputs))
        then = trend(*(getattr(part, x) or a.gear_ratio for x in trend.inputs))
        assert getattr(a, quantity) / own == pytest.approx(now / then, rel=1e-11)


@pytest.mark.parametrize("stated", [{}, *({name: 10.0} for name in DRIVE)], ids=str)
def test_fewer_than_two_drive_quantities_are_an_error(stated: dict[str, float]) -> None:
    with pytest.raises(ResolveError, match="two of peak_torque, no_load_speed, gear_ratio") as e:
        size("leg", {**stated, "mass": 1.0, "radius": 0.05}, None)
    assert "'leg'" in str(e.value)


@given(st.floats(1, 300), st.floats(2, 100), st.floats(1.1, 4))
def test_by_the_published_laws_torque_grows_mass_and_volume_by_their_exponents(
    torque: float, ratio: float, factor: float
) -> None:
    paper = laws("paper")
    small = size("leg", {"peak_torque": torque, "gear_ratio": ratio}, None, laws=paper)
    large = size("leg", {"peak_torque": torque * factor, "gear_ratio": ratio}, None, laws=paper)
    for quantity in ("mass", "volume", "aspect_ratio"):
        exponent = paper.trends[quantity].exponents["peak_torque"]
        grown = getattr(large, quantity) / getattr(small, quantity)
        assert grown == pytest.approx(factor**exponent, rel=1e-9)
    assert large.rotor_inertia / small.rotor_inertia == pytest.approx(
        (large.radius / small.radius) ** 4
    )
    assert large.no_load_speed == small.no_load_speed


@given(st.floats(1, 300), st.floats(2, 160), st.floats(1.01, 4), st.sampled_from(SETS))
def test_more_torque_at_one_reduction_never_gives_a_smaller_module(
    torque: float, ratio: float, factor: float, which: str
) -> None:
    small, large = (
        size("leg", {"peak_torque": t, "gear_ratio": ratio}, None, laws=laws(which))
        for t in (torque, torque * factor)
    )
    for quantity in ("mass", "volume", "radius", "length", "rotor_inertia", "armature"):
        assert getattr(large, quantity) > getattr(small, quantity)


@given(st.floats(1, 300), st.floats(2, 160), st.floats(1.01, 4))
def test_a_higher_reduction_gives_a_smaller_rotor_and_a_larger_armature(
    torque: float, ratio: float, factor: float
) -> None:
    low, high = (
        size("leg", {"peak_torque": torque, "gear_ratio": n}, None) for n in (ratio, ratio * factor)
    )
    assert high.rotor_inertia < low.rotor_inertia
    assert high.armature > low.armature
    assert high.no_load_speed < low.no_load_speed
    assert high.volume < low.volume


@given(st.floats(1, 300), st.floats(1, 60), st.floats(1.1, 4))
def test_armature_grows_with_the_square_of_the_reduction_for_one_rotor(
    torque: float, ratio: float, factor: float
) -> None:
    stated = {"peak_torque": torque, "rotor_inertia": 1e-4}
    low = size("leg", {**stated, "gear_ratio": ratio}, None)
    high = size("leg", {**stated, "gear_ratio": ratio * factor}, None)
    assert high.armature / low.armature == pytest.approx(factor**2)
    assert high.mass == low.mass


@given(
    choices,
    st.lists(values, min_size=2, max_size=5),
    st.sampled_from([None, *PARTS]),
    st.integers(0, 2 ** len(STATABLE) - 1),
)
def test_arrays_are_sized_as_floats_are(
    chosen: list[str], rows: list[dict[str, float]], name: str | None, mixed: int
) -> None:
    part = catalogue()[name] if name else None
    # Some of the stated values vary from design to design, the others are one for all.
    varies = {q: bool(mixed >> i & 1) for i, q in enumerate(STATABLE)}
    own = [{q: row[q] if varies[q] else rows[0][q] for q in chosen} for row in rows]
    stated = {q: np.array([o[q] for o in own]) if varies[q] else rows[0][q] for q in chosen}
    many = size("leg", stated, part)
    for i, row in enumerate(own):
        one = size("leg", row, part)
        for quantity in (*STATABLE, "volume"):
            value = np.broadcast_to(getattr(many, quantity), len(rows))[i]
            assert value == pytest.approx(getattr(one, quantity), rel=1e-12), quantity
