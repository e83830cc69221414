"""The comparison of a family's policy with policies of single bodies, at toy size."""

from __future__ import annotations

import json
from functools import partial
from pathlib import Path

import pytest

pytest.importorskip("mjlab")
pytest.importorskip("matplotlib")

import draft
from benchmarks import family, unseen
from draft.learn.policy.policy import FAMILY
from draft.learn.training.run import file_digest


@pytest.mark.parametrize("stages", [family.STAGES, family.STAGES[:-1]], ids=["all", "speed only"])
def test_a_body_is_measured_with_three_policies_once(
    stages: tuple[str, ...], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(family, "SPEEDS", (1.0,))
    monkeypatch.setattr(family, "KICKS", (1.0,))
    monkeypatch.setattr(family, "SECONDS", 4.0)
    # What is learnt is not looked at: how often, from what, and what is kept of it.
    monkeypatch.setattr(draft, "train", partial(draft.train, envs=8))
    body = family.drawn(1, seed=1)[0]

    def row() -> dict:
        return family._row(tmp_path / "runs", tmp_path, None, 1, 1, 1, stages, body, tune=True)

    found = row()
    assert set(found["family"]) == set(found["alone"]) == set(found["tuned"]) == set(family.SKILLS)
    assert found["policy"] == file_digest(FAMILY)
    assert (tmp_path / "runs/body00-push-0").exists() == ("push" in stages)
    assert "push" in stages or found["alone"]["kick"] is None
    assert found["family"]["top_speed"] > 0.5
    assert json.loads((tmp_path / "body00.json").read_text()) == found
    monkeypatch.setattr(draft, "train", lambda *_, **__: pytest.fail("it is trained again"))
    monkeypatch.setattr(family, "_measured", lambda *_: pytest.fail("it is measured again"))
    assert row() == found
    (tmp_path / "body00.json").write_text(json.dumps(found | {"values": {"thigh_length": 0.3}}))
    with pytest.raises(SystemExit, match=r"body00\.json is of another body"):
        row()


def test_the_map_has_a_panel_for_each_skill_and_tells_policies_that_have_none() -> None:
    values = family.drawn(1, seed=1)[0].values
    alone = {"top_speed": 4.0, "kick": None, "eta": 0.2}
    row = {"name": "a", "values": values, "leg": 0.5, "alone": alone}
    row["family"] = {"top_speed": 3.8, "kick": 4.0, "eta": None}
    words = {text.get_text() for ax in family.picture([row]).axes for text in ax.texts}
    assert words == {"0.95", "nan", "0.00"}


def test_the_order_of_bodies_by_both_policies_is_compared(
    capsys: pytest.CaptureFixture[str],
) -> None:
    def row(name: str, of_family: float, alone: float) -> dict:
        both = {"family": of_family, "alone": alone}
        return {"name": name} | {key: dict.fromkeys(family.SKILLS, x) for key, x in both.items()}

    rows = [row("a", 3.0, 2.0), row("b", 4.0, 5.0), row("c", 5.0, 4.0)]
    family._print(rows)
    said = " ".join(capsys.readouterr().out.split())
    # Closed form for three bodies, two of which change places: 1 - 6 * 2 / (3 * 8).
    assert "worst 0.80 (bar 0.85), 3 bodies, rank correlation 0.50" in said
    family._print(rows[:2])
    assert "correlation" not in capsys.readouterr().out


def test_bodies_that_a_family_has_not_seen_are_rolled_out_together(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(unseen, "COMMANDS", (1.0, 3.0))
    monkeypatch.setattr(unseen, "KICKS", (2.0,))
    unseen.main(unseen.Numbers(bodies=2, replicas=1, seconds=4.0))
    speeds, up, _, kicked = (line.split()[-2:] for line in capsys.readouterr().out.splitlines()[1:])
    assert 0.5 < float(speeds[0]) < 1.5 < float(speeds[1])
    assert up == ["100", "100"]
    assert kicked == ["%", "100"]
