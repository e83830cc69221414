"""What a policy can do after a training beside what the one it started from could do."""

from __future__ import annotations

import shutil
from pathlib import Path
from typing import Any

import pytest

pytest.importorskip("torch")
pytest.importorskip("mjlab")

from draft import learn
from draft.learn.engine.machine import NATIVE
from draft.learn.measuring.rollout import review
from draft.learn.training.ppo.warm_start import ALONE
from draft.learn.training.run import Run
from tests.learn.runs import train
from tests.learn.small import plan

FLAT: dict[str, Any] = {"ground": "flat", "see_ground": False}
RUNS: dict[str, Any] = {
    "stage": "velocity",
    "values": {"learning.hidden": (256, 128, 64), "velocity.growth": 0.2},
    **FLAT,
}


@pytest.fixture(autouse=True)
def brief(monkeypatch: pytest.MonkeyPatch) -> None:
    # Long enough for a policy to walk, which is all that is compared.
    monkeypatch.setattr(review, "SECONDS", 3.0)


def of(folder: Path, origin: str | Path, **words: Any) -> Run:
    """A run of one iteration that starts from a policy."""
    run = learn.begin(folder, plan(**words), {}, origin)
    train(run, 1)
    return run


def test_a_policy_that_has_not_learnt_yet_does_as_it_did_before(tmp_path: Path) -> None:
    assert ALONE > 1  # In the first iteration only the critic learns.
    run = of(tmp_path / "run", "family", **RUNS)
    now = review.review(run, "cpu", NATIVE, 4)
    before = review.before(run, "cpu", NATIVE, 4)
    assert [one.level for one in now] == [one.level for one in before]
    for one, other in zip(now, before, strict=True):
        assert one.up == other.up == 4
        # One is a network of torch, the other the exported file's by numpy.
        assert one.speed == pytest.approx(other.speed, abs=0.02)
    assert before[-1].speed > 0.5


def test_a_run_goes_on_from_another_of_its_stage(tmp_path: Path) -> None:
    of(tmp_path / "first", "scratch", **FLAT)
    run = of(tmp_path / "second", tmp_path / "first", **FLAT)
    assert len(review.before(run, "cpu", NATIVE, 2)) == 4
    moved = tmp_path / "elsewhere"
    moved.mkdir()
    for name in ("first", "second"):
        shutil.move(tmp_path / name, moved / name)
    again = learn.open_run(moved / "second")
    assert len(review.before(again, "cpu", NATIVE, 2)) == 4
    shutil.rmtree(moved / "first")
    assert review.before(again, "cpu", NATIVE, 2) == []


def test_nothing_is_compared_with_a_policy_of_another_stage_or_none(tmp_path: Path) -> None:
    base = of(tmp_path / "base", "scratch", **FLAT)
    assert review.before(base, "cpu", NATIVE, 2) == []
    pushed = of(tmp_path / "push", tmp_path / "base", stage="push", **FLAT)
    assert review.before(pushed, "cpu", NATIVE, 2) == []
    blind = of(tmp_path / "blind", "scratch", stage="velocity", **FLAT)
    sighted = of(tmp_path / "sighted", blind.folder, stage="velocity", ground="uneven")
    assert sighted.plan.see_ground
    assert review.before(sighted, "cpu", NATIVE, 2) == []
