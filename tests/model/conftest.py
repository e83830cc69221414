"""Models that the tests of this folder share."""

from __future__ import annotations

import pytest

import draft
from tests.model.shipped import SHIPPED, built


@pytest.fixture(
    params=SHIPPED, ids=lambda pair: f"{pair[0]}-{pair[1] or 'default'}", scope="module"
)
def model(request: pytest.FixtureRequest) -> draft.Model:
    """Each shipped design in turn."""
    return built(*request.param)
