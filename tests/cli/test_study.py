"""`draft study` as a newcomer uses it, with workers that learn nothing."""

from __future__ import annotations

import importlib.util
import io
import json
import re
import subprocess
import sys
import types
from pathlib import Path
from typing import Any

import pytest
from rich.console import Console

from draft.cli.display import study_output as display
from draft.learn.bodies.designs import open_bodies
from draft.learn.engine import machine
from draft.learn.engine.machine import Machine
from draft.learn.training import run as runs
from draft.learn.training.members import robots_digest
from draft.learn.training.run import open_run
from draft.study import placement, running
from tests.commands import Command
from tests.study.small import Fake, machine_of

TEXT = """\
designs: [cheetah]
seeds: 1
stages: [base, push]
iterations: {base: 300, push: 100}
evaluate: {replicas: 32, perturbed: false}
"""
ROOT = Path(__file__).parents[2]
needs_scipy = pytest.mark.skipif(
    importlib.util.find_spec("scipy") is None, reason="scipy is not installed"
)
# A study that never gets beyond its second job, in a process that can be killed.
SLOW = """
import sys, time
from draft.cli import main
from draft.study import running
from tests.commands import Command
from tests.study.small import Fake

class Slow(Fake):
    def start(self, request, log, fresh=False):
        while self.began:
            time.sleep(60)
        super().start(request, log, fresh)

running.make_workers = lambda *options: [Slow()]
sys.exit(main(["study", "mine.yaml"]))
"""


@pytest.fixture(autouse=True)
def worker(monkeypatch: pytest.MonkeyPatch) -> Fake:
    """The one worker of every study here; the file `mine.yaml`."""
    Path("mine.yaml").write_text(TEXT)
    return works(monkeypatch, Fake())


def works(monkeypatch: pytest.MonkeyPatch, fake: Fake) -> Fake:
    """Let a worker do the jobs."""
    monkeypatch.setattr(running, "make_workers", lambda *options: [fake])
    return fake


def failing() -> Fake:
    return Fake(lambda name, _: 2 if name == "cheetah-push-0" else None)


def test_a_dry_run_prints_the_plan_and_writes_nothing(command: Command) -> None:
    dry = "study mine.yaml --dry-run --device cuda"
    said = "\n".join(line.rstrip() for line in command(f"{dry} --rate 1e4").out.splitlines())
    assert (
        said
        == """\
job                     after           state  GPU-hours
cheetah-base-0                          new        0.819
cheetah-base-0-nominal  cheetah-base-0  new        0.001
cheetah-push-0          cheetah-base-0  new        0.273
cheetah-push-0-nominal  cheetah-push-0  new        0.012
report                  2 jobs          new
0 of 5 jobs are done; 1.11 GPU-hours are left: an estimate, at the 10,000 steps/s of --rate"""
    )
    assert not Path("studies").exists()
    told = command.json(dry)
    assert told["jobs"]["cheetah-push-0"]["needs"] == ["cheetah-base-0"]
    assert told["hours"] == pytest.approx(1.105 / 10, rel=1e-2)
    assert (told["unit"], told["engine"], told["at_once"]) == ("GPU-hours", "warp", None)
    assert "assumption" in told["rate"]


def test_on_a_cpu_a_dry_run_prints_the_hours_of_its_engine(
    command: Command, monkeypatch: pytest.MonkeyPatch
) -> None:
    machine_of(2, monkeypatch)
    rates = {name: {"flat": 1e3, "uneven": 5e2} for name in ("native", "warp")}
    monkeypatch.setattr(machine, "_RATES", rates)
    Path("mine.yaml").write_text(f"recipe: laptop\n{TEXT}")
    dry = "study mine.yaml --dry-run"
    said = command(dry).out.splitlines()
    assert said[0].split()[-1] == "hours"
    # 300 and 100 iterations of 512 worlds and 24 steps, at 2 x 1000 steps/s, and evaluations.
    assert said[1].split()[-1] == f"{300 * 512 * 24 / 2000 / 3600:.3f}"
    words = "native MuJoCo (the fastest without a GPU), 2 processes for each training, 1 job at"
    assert said[-2] == f"engine: {words} once"
    source = "an estimate, at steps/s measured on another CPU: 2,000 on"
    assert f"; 0.75 hours are left: {source}" in said[-1]
    told = command.json(dry)
    expected = ("hours", "native", "the fastest without a GPU", 2, 1)
    names = ("unit", "engine", "why", "processes", "at_once")
    assert tuple(told[name] for name in names) == expected
    for more, words in (
        ("--workers 2", "0.75 hours are left with 2 jobs at once"),
        ("--toy", "1 process for each training, 2 jobs at once"),
        ("--engine warp --device cpu", "engine: MuJoCo Warp (requested), 1 process"),
    ):
        assert words in command(f"{dry} {more}").out


