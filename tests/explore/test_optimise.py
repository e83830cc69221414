"""Searches: the front of a known problem, constraints that are met, studies that go on."""

from __future__ import annotations

import csv
import dataclasses
import json
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import draft
from draft.cli import main
from draft.explore import goals
from draft.explore.front import Entry, best
from draft.explore.optimise import Search, evaluate, first_designs
from draft.extras import remedy
from tests.explore.small import VARY, job, metric
from tests.written import write_robot

SPEC = draft.load("quadruped")
GOALS = ("--minimise", "leg.mass", "--maximise", "thigh_length")
ARGUMENTS = ("--vary", "thigh_length=0.2:0.5", "actuators.leg.peak_torque=20:80", *GOALS)


@given(st.lists(st.tuples(st.integers(0, 5), st.integers(0, 5), st.integers(0, 5)), min_size=1))
def test_the_best_are_those_that_no_other_beats(rows: list[tuple[int, ...]]) -> None:
    kept = {rows[i] for i in best(np.array(rows, float))}
    beaten = {
        a
        for a in rows
        if any(b != a and all(x <= y for x, y in zip(b, a, strict=True)) for b in rows)
    }
    assert kept == set(rows) - beaten
    assert len(best(np.array(rows, float))) == len(kept)


def search(*subject_to: str, **changes: Any) -> Search:
    wanted = goals.goals(SPEC, ["leg.mass"], ["thigh_length"])
    one = job(SPEC, kind="optimise", words=VARY)
    return Search(one, wanted, goals.constraints(SPEC, subject_to), **{"trials": 100, **changes})


def test_a_constraint_is_missed_by_the_share_that_lacks() -> None:
    one = search("accepted and thigh_length >= 0.4", "0.3 > thigh_length")
    assert [c.text for c in one.constraints] == [
        "accepted",
        "thigh_length >= 0.4",
        "0.3 > thigh_length",
    ]
    drawn = {
        "thigh_length": np.array([0.2, 0.3, 0.4]),
        "actuators.leg.peak_torque": np.array([60.0, 900.0, 60.0]),
    }
    values, missed = evaluate(one, drawn)
    assert values[:, 1].tolist() == [0.2, 0.3, 0.4]
    assert missed[:, 0].tolist() == [0.0, 1.0, 0.0]
    assert missed[:, 1] == pytest.approx([0.5, 0.25, 0.0])
    assert missed[:, 2] == pytest.approx([0.0, 0.0, 0.25], abs=1e-8)


def test_a_search_begins_with_designs_that_meet_the_constraints() -> None:
    one = search("accepted", "thigh_length > 0.45")
    first = first_designs(one, 50)
    assert len(first) == 50
    for values in first:
        assert values["thigh_length"] > 0.45
        assert SPEC.resolve(values).accepted


