"""Extensions that a test installs, and that are gone after it."""

from __future__ import annotations

import sys
import threading
from collections.abc import Iterator
from pathlib import Path

import pytest

from draft import extensions
from tests.extensions.packages import Install, write


@pytest.fixture
def install(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Install]:
    """Function that installs an extension, as the only one beside others of the test."""
    monkeypatch.setattr(extensions, "_LOADED", [])
    monkeypatch.setattr(extensions, "_BEGUN", threading.Event())
    monkeypatch.setattr(extensions, "_DONE", threading.Event())
    site = tmp_path / "site"
    site.mkdir()
    monkeypatch.syspath_prepend(str(site))
    packages = []

    def add(package: str, text: str, entry: str = "") -> None:
        packages.extend([package, entry.partition(".")[0]])
        write(site, package, text, entry)

    yield add
    for name in [name for name in sys.modules if name.partition(".")[0] in packages]:
        del sys.modules[name]
    for registry in extensions._REGISTRIES:
        for name in packages:
            registry.drop(name, ())
