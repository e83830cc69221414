"""The survey's twins, each robot held out, and the residuals that ship."""

from __future__ import annotations

import json
import math
from pathlib import Path

import pytest

from docs.twins import by_published_sum
from draft.files import Content
from draft.laws.residuals import FILE, residuals
from draft.laws.survey import read
from draft.twins.compare import compare_twin
from draft.twins.every import Row, run, score, tasks
from draft.twins.record import residuals as residuals_of
from tests.twins.test_vendors import ROBOTS

# A twin of every robot of the survey takes a minute of a processor.
pytestmark = pytest.mark.slow
SHARED = pytest.mark.skipif(not ROBOTS.is_dir(), reason="the robots are not beside this folder")


@pytest.fixture(scope="module")
def rows() -> list[Row]:
    todo = [task for task in tasks(ROBOTS / "survey") if task[2]]
    # Masses do not depend on poses, of which two are the fewest.
    return [row for row in run(todo, count=2) if isinstance(row, Row)]


@SHARED
def test_every_fitted_robot_has_a_twin_and_the_errors_are_as_told(rows: list[Row]) -> None:
    assert len(rows) == 49
    humanoids = score([row for row in rows if row.population == "humanoid"])
    quadrupeds = score([row for row in rows if row.population == "quadruped"])
    assert (humanoids.n, quadrupeds.n) == (29, 20)
    assert humanoids.fold == pytest.approx(1.120, abs=5e-4)
    assert quadrupeds.fold == pytest.approx(1.135, abs=5e-4)
    assert humanoids.covered == 1.0
    assert quadrupeds.covered == pytest.approx(19 / 20)
    assert [row.robot for row in rows if not row.inside] == ["anymal_b"]


@SHARED
def test_the_shipped_residuals_are_those_of_twins_by_the_published_sum() -> None:
    """Studies perturb designs that weigh by it, and their results must not change."""
    table = json.loads(FILE.read_text(encoding="utf-8"))
    todo = sorted(task for task in tasks(ROBOTS / "survey") if task[2])
    assert {f"survey/{key}" for key, *_ in todo} == {key for key in table if "/" in key}
    for key, file, _, _, held in todo[::8]:
        shipped, found = table[f"survey/{key}"], by_published_sum(Path(file), key, held)
        assert (shipped["population"], shipped["held_out"]) == (found.population, True)
        _same(shipped["groups"], residuals_of(found))


def _same(shipped: dict, found) -> None:
    assert set(shipped) == set(found)
    for name, group in found.items():
        for key, value in group.items():
            assert shipped[name][key] == pytest.approx(value, rel=1e-4, abs=1e-6), (name, key)


@SHARED
def test_the_shipped_residuals_of_go2_are_those_of_its_twin() -> None:
    found = by_published_sum(ROBOTS / "twins" / "go2" / "go2_description.urdf")
    _same(json.loads(FILE.read_text(encoding="utf-8"))["go2"]["groups"], residuals_of(found))


def test_residuals_are_read_for_four_twins_and_every_surveyed_robot() -> None:
    table = residuals()
    surveyed = {f"survey/{row.robot}" for row in read()}
    assert set(table) == surveyed | {"g1", "h2", "go2", "b2"}
    for robot in table.values():
        assert "trunk" in robot.groups
        for group in robot.groups.values():
            assert group.mass > 0
            assert group.gyration is None or group.gyration > 0
            assert all(map(math.isfinite, group.com_shift))


@SHARED
def test_a_robot_that_is_held_out_is_not_in_its_own_trends() -> None:
    path = ROBOTS / "survey" / "unitree_b1.urdf"
    seen, unseen = compare_twin(path, poses=2), compare_twin(path, without=("unitree_b1",), poses=2)
    assert unseen.design.trunk.density < seen.design.trunk.density
    # The trends without it are held in memory.
    assert isinstance(unseen.design.spec.structure, Content)
    assert unseen.design.spec.folder is None
