"""`draft train` as a newcomer uses it, in the same process."""

from __future__ import annotations

import csv
import importlib.util
import signal
from pathlib import Path

import pytest

from draft.cli import BAD_INPUT, INTERRUPTED, REFUSED, main
from draft.extras import remedy
from draft.files import lock
from tests.written import edit, write_robot

SMALL = (
    # Several processes are tests/learn/engine/test_ranks.py's.
    *("--envs", "4", "--device", "cpu", "--replicas", "1", "--ground", "uneven", "--set"),
    *("learning.steps=4", "learning.hidden=16,16", "ground.rows=4", "ground.border=2"),
)
needs_mjlab = pytest.mark.skipif(
    importlib.util.find_spec("mjlab") is None, reason="mjlab is not installed"
)


@pytest.fixture(autouse=True)
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)


@pytest.fixture
def brief_review(monkeypatch: pytest.MonkeyPatch) -> None:
    """The review after a training lasts one second instead of eight."""
    pytest.importorskip("mjlab")
    from draft.learn.measuring.rollout import review

    monkeypatch.setattr(review, "SECONDS", 1.0)


@needs_mjlab
@pytest.mark.usefixtures("brief_review")
def test_a_run_is_trained_gone_on_with_and_then_done(capsys: pytest.CaptureFixture[str]) -> None:
    command = ["train", "cheetah", "--iterations", "2", *SMALL]
    assert main([*command, "--minutes", "1e-9"]) == 0
    said = capsys.readouterr().out
    assert "quadruped:cheetah: stage base, seed 0, to runs/cheetah-base-0" in said
    assert "on the CPU (" in said
    assert ", 4 worlds\n" in said
    assert "stopped: 0 of 2 iterations are kept, no policy; the same command resumes\n" in said
    assert main(command) == 0
    said = capsys.readouterr().out
    assert "iteration 2/2" in said
    assert "linear_velocity" in said
    assert "after 0.0 min of training, 0.0 million steps:\n  asked for 0.25 m/s: walks at" in said
    assert "it does not walk as asked at 0.25, 0.5, 0.75, 1 m/s yet" in said
    assert "repeat the command with --iterations 4\n" in said
    assert "see it with: draft play runs/cheetah-base-0\n" in said
    assert main(command) == 0
    assert capsys.readouterr().out == "runs/cheetah-base-0: 2 of 2 iterations are done\n"
    assert main(["train", "runs/cheetah-base-0", "--iterations", "3", "--device", "cpu"]) == 0
    assert "iteration 3/3" in capsys.readouterr().out
    with Path("runs/cheetah-base-0/progress.csv").open() as file:
        assert [row["iteration"] for row in csv.DictReader(file)] == ["1", "2", "3"]
    assert list(Path("runs/cheetah-base-0/tensorboard").glob("events*"))
    assert "Active Reward Terms" in Path("runs/cheetah-base-0/environment.txt").read_text()


