"""Controllers of a few robots, written and compiled once."""

from __future__ import annotations

import functools
from collections.abc import Callable, Iterator
from contextlib import closing
from pathlib import Path

import pytest

import draft
from draft.deployment.deploy import deploy
from draft.design import Design
from draft.design.references import open_design
from tests.deployment.controllers import COMPILER, Compiled, Deployed, Python

Written = Callable[[str, str], Path]


def body(name: str) -> Design:
    """A shipped design, or one that no policy was trained with alone."""
    if name == "family":
        return open_design("quadruped").spec.resolve({"thigh_length": 0.27, "shank_length": 0.26})
    return open_design(name)


@pytest.fixture(scope="session")
def shipped_quadruped() -> Path:
    """Folder of the shipped quadruped."""
    return Path(draft.__file__).parent / "robots" / "quadruped"


@pytest.fixture(scope="session")
def written(tmp_path_factory: pytest.TempPathFactory) -> Written:
    """Folder of the controller of a body and a skill."""

    @functools.cache
    def write(name: str, skill: str) -> Path:
        folder = tmp_path_factory.mktemp("controllers") / f"{name}-{skill}"
        return deploy(body(name), folder, skill).folder

    return write


@pytest.fixture(params=["python", "c++"])
def controller(request: pytest.FixtureRequest, written: Written) -> Iterator[Deployed]:
    """The cheetah's controller in each language, started at time 0."""
    folder = written("cheetah", "run")
    if request.param == "python":
        yield Python(folder)
        return
    if COMPILER is None:
        pytest.skip("needs a compiler of C++17")
    with closing(Compiled(folder)) as made:
        yield made
