"""A folder to run commands in."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.written import write_robot


@pytest.fixture(autouse=True)
def robot(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A sound robot in the folder `robot` of an otherwise empty working directory."""
    monkeypatch.chdir(tmp_path)
    return write_robot(Path("robot"))
