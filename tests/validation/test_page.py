"""The page of real robots is what its command writes from the measured columns."""

from __future__ import annotations

import json
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

pytest.importorskip("PIL")
pytest.importorskip("matplotlib")

from benchmarks import physics
from benchmarks import real_robots as measured
from docs import real_robots
from draft.learn.measuring.bands import FILE


def test_the_page_is_that_of_the_measured_robots() -> None:
    found = measured.records()
    assert real_robots.PAGE.read_text(encoding="utf-8") == real_robots.page(found)
    assert json.loads(FILE.read_text(encoding="utf-8")) == measured.bands_of(found)


def test_at_least_sixteen_machines_are_told_and_every_claim_has_a_verdict() -> None:
    found = measured.records()
    assert len(found) >= 16
    words = {item["verdict"] for one in found for item in one["published"]}
    assert words <= {"right", "below", "within", "outside", "not judged", "not measured"}
    assert "below" in words  # Misses are shown as well.


def test_the_table_of_physics_keeps_other_robots_and_settings(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def found(_: Any, __: Any, chosen: Any, **___: Any) -> Any:
        return [(one, {"top_speed": SimpleNamespace(value=2.0)}) for one in chosen]

    monkeypatch.setattr(physics, "under_physics", found)
    monkeypatch.setattr(physics, "open_source", lambda *_, **__: SimpleNamespace(of_any_legs=True))
    first, second = (one.label for one in physics.SETTINGS[:2])
    others = [
        {"robot": "bear", "setting": first, "top_speed": 1.0},
        {"robot": "cheetah", "setting": second, "top_speed": 1.0},
    ]
    old = {"robot": "cheetah", "setting": first, "top_speed": 1.0}
    file = tmp_path / "physics.json"
    file.write_text(json.dumps([*others, old]), encoding="utf-8")
    physics.main(("cheetah",), only=(first,), out=file)
    assert json.loads(file.read_text(encoding="utf-8")) == [*others, old | {"top_speed": 2.0}]
