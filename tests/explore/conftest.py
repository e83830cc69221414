"""A folder to explore in."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.written import write_robot


@pytest.fixture
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder with a sound robot in it, as the working directory."""
    monkeypatch.chdir(tmp_path)
    return write_robot(Path("robot"))
