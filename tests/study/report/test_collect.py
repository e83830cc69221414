"""Collecting: what is finished is taken as it was measured, and nothing else."""

from __future__ import annotations

import json
import shutil
from pathlib import Path
from typing import Any

import numpy as np
import pytest

pytest.importorskip("pyarrow")

from draft.errors import DraftError
from draft.study.report import folder as files
from draft.study.report.collect import collect
from draft.study.report.occupancy import Utilisation
from draft.study.report.table import to_csv
from draft.study.report.tables import all_tables
from tests.learn import synthetic
from tests.study.report.conftest import plan_of

SMALL: dict[str, Any] = {"designs": ("cheetah",), "seeds": (0,), "stages": ("velocity",)}
RUN = "runs/cheetah-velocity-0.json"


def contents(folder: Path) -> dict[str, bytes]:
    return {
        path.relative_to(folder).as_posix(): path.read_bytes()
        for path in sorted(folder.rglob("*"))
        if path.is_file()
    }


def test_scalars_are_those_of_the_summaries(source: Path, collected: Path) -> None:
    paths = sorted(source.glob("runs/*/evaluation/*/summary.json"))
    told = {
        (path.parts[-4], path.parts[-2]): json.loads(path.read_text())["scalars"] for path in paths
    }
    kept = {(one.run.name, one.name): one.summary.scalars for one in
            files.read(collected, results=True).evaluations}  # fmt: skip
    assert len(told) == 72
    assert kept == told


def test_every_table_of_the_report_is_the_same_from_collected_results(
    source: Path, collected: Path
) -> None:
    def csv(study: Any) -> dict[str, str]:
        return {name: to_csv(t) for name, t in all_tables(study, Utilisation(study)).items()}

    assert csv(files.read(collected, results=True)) == csv(files.read(source))


def test_counted_samples_and_training_curves_are_the_same(source: Path, collected: Path) -> None:
    one, other = (
        next(e for e in study.of("quadruped:bear", "nominal") if e.run.name == "bear-push-1")
        for study in (files.read(source), files.read(collected, results=True))
    )
    assert one.run.curve == other.run.curve
    assert 20 < len(other.run.curve["iteration"]) <= 50
    ours, theirs = one.samples["push"], other.samples["push"]
    assert list(ours.plane) == list(theirs.plane) == ["hip roll", "hip pitch", "knee"]
    for joint in ours.plane:
        np.testing.assert_array_equal(ours.plane[joint], theirs.plane[joint])
        np.testing.assert_array_equal(ours.bins[joint]["sum"], theirs.bins[joint]["sum"])


def test_evaluations_of_an_older_draft_are_read_by_their_older_words(tmp_path: Path) -> None:
    from pyarrow import parquet

    new, old = tmp_path / "new", tmp_path / "old"
    shutil.copytree(synthetic.study(new, **SMALL), old)
    for path in old.glob("runs/*/evaluation/*/summary.json"):
        summary = json.loads(path.read_text())
        path.write_text(json.dumps(summary | {"batteries": summary.pop("tests")}))
    for path in old.glob("runs/*/evaluation/*/*.parquet"):
        table = parquet.read_table(path)
        words = ["battery" if name == "test" else name for name in table.column_names]
        assert "battery" in words
        parquet.write_table(table.rename_columns(words), path)
    (ours, *_), (theirs, *_) = files.read(new).evaluations, files.read(old).evaluations
    assert ours.summary.tests.keys() == {"speed"}
    assert theirs.summary == ours.summary
    np.testing.assert_equal(theirs.samples["speed"].plane, ours.samples["speed"].plane)
    np.testing.assert_equal(theirs.samples["speed"].bins, ours.samples["speed"].bins)
    assert files.texts(files.read(old))[RUN] == files.texts(files.read(new))[RUN]


@pytest.mark.parametrize("name", ["three_quadrupeds", "paper"])
def test_results_in_the_repository_are_written_as_they_are_read(name: str) -> None:
    folder = Path(__file__).parents[3] / "examples/results" / name
    written = files.texts(files.read(folder, results=True))
    assert len(written) > 10
    assert written == {path: (folder / path).read_text(encoding="utf-8") for path in written}


def test_three_seeds_take_less_than_three_megabytes(collected: Path) -> None:
    found = contents(collected)
    assert sum(map(len, found.values())) < 3e6
    assert {"study.json", "three.yaml", "designs/quadruped-bear.xml"} <= set(found)
    assert not [name for name, data in found.items() if str(collected.parent).encode() in data]


