"""Results on disk: whole or not at all, and known again."""

from __future__ import annotations

import json
import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from draft.learn.bodies.legged import CLASSES
from draft.learn.measuring.evaluation_options import Options
from draft.learn.measuring.levels import SKILL_TESTS
from draft.learn.measuring.results import (
    OCCUPANCY,
    SUMMARY,
    UTILISATION,
    WORLDS,
    make_request,
    read,
    result_folder,
    save,
    summarise,
)
from draft.learn.measuring.scalars import Worlds
from draft.learn.measuring.summary import Request, Summary, parse
from draft.learn.measuring.utilisation import BINS, CELLS, Histograms
from draft.learn.training.run import Run, create
from tests.learn.measuring.columns import worlds
from tests.learn.small import plan

parquet = pytest.importorskip("pyarrow.parquet")
PUSH = replace(SKILL_TESTS["push"], levels=(1.0, 2.0))
OPTIONS = Options(replicas=2, seed=3)


def begin(folder: Path, *words: str) -> tuple[Run, Request]:
    run = create(folder, plan(*words, stage="push"), {})
    (folder / "model_1500.pt").write_bytes(b"weights")
    return run, make_request(run, (PUSH,), OPTIONS)


def rows(*names: str) -> Worlds:
    each = [
        {"level": level, "member": name, "fell": fell, "speed": math.nan if fell else 0.3}
        for name in names
        for level, fell in ((1.0, False), (1.0, False), (2.0, True), (2.0, True))
    ]
    return worlds("push", each)


def counts(*names: str) -> Histograms:
    found = np.zeros((len(names), 3, 3, BINS), dtype=np.int64)
    found[..., 100] = 7
    ones = np.ones(len(names))
    plane = np.zeros((len(names), 3, CELLS, CELLS), dtype=np.int64)
    plane[..., 12, 3] = 7
    push = np.array(["push"] * len(names))
    return Histograms(push, ones, np.array(names), found, plane, CLASSES)


def result(run: Run, what: Request) -> tuple[Summary, Worlds, Histograms]:
    names = [member.name for member in run.plan.members]
    made = rows(*names), counts(*names)
    return summarise(run, what, (PUSH,), *made, device="cpu", took_s=1.0), *made


def test_a_result_reads_back_with_its_request_and_versions(tmp_path: Path) -> None:
    run, what = begin(tmp_path / "run")
    folder = result_folder(run, what)
    assert folder == tmp_path / "run/evaluation/nominal-walking"
    save(folder, *result(run, what))
    found = read(folder)
    assert found is not None
    assert found.asked == what
    assert found.scalars["kick"] == 1.5
    assert found.utilisation_level == {"push": 1.0}
    assert found.utilisation["push"]["knee"]["torque"] == pytest.approx(0.505, abs=0.005)
    assert found.evaluation_seed == 3
    assert (found.arm, found.errors) == ("nominal", None)
    assert found.iteration == 1500
    assert found.versions["draft"]
    assert found.leg_length == 0.48
    table = parquet.read_table(folder / WORLDS)
    assert table.column("fell").to_pylist() == [False, False, True, True]
    assert table.column("speed").to_pylist() == [0.3, 0.3, None, None]
    bins = parquet.read_table(folder / UTILISATION)
    assert set(bins.column("bin").to_pylist()) == {100}
    assert bins.num_rows == 9
    cells = parquet.read_table(folder / OCCUPANCY).to_pylist()
    assert [row["joint"] for row in cells] == list(CLASSES)
    assert {(row["level"], row["torque"], row["speed"], row["count"]) for row in cells} == {
        (1.0, 12, 3, 7)
    }
    assert [path.name for path in folder.parent.iterdir()] == ["nominal-walking"]


@pytest.mark.parametrize(
    "change",
    [
        {"checkpoint": "x"},
        {"evaluation_seed": 4},
        {"replicas": 3},
        {"levels": {"push": [1.0]}},
        {"seconds": 6.0},
        {"robots": "x"},
    ],
)
def test_a_result_of_something_else_is_no_answer(tmp_path: Path, change: dict[str, Any]) -> None:
    run, what = begin(tmp_path / "run")
    summary, *_ = result(run, what)
    assert parse(summary.text()).asked == what
    assert summary.asked != what.model_copy(update=change)


def test_a_result_records_its_source_of_errors_and_is_none_of_others(tmp_path: Path) -> None:
    run, nominal = begin(tmp_path / "run")
    what = nominal.model_copy(update={"arm": "perturbed", "errors": "paper"})
    folder = result_folder(run, what)
    save(folder, *result(run, what))
    found = read(folder)
    assert found is not None
    assert found.errors == "paper"
    assert found.asked == what
    assert found.asked != what.model_copy(update={"errors": "twins"})
    # As results were before they recorded it.
    data = json.loads((folder / SUMMARY).read_text())
    del data["asked"]["errors"]
    (folder / SUMMARY).write_text(json.dumps(data))
    assert read(folder) is None


@pytest.mark.parametrize("missing", [WORLDS, UTILISATION, OCCUPANCY, SUMMARY])
def test_a_part_of_a_result_is_none_and_is_replaced(tmp_path: Path, missing: str) -> None:
    run, what = begin(tmp_path / "run")
    folder = result_folder(run, what)
    save(folder, *result(run, what))
    (folder / missing).unlink()
    assert read(folder) is None
    save(folder, *result(run, what))
    assert read(folder) is not None


@pytest.mark.parametrize("text", ["", "{", "[]", '{"format": 1}', '{"format": 9, "asked": {}}'])
def test_a_broken_summary_is_none(tmp_path: Path, text: str) -> None:
    run, what = begin(tmp_path / "run")
    folder = result_folder(run, what)
    save(folder, *result(run, what))
    (folder / SUMMARY).write_text(text)
    assert read(folder) is None


def test_a_result_that_cannot_be_written_leaves_the_old_one(tmp_path: Path) -> None:
    run, what = begin(tmp_path / "run")
    folder = result_folder(run, what)
    save(folder, *result(run, what))
    summary, made, counted = result(run, what)
    with pytest.raises(ValueError, match="JSON"):
        save(folder, summary.model_copy(update={"took_s": math.nan}), made, counted)
    assert read(folder) is not None
    assert [path.name for path in folder.parent.iterdir()] == ["nominal-walking"]


def test_a_family_is_summarised_member_by_member(tmp_path: Path) -> None:
    run, what = begin(tmp_path / "run", "cheetah", "bear")
    summary, *_ = result(run, what)
    assert summary.scalars == {"kick": None, "kick_normalised": None}
    assert summary.reasons["kick"] == "several designs: see by_member"
    bear = summary.by_member["quadruped:bear"]
    assert bear.scalars["kick"] == 1.5
    assert bear.leg_length == pytest.approx(0.74)
    assert bear.utilisation_level == {"push": 1.0}
    assert parse(summary.text()) == summary
