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

from draft.cli import BAD_INPUT, REFUSED, main
from draft.cli.display import study_output as display
from draft.learn.bodies.designs import open_bodies
from draft.learn.engine import machine
from draft.learn.engine.machine import Machine
from draft.learn.training import run as runs
from draft.learn.training.members import robots_digest
from draft.learn.training.run import open_run
from draft.study import capacity, placement, running
from tests.study.small import Fake

TEXT = """\
designs: [cheetah]
seeds: 1
stages: [base, push]
iterations: {base: 300, push: 100}
evaluate: {replicas: 32, perturbed: false}
"""
RATED = ("native", "warp")
ROOT = Path(__file__).parents[2]
needs_scipy = pytest.mark.skipif(
    importlib.util.find_spec("scipy") is None, reason="scipy is not installed"
)
# A study that never gets beyond its second job, in a process that can be killed.
SLOW = """
import sys, time
from draft.cli import main
from draft.study import running
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
def worker(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Fake:
    monkeypatch.chdir(tmp_path)
    Path("mine.yaml").write_text(TEXT)
    fake = Fake()
    monkeypatch.setattr(running, "make_workers", lambda *options: [fake])
    return fake


def test_a_dry_run_prints_the_plan_and_writes_nothing(capsys: pytest.CaptureFixture[str]) -> None:
    command = ["study", "mine.yaml", "--dry-run", "--device", "cuda"]
    assert main([*command, "--rate", "1e4"]) == 0
    said = "\n".join(line.rstrip() for line in capsys.readouterr().out.splitlines())
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
    assert main([*command, "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert told["jobs"]["cheetah-push-0"]["needs"] == ["cheetah-base-0"]
    assert told["hours"] == pytest.approx(1.105 / 10, rel=1e-2)
    assert (told["unit"], told["engine"], told["at_once"]) == ("GPU-hours", "warp", None)
    assert "assumption" in told["rate"]


@pytest.fixture
def two_cores(monkeypatch: pytest.MonkeyPatch) -> None:
    """A machine of two cores without a GPU, where native MuJoCo can be used."""
    for place in (capacity, machine):
        monkeypatch.setattr(place, "cores", lambda: 2)
    monkeypatch.setattr(machine, "obstacle", lambda: None)
    cpu = Machine(["cpu"], machine.choose("auto", ["cpu"]), None, 2)
    monkeypatch.setattr(placement, "this_machine", lambda: cpu)
    monkeypatch.setattr(machine, "_RATES", {n: {"flat": 1e3, "uneven": 5e2} for n in RATED})


@pytest.mark.usefixtures("two_cores")
def test_on_a_cpu_a_dry_run_prints_the_hours_of_its_engine(
    capsys: pytest.CaptureFixture[str],
) -> None:
    Path("mine.yaml").write_text(f"recipe: laptop\n{TEXT}")
    assert main(["study", "mine.yaml", "--dry-run"]) == 0
    said = capsys.readouterr().out.splitlines()
    assert said[0].split()[-1] == "hours"
    # 300 and 100 iterations of 512 worlds and 24 steps, at 2 x 1000 steps/s, and evaluations.
    assert said[1].split()[-1] == f"{300 * 512 * 24 / 2000 / 3600:.3f}"
    words = "native MuJoCo (the fastest without a GPU), 2 processes for each training, 1 job at"
    assert said[-2] == f"engine: {words} once"
    rates = "an estimate, at steps/s measured on another CPU: 2,000 on"
    assert f"; 0.75 hours are left: {rates}" in said[-1]
    assert main(["study", "mine.yaml", "--dry-run", "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    expected = ("hours", "native", "the fastest without a GPU", 2, 1)
    names = ("unit", "engine", "why", "processes", "at_once")
    assert tuple(told[name] for name in names) == expected
    assert main(["study", "mine.yaml", "--dry-run", "--workers", "2"]) == 0
    assert "0.75 hours are left with 2 jobs at once" in capsys.readouterr().out
    assert main(["study", "mine.yaml", "--dry-run", "--toy"]) == 0
    assert "1 process for each training, 2 jobs at once" in capsys.readouterr().out
    assert main(["study", "mine.yaml", "--dry-run", "--engine", "warp", "--device", "cpu"]) == 0
    assert "engine: MuJoCo Warp (requested), 1 process" in capsys.readouterr().out


def test_where_nothing_can_be_learnt_hours_are_those_of_gpus(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    nothing = Machine(["cpu"], None, "torch", 2)
    monkeypatch.setattr(placement, "this_machine", lambda: nothing)
    assert main(["study", "mine.yaml", "--dry-run"]) == 0
    assert "GPU-hours are left: an estimate, at 100,000 steps/s" in capsys.readouterr().out


def test_a_study_runs_and_is_then_done(capsys: pytest.CaptureFixture[str], worker: Fake) -> None:
    assert main(["study", "mine.yaml"]) == 0
    said = capsys.readouterr().out
    assert "[1/5] cheetah-base-0: done after 0 s" in said
    assert "5 of 5 jobs are done" in said
    assert f"report: {Path('studies/mine/report/index.html').absolute()}" in said
    assert len(worker.began) == 5
    assert main(["study", "mine.yaml", "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert told["done"]
    assert set(told["jobs"].values()) == {"done"}
    assert main(["study", "mine.yaml", "--dry-run"]) == 0
    said = capsys.readouterr().out
    assert re.search(r" 0\.00 (GPU-)?hours are left", said)
    assert len(worker.began) == 5
    Path("mine.yaml").write_text(TEXT.replace("push: 100", "push: 99"))
    assert main(["study", "mine.yaml", "--dry-run"]) == 0
    said = capsys.readouterr().out
    assert re.search(r"cheetah-push-0 +cheetah-base-0 +changed +0\.0*[1-9]", said)
    assert main(["study", "mine.yaml"]) == 0
    assert "2 outputs have other numbers; moved to" in capsys.readouterr().out


def test_versions_that_changed_are_reported_and_what_is_done_is_kept(
    capsys: pytest.CaptureFixture[str], worker: Fake, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert main(["study", "mine.yaml"]) == 0
    here = runs.versions()
    monkeypatch.setattr(runs, "_version", (here | {"mujoco": "99.1", "tyro": "99.2"}).get)
    words = f"versions changed since: mujoco {here['mujoco']} -> 99.1; finished jobs are kept"
    capsys.readouterr()
    assert main(["study", "mine.yaml", "--dry-run"]) == 0
    assert words in " ".join(capsys.readouterr().out.split())
    assert main(["study", "mine.yaml", "--dry-run", "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert told["versions_changed"] == f"mujoco {here['mujoco']} -> 99.1"
    assert main(["study", "mine.yaml"]) == 0
    assert words in capsys.readouterr().out
    assert len(worker.began) == 5
    assert main(["study", "mine.yaml", "--dry-run"]) == 0
    assert "versions" not in capsys.readouterr().out


def test_a_terminal_shows_what_is_at_work_and_what_is_ahead(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    shown = io.StringIO()
    terminal = Console(file=shown, force_terminal=True, width=100)
    monkeypatch.setattr(display, "console", lambda: terminal)
    fake = Fake(lambda name, _: 2 if name == "cheetah-push-0" else None)
    monkeypatch.setattr(running, "make_workers", lambda *options: [fake])
    assert main(["study", "mine.yaml"]) == 1
    said = re.sub(r"\x1b\[[0-9;?]*[A-Za-z]", "", shown.getvalue())
    assert re.search(r"cheetah-base-0 +running +300 of 300", said)
    assert re.search(r"cheetah-push-0 +failed", said)
    assert said.rstrip().endswith("skipped")
    assert "2 of 5 jobs are done, 1 failed, 1 skipped" in said


def test_what_fails_is_reported_at_the_end(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    fake = Fake(lambda name, _: 2 if name == "cheetah-push-0" else None)
    monkeypatch.setattr(running, "make_workers", lambda *options: [fake])
    assert main(["study", "mine.yaml"]) == 1
    out, err = capsys.readouterr()
    assert "cheetah-push-0-nominal: skipped, cheetah-push-0 has failed" in out
    assert "repeat the command to resume" in out
    log = Path("studies/mine/logs/cheetah-push-0.log").absolute()
    words = f"cheetah-push-0 failed: exit code 2; {log} ends with\n    cheetah-push-0 says this\n"
    assert err == words


def test_a_time_too_short_for_anything_is_reported_with_how_long_it_takes(
    capsys: pytest.CaptureFixture[str], worker: Fake
) -> None:
    assert main(["study", "mine.yaml", "--minutes", "0.1"]) == 0
    said = capsys.readouterr().out
    assert "too little time to do anything; pass --minutes 1 or more" in said
    assert "repeat the command" not in said
    assert main(["study", "mine.yaml", "--minutes", "0.1", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["minutes_needed"] == 1
    assert worker.began == []
    assert main(["study", "mine.yaml", "--minutes", "9"]) == 0
    said = capsys.readouterr().out
    assert "5 of 5 jobs are done" in said
    assert "too little time" not in said


def test_a_toy_has_a_folder_of_its_own(worker: Fake) -> None:
    assert main(["study", "mine.yaml", "--toy"]) == 0
    run = Path("studies/mine-toy/runs/cheetah-base-0").absolute()
    assert worker.requests["cheetah-base-0"].run == str(run)
    assert Path("studies/mine-toy/report/index.html").exists()
    assert not Path("studies/mine").exists()


@needs_scipy
def test_a_family_is_drawn_once_and_kept_as_design_files(worker: Fake) -> None:
    Path("mine.yaml").write_text(
        "designs:\n- {design: cheetah, vary: ['thigh_length=0.22:0.28'], bodies: 2}\n- cheetah\n"
        "stages: [base]\nseeds: 2\n"
    )
    assert main(["study", "mine.yaml", "--toy"]) == 0
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
    worker: Fake, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    Path("own.yaml").write_text("doc: Mine.\nvalues: {}\n")
    Path("mine.yaml").write_text(TEXT.replace("[cheetah]", "['quadruped:own.yaml']"))

    def edit(name: str, request: Any) -> None:
        Path("own.yaml").write_text("doc: Mine.\nvalues: {thigh_length: 0.3}\n")

    monkeypatch.setattr(running, "make_workers", lambda *options: [Fake(edit)])
    assert main(["study", "mine.yaml"]) == 0
    assert "5 of 5 jobs are done" in capsys.readouterr().out
    folder = Path("studies/mine/runs")
    before = {run.name: open_run(run).plan.members for run in folder.iterdir()}
    assert len({robots_digest(members) for members in before.values()}) == 1
    design = next((folder / "own-base-0/designs").iterdir()).read_text()
    assert "thigh_length: 0.3\n" not in design
    monkeypatch.setattr(running, "make_workers", lambda *options: [worker])
    assert main(["study", "mine.yaml"]) == 0
    assert "4 outputs have other numbers" in capsys.readouterr().out
    assert len(worker.began) == 5
    after = open_run(folder / "own-base-0").plan.members
    assert robots_digest(after) != robots_digest(before["own-base-0"])


@pytest.mark.parametrize(
    ("text", "words", "code"),
    [
        ("designs: [cheetah, hopper]", "mine.yaml:1:20: hopper cannot be trained", BAD_INPUT),
        ("designs: [chetah]", "mine.yaml:1:11: 'chetah' names no robot or design", BAD_INPUT),
        ("designs: [cheetah, cheetah]", "mine.yaml:1:20: 'quadruped-cheetah' is listed", BAD_INPUT),
        ("designs: ['quadruped:small.yaml']", "mine.yaml:1:", REFUSED),
        (
            "designs: [{design: bear, vary: ['thigh=1:2'], bodies: 2}]",
            "mine.yaml:1:11: `vary`",
            BAD_INPUT,
        ),
    ],
)
def test_designs_that_cannot_be_studied_are_reported_with_their_place(
    text: str, words: str, code: int, capsys: pytest.CaptureFixture[str]
) -> None:
    Path("mine.yaml").write_text(text + "\n")
    Path("small.yaml").write_text(
        "doc: Its hips overlap.\n"
        "values: {thigh_length: 0.25, shank_length: 0.23, hip_offset: 0.03}\n"
    )
    assert main(["study", "mine.yaml"]) == code
    said = capsys.readouterr().err
    assert words in said
    assert "Traceback" not in said
    assert not Path("studies").exists()


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["none.yaml"], "none.yaml: file not found"),
        (["mine.yaml", "--minutes", "0"], "--minutes 0 is not a number above 0"),
        (["mine.yaml", "--dry-run", "--rate", "nan"], "--rate nan is not above 0"),
        (["mine.yaml", "--rate", "1e4"], "--rate is for --dry-run"),
        (["mine.yaml", "--workers", "0"], "--workers 0 is not a whole number from 1"),
        (["mine.yaml", "--address", "here:1"], "--address is for a Ray cluster"),
        (["mine.yaml", "--out", " "], "--out names no folder"),
        (["mine.yaml", "--out", "."], "holds no study, but mine.yaml"),
    ],
)
def test_options_that_make_no_sense_are_refused(
    arguments: list[str], words: str, capsys: pytest.CaptureFixture[str]
) -> None:
    before = sorted(Path().iterdir())
    assert main(["study", *arguments]) == BAD_INPUT
    assert words in capsys.readouterr().err
    assert sorted(Path().iterdir()) == before


def begin() -> subprocess.Popen[str]:
    return subprocess.Popen(
        [sys.executable, "-c", SLOW],
        stdout=subprocess.PIPE,
        text=True,
        env={"PYTHONPATH": f"{ROOT}:{ROOT / 'src'}", "MUJOCO_GL": "disabled"},
    )


def test_a_study_that_is_killed_again_and_again_ends_well(worker: Fake) -> None:
    for _ in range(3):
        with begin() as process:
            assert process.stdout is not None
            while "done after" not in process.stdout.readline():
                assert process.poll() is None
            process.kill()
    assert main(["study", "mine.yaml"]) == 0
    assert len(worker.began) == 2  # Each of the three did one of five.


def test_two_processes_do_not_share_a_folder(capsys: pytest.CaptureFixture[str]) -> None:
    with begin() as process:
        assert process.stdout is not None
        while "running" not in process.stdout.readline():
            assert process.poll() is None
        assert main(["study", "mine.yaml"]) == BAD_INPUT
        words = f"is running in '{Path('studies/mine').absolute()}' (process {process.pid})"
        assert words in capsys.readouterr().err
        process.kill()


def test_a_report_can_be_asked_for(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    def write(folder: Path) -> Path:
        return folder / "report/index.html"

    report: Any = types.ModuleType("draft.study.report.writing")
    report.write = write
    monkeypatch.setitem(sys.modules, "draft.study.report.writing", report)
    assert main(["study", "report", "somewhere"]) == 0
    assert capsys.readouterr().out == "report: somewhere/report/index.html\n"


def test_help_covers_both(capsys: pytest.CaptureFixture[str]) -> None:
    for words, told in ((["--help"], "--dry-run"), (["report", "--help"], "DIR")):
        with pytest.raises(SystemExit):
            main(["study", *words])
        assert told in capsys.readouterr().out
