"""`draft train` as a newcomer uses it, in the same process."""

from __future__ import annotations

import csv
import importlib.util
import signal
from functools import partial
from pathlib import Path

import pytest

from draft.cli import BAD_INPUT, INTERRUPTED, REFUSED
from draft.files import lock
from tests.commands import Command

SMALL = (
    # Several processes are tests/learn/engine/test_ranks.py's.
    *("--envs", "4", "--device", "cpu", "--replicas", "1", "--ground", "uneven", "--set"),
    *("learning.steps=4", "learning.hidden=16,16", "ground.rows=4", "ground.border=2"),
)
needs_mjlab = pytest.mark.skipif(
    importlib.util.find_spec("mjlab") is None, reason="mjlab is not installed"
)


@pytest.fixture
def small_review(monkeypatch: pytest.MonkeyPatch) -> None:
    """The review after a training has four robots at each level instead of 64."""
    pytest.importorskip("mjlab")
    from draft.learn.measuring.rollout import review

    for name in ("review", "before"):
        monkeypatch.setattr(review, name, partial(getattr(review, name), replicas=4))


@needs_mjlab
@pytest.mark.usefixtures("small_review")
def test_a_run_is_trained_gone_on_with_and_then_done(command: Command) -> None:
    asked = ("train cheetah --iterations 2", *SMALL)
    said = command(*asked, "--minutes", "1e-9").out
    assert "quadruped:cheetah: stage base, seed 0, to runs/cheetah-base-0" in said
    assert "on the CPU (" in said
    assert ", 4 worlds\n" in said
    assert "stopped: 0 of 2 iterations are kept, no policy; the same command resumes\n" in said
    with lock(Path("runs/cheetah-base-0"), "draft train"):
        assert "another training is running" in command(*asked, code=BAD_INPUT).err
    said = command(*asked).out
    assert "iteration 2/2" in said
    assert "linear_velocity" in said
    assert "after 0.0 min of training, 0.0 million steps:\n  asked for 0.25 m/s: walks at" in said
    assert "it does not walk as asked at 0.25, 0.5, 0.75, 1 m/s yet" in said
    assert "repeat the command with --iterations 4\n" in said
    assert "see it with: draft play runs/cheetah-base-0\n" in said
    assert command(*asked).out == "runs/cheetah-base-0: 2 of 2 iterations are done\n"
    out = command("train runs/cheetah-base-0 --iterations 3 --device cpu").out
    assert "iteration 3/3" in out
    with Path("runs/cheetah-base-0/progress.csv").open() as file:
        assert [row["iteration"] for row in csv.DictReader(file)] == ["1", "2", "3"]
    assert list(Path("runs/cheetah-base-0/tensorboard").glob("events*"))
    assert "Active Reward Terms" in Path("runs/cheetah-base-0/environment.txt").read_text()


@needs_mjlab
def test_ctrl_c_keeps_the_policy_and_later_stages_and_others_say_that_it_is_unfinished(
    command: Command, monkeypatch: pytest.MonkeyPatch
) -> None:
    from draft.learn.training.progress import LinePrinter

    def interrupt(self: LinePrinter, progress: object) -> None:
        signal.raise_signal(signal.SIGINT)

    with monkeypatch.context() as patch:
        patch.setattr(LinePrinter, "report", interrupt)
        said = command("train cheetah --iterations 3", *SMALL, code=INTERRUPTED)
    assert said.err == (
        "interrupted: 1 of 3 iterations are kept, with a policy of iteration 1; "
        "the same command resumes\n"
    )
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler
    run = "runs/cheetah-base-0"
    unfinished = (
        f"policy: iteration 1 of 3, unfinished: 'draft train {run} --iterations 3' "
        "continues the training\n"
    )
    assert command(f"play {run} --onnx").out.startswith(unfinished)
    said = command(f"evaluate {run} --replicas 2 --levels 1 --seconds 1").out
    assert said.startswith(f"{run}: {unfinished}")
    # A later stage finds the base run beside it.
    push = "train cheetah --stage push --iterations 1 --no-review"
    assert f"starts from {run}, {unfinished}" in command(push, *SMALL).out
    err = command("train bear --stage push", *SMALL, code=BAD_INPUT).err
    assert "there is no run runs/bear-base-0" in err
    err = command(f"train bear --stage push --from {run}", *SMALL, code=BAD_INPUT).err
    assert "is a run of quadruped:cheetah, which differs from the design" in err
    assert not Path("runs/bear-push-0").exists()


@needs_mjlab
@pytest.mark.usefixtures("small_review")
def test_a_family_is_drawn_and_trained_in_one_simulation(command: Command) -> None:
    vary = "--vary thigh_length=0.2:0.3 --bodies 3 --see-design --iterations 1"
    assert "quadruped-3-bodies-base-0" in command(f"train quadruped {vary}", *SMALL).out
    assert len(list(Path("runs/quadruped-3-bodies-base-0/designs").iterdir())) == 3
    command("train cheetah bear --iterations 1", *SMALL)
    assert Path("runs/cheetah-and-1-more-base-0/resume.pt").exists()


@pytest.mark.parametrize(
    ("words", "said", "code"),
    [
        ("cheetah --set hip_offset=0.03", "refused", REFUSED),
        *(
            (*case, BAD_INPUT)
            for case in (
                ("chetah", "did you mean 'cheetah'?"),
                ("hopper", "hopper cannot be trained: it has one leg with a knee and a foot"),
                ("cheetah hopper", "hopper cannot be trained"),
                ("robot", "monoped cannot be trained"),
                # Ranges of numbers: tests/learn/test_training_options.py.
                ("cheetah --minutes nan", "--minutes nan is not a number above 0"),
                ("cheetah --set rewards.heigt=3", "did you mean 'rewards.height'?"),
                ("cheetah --set rewards.height=tall", "'tall' is not a value of rewards.height"),
                ("cheetah --set ground.step=1,2,3", "such as [0.0, 0.14]"),
                ("cheetah --set learning.mirror=perhaps", "such as false"),
                ("cheetah --set velocity.pushed=3", "velocity.pushed must be a share, 0 to 1"),
                ("cheetah --set thigh=3", "thigh_length"),
                ("quadruped --vary thigh_length=0.2:0.3", "--bodies is missing"),
                ("cheetah --bodies 5000", "--bodies 5000 is not a whole number from 1 to 4096"),
                ("quadruped --bodies 3", "--bodies draws designs, but nothing is varied"),
                ("cheetah bear --envs 1", "1 world cannot hold 2 designs"),
                ("cheetah --from nowhere", "there is no policy 'nowhere' to start from"),
                (
                    "cheetah --from nowhere",
                    "name the folder of a run, an ONNX file, 'any', 'family'",
                ),
                ("cheetah --from nowhere.onnx", "cannot read nowhere.onnx"),
                ("humanoid --from family", "does not drive the joints of humanoid"),
                ("cheetah --out ' '", "--out names no folder"),
                ("cheetah --stage push", "--from scratch"),
            )
        ),
    ],
)
def test_what_cannot_be_trained_is_explained(
    words: str, said: str, code: int, command: Command
) -> None:
    if any(option in words for option in ("--from", "--out", "--stage")):
        pytest.importorskip("torch")
    assert said in command(f"train {words}", code=code).err
    assert not Path("runs").exists()
