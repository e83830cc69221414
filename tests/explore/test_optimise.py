"""Searches: the front of a known problem, constraints that are met, studies that go on."""

from __future__ import annotations

import csv
import dataclasses
import json
import shlex
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import draft
from draft.explore import goals
from draft.explore.front import Entry, best
from draft.explore.search import Search, evaluate, first_designs
from draft.explore.storage import FILE, STUDY, SqliteLog
from draft.files import held
from draft.metrics import grasp, of_design
from tests.commands import Command
from tests.explore.small import VARY, job, metric
from tests.written import files_below

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
    one = job(SPEC, kind="optimise", vary=VARY)
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


@given(st.floats(-20, 20), st.floats(0, 20), st.sampled_from(["<=", ">="]), st.booleans())
def test_a_constraint_is_missed_the_more_the_further_a_design_is_from_it(
    limit: float, step: float, sign: str, first: bool
) -> None:
    text = f"thigh_length {sign} {limit}"
    if first:
        text = f"{limit} {'<=' if sign == '>=' else '>='} thigh_length"
    (one,) = goals.constraints(SPEC, [text])
    away = 1.0 if sign == "<=" else -1.0
    gaps = np.array([0.0, 0.01, 0.02, 0.02 + step, 100.0])
    design = SimpleNamespace(parameters={"thigh_length": limit + away * gaps}, count=len(gaps))
    missed = one.violation(cast("draft.Design", design), {})
    assert missed[0] == 0
    assert missed[1] > 0
    assert (np.diff(missed) >= 0).all()
    assert missed[-1] > missed[1]


def test_a_search_begins_with_designs_that_meet_the_constraints() -> None:
    one = search("accepted", "thigh_length > 0.45")
    first = first_designs(one, 50)
    assert len(first) == 50
    for values in first:
        assert values["thigh_length"] > 0.45
        assert SPEC.resolve(values).accepted