def test_where_nothing_can_be_learnt_hours_are_those_of_gpus(
    command: Command, monkeypatch: pytest.MonkeyPatch
) -> None:
    nothing = Machine(["cpu"], None, "torch", 2)
    monkeypatch.setattr(placement, "this_machine", lambda: nothing)
    out = command("study mine.yaml --dry-run").out
    assert "GPU-hours are left: an estimate, at 100,000 steps/s" in out


def test_a_study_runs_and_is_then_done(command: Command, worker: Fake) -> None:
    said = command("study mine.yaml").out
    assert "[1/5] cheetah-base-0: done after 0 s" in said
    assert "5 of 5 jobs are done" in said
    assert f"report: {Path('studies/mine/report/index.html').absolute()}" in said
    assert len(worker.began) == 5
    told = command.json("study mine.yaml")
    assert told["done"]
    assert set(told["jobs"].values()) == {"done"}
    said = command("study mine.yaml --dry-run").out
    assert re.search(r" 0\.00 (GPU-)?hours are left", said)
    assert len(worker.began) == 5
    Path("mine.yaml").write_text(TEXT.replace("push: 100", "push: 99"))
    said = command("study mine.yaml --dry-run").out
    assert re.search(r"cheetah-push-0 +cheetah-base-0 +changed +0\.0*[1-9]", said)
    assert "2 outputs have other numbers; moved to" in command("study mine.yaml").out


def test_versions_that_changed_are_reported_and_what_is_done_is_kept(
    command: Command, worker: Fake, monkeypatch: pytest.MonkeyPatch
) -> None:
    command("study mine.yaml")
    here = runs.versions()
    monkeypatch.setattr(runs, "_version", (here | {"mujoco": "99.1", "tyro": "99.2"}).get)
    changed = f"mujoco {here['mujoco']} -> 99.1"
    words = f"versions changed since: {changed}; finished jobs are kept"
    assert words in " ".join(command("study mine.yaml --dry-run").out.split())
    assert command.json("study mine.yaml --dry-run")["versions_changed"] == changed
    assert words in command("study mine.yaml").out
    assert len(worker.began) == 5
    assert "versions" not in command("study mine.yaml --dry-run").out


def test_a_terminal_shows_what_is_at_work_and_what_is_ahead(
    command: Command, monkeypatch: pytest.MonkeyPatch
) -> None:
    shown = io.StringIO()
    terminal = Console(file=shown, force_terminal=True, width=100)
    monkeypatch.setattr(display, "console", lambda: terminal)
    works(monkeypatch, failing())
    command("study mine.yaml", code=1)
    said = re.sub(r"\x1b\[[0-9;?]*[A-Za-z]", "", shown.getvalue())
    assert re.search(r"cheetah-base-0 +running +300 of 300", said)
    assert re.search(r"cheetah-push-0 +failed", said)
    assert said.rstrip().endswith("skipped")
    assert "2 of 5 jobs are done, 1 failed, 1 skipped" in said


def test_what_fails_is_reported_at_the_end(
    command: Command, monkeypatch: pytest.MonkeyPatch
) -> None:
    works(monkeypatch, failing())
    out, err = command("study mine.yaml", code=1)
    assert "cheetah-push-0-nominal: skipped, cheetah-push-0 has failed" in out
    assert "repeat the command to resume" in out
    log = Path("studies/mine/logs/cheetah-push-0.log").absolute()
    words = f"cheetah-push-0 failed: exit code 2; {log} ends with\n    cheetah-push-0 says this\n"
    assert err == words


def test_a_time_too_short_for_anything_is_reported_with_how_long_it_takes(
    command: Command, worker: Fake
) -> None:
    said = command("study mine.yaml --minutes 0.1").out
    assert "too little time to do anything; pass --minutes 1 or more" in said
    assert "repeat the command" not in said
    assert command.json("study mine.yaml --minutes 0.1")["minutes_needed"] == 1
    assert worker.began == []
    said = command("study mine.yaml --minutes 9").out
    assert "5 of 5 jobs are done" in said
    assert "too little time" not in said


@needs_scipy
def test_a_family_is_drawn_once_and_kept_as_design_files_in_a_toys_own_folder(
    command: Command,
) -> None:
    Path("mine.yaml").write_text(
        "designs:\n- {design: cheetah, vary: ['thigh_length=0.22:0.28'], bodies: 2}\n- cheetah\n"
        "stages: [base]\nseeds: 2\n"
    )
    command("study mine.yaml --toy")
    assert not Path("studies/mine").exists()
    name = "cheetah-2-bodies"
    folder = Path("studies/mine-toy/designs") / name
    drawn = open_run(Path("studies/mine-toy/runs") / f"{name}-base-0").plan
    single = open_run(Path("studies/mine-toy/runs/cheetah-base-0")).plan
    assert (drawn.see_design, single.see_design) == (True, False)
    record = json.loads(Path("studies/mine-toy/study.json").read_text())
    names = [member.name for member in drawn.members]
    assert record["designs"][0]["members"] == names == ["quadruped:body_1", "quadruped:body_2"]
    assert [path.name for path in Path("studies/mine-toy/designs").iterdir()] == [name]
    # The files give the very same robots.
    found = open_bodies([f"quadruped:{folder}/body_{k}.yaml" for k in (1, 2)]).members
    assert robots_digest(found) == robots_digest(drawn.members)


