"""Rules of the tables of the policy of all legs, and the page, which is what its command writes."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

pytest.importorskip("PIL")
pytest.importorskip("matplotlib")

from benchmarks import any_legs as unseen
from benchmarks import roll_outs, zero_shot
from docs import any_legs
from draft.errors import DraftError
from draft.learn.policy.policy import FAMILY


def _row(
    robot: str, half: tuple[float, Any] = (1.0, 0.02), legs: int = 4, again: bool = False
) -> dict[str, Any]:
    """Results of a robot, with the share that stays up and the error at 0.5 sqrt(g L)."""
    asked = {case.name: (1.0, 0.02) for case in zero_shot.cases_of(legs)} | {"0.5": half}
    found = {
        name: {"up": up, "reached": 0.0, "error": error, "followed": 1.0}
        for name, (up, error) in asked.items()
    }
    far = {"outside": 0.0, "farthest": [], "limit": None, "notes": [], "joints": 12}
    return {"robot": robot, "again": again, "legs": legs, "cases": found, **far}


def test_the_page_is_that_of_the_results() -> None:
    found = (json.loads(file.read_text(encoding="utf-8")) for file in any_legs.RESULTS)
    text = any_legs.page(*found, images=any_legs.drawn())
    assert any_legs.PAGE.read_text(encoding="utf-8") == text


@pytest.mark.parametrize(
    ("cell", "walks"),
    [((1.0, 0.1), True), ((7 / 8, 0.1), True), ((6 / 8, 0.1), False), ((1.0, 0.11), False)],
)
def test_a_robot_walks_if_it_stays_up_and_follows(cell: tuple[float, float], walks: bool) -> None:
    assert zero_shot.walks(_row("a", half=cell), 0.5) == walks


def test_a_robot_of_which_all_fall_does_not_walk() -> None:
    assert not zero_shot.walks(_row("a", half=(0.0, None)), 0.5)


def test_a_machine_counts_once_and_one_that_is_not_measured_does_not_count() -> None:
    robots = [
        _row("a"),
        _row("twin_a", again=True, half=(0.0, None)),
        _row("b", half=(0.5, 0.02)),
        _row("c", legs=2),
        {"robot": "d", "again": False, "reason": "it has no legs"},
    ]
    four, two = zero_shot.bars({"robots": robots})
    assert (four["value"], four["met"]) == (0.5, False)
    assert (two["value"], two["met"]) == (1.0, True)
    lines = any_legs._failures({"robots": robots})
    assert [line for line in lines if line.startswith("- ")] == [
        "- b, at 0.5: 50 % up, error 0.02.",
        "- d: it has no legs.",
    ]


def test_robots_on_two_legs_are_asked_half_of_the_speed() -> None:
    for legs, fastest in ((2, 0.5), (4, 1.0), (6, 1.0)):
        speeds = [case.command[0] for case in zero_shot.cases_of(legs)[:-1]]
        assert speeds == [0.0, fastest / 4, fastest / 2, fastest]


def test_a_dozen_that_walk_is_pictured_with_as_many_on_two_legs() -> None:
    four = [_row(f"four{i:02d}") for i in range(9)] + [_row("falls", half=(0.0, None))]
    two = [_row(f"two{i}", legs=2) for i in range(4)]
    found = any_legs.pictured({"robots": [*four, *two]})
    assert found == [*(f"four{i:02d}" for i in range(8)), *(f"two{i}" for i in range(4))]


def test_bars_of_bodies_are_means_over_bodies_and_the_worst_kind() -> None:
    def kind(name: str, legs: int, bodies: int, up: float, error: float, turn: float) -> dict:
        cases = {case.name: (up, error, 0.2) for case in unseen.cases_of(legs)}
        cases["turn"] = (1.0, 0.0, turn)
        rows = {
            name: {"up": u, "error": e, "reached": r, "followed": 1.0}
            for name, (u, e, r) in cases.items()
        }
        trained = name != "eight legs"
        shape = {"legs": legs, "joints": 12, "bodies": bodies, "trained": trained}
        return {"kind": name, "cases": rows, **shape}

    found = {
        "kinds": [
            kind("quadruped", 4, 16, 1.0, 0.03, 0.3),
            kind("hexapod", 6, 6, 1.0, 0.06, 0.3),
            kind("biped", 2, 8, 1.0, 0.05, 0.15),
            kind("biped_of_four", 2, 4, 0.5, 0.1, 0.3),
            kind("humanoid", 2, 6, 1.0, 0.05, 0.3),
            kind("biped_slanting", 2, 2, 1.0, 0.05, 0.3),
            kind("eight legs", 8, 5, 0.7, 0.1, 0.0),
        ],
        "action": {"joints": 29, "ms": 0.1},
        "humanoid": {"top_speed": None},
        "family": {"ratio": 0.39},
        "policy": {"megabytes": 0.5},
    }
    rows = {row["what"]: row for row in unseen.bars(found)}
    assert rows["hexapods, error there, per sqrt(g L)"]["met"] is False
    biped = rows["bipeds and humanoids, up at 0.25 sqrt(g L)"]
    assert biped["value"] == pytest.approx(18 / 20, abs=1e-4)
    assert rows["bipeds and humanoids, error there, per sqrt(g L)"]["value"] == pytest.approx(
        (16 * 0.05 + 2 * 0.1) / 18, abs=1e-4
    )
    turn = rows["turn 0.3, relative error, worst kind: biped"]
    assert (turn["value"], turn["met"]) == (pytest.approx(0.5), False)
    assert rows["never trained, up at 0.25, worst: eight legs"]["value"] == 0.7
    assert rows["shipped humanoid, top speed"]["met"] is False
    family = rows["12 quadrupeds, top speed over that by the policy of all quadrupeds"]
    assert (family["value"], family["met"]) == (0.39, False)


def test_the_manifest_names_the_robots_and_their_further_files(tmp_path: Path) -> None:
    for name in ("survey/a.urdf", "survey/old.urdf", "twins/b.xml", "odd/c.xml"):
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).write_text("<mujoco/>")
    (tmp_path / "manifest.csv").write_text(
        "key,file,exclusion_reason\n"
        "a,survey/a.urdf,\n"
        'old,survey/old.urdf,"older file, kept for comparison"\n'
        "twin_b,twins/b.xml,\n"
        "gone,survey/gone.urdf,\n"
    )
    found = {one.key: one.again for one in zero_shot.entries(tmp_path)}
    assert found == {"a": False, "old": True, "twin_b": True}
    (tmp_path / "manifest.csv").unlink()
    assert [one.key for one in zero_shot.entries(tmp_path)] == ["c", "a", "old", "b"]


def test_a_folder_without_robots_and_a_policy_of_other_joints_are_refused(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    with pytest.raises(DraftError, match="has no descriptions of robots"):
        zero_shot.entries(tmp_path)
    for main in (zero_shot.main, unseen.main):
        with pytest.raises(DraftError, match="is no policy of all legs"):
            main(policy=FAMILY)
    with pytest.raises(DraftError, match="those of the training"):
        unseen.main(seed=0)
    monkeypatch.setattr(zero_shot, "open_legs_policy", lambda path: None)
    monkeypatch.chdir(tmp_path)
    zero_shot.main()
    assert "skipped: there is no folder" in capsys.readouterr().out


def test_what_the_user_can_correct_ends_a_command_with_a_line(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr("sys.argv", ["any_legs", "--seed", "0"])
    with pytest.raises(SystemExit, match="error: bodies of seed 0"):
        roll_outs.run_as_command(unseen.main, "")