def test_samples_are_small_even_if_all_that_torque_and_speed_can_be_is_met(tmp_path: Path) -> None:
    """36 runs stay below 3 MB with five digits in every bin and cell."""
    (one,) = files.read(synthetic.study(tmp_path, arms=("nominal",), **SMALL)).evaluations
    samples = one.samples["speed"]
    for counts in [
        *samples.plane.values(),
        *(x for y in samples.bins.values() for x in y.values()),
    ]:
        np.add(counts, 10_000, out=counts)
    told = samples.model_dump()
    records = 3 * 3 * 5  # designs, seeds, tests
    assert 1e6 < records * len(files.dumps(told)) < 2.6e6


def test_what_comes_in_later_is_added(source: Path, tmp_path: Path) -> None:
    part = tmp_path / "part"
    shutil.copytree(source, part)
    for run in (part / "runs").glob("*-2"):
        shutil.rmtree(run)
    shutil.rmtree(part / "runs/bear-push-1/evaluation/perturbed-walking")
    state = part / "runs/giraffe-terrain-1/state.json"
    state.write_text(state.read_text().replace("2000", "1990"))
    out = tmp_path / "out"
    first = collect(part, out)
    assert "giraffe-terrain-1 is not finished: 1990 of 2000 iterations" in first.omitted
    assert "giraffe: no terrain policy of seeds 1, 2" in first.missing
    assert "bear: the push policy of seed 1 has no perturbed evaluation" in first.missing
    second = collect(source, out)
    assert len(second.new) == 13
    assert second.changed == ("bear-push-1",)
    assert second.missing == ()
    at_once = tmp_path / "at_once"
    assert collect(source, at_once).written
    before = contents(at_once)
    assert contents(out) == before
    # Collecting again changes no byte.
    again = collect(source, at_once)
    assert (again.written, again.new, again.changed) == (False, (), ())
    assert contents(at_once) == before


def test_parts_of_a_study_from_two_machines_go_together(tmp_path: Path) -> None:
    out = tmp_path / "out"
    for seed in (4, 3):
        here = tmp_path / f"machine{seed}"
        synthetic.study(here, ("cheetah",), (seed,), stages=("base",))
        plan_of(here, seeds=[seed], stages=["base"])
        collect(here, out)
    study = files.read(out, results=True)
    assert study.seeds == [3, 4]
    assert study.planned
    assert study.planned.seeds == (3, 4)


def test_an_evaluation_that_is_done_again_stays_until_it_is_replaced(tmp_path: Path) -> None:
    folder = synthetic.study(tmp_path / "study", **SMALL)
    out = tmp_path / "out"
    collect(folder, out)
    before = contents(out)
    place = folder / "runs/cheetah-velocity-0/evaluation/nominal-walking"
    shutil.move(place, tmp_path / "aside")
    assert not collect(folder, out).written
    assert contents(out) == before
    shutil.move(tmp_path / "aside", place)
    summary = place / "summary.json"
    summary.write_text(summary.read_text().replace('"replicas": 256', '"replicas": 64'))
    assert collect(folder, out).changed == ("cheetah-velocity-0",)


def test_a_run_of_another_plan_is_refused_and_nothing_is_written(tmp_path: Path) -> None:
    out = tmp_path / "out"
    collect(synthetic.study(tmp_path / "study", **SMALL), out)
    before = contents(out)
    other = synthetic.study(tmp_path / "other", ("cheetah",), (1,), stages=("velocity",))
    record = other / "runs/cheetah-velocity-1/run.json"
    told = json.loads(record.read_text())
    told["config"]["rewards"]["height"] = 0.51
    told["environments"] = 16
    record.write_text(json.dumps(told))
    with pytest.raises(DraftError) as refused:
        collect(other, out)
    said = str(refused.value)
    assert "run cheetah-velocity-1 is of another plan than cheetah-velocity-0" in said
    assert "environments, rewards.height differ; nothing was written" in said
    assert "choose another `out`" in said
    assert contents(out) == before


def test_another_robot_of_the_same_name_is_refused(tmp_path: Path) -> None:
    out = tmp_path / "out"
    collect(synthetic.study(tmp_path / "study", **SMALL), out)
    other = synthetic.study(tmp_path / "other", ("bear",), (1,), stages=("velocity",))
    folder = other / "runs/bear-velocity-1"
    for name in ("run.json", "members.json", "evaluation/nominal-walking/summary.json",
                 "evaluation/perturbed-walking/summary.json"):  # fmt: skip
        text = (folder / name).read_text().replace("quadruped:bear", "quadruped:cheetah")
        (folder / name).write_text(text)
    from draft.learn.bodies.legged import LeggedRobot
    from draft.learn.training.members import robots_digest

    robots = [LeggedRobot.from_dict(d) for d in json.loads((folder / "members.json").read_text())]
    told = json.loads((folder / "run.json").read_text())
    (folder / "run.json").write_text(json.dumps(told | {"robots": robots_digest(robots)}))
    with pytest.raises(DraftError, match=r"of another plan .*: robot differ"):
        collect(other, out)


