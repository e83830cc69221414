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
from draft.explore.search import Search, evaluate, first_designs
from draft.explore.storage import FILE, STUDY, SqliteLog
from draft.extras import remedy
from draft.metrics import of_design
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
        ((*GOALS, "--trials", "0"), "--trials 0 is not a whole number from 1 to 1000000"),
        ((*GOALS, "--storage", "nowhere://x"), "cannot open the study at 'nowhere://x'"),
        ((*GOALS, "--out", "robot/tree.yaml"), "cannot write robot/tree.yaml: file exists"),
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


def params(found: Path) -> list[dict[str, float]]:
    """Varied values of all trials of a study, in order."""
    optuna = pytest.importorskip("optuna")
    storage = optuna.storages.JournalStorage(SqliteLog(found / FILE))
    study = optuna.load_study(study_name=STUDY, storage=storage)
    return [trial.params for trial in study.trials]


@pytest.mark.parametrize("sampler", ["nsga2", "tpe"])
def test_a_search_that_is_interrupted_repeats_the_one_that_was_not(
    here: Path, capsys: pytest.CaptureFixture[str], sampler: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    words = ("--sampler", sampler, "--subject-to", "accepted")
    whole = run(capsys, "--trials", "160", "--out", "whole", *words)
    # Ended by its number of trials within a generation, and by a fault while one is written.
    run(capsys, "--trials", "70", "--out", "parts", *words)
    optuna = pytest.importorskip("optuna")
    real = optuna.study.Study.add_trials

    def some(study: Any, trials: list[Any]) -> None:
        if "Journal" in type(study._storage).__name__:
            real(study, trials[:7])
            raise KeyboardInterrupt
        real(study, trials)

    with monkeypatch.context() as patch:
        patch.setattr(optuna.study.Study, "add_trials", some)
        end = ["--trials", "160", "--out", "parts", *words]
        assert main(["optimise", "robot", *ARGUMENTS, *end]) == 130
        capsys.readouterr()
    assert len(params(Path("parts"))) == 77
    again = run(capsys, "--trials", "160", "--out", "parts", *words)
    assert params(Path("parts")) == params(Path("whole"))
    assert again["front"] == whole["front"]


def test_conditions_that_nothing_meets_are_counted(
    here: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    words = ["--subject-to", "leg.mass < 0.001", "accepted", "--trials", "12", "--out", "o"]
    found = run(capsys, *words)
    assert found["front"] == []
    assert found["failed"]["leg.mass < 0.001"] == 12
    assert 0 <= found["failed"]["accepted"] <= 12
    assert main(["optimise", "robot", *ARGUMENTS, *words]) == 0
    out = capsys.readouterr().out
    assert "12 trials, and none meets all conditions:" in out
    assert "leg.mass < 0.001: fails in 12 of 12" in out


def test_a_full_disk_is_bad_input_and_the_search_resumes(
    here: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    from draft.explore import storage

    run(capsys, "--trials", "20", "--out", "whole")
    run(capsys, "--trials", "5", "--out", "o")

    class Full(storage._Connection):
        """A database that may not grow, as on a full disk."""

        def __init__(self, *args: Any, **kwargs: Any) -> None:
            super().__init__(*args, **kwargs)
            (pages,) = self.execute("PRAGMA page_count").fetchone()
            self.execute(f"PRAGMA max_page_count={pages}")

    with monkeypatch.context() as patch:
        patch.setattr(storage, "_Connection", Full)
        words = ["--trials", "2000", "--out", "o"]
        assert main(["optimise", "robot", *ARGUMENTS, *words]) == 2
    err = capsys.readouterr().err
    assert "cannot write the study at 'o/study.db': database or disk is full" in err
    assert "free some space and repeat the command" in err
    kept = len(params(Path("o")))
    assert kept >= 5
    run(capsys, "--trials", str(max(kept, 20)), "--out", "o")
    assert params(Path("o"))[:20] == params(Path("whole"))


def test_two_processes_do_not_search_in_one_folder(
    here: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    from draft.files import held

    with held(Path("o"), "draft optimise"):
        assert main(["optimise", "robot", *ARGUMENTS, "--trials", "5", "--out", "o"]) == 2
    assert "another search is running in 'o'" in capsys.readouterr().err
    assert not Path("o/study.db").exists()


def test_a_search_that_fails_leaves_no_folder(
    here: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    words = ["--trials", "5", "--out", "a/b", "--storage", "nonsense://x"]
    assert main(["optimise", "robot", *ARGUMENTS, *words]) == 2
    capsys.readouterr()
    assert [path.name for path in Path().iterdir()] == ["robot"]


@pytest.mark.slow
def test_a_search_loads_its_robots_and_asks_what_more_they_carry(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    ranges = ("--vary", "actuators.leg.peak_torque=10:80", "--minimise", "mass")
    wanted = ("--payload", "10", "--subject-to", "payload_rated > 10")
    command = ["optimise", "quadruped:cheetah", *ranges, *wanted, "--trials", "30", "--out", "o"]
    assert main([*command, "--json"]) == 0
    (found,) = json.loads(capsys.readouterr().out)["front"]
    design = SPEC.resolve(Path("o/designs/front_001.yaml"))
    assert design.payload_mass == pytest.approx(10.0)
    assert design.mass == pytest.approx(found["goals"]["mass"])
    assert of_design(design, ["payload_rated"])["payload_rated"] > 10.0
    weaker = {"actuators.leg.peak_torque": 10.0, "payload": 10.0}
    assert of_design(SPEC.resolve("cheetah", weaker), ["payload_rated"])["payload_rated"] < 10.0
