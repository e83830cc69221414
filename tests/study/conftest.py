"""Studies of tests do not wait between two looks at their jobs."""

from __future__ import annotations

import pytest

from draft.study import execution as module


@pytest.fixture(autouse=True)
def at_once(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "_POLL", 0.0)