def test_strips_beside_the_results_stay(tmp_path: Path) -> None:
    folder = synthetic.study(tmp_path / "study", **SMALL)
    out = tmp_path / "out"
    collect(folder, out)
    (out / "strips").mkdir()
    (out / "strips/cheetah-run.png").write_bytes(b"png")
    synthetic.evaluated(synthetic.trained(folder, "cheetah", "velocity", 1))
    assert collect(folder, out).new == ("cheetah-velocity-1",)
    assert (out / "strips/cheetah-run.png").read_bytes() == b"png"
    assert {path.name for path in tmp_path.iterdir()} == {"study", "out"}


def test_families_and_evaluations_of_another_checkpoint_are_omitted(tmp_path: Path) -> None:
    folder = synthetic.study(tmp_path / "s", **SMALL)
    synthetic.family(folder, lambda thigh, ratio: 2.0)
    run = synthetic.trained(folder, "cheetah", "push", 0)
    synthetic.evaluated(run, change=lambda summary: summary.update(iteration=700))
    done = collect(folder, tmp_path / "out")
    assert set(done.omitted) == {
        "family-velocity-0 is of a family; only single designs are collected",
        "cheetah-push-0, nominal-walking: the evaluation is of iteration 700, not 1500",
    }
    assert {one.name for one in done.study.singles} == {"cheetah-velocity-0", "cheetah-push-0"}
    assert {one.run.name for one in done.study.evaluations} == {"cheetah-velocity-0"}


def test_a_study_without_a_finished_run_is_explained(tmp_path: Path) -> None:
    run = synthetic.trained(tmp_path, "cheetah", "base", 0)
    run.note(3, 1.0, 1, "native", 3)
    with pytest.raises(DraftError, match="has no finished run") as refused:
        collect(tmp_path, tmp_path / "out")
    assert "cheetah-base-0 is not finished: 3 of 1200 iterations" in str(refused.value)
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(
    ("file", "change", "words"),
    [
        (RUN, lambda text: text[: len(text) // 2], "EOF while parsing"),
        (RUN, lambda text: text.replace('"seed": 0', '"seed": "x"', 1), "seed: Input should be"),
        (RUN, lambda text: text.replace('"seconds"', '"minutes"', 1), "seconds: Field required"),
        (RUN, lambda text: text.replace('"run": "cheetah', '"run": "bear', 1), "it is of run bear"),
        (RUN, lambda text: text.replace('"arm": "nominal"', '"arm": "other"'), "arm: Input"),
        (RUN, lambda text: text.replace('"reward": [', '"reward": [1,'), "columns differ"),
        (RUN, lambda text: text.replace('"torque": [', f'"torque": [{"1," * 400}'), "more bins"),
        (RUN, lambda text: text.replace('"torque": [', '"torque": [0.5,'), "valid integer"),
        ("study.json", lambda text: "[]", "should be an object"),
        ("study.json", lambda text: text.replace('"format": 1', '"format": 2'), "format: Input"),
        ("study.json", lambda text: text.replace('"velocity": {', '"push": {'), "says nothing of"),
        ("designs/quadruped-cheetah.json", lambda text: "{}", "name is missing"),
        ("designs/quadruped-cheetah.json", lambda text: text.replace("40", "41"), "another robot"),
        ("designs/quadruped-cheetah.xml", lambda text: text + " ", "another robot"),
    ],
)
def test_a_broken_file_is_named(tmp_path: Path, file: str, change: Any, words: str) -> None:
    source, out = synthetic.study(tmp_path / "study", **SMALL), tmp_path / "out"
    collect(source, out)
    path = out / file
    path.write_text(change(path.read_text()))
    with pytest.raises(DraftError) as refused:
        files.read(out, results=True)
    said = str(refused.value)
    assert words in said
    assert "cannot be read as results" in said
    with pytest.raises(DraftError, match="cannot be read as results"):
        collect(source, out)


def test_folders_without_results_are_explained_and_kept(source: Path, tmp_path: Path) -> None:
    with pytest.raises(DraftError) as refused:
        files.read(source, results=True)
    said = str(refused.value)
    assert "is the folder of a study, whose results are not collected yet" in said
    assert f'`draft.study.collect("{source}", out="DIR")`' in said
    assert "delete" not in said
    with pytest.raises(DraftError, match="holds no results of a study"):
        files.read(tmp_path, results=True)
    (tmp_path / "letter.txt").write_text("dear")
    with pytest.raises(DraftError, match="does not hold results of a study; it is kept"):
        collect(source, tmp_path)
    assert contents(tmp_path) == {"letter.txt": b"dear"}
