"""Environments with exactly some extras, made of links to what is installed here.

An environment has what the metadata of Draft and of its dependencies require for these extras, and
no tools of developers: the packages that `uv sync --no-dev --extra NAME` installs, at no cost.
"""

from __future__ import annotations

import re
import sys
import venv
from collections.abc import Iterable
from functools import cache
from importlib.metadata import Distribution, distributions
from pathlib import Path

import pytest
from packaging.requirements import Requirement

from draft.extras import DISTRIBUTION, required
from tests.warm import Warm

_NOT_LINKED = {"..", "__pycache__"}  # Scripts, whose first line names an environment.


_kept: dict[tuple[frozenset[str], frozenset[str]], Warm] = {}


def warm(kept: pytest.TempPathFactory, extras: Iterable[str], also: Iterable[str] = ()) -> Warm:
    """The warm Python of an environment, which all tests of this process share.

    Args:
        kept: where it is made the first time.
        extras: extras of Draft.
        also: other packages.
    """
    key = frozenset(extras), frozenset(also)
    if key not in _kept:
        _kept[key] = Warm(environment(kept.mktemp("environment") / "environment", *key))
    return _kept[key]


def environment(folder: Path, extras: Iterable[str], also: Iterable[str] = ()) -> Path:
    """Make an environment in a new folder, or find it there, and return its Python.

    A test is skipped where a package of the extras is not installed.

    Args:
        folder: the folder.
        extras: extras of Draft.
        also: other packages.
    """
    extras, also = tuple(extras), tuple(also)
    if sys.platform == "win32":
        pytest.skip("links need rights there")
    for package in (*also, *(name for extra in extras for name in required()[extra])):
        if _normal(package) not in _installed():
            pytest.skip(f"needs {package}")
    python = folder / "bin" / "python"
    if python.exists():
        return python
    venv.create(folder, with_pip=False, symlinks=True)
    (site,) = folder.glob("lib/python*/site-packages")
    chosen = closure(extras, also)
    for name in chosen:
        one = _installed()[name]
        for file in one.files or ():
            top = file.parts[0]
            whole = _owners()[top] <= chosen
            link = site / (top if whole else str(file))
            if top in _NOT_LINKED or link.is_symlink():
                continue
            link.parent.mkdir(parents=True, exist_ok=True)
            link.symlink_to(Path(str(one.locate_file(top if whole else file))).resolve())
    command = folder / "bin" / "draft"
    command.write_text(f"#!{python}\nfrom draft.__main__ import run\n\nrun()\n", encoding="utf-8")
    command.chmod(0o755)
    return python


def closure(extras: Iterable[str], also: Iterable[str] = ()) -> set[str]:
    """Names of Draft and all installed packages that it requires with these extras, and of others.

    Args:
        extras: extras of Draft.
        also: other packages, which come with all that they require.
    """
    found: set[tuple[str, str]] = set()
    left = [(DISTRIBUTION, extra) for extra in ("", *extras)] + [(name, "") for name in also]
    while left:
        name, extra = one = left.pop()
        if one in found or name not in _installed():
            continue
        found.add(one)
        for line in _installed()[name].requires or ():
            need = Requirement(line)
            if need.marker is None or need.marker.evaluate({"extra": extra}):
                left += [(_normal(need.name), also) for also in ("", *need.extras)]
    return {name for name, _ in found}


@cache
def _installed() -> dict[str, Distribution]:
    return {_normal(one.name): one for one in distributions()}


@cache
def _owners() -> dict[str, set[str]]:
    """Names of the packages that have files below each name in `site-packages`."""
    owners: dict[str, set[str]] = {}
    for name, one in _installed().items():
        for file in one.files or ():
            owners.setdefault(file.parts[0], set()).add(name)
    return owners


def _normal(name: str) -> str:
    return re.sub(r"[-_.]+", "-", name).lower()