def test_a_search_begins_without_what_takes_many_poses_of_each_design(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    def never(design: draft.Design) -> float:
        raise AssertionError(f"{design.count} designs are sampled")

    monkeypatch.setattr(grasp, "grasps", never)
    hand = draft.load("hand")
    conditions = goals.constraints(hand, ["mass < 0.68", "pinch_force > 5"])
    run = job(hand, kind="optimise", vary=("tip_length=0.025:0.05",))
    one = Search(run, goals.goals(hand, ["mass"], []), conditions, trials=10)
    first = first_designs(one, 10)
    assert len(first) == 10
    assert all(hand.resolve(values).mass < 0.68 for values in first)


Run = Callable[..., dict[str, Any]]


@pytest.fixture
def run(here: Path, command: Command) -> Run:
    """A search, and the object that it prints."""
    return lambda line: command.json("optimise robot", *ARGUMENTS, *shlex.split(line))


@pytest.mark.slow
@pytest.mark.parametrize("sampler", ["nsga2", "tpe"])
def test_every_design_of_the_front_builds_and_meets_the_constraints(
    run: Run, command: Command, sampler: str
) -> None:
    found = run(
        f"--trials 120 --out o --sampler {sampler} --set shank_length=0.22 "
        "--subject-to 'accepted and leg.mass < 1.5'"
    )
    assert found["trials"] == 120
    front = found["front"]
    masses = [one["goals"]["leg.mass"] for one in front]
    assert masses == sorted(masses)
    with Path("o/front.csv").open(newline="") as file:
        assert [row["design"] for row in csv.DictReader(file)] == [one["design"] for one in front]
    spec = draft.load("robot")
    for one in front:
        design = spec.resolve(Path(f"o/designs/{one['design']}.yaml"))
        assert design.accepted
        assert design.parameters["shank_length"] == 0.22
        assert design.actuators["leg"].mass == pytest.approx(one["goals"]["leg.mass"])
    command("build robot --design o/designs/front_001.yaml")


@pytest.mark.slow
def test_a_search_goes_on_up_to_its_trials(run: Run) -> None:
    first = run("--trials 60 --out o")
    assert run("--trials 60 --out o") == first
    more = run("--trials 130 --out o")
    assert (first["trials"], more["trials"]) == (60, 130)


@pytest.mark.slow
def test_processes_may_share_a_study(run: Run) -> None:
    run("--trials 50 --out a --storage sqlite:///shared.db")
    assert run("--trials 100 --out b --storage sqlite:///shared.db")["trials"] == 100
    assert not Path("b/study.db").exists()


@pytest.mark.usefixtures("here")
def test_goals_may_need_models(command: Command, monkeypatch: pytest.MonkeyPatch) -> None:
    metric(monkeypatch, "model_weight", "model")
    words = "--vary thigh_length=0.2:0.5 --minimise model_weight --trials 20 --out o"
    (one,) = command.json(f"optimise robot {words}")["front"]
    assert one["goals"]["model_weight"] > 0


@pytest.mark.parametrize(
    ("words", "message"),
    [
        ("", "there is nothing to optimise\n  give --minimise or --maximise"),
        ("--minimise masss", "--minimise:1:1: unknown name 'masss'"),
        ("--minimise leg.mass --maximise leg.mass", "'leg.mass' is given twice"),
        *(
            (f"{' '.join(GOALS)} {words}", message)
            for words, message in (
                ("--subject-to 'leg.mass <'", "--subject-to:1:11: "),
                ("--subject-to 'accepted and lg.mass'", "--subject-to:1:14: unknown actuator"),
                ("--trials 0", "--trials 0 is not a whole number from 1 to 1000000"),
                ("--storage nowhere://x", "cannot open the study at 'nowhere://x'"),
                ("--out robot/tree.yaml", "cannot write robot/tree.yaml: file exists"),
            )
        ),
    ],
)
@pytest.mark.usefixtures("here")
def test_every_mistake_is_said_and_leaves_no_folder(
    command: Command, words: str, message: str
) -> None:
    before = files_below(Path())
    line = f"optimise robot --vary thigh_length=0.2:0.5 --out a/b {words}"
    assert message in command(line, code=2).err
    assert files_below(Path()) == before


def test_another_search_or_process_is_kept_out_of_a_study(run: Run, command: Command) -> None:
    words = "optimise robot --trials 5 --out o"
    with held(Path("o"), "draft optimise"):
        err = command(words, *ARGUMENTS, code=2).err
    assert "another search is running in 'o'" in err
    assert not Path("o/study.db").exists()
    run("--trials 5 --out o")
    err = command(words, *ARGUMENTS, "--subject-to", "accepted", code=2).err
    assert "'the study' belongs to another run: subject_to differs" in err


@pytest.mark.slow
def test_designs_of_ones_own_are_kept_and_the_front_is_drawn(
    here: Path, run: Run, command: Command
) -> None:
    pytest.importorskip("matplotlib")
    mine = here / "designs" / "front_heavy.yaml"
    mine.write_text("doc: Mine.\nvalues: {thigh_length: 0.3}\n", encoding="utf-8")
    run(f"--trials 60 --out {here}")
    run(f"--trials 80 --out {here} --figure")
    for name in ("front.png", "front.pdf"):
        assert (here / name).stat().st_size > 5000
    assert mine.is_file()
    names = {path.stem for path in mine.parent.glob("front_0*.yaml")}
    front = json.loads((here / "front.json").read_text(encoding="utf-8"))["front"]
    assert names == {one["design"] for one in front}
    (mine.parent / "front_001.yaml").write_text("doc: Mine.\nvalues: {}\n", encoding="utf-8")
    (here / "front.json").unlink()
    err = command(f"optimise robot --trials 90 --out {here}", *ARGUMENTS, code=2).err
    assert "is not a design of this search; it is kept" in err
    assert (mine.parent / "front_001.yaml").read_text(encoding="utf-8").startswith("doc: Mine")


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


def params(found: Path) -> list[dict[str, float]]:
    """Varied values of all trials of a study, in order."""
    optuna = pytest.importorskip("optuna")
    storage = optuna.storages.JournalStorage(SqliteLog(found / FILE))
    study = optuna.load_study(study_name=STUDY, storage=storage)
    return [trial.params for trial in study.trials]


def test_conditions_that_nothing_meets_are_counted(run: Run, command: Command) -> None:
    words = "--subject-to 'leg.mass < 0.001' accepted --trials 12 --out o"
    found = run(words)
    assert found["front"] == []
    assert found["failed"]["leg.mass < 0.001"] == 12
    assert 0 <= found["failed"]["accepted"] <= 12
    out = command(f"optimise robot {words}", *ARGUMENTS).out
    assert "12 trials, and none meets all conditions:" in out
    assert "leg.mass < 0.001: fails in 12 of 12" in out
    assert out.endswith("written to o: front.csv, front.json\n")


def test_a_full_disk_is_bad_input_and_the_search_resumes(
    run: Run, command: Command, monkeypatch: pytest.MonkeyPatch
) -> None:
    from draft.explore import storage

    run("--trials 20 --out whole")
    run("--trials 5 --out o")

    class Full(storage._Connection):
        """A database that may not grow, as on a full disk."""

        def __init__(self, *args: Any, **kwargs: Any) -> None:
            super().__init__(*args, **kwargs)
            (pages,) = self.execute("PRAGMA page_count").fetchone()
            self.execute(f"PRAGMA max_page_count={pages}")

    with monkeypatch.context() as patch:
        patch.setattr(storage, "_Connection", Full)
        err = command("optimise robot --trials 2000 --out o", *ARGUMENTS, code=2).err
    assert "cannot write the study at 'o/study.db': database or disk is full" in err
    assert "free some space and repeat the command" in err
    kept = len(params(Path("o")))
    assert kept >= 5
    run(f"--trials {max(kept, 20)} --out o")
    assert params(Path("o"))[:20] == params(Path("whole"))


@pytest.mark.slow
@pytest.mark.usefixtures("here")
def test_a_search_loads_its_robots_and_asks_what_more_they_carry(command: Command) -> None:
    (found,) = command.json(
        "optimise quadruped:cheetah --vary actuators.leg.peak_torque=10:80 --minimise mass "
        "--payload 10 --subject-to 'payload_rated > 10' --trials 30 --out o"
    )["front"]
    design = SPEC.resolve(Path("o/designs/front_001.yaml"))
    assert design.payload_mass == pytest.approx(10.0)
    assert design.mass == pytest.approx(found["goals"]["mass"])
    assert of_design(design, ["payload_rated"])["payload_rated"] > 10.0
    weaker = {"actuators.leg.peak_torque": 10.0, "payload": 10.0}
    assert of_design(SPEC.resolve("cheetah", weaker), ["payload_rated"])["payload_rated"] < 10.0
