"""Studies that tests of the report share, and figures that take little time."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest


@pytest.fixture(scope="session")
def three(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A study of three designs, three seeds and two arms."""
    pytest.importorskip("pyarrow")
    from tests.learn import synthetic

    return synthetic.study(tmp_path_factory.mktemp("three") / "study")


@pytest.fixture(autouse=True)
def no_pictures(monkeypatch: pytest.MonkeyPatch) -> None:
    """Figures are coarse, and robots are not rendered but stood for."""
    pytest.importorskip("matplotlib")
    from draft.study.report import robots, writing

    monkeypatch.setattr(writing, "DPI", 40)
    monkeypatch.setattr(writing, "KINDS", ("svg",))
    image = np.zeros((60, 200, 3), np.uint8)
    monkeypatch.setattr(robots, "render", lambda members: (image, [9.0] * len(members), 50.0))
