"""A run's folder: what it holds, and what is said when it is not what it should be."""

from __future__ import annotations

import json
import os
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from draft.errors import DraftError
from draft.files import lock, locked
from draft.learn.bodies.designs import open_bodies
from draft.learn.training import run as runs
from draft.learn.training.options import TrainOptions
from draft.learn.training.run import (
    Origin,
    Plan,
    check_same,
    create,
    file_digest,
    is_run,
    open_run,
    upgrades,
    versions,
)
from draft.learn.training.train import prepare
from draft.model.texts import Text
from tests.learn.small import member, plan

DESIGNS = {"quadruped:cheetah": "values: {}\n"}


def test_a_run_holds_the_design_its_numbers_versions_and_seed(tmp_path: Path) -> None:
    run = create(tmp_path / "run", plan(seed=7), DESIGNS)
    record = json.loads((run.folder / "run.json").read_text())
    assert record["designs"] == ["quadruped:cheetah"]
    assert record["seed"] == 7
    assert record["config"]["learning"]["steps"] == 4
    assert {"draft", "mjlab", "torch", "mujoco"} <= set(record["versions"])
    assert (run.folder / "designs/quadruped-cheetah.yaml").read_text() == "values: {}\n"
    assert [path.name for path in tmp_path.iterdir()] == ["run"]


def test_what_is_read_back_is_the_plan_that_was_written(tmp_path: Path) -> None:
    made = plan("cheetah", "bear", stage="push", seed=3, ground="flat", see_design=True)
    made = replace(made, origin=Origin("runs/base", 12, "abc"))
    create(tmp_path / "run", made, DESIGNS)
    assert open_run(tmp_path / "run").plan == made


def test_an_empty_folder_is_taken_and_one_with_something_else_is_kept(tmp_path: Path) -> None:
    (tmp_path / "run").mkdir()
    assert is_run(create(tmp_path / "run", plan(), DESIGNS).folder)
    with pytest.raises(DraftError, match="is not a run of Draft; it is kept"):
        create(tmp_path, plan(), DESIGNS)
    assert [path.name for path in tmp_path.iterdir()] == ["run"]


