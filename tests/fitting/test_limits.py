"""Laws of what a machine can sustain are what the shipped tables give."""

from __future__ import annotations

import csv
import json
import os
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from draft.fitting import beyond as beyond_fit
from draft.fitting import limits as limits_fit
from draft.fitting.actuators.catalogue_refit import actuator_trends
from draft.fitting.actuators.servo_refit import servo_trends
from draft.fitting.structure.survey_refit import structure_trends
from draft.laws.actuators import FILE as ACTUATORS
from draft.laws.beyond import FILE as BEYOND
from draft.laws.limits import FILE, limits
from draft.laws.servos import TRENDS as SERVOS
from draft.laws.structure import FILE as STRUCTURE

SHARED = Path(os.environ.get("DRAFT_SHARED", Path(__file__).parents[2].parent / "shared")) / "data"
TABLES = ("overload_times", "torque_speed_corners", "legged_batteries")


def numbers(record: object, path: str = "") -> dict[str, object]:
    """Numbers and words of nested data by their place."""
    if isinstance(record, dict):
        parts = record.items()
    elif isinstance(record, list):
        parts = enumerate(record)
    else:
        return {path: record}
    return {k: v for key, one in parts for k, v in numbers(one, f"{path}.{key}").items()}


def same(shipped: object, fresh: object, rel: float) -> None:
    """Check that a file is what a fit gives, but for the last digits of another machine's."""
    ours, theirs = numbers(fresh), numbers(shipped)
    assert ours.keys() == theirs.keys()
    for place, value in theirs.items():
        wanted = pytest.approx(value, rel=rel, abs=1e-9) if isinstance(value, float) else value
        assert ours[place] == wanted, place


@pytest.mark.parametrize(
    ("file", "fit", "rel"),
    [
        pytest.param(FILE, limits_fit.records, 1e-6, id="limits"),
        pytest.param(SERVOS, servo_trends, 1e-6, id="servos"),
        pytest.param(BEYOND, beyond_fit.records, 1e-6, id="beyond"),
        pytest.param(STRUCTURE, structure_trends, 1e-7, id="structure"),
        pytest.param(ACTUATORS, actuator_trends, 1e-7, id="actuators", marks=pytest.mark.slow),
    ],
)
def test_a_shipped_file_is_what_the_shipped_tables_give(
    file: Path, fit: Callable[[], dict[str, Any]], rel: float
) -> None:
    same(json.loads(file.read_text(encoding="utf-8")), fit(), rel)


@pytest.mark.parametrize("table", TABLES)
def test_a_shipped_table_is_the_gathered_one(table: str) -> None:
    gathered = SHARED / f"{table}.csv"
    if not gathered.exists():
        pytest.skip("the gathered tables are not at hand")
    assert (limits_fit.DATA / gathered.name).read_bytes() == gathered.read_bytes()


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
    with (limits_fit.DATA / "torque_speed_corners.csv").open(encoding="utf-8") as file:
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