@needs_mjlab
def test_ctrl_c_keeps_the_policy_and_says_so_and_who_uses_it_says_it_is_unfinished(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    from draft.learn.training.progress import LinePrinter

    def interrupt(self: LinePrinter, progress: object) -> None:
        signal.raise_signal(signal.SIGINT)

    command = ["train", "cheetah", "--iterations", "3", *SMALL]
    with monkeypatch.context() as patch:
        patch.setattr(LinePrinter, "report", interrupt)
        assert main(command) == INTERRUPTED
    assert capsys.readouterr().err == (
        "interrupted: 1 of 3 iterations are kept, with a policy of iteration 1; "
        "the same command resumes\n"
    )
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler
    unfinished = (
        "policy: iteration 1 of 3, unfinished: 'draft train runs/cheetah-base-0 --iterations 3' "
        "continues the training\n"
    )
    assert main(["play", "runs/cheetah-base-0", "--onnx"]) == 0
    assert capsys.readouterr().out.startswith(unfinished)
    few = ["--replicas", "2", "--levels", "1", "--seconds", "1"]
    assert main(["evaluate", "runs/cheetah-base-0", *few]) == 0
    assert capsys.readouterr().out.startswith(f"runs/cheetah-base-0: {unfinished}")
    push = ["train", "cheetah", "--stage", "push", "--iterations", "1", "--no-review", *SMALL]
    assert main(push) == 0
    assert f"starts from runs/cheetah-base-0, {unfinished}" in capsys.readouterr().out


@needs_mjlab
@pytest.mark.usefixtures("brief_review")
def test_a_later_stage_finds_the_base_run_beside_it(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["train", "cheetah", "--iterations", "1", *SMALL]) == 0
    assert main(["train", "cheetah", "--stage", "push", "--iterations", "1", *SMALL]) == 0
    capsys.readouterr()
    assert main(["train", "bear", "--stage", "push", *SMALL]) == BAD_INPUT
    assert "there is no run runs/bear-base-0" in capsys.readouterr().err
    from_cheetah = ["train", "bear", "--stage", "push", "--from", "runs/cheetah-base-0", *SMALL]
    assert main(from_cheetah) == BAD_INPUT
    assert "is a run of quadruped:cheetah, which differs from the design" in capsys.readouterr().err
    assert not Path("runs/bear-push-0").exists()


@needs_mjlab
@pytest.mark.usefixtures("brief_review")
def test_a_run_is_one_processs_at_a_time(capsys: pytest.CaptureFixture[str]) -> None:
    command = ["train", "cheetah", "--iterations", "1", *SMALL]
    assert main([*command, "--minutes", "1e-9"]) == 0
    with lock(Path("runs/cheetah-base-0"), "draft train"):
        assert main(command) == BAD_INPUT
    assert "another training is running" in capsys.readouterr().err
    assert main(command) == 0


@needs_mjlab
@pytest.mark.usefixtures("brief_review")
def test_a_family_is_drawn_and_trained_in_one_simulation(
    capsys: pytest.CaptureFixture[str],
) -> None:
    vary = ["--vary", "thigh_length=0.2:0.3", "--bodies", "3", "--see-design"]
    assert main(["train", "quadruped", *vary, "--iterations", "1", *SMALL]) == 0
    assert "quadruped-3-bodies-base-0" in capsys.readouterr().out
    assert len(list(Path("runs/quadruped-3-bodies-base-0/designs").iterdir())) == 3
    assert main(["train", "cheetah", "bear", "--iterations", "1", *SMALL]) == 0
    assert Path("runs/cheetah-and-1-more-base-0/resume.pt").exists()


def test_a_design_that_the_filter_refuses_is_not_trained(
    capsys: pytest.CaptureFixture[str],
) -> None:
    assert main(["train", "cheetah", "--set", "hip_offset=0.03"]) == REFUSED
    assert "refused" in capsys.readouterr().err
    assert not Path("runs").exists()


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["chetah"], "did you mean 'cheetah'?"),
        (["hopper"], "hopper cannot be trained: it has one leg with a knee and a foot"),
        (["cheetah", "hopper"], "hopper cannot be trained"),
        (["cheetah", "--iterations", "0"], "--iterations 0 is not a whole number from 1 to"),
        (["cheetah", "--envs", "-4"], "--envs -4 is not a whole number from 1 to"),
        (["cheetah", "--minutes", "nan"], "--minutes nan is not a number above 0"),
        (["cheetah", "--seed", "-1"], "--seed -1 is not a whole number from 0"),
        (["cheetah", "--set", "rewards.heigt=3"], "did you mean 'rewards.height'?"),
        (["cheetah", "--set", "rewards.height=tall"], "'tall' is not a value of rewards.height"),
        (["cheetah", "--set", "ground.step=1,2,3"], "such as [0.0, 0.14]"),
        (["cheetah", "--set", "learning.mirror=perhaps"], "such as false"),
        (["cheetah", "--set", "velocity.pushed=3"], "velocity.pushed must be a share, 0 to 1"),
        (["cheetah", "--set", "thigh=3"], "thigh_length"),
        (["quadruped", "--vary", "thigh_length=0.2:0.3"], "--bodies is missing"),
        (["cheetah", "--bodies", "5000"], "--bodies 5000 is not a whole number from 1 to 4096"),
        (["quadruped", "--bodies", "3"], "--bodies draws designs, but nothing is varied"),
        (["cheetah", "bear", "--envs", "1"], "1 world cannot hold 2 designs"),
        (["cheetah", "--from", "nowhere"], "there is no policy 'nowhere' to start from"),
        (["cheetah", "--from", "nowhere"], "name the folder of a run, an ONNX file, 'family'"),
        (["cheetah", "--from", "nowhere.onnx"], "cannot read nowhere.onnx"),
        (["humanoid", "--from", "family"], "does not drive the joints of humanoid"),
        (["cheetah", "--out", " "], "--out names no folder"),
        (["cheetah", "--stage", "push"], "--from scratch"),
    ],
)
def test_what_cannot_be_trained_is_explained(
    arguments: list[str], words: str, capsys: pytest.CaptureFixture[str]
) -> None:
    if "--from" in arguments or "--out" in arguments or "--stage" in arguments:
        pytest.importorskip("torch")
    assert main(["train", *arguments]) == BAD_INPUT
    said = capsys.readouterr().err
    assert words in said
    assert "Traceback" not in said
    assert not Path("runs").exists()


def test_without_the_extra_its_name_is_reported(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(__import__("sys").modules, "torch", None)
    assert main(["train", "cheetah"]) == BAD_INPUT
    assert remedy("learn") in capsys.readouterr().err
    assert not Path("runs").exists()


def test_a_robot_of_ones_own_is_refused_with_its_reason(
    capsys: pytest.CaptureFixture[str],
) -> None:
    write_robot(Path("mine"))
    edit(Path("mine"), "parameters.yaml", "name: monoped", "name: mine")
    assert main(["train", "mine"]) == BAD_INPUT
    assert "mine cannot be trained" in capsys.readouterr().err