def test_what_a_killed_process_left_of_a_run_is_swept_and_nothing_else(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for name in (".run-killed__", ".run-at_work_", ".run-other-abcdefgh"):
        (tmp_path / name).mkdir()
        (tmp_path / name / "run.json").write_text("{}")
        lock(tmp_path / name, "draft train").close()
    real, seen = os.rename, list[bool]()

    def rename(source: Path, target: Path) -> None:
        seen.append(locked(source))
        real(source, target)

    monkeypatch.setattr(os, "rename", rename)
    with lock(tmp_path / ".run-at_work_", "draft train"):
        create(tmp_path / "run", plan(), DESIGNS)
    names = {".run-at_work_", ".run-other-abcdefgh", "run"}
    assert {path.name for path in tmp_path.iterdir()} == names
    # Nobody sweeps what is being made, and whoever trains it finds it free.
    assert seen == [True]
    assert not locked(tmp_path / "run")


def test_a_folder_that_cannot_be_made_is_explained(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(DraftError, match="cannot write"):
        create(tmp_path / "file" / "run", plan(), DESIGNS)


UNREADABLE = "is broken: run.json or members.json cannot be read"


@pytest.mark.parametrize(
    ("file", "old", "new", "message"),
    [
        pytest.param("run.json", None, None, "is not a run of `draft.train`", id="no run"),
        pytest.param("run.json", None, "{", UNREADABLE, id="no JSON"),
        pytest.param("run.json", None, "[]", UNREADABLE, id="no record"),
        pytest.param("run.json", None, '{"format": 2, "stage": "base"}', UNREADABLE, id="few keys"),
        pytest.param("run.json", '"format": 2', '"format": 99', "another version", id="format"),
        pytest.param("members.json", None, "[]", UNREADABLE, id="no robots"),
        pytest.param("members.json", None, "[{}]", UNREADABLE, id="robot without numbers"),
        pytest.param("members.json", None, "\x00", UNREADABLE, id="binary robots"),
        pytest.param(
            "members.json",
            '"mass": 33',
            '"mass": 34',
            "is broken: the robots of members.json are not those of run.json",
            id="changed by hand",
        ),
    ],
)
def test_a_folder_that_is_no_run_as_it_was_written_is_explained(
    tmp_path: Path, file: str, old: str | None, new: str | None, message: str
) -> None:
    folder = create(tmp_path / "run", plan(), DESIGNS).folder
    text = (folder / file).read_text()
    if new is None:
        (folder / file).unlink()
    else:
        (folder / file).write_text(new if old is None else text.replace(old, new))
    with pytest.raises(DraftError) as caught:
        open_run(folder)
    assert message in str(caught.value)


@pytest.fixture(scope="module")
def drawn() -> Plan:
    """A plan for designs that differ in numbers only."""
    pytest.importorskip("scipy")
    members = open_bodies(["cheetah"], ["thigh_length=0.2:0.3", "trunk_length=0.4:0.5"], 5).members
    return replace(plan(), members=members)


def test_a_family_is_stored_as_arrays_beside_one_template(drawn: Plan, tmp_path: Path) -> None:
    folder = create(tmp_path / "run", drawn, {}).folder
    assert "<mujoco" not in (folder / "members.json").read_text()
    with np.load(folder / "members.npz") as found:
        assert str(found["template"]).count("<mujoco") == 1
        assert len(found["numbers"]) == 5
    assert open_run(folder).plan == drawn
    # As an older version stored it.
    (folder / "members.npz").unlink()
    robots = [member.as_dict() for member in drawn.members]
    (folder / "members.json").write_text(json.dumps(robots))
    assert open_run(folder).plan == drawn


def test_a_family_whose_texts_differ_in_more_than_numbers_is_stored_as_texts(
    drawn: Plan, tmp_path: Path
) -> None:
    first, second, *_ = drawn.members
    odd = replace(second, text=Text(second.xml.replace("<worldbody>", "<worldbody >")))
    made = replace(plan(), members=(first, odd))
    folder = create(tmp_path / "run", made, {}).folder
    assert not (folder / "members.npz").exists()
    assert open_run(folder).plan == made


@pytest.mark.parametrize("broken", ["missing", "cut", "few rows", "few numbers", "other numbers"])
def test_a_family_without_its_numbers_is_explained(
    drawn: Plan, tmp_path: Path, broken: str
) -> None:
    folder = create(tmp_path / "run", drawn, {}).folder
    file = folder / "members.npz"
    content = file.read_bytes()
    with np.load(file) as found:
        template, numbers = found["template"], found["numbers"]
    file.unlink()
    changed = {"few rows": numbers[1:], "few numbers": numbers[:, 1:], "other numbers": 2 * numbers}
    if broken == "cut":
        file.write_bytes(content[: len(content) // 2])
    elif broken in changed:
        np.savez(file, template=template, numbers=changed[broken])
    with pytest.raises(DraftError, match=r"'.*run' is broken: "):
        open_run(folder)


def test_a_run_resumes_only_with_the_plan_that_created_it(tmp_path: Path) -> None:
    run = create(tmp_path / "run", plan(), DESIGNS)
    check_same(run, plan())
    changed = plan(seed=1, values={"rewards.height": 0.4})
    with pytest.raises(DraftError, match=r"seed, rewards\.height differ"):
        check_same(run, changed)
    with pytest.raises(DraftError, match="designs, robots differ"):
        check_same(run, replace(plan(), members=(member("bear"),)))


def test_the_iterations_of_a_run_are_those_of_its_joints_unless_they_are_given(
    tmp_path: Path,
) -> None:
    pytest.importorskip("torch")

    def total(design: str, **options: Any) -> int:
        given = TrainOptions.of({"device": "cpu", **options})
        run = prepare(design, tmp_path / f"{len(list(tmp_path.iterdir()))}", given)
        number = json.loads((run.folder / "run.json").read_text())["config"]["learning"]
        assert number["iterations_base"] == run.plan.config.iterations("base")
        return given.total(run.plan)

    assert total("cheetah") == total("biped") == 250
    assert total("hexapod") == 459
    assert total("humanoid") == 939
    assert total("humanoid", iterations=7) == 7
    assert total("humanoid", values={"learning.iterations_base": 300}) == 300


def test_checkpoints_are_found_by_their_iteration(tmp_path: Path) -> None:
    run = create(tmp_path / "run", plan(), DESIGNS)
    with pytest.raises(DraftError, match="no checkpoint yet"):
        run.checkpoint()
    for n in (10, 9, 100):
        (run.folder / f"model_{n}.pt").write_bytes(b"")
    (run.folder / "model_x.pt").write_bytes(b"")
    assert [n for n, _ in run.checkpoints()] == [9, 10, 100]
    assert run.checkpoint()[0] == 100
    assert run.checkpoint(9)[1].name == "model_9.pt"
    with pytest.raises(DraftError, match="checkpoints: 9, 10, 100"):
        run.checkpoint(11)


def test_how_far_a_run_is_can_be_read_without_torch(tmp_path: Path) -> None:
    run = create(tmp_path / "run", plan(), DESIGNS)
    assert run.done() == 0
    assert (run.seconds(), run.processes(), run.engine()) == (0.0, None, None)
    assert run.total() == 1200
    run.note(5, 60.0, 2, "native", 40)
    assert (run.done(), run.total()) == (5, 40)
    assert (run.seconds(), run.processes(), run.engine()) == (60.0, 2, "native")
    for broken in (
        "{",
        "[1]",
        '{"iteration": "many", "seconds": "long", "processes": [], "engine": 1}',
    ):
        (run.folder / "state.json").write_text(broken)
        assert run.done() == 0
        assert (run.seconds(), run.processes(), run.engine()) == (0.0, None, None)
    assert file_digest(run.folder / "state.json") != file_digest(run.folder / "run.json")


def test_a_policy_is_described_by_its_iteration_and_what_is_left_to_train(tmp_path: Path) -> None:
    run = create(tmp_path / "a run", plan(), DESIGNS)
    line, words = run.policy_line, f'`draft.train("{tmp_path}/a run"'
    run.note(47, 60.0, 1, "native", 250)
    assert line(47) == (
        f"policy: iteration 47 of 250, unfinished: {words}, iterations=250)` continues the training"
    )
    assert line(25).endswith("continues the training from 47")
    run.note(47, 60.0, 1, "native", 1200)
    assert f"{words})` continues" in line(47)
    run.note(1200, 60.0, 1, "native", 1200)
    assert line(1200) == "policy: iteration 1200 of 1200"
    assert line(25) == f"policy: iteration 25 of 1200, an earlier checkpoint of {run.folder}"


def test_changed_versions_are_reported(monkeypatch: pytest.MonkeyPatch) -> None:
    here = versions()
    assert upgrades(here | {"numpy": "9"}) == ""
    assert upgrades(here | {"mujoco": "0.1"}) == f"mujoco 0.1 -> {here['mujoco']}"
    for broken in (None, [], {}):
        assert upgrades(broken) == ""
    # What is not installed here says nothing of how a result came about.
    monkeypatch.setattr(runs, "_version", (here | {"torch": "none"}).get)
    assert upgrades(here | {"torch": "9.9"}) == ""
