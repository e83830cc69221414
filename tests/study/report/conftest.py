"""A study and what was collected of it, shared by tests that change neither; quick figures."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import numpy as np
import pytest

PLAN = {
    "name": "three",
    "toy": False,
    "recipe": "laptop",
    "designs": [
        {"name": name, "members": [f"quadruped:{name}"], "family": False}
        for name in ("cheetah", "bear", "giraffe")
    ],
    "seeds": [0, 1, 2],
    "stages": ["base", "velocity", "terrain", "push"],
    "iterations": {"base": 1200, "velocity": 1800, "terrain": 2000, "push": 1500},
    "evaluate": {"perturbed": True, "published": False},
    "jobs": {
        "cheetah-base-0": {"kind": "train", "state": "done", "seconds": 3600.0},
        "report": {"kind": "report", "state": "done", "seconds": 5.0},
    },
}


def plan_of(folder: Path, **changes: object) -> None:
    """Write what `draft study` notes of a study, and its file."""
    (folder / "study.json").write_text(json.dumps(PLAN | changes))
    (folder / "study.yaml").write_text("designs: [cheetah, bear, giraffe]\nrecipe: laptop\n")


@pytest.fixture(scope="session")
def source(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A study of three designs, three seeds and two arms."""
    pytest.importorskip("pyarrow")
    from tests.learn import synthetic

    folder = synthetic.study(tmp_path_factory.mktemp("source") / "study")
    plan_of(folder)
    return folder


@pytest.fixture(scope="session")
def collected(source: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Its results."""
    from draft.study.report.collect import collect

    out = tmp_path_factory.mktemp("results") / "three"
    collect(source, out)
    return out


@pytest.fixture(scope="session")
def _one(tmp_path_factory: pytest.TempPathFactory) -> Path:
    from tests.learn import synthetic

    folder = tmp_path_factory.mktemp("one") / "study"
    return synthetic.study(folder, ("cheetah",), (0,), ("nominal",), ("velocity",))


@pytest.fixture
def one(_one: Path, tmp_path: Path) -> Path:
    """A study of one policy, with one evaluation, which a test may change."""
    return Path(shutil.copytree(_one, tmp_path / "study"))


@pytest.fixture(autouse=True)
def no_pictures(monkeypatch: pytest.MonkeyPatch) -> None:
    """Figures are coarse, and robots are not rendered but stood for."""
    pytest.importorskip("matplotlib")
    from draft.study.report import robots, writing

    monkeypatch.setattr(writing, "DPI", 40)
    monkeypatch.setattr(writing, "KINDS", ("svg",))
    image = np.zeros((60, 200, 3), np.uint8)
    monkeypatch.setattr(robots, "render", lambda members: (image, [9.0] * len(members), 50.0))
