"""Whose inertia errors the perturbed arm had, as the report tells it."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

pytest.importorskip("matplotlib")
pytest.importorskip("pyarrow")

from draft.study.report.folder import read
from draft.study.report.run_tables import remarks
from tests.learn import synthetic
from tests.study.report.pages import page_of, tables_of


def test_whose_inertia_errors_the_perturbed_arm_had_is_reported(source: Path) -> None:
    said = page_of(source)
    assert (
        "72 evaluations, nominal and perturbed inertia (errors of the twins of Go2 and B2)" in said
    )
    assert "3 nominal, 3 perturbed (twins)" in said
    assert "not to be compared" not in said


def test_evaluations_with_other_inertia_errors_than_most_are_flagged(tmp_path: Path) -> None:
    alone: dict[str, Any] = {"designs": ("bear",), "seeds": (0, 1), "stages": ("push",)}
    folder = synthetic.study(tmp_path, **alone)
    run = synthetic.trained(folder, "bear", "push", 2)
    synthetic.evaluated(run, "perturbed", change=lambda summary: summary.update(errors="paper"))
    study = read(folder)
    words = "published errors, where others have errors of the twins of Go2 and B2"
    assert remarks(study) == [f"bear, push, perturbed inertia, seed 2: {words}: not to be compared"]
    (row,) = tables_of(folder)["evaluations"].rows
    assert row[2] == "2 nominal, 1 perturbed (paper), 2 perturbed (twins)"


def test_unknown_inertia_errors_make_no_summary(tmp_path: Path) -> None:
    run = synthetic.trained(tmp_path, "bear", "push", 0)
    synthetic.evaluated(run, "perturbed", change=lambda summary: summary.update(errors="mine"))
    (warning,) = read(tmp_path).warnings
    assert "errors: Input should be 'twins', 'survey' or 'paper'" in warning