def test_a_design_that_is_edited_while_the_study_runs_counts_from_the_next_call_on(
    worker: Fake, monkeypatch: pytest.MonkeyPatch, command: Command
) -> None:
    Path("own.yaml").write_text("doc: Mine.\nvalues: {}\n")
    Path("mine.yaml").write_text(TEXT.replace("[cheetah]", "['quadruped:own.yaml']"))

    def edit(name: str, request: Any) -> None:
        Path("own.yaml").write_text("doc: Mine.\nvalues: {thigh_length: 0.3}\n")

    works(monkeypatch, Fake(edit))
    assert "5 of 5 jobs are done" in command("study mine.yaml").out
    folder = Path("studies/mine/runs")
    before = {run.name: open_run(run).plan.members for run in folder.iterdir()}
    assert len({robots_digest(members) for members in before.values()}) == 1
    design = next((folder / "own-base-0/designs").iterdir()).read_text()
    assert "thigh_length: 0.3\n" not in design
    works(monkeypatch, worker)
    assert "4 outputs have other numbers" in command("study mine.yaml").out
    assert len(worker.began) == 5
    after = open_run(folder / "own-base-0").plan.members
    assert robots_digest(after) != robots_digest(before["own-base-0"])


@pytest.mark.parametrize(
    ("text", "words", "code"),
    [
        ("[cheetah, hopper]", "mine.yaml:1:20: hopper cannot be trained", 2),
        ("[chetah]", "mine.yaml:1:11: 'chetah' names no robot or design", 2),
        ("[cheetah, cheetah]", "mine.yaml:1:20: 'quadruped-cheetah' is listed", 2),
        ("['quadruped:small.yaml']", "mine.yaml:1:", 1),
        ("[{design: bear, vary: ['thigh=1:2'], bodies: 2}]", "mine.yaml:1:11: `vary`", 2),
    ],
)
def test_designs_that_cannot_be_studied_are_reported_with_their_place(
    text: str, words: str, code: int, command: Command
) -> None:
    Path("mine.yaml").write_text(f"designs: {text}\n")
    Path("small.yaml").write_text(
        "doc: Its hips overlap.\n"
        "values: {thigh_length: 0.25, shank_length: 0.23, hip_offset: 0.03}\n"
    )
    assert words in command("study mine.yaml", code=code).err
    assert not Path("studies").exists()


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ("none.yaml", "none.yaml: file not found"),
        ("mine.yaml --minutes 0", "--minutes 0 is not a number above 0"),
        ("mine.yaml --dry-run --rate nan", "--rate nan is not above 0"),
        ("mine.yaml --rate 1e4", "--rate is for --dry-run"),
        ("mine.yaml --workers 0", "--workers 0 is not a whole number from 1"),
        ("mine.yaml --address here:1", "--address is for a Ray cluster"),
        ("mine.yaml --out ' '", "--out names no folder"),
        ("mine.yaml --out .", "holds no study, but mine.yaml"),
    ],
)
def test_options_that_make_no_sense_are_refused(words: str, said: str, command: Command) -> None:
    before = sorted(Path().iterdir())
    assert said in command.refuses(f"study {words}")
    assert sorted(Path().iterdir()) == before


def begin(word: str) -> subprocess.Popen[str]:
    """A study in a process of its own, which has said a word."""
    process = subprocess.Popen(
        [sys.executable, "-c", SLOW],
        stdout=subprocess.PIPE,
        text=True,
        env={"PYTHONPATH": f"{ROOT}:{ROOT / 'src'}", "MUJOCO_GL": "disabled"},
    )
    assert process.stdout is not None
    while word not in process.stdout.readline():
        assert process.poll() is None
    return process


def test_a_study_has_one_process_and_ends_well_however_often_it_is_killed(
    command: Command, worker: Fake
) -> None:
    for _ in range(3):
        with begin("done after") as process:
            err = command("study mine.yaml", code=2).err
            process.kill()
        words = f"is running in '{Path('studies/mine').absolute()}' (process {process.pid})"
        assert words in err
    command("study mine.yaml")
    assert len(worker.began) == 2  # Each of the three did one of five.


def test_a_report_can_be_asked_for(command: Command, monkeypatch: pytest.MonkeyPatch) -> None:
    report: Any = types.ModuleType("draft.study.report.writing")
    report.write = lambda folder: folder / "report/index.html"
    monkeypatch.setitem(sys.modules, "draft.study.report.writing", report)
    out = command("study report somewhere").out
    assert out == "report: somewhere/report/index.html\n"
