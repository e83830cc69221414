"""A studio and a tab of it, for each test."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest

import draft
from draft.studio.library import Library
from tests.studio.browser.page import visit

if TYPE_CHECKING:
    from draft.studio.server import Studio


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    return tmp_path / "designs"


@pytest.fixture
def studio(tmp_path: Path, folder: Path) -> Iterator[Studio]:
    pytest.importorskip("viser", reason="needs the extra 'view'")
    from draft.studio.server import Studio

    made = Studio(Library(draft.load("quadruped"), folder), port=0, out=tmp_path / "out")
    yield made
    made.close()


@pytest.fixture
def address(studio: Studio) -> str:
    return f"http://127.0.0.1:{studio.port}/"


@pytest.fixture
def tab(browser: Any, address: str) -> Iterator[Any]:
    made = visit(browser, address)
    yield made
    made.context.close()
