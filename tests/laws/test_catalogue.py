"""The catalogue is the published one, and its extremes are what its rows say."""

from __future__ import annotations

import collections
import math

import pytest

from draft.errors import DraftError
from draft.laws.catalogue import aspect_range, catalogue, extremes, find

# Family, its modules, and its lowest and highest reduction.
FAMILIES = {"QDD": (33, (6, 10)), "MidGear": (33, (7, 64)), "HighGR": (48, (50, 161))}


def test_the_catalogue_has_114_modules_in_three_families_with_their_published_reductions() -> None:
    parts = catalogue().values()
    assert collections.Counter(one.family for one in parts) == {
        k: n for k, (n, _) in FAMILIES.items()
    }
    assert len(parts) == 114
    for family, (_, reductions) in FAMILIES.items():
        own = [one.gear_ratio for one in parts if one.family == family and one.gear_ratio]
        assert (min(own), max(own)) == reductions == extremes()[1][family].gear_range


def test_aspect_ratios_reach_from_0_28_to_1_69() -> None:
    low, high = aspect_range()
    # The print rounds outwards: the longest module has 77.5 mm over 46 mm.
    assert (math.floor(100 * low), math.ceil(100 * high)) == (28, 169)


def test_every_module_has_its_numbers_and_its_page() -> None:
    for part in catalogue().values():
        numbers = (part.peak_torque, part.no_load_speed, part.mass, part.radius, part.length)
        assert min(numbers) > 0, part.name
        assert part.rotor_inertia is None or part.rotor_inertia > 0, part.name
        assert part.source.startswith("http"), part.name


def test_a_module_turns_in_si_units() -> None:
    part = find("AK80-6")
    assert (part.peak_torque, part.no_load_speed, part.gear_ratio) == (12.0, 75.3982, 6.0)
    assert (part.mass, part.radius, part.length) == (0.485, 0.049, 0.0385)
    assert part.volume == pytest.approx(math.pi * 0.049**2 * 0.0385)
    assert part.power_density == pytest.approx(12 * 75.3982 / 4 / 0.485)


@pytest.mark.parametrize("kind", ["torque", "torque_density", "power_density"])
def test_no_module_of_a_family_beats_its_extreme(kind: str) -> None:
    quantity = "peak_torque" if kind == "torque" else kind
    whole, families = extremes()
    for name, family in {"": whole, **families}.items():
        most = getattr(getattr(family, kind), quantity)
        own = [getattr(p, quantity) for p in catalogue().values() if name in ("", p.family)]
        assert most == max(own)


def test_a_part_that_does_not_exist_is_answered_with_the_nearest() -> None:
    with pytest.raises(DraftError, match="did you mean 'AK80-6'"):
        find("AK80-66")
