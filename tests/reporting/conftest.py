"""Reports of the shipped robots."""

from __future__ import annotations

import pytest

from draft.design.references import open_designs
from draft.reporting.subjects import Subject, subjects


@pytest.fixture(scope="session")
def three() -> list[Subject]:
    return subjects(open_designs([f"quadruped:{name}" for name in ("cheetah", "bear", "giraffe")]))
