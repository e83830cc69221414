"""Random faults in specs, expressions and descriptions: a result or a message, never anything else.

The seeds are fixed. `python scripts/fuzz.py --n 10000` tries others.
"""

from __future__ import annotations

from collections import Counter
from pathlib import Path

import pytest

from tests import mutations

COUNTS = {"spec": 300, "expression": 300, "description": 100}


@pytest.mark.slow
@pytest.mark.parametrize("kind", COUNTS)
def test_what_has_faults_is_answered(kind: str, tmp_path: Path) -> None:
    codes: Counter[int] = Counter()
    for seed in range(COUNTS[kind]):
        folder = tmp_path / str(seed)
        folder.mkdir()
        outcome = mutations.run(kind, seed, folder)
        assert not outcome.fault, f"{kind} {seed}: {outcome.fault}"
        codes[outcome.code] += 1
    # Faults that are all refused, or all accepted, would try little.
    assert codes[0] > COUNTS[kind] / 20, codes
    assert codes[2] > COUNTS[kind] / 20 or kind == "expression", codes


def test_the_sound_robot_is_accepted(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(mutations, "spec", lambda _: mutations.texts(mutations.FILES))
    outcome = mutations.run("spec", 1, tmp_path)
    assert outcome == mutations.Outcome(0)


def test_what_draft_does_wrong_is_reported(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def failing(words: list[str]) -> int:
        Path("out").mkdir()
        print("Traceback (most recent call last):")
        return len(words)

    monkeypatch.setattr(mutations, "main", failing)
    (tmp_path / "2").mkdir()
    assert "Draft blames itself" in mutations.run("spec", 2, tmp_path / "2").fault
    monkeypatch.setattr(mutations, "main", lambda words: 70)
    (tmp_path / "3").mkdir()
    assert mutations.run("spec", 3, tmp_path / "3").fault.startswith("the exit code is 70")


def test_equal_seeds_draw_equal_faults() -> None:
    from random import Random

    for draw in (mutations.spec, mutations.expression, mutations.description):
        assert draw(Random("7")) == draw(Random("7"))
        assert draw(Random("7")) != draw(Random("8"))