@pytest.fixture
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder with a sound robot in it, as the working directory."""
    monkeypatch.chdir(tmp_path)
    return write_robot(Path("robot"))


def run(capsys: pytest.CaptureFixture[str], *arguments: str) -> dict[str, Any]:
    assert main(["optimise", "robot", *ARGUMENTS, *arguments, "--json"]) == 0
    out, err = capsys.readouterr()
    assert err == ""
    return json.loads(out)


@pytest.mark.slow
@pytest.mark.parametrize("sampler", ["nsga2", "tpe"])
def test_every_design_of_the_front_builds_and_meets_the_constraints(
    here: Path, capsys: pytest.CaptureFixture[str], sampler: str
) -> None:
    subject_to = ("--subject-to", "accepted and leg.mass < 1.5", "--set", "shank_length=0.22")
    found = run(capsys, "--trials", "120", "--out", "o", "--sampler", sampler, *subject_to)
    assert found["trials"] == 120
    front = found["front"]
    assert [one["goals"]["leg.mass"] for one in front] == sorted(
        one["goals"]["leg.mass"] for one in front
    )
    with Path("o/front.csv").open(newline="") as file:
        assert [row["design"] for row in csv.DictReader(file)] == [one["design"] for one in front]
    spec = draft.load("robot")
    for one in front:
        design = spec.resolve(Path(f"o/designs/{one['design']}.yaml"))
        assert design.accepted
        assert design.parameters["shank_length"] == 0.22
        assert design.actuators["leg"].mass == pytest.approx(one["goals"]["leg.mass"])
    assert main(["build", "robot", "--design", "o/designs/front_001.yaml"]) == 0


@pytest.mark.slow
def test_a_search_goes_on_up_to_its_trials(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    first = run(capsys, "--trials", "60", "--out", "o")
    again = run(capsys, "--trials", "60", "--out", "o")
    assert again == first
    more = run(capsys, "--trials", "130", "--out", "o")
    assert (first["trials"], more["trials"]) == (60, 130)


def test_another_search_does_not_go_on_in_a_study(
    here: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    run(capsys, "--trials", "5", "--out", "o")
    other = ["--trials", "5", "--out", "o", "--subject-to", "accepted"]
    assert main(["optimise", "robot", *ARGUMENTS, *other]) == 2
    assert "'the study' belongs to another run: subject_to differs" in capsys.readouterr().err


@pytest.mark.slow
def test_processes_may_share_a_study(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    url = ("--storage", "sqlite:///shared.db")
    run(capsys, "--trials", "50", "--out", "a", *url)
    assert run(capsys, "--trials", "100", "--out", "b", *url)["trials"] == 100
    assert not Path("b/study.db").exists()


def test_goals_may_need_models(
    here: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    metric(monkeypatch, "model_weight", "model")
    arguments = ["--vary", "thigh_length=0.2:0.5", "--minimise", "model_weight", "--trials", "20"]
    assert main(["optimise", "robot", *arguments, "--out", "o", "--json"]) == 0
    (one,) = json.loads(capsys.readouterr().out)["front"]
    assert one["goals"]["model_weight"] > 0


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ((), "there is nothing to optimise\n  give --minimise or --maximise"),
        (("--minimise", "masss"), "--minimise:1:1: unknown name 'masss'"),
        (("--minimise", "leg.mass", "--maximise", "leg.mass"), "'leg.mass' is given twice"),
        ((*GOALS, "--subject-to", "leg.mass <"), "--subject-to:1:11: "),
        ((*GOALS, "--subject-to", "accepted and lg.mass"), "--subject-to:1:14: unknown actuator"),
        ((*GOALS, "--trials", "0"), "--trials 0 is not from 1 to 1000000"),
        ((*GOALS, "--storage", "nowhere://x"), "cannot open the study at 'nowhere://x'"),
        ((*GOALS, "--out", "robot/tree.yaml"), "cannot open the study at 'robot/tree.yaml'"),
    ],
)
def test_every_mistake_is_said(
    here: Path, capsys: pytest.CaptureFixture[str], arguments: tuple[str, ...], message: str
) -> None:
    given_ = ["--vary", "thigh_length=0.2:0.5", "--out", "o", *arguments]
    assert main(["optimise", "robot", *given_]) == 2
    assert message in capsys.readouterr().err


def test_a_library_that_is_missing_is_named(
    here: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "optuna", None)
    assert main(["optimise", "robot", *ARGUMENTS, "--out", "o"]) == 2
    expected = f"error: optuna is not installed\n  {remedy('explore')}\n"
    assert capsys.readouterr().err == expected


@pytest.mark.slow
def test_designs_of_ones_own_are_kept(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    mine = here / "designs" / "front_heavy.yaml"
    mine.parent.mkdir(exist_ok=True)
    mine.write_text("doc: Mine.\nvalues: {thigh_length: 0.3}\n", encoding="utf-8")
    run(capsys, "--trials", "60", "--out", str(here))
    run(capsys, "--trials", "80", "--out", str(here))
    assert mine.is_file()
    names = {path.stem for path in mine.parent.glob("front_0*.yaml")}
    front = json.loads((here / "front.json").read_text(encoding="utf-8"))["front"]
    assert names == {one["design"] for one in front}
    (mine.parent / "front_001.yaml").write_text("doc: Mine.\nvalues: {}\n", encoding="utf-8")
    (here / "front.json").unlink()
    assert main(["optimise", "robot", *ARGUMENTS, "--trials", "90", "--out", str(here)]) == 2
    assert "is not a design of this search; it is kept" in capsys.readouterr().err
    assert (mine.parent / "front_001.yaml").read_text(encoding="utf-8").startswith("doc: Mine")


@pytest.mark.slow
def test_the_front_is_drawn_and_written(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    pytest.importorskip("matplotlib")
    run(capsys, "--trials", "40", "--out", "out", "--figure")
    for name in ("front.png", "front.pdf"):
        assert Path("out", name).stat().st_size > 5000


@pytest.mark.parametrize(("texts", "panels"), [(["mass"], 1), (["mass", "leg.mass", "pi"], 3)])
def test_every_pair_of_goals_has_a_panel(texts: list[str], panels: int) -> None:
    pytest.importorskip("matplotlib")
    from matplotlib import pyplot as plt
    from optuna.trial import create_trial

    from draft.explore.front_figure import draw

    one = search()
    one = dataclasses.replace(one, goals=goals.goals(SPEC, texts, []))
    values = np.random.default_rng(0).uniform(1, 2, (30, len(texts)))
    trials = [create_trial(values=list(row)) for row in values]
    goals_of_first = dict(zip(texts, map(float, values[0]), strict=True))
    front: list[Entry] = [{"design": "one", "trial": 0, "values": {}, "goals": goals_of_first}]
    plt.switch_backend("agg")
    figure = draw(one, trials, front)
    assert len(figure.axes) == panels
    assert "mass [kg], less is better" in {
        label for ax in figure.axes for label in (ax.get_xlabel(), ax.get_ylabel())
    }
    plt.close(figure)
