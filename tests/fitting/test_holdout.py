"""Bands hold what they say of vendors held out, and all of it is quick to work out."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from draft.fitting import scores
from draft.fitting.actuators import catalogue_holdout as holdout
from draft.fitting.actuators.catalogue_rows import rows_of
from draft.fitting.actuators.recipes import SETS as RECIPES
from draft.laws.actuators import SETS, laws
from draft.laws.catalogue import catalogue

ROWS = rows_of(catalogue().values())
QUANTITIES = ("mass", "volume", "aspect_ratio", "radius", "length", "gear_ratio", "rotor_inertia")


@pytest.mark.parametrize("name", SETS)
def test_a_90_percent_band_set_without_a_vendor_holds_85_to_95_percent_of_modules(
    name: str,
) -> None:
    covered = holdout.coverage(RECIPES[name], ROWS)
    for quantity in (*QUANTITIES, "rotor_inertia_of_size", "peak_torque"):
        ninety = covered[quantity, 0.9]
        assert 0.85 <= ninety.overall <= 0.95, quantity
        assert ninety.overall == pytest.approx(laws(name).trends[quantity].coverage_90)
        assert len(ninety.by_vendor) >= 5


@pytest.mark.parametrize("name", SETS)
def test_a_50_percent_band_set_without_a_vendor_holds_about_half(name: str) -> None:
    covered = holdout.coverage(RECIPES[name], ROWS)
    for quantity in QUANTITIES:
        assert 0.4 <= covered[quantity, 0.5].overall <= 0.63, quantity


def test_modules_of_a_held_out_group_do_not_move_their_own_predictions() -> None:
    before = holdout.held_out(RECIPES["draft"], ROWS, ROWS.vendor)
    own = np.array(ROWS.vendor) == "CubeMars"
    log = {q: np.where(own & (q == "mass"), values + 1.0, values) for q, values in ROWS.log.items()}
    changed = type(ROWS)(log, ROWS.name, ROWS.vendor, ROWS.family)
    after = holdout.held_out(RECIPES["draft"], changed, ROWS.vendor)
    geared = ROWS.geared
    assert after["mass"][own & geared] == pytest.approx(before["mass"][own & geared], rel=1e-9)
    others = ~own & geared
    assert not np.allclose(after["mass"][others], before["mass"][others])


@given(st.lists(st.floats(-2, 2), min_size=10, max_size=60), st.floats(0.1, 0.85))
def test_a_fold_holds_at_least_its_share_of_the_errors_that_set_it(
    errors: list[float], share: float
) -> None:
    array = np.array(errors)
    fold = scores.fold(array, share)
    assert fold >= 1.0
    assert np.mean(np.abs(array) <= np.log(fold) + 1e-12) >= share - 1 / len(array)
    assert scores.fold(np.append(array, np.nan), share) == fold
