"""What a study has not yet is said."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

pytest.importorskip("matplotlib")
pytest.importorskip("pyarrow")


from draft.study.report.folder import read
from draft.study.report.missing import missing
from tests.learn import synthetic
from tests.study.report.pages import page_of


def test_missing_stages_seeds_and_arms_are_listed(tmp_path: Path) -> None:
    synthetic.study(tmp_path, designs=("cheetah",), seeds=(0, 1), stages=("base", "velocity"))
    synthetic.trained(tmp_path, "bear", "base", 1)
    said = missing(read(tmp_path))
    assert "cheetah: no push policy was trained" in said
    assert "bear: no base policy of seed 0" in said
    assert "bear: the base policy has no nominal evaluation" in said
    page = page_of(tmp_path)
    assert all(words in page for words in said)
    assert "not evaluated" in page


def test_what_the_study_plans_and_has_not_started_is_listed(tmp_path: Path) -> None:
    synthetic.trained(tmp_path, "cheetah", "base", 0)
    plan = {
        "name": "legs_and_arms",
        "toy": True,
        "designs": [
            {"name": "cheetah", "members": ["quadruped:cheetah"], "family": False},
            {"name": "bear", "members": ["quadruped:bear"], "family": False},
            {"name": "legs", "members": ["a", "b"], "family": True},
        ],
        "seeds": [0, 3],
        "stages": ["base", "push"],
        "evaluate": {"perturbed": False, "published": True},
        "jobs": {"cheetah-base-3": {"state": "failed"}, "cheetah-base-0": {"state": "done"}},
    }
    (tmp_path / "study.json").write_text(json.dumps(plan))
    assert [words for words in missing(read(tmp_path)) if "evaluation" not in words] == [
        "cheetah: no base policy of seed 3",
        "cheetah: no push policy was trained",
        "quadruped:bear: not started",
        "legs: not started",
        "cheetah-base-3: failed; see logs/cheetah-base-3.log",
    ]
    assert [words for words in missing(read(tmp_path)) if "evaluation" in words] == [
        "cheetah: the base policy has no nominal evaluation",
        "cheetah: the base policy has no nominal evaluation by the published protocol",
    ]
    assert "<h1>Study: legs_and_arms</h1>" in page_of(tmp_path)
    assert "This is the toy of a study" in page_of(tmp_path)
    (tmp_path / "study.json").write_text("[")
    assert "toy" not in page_of(tmp_path)
    assert "cheetah: no velocity policy was trained" in missing(read(tmp_path))
