"""Reports of the shipped robots."""

from __future__ import annotations

import pytest

from draft.explore.report.subjects import Subject, open_designs, subjects


@pytest.fixture(scope="session")
def three() -> list[Subject]:
    return subjects(open_designs([f"quadruped:{name}" for name in ("cheetah", "bear", "giraffe")]))
