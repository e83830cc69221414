"""The page of real robots is what its command writes from the measured columns."""

from __future__ import annotations

import json

import pytest

pytest.importorskip("PIL")
pytest.importorskip("matplotlib")

from benchmarks import real_robots as measured
from docs import real_robots
from draft.learn.measuring.bands import FILE


def test_the_page_is_that_of_the_measured_robots() -> None:
    found = measured.records()
    assert real_robots.PAGE.read_text(encoding="utf-8") == real_robots.page(found)
    assert json.loads(FILE.read_text(encoding="utf-8")) == measured.bands_of(found)


def test_at_least_sixteen_machines_are_told_and_every_claim_has_a_verdict() -> None:
    found = measured.records()
    assert len(found) >= 16
    words = {item["verdict"] for one in found for item in one["published"]}
    assert words <= {"right", "below", "within", "outside", "not judged", "not measured"}
    assert "below" in words  # Misses are shown as well.
