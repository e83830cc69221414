"""Laws of what a machine can sustain are what the shipped tables give."""

from __future__ import annotations

import csv
import json
import os
from pathlib import Path

import numpy as np
import pytest

from draft.fitting import limits as fitting
from draft.laws.limits import FILE, limits

SHARED = Path(os.environ.get("DRAFT_SHARED", Path(__file__).parents[2].parent / "shared")) / "data"
TABLES = ("overload_times", "torque_speed_corners", "legged_batteries")


def test_the_shipped_coefficients_are_what_the_shipped_tables_give() -> None:
    shipped, fresh = json.loads(FILE.read_text(encoding="utf-8")), fitting.records()
    assert shipped.keys() == fresh.keys()
    for name, law in fresh.items():
        own = shipped[name]
        assert own["n"] == law["n"]
        for key in ("fold", "fold_50", "fold_90"):
            assert own[key] == pytest.approx(law[key], rel=1e-6), (name, key)
        for a, b in zip(own["terms"], law["terms"], strict=True):
            assert a["factor"] == pytest.approx(b["factor"], rel=1e-6)
            assert a["exponents"] == pytest.approx(b["exponents"], rel=1e-6)


@pytest.mark.parametrize("table", TABLES)
def test_a_shipped_table_is_the_gathered_one(table: str) -> None:
    gathered = SHARED / f"{table}.csv"
    if not gathered.exists():
        pytest.skip("the gathered tables are not at hand")
    assert (fitting.DATA / gathered.name).read_bytes() == gathered.read_bytes()


def test_figures_of_the_tables_are_those_that_were_gathered() -> None:
    laws = limits()
    assert laws.corner.coefficient == pytest.approx(0.547, abs=1e-3)
    assert laws.corner.n == 17
    assert laws.specific_energy.coefficient == pytest.approx(169, abs=1)
    assert laws.specific_energy.n == 7
    assert laws.battery_share.coefficient == pytest.approx(0.115, abs=1e-3)
    assert laws.battery_share.n == 9
    assert laws.energy_share.n == 19
    assert 0.65 <= laws.stall_share.coefficient <= 0.75


def test_the_corner_is_the_median_of_the_table_by_hand() -> None:
    with (fitting.DATA / "torque_speed_corners.csv").open(encoding="utf-8") as file:
        rows = [row for row in csv.DictReader(file) if row["use_in_stats"] == "yes"]
    shares = [float(r["corner_speed_rad_s"]) / float(r["no_load_speed_rad_s"]) for r in rows]
    assert limits().corner.coefficient == pytest.approx(float(np.median(shares)))


def test_every_law_is_scored_on_what_it_was_not_fitted_to() -> None:
    laws = limits()
    for law in (laws.stalled, laws.rotating, laws.corner, laws.specific_energy):
        ((kind, error),) = law.held_out.items()
        assert kind in ("module", "vendor", "maker")
        assert law.fold is not None
        assert law.fold_90 is not None
        assert error >= law.fold * 0.99
        assert law.fold_90 > error
