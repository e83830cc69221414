"""`draft play` with input that is wrong, and what it writes."""

from __future__ import annotations

import shlex
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

import draft
from draft.learn.policy.policy import designs, open_policy
from draft.learn.training.run import Run, create
from draft.model import picture
from tests.commands import Command
from tests.learn.small import plan

SMALL = """
import sys
from draft.cli import main
from draft.offscreen import prefer_offscreen

prefer_offscreen()
from draft.learn.policy import video

video.SIZE, video._SUNS = (160, 90), 2
sys.exit(main(["play", *sys.argv[1:]]))
"""
SHIPPED = draft.policy("cheetah").file
GO2 = Path(__file__).parents[2] / "examples/descriptions/unitree_go2/go2.urdf"


@pytest.fixture
def run() -> Run:
    """A run with files that only look like checkpoints."""
    made = create(Path("run"), plan(), {"cheetah": "values: {}\n"})
    for iteration in (2, 10):
        (made.folder / f"model_{iteration}.pt").write_bytes(b"no checkpoint")
    return made


@pytest.fixture
def refused(command: Command) -> Callable[..., str]:
    """What is said of bad input, after which nothing new may be there."""

    def ask(*words: str) -> str:
        before = sorted(Path().rglob("*"))
        err = command("play", *words, code=2).err
        assert sorted(Path().rglob("*")) == before
        return err

    return ask


NO_RUN = "is neither a run of 'draft train' nor a design"


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ("nowhere", f"'nowhere' {NO_RUN}"),
        ("run/model_2.pt", f"'run/model_2.pt' {NO_RUN}"),
        ("nowhere", f"{', '.join(designs())}; 'draft train DESIGN' makes a run"),
        ("new", "new has no checkpoint yet"),
        ("run --checkpoint 7", "run has no checkpoint of iteration 7\n  checkpoints: 2, 10"),
        *(
            (f"run --seconds={n}", "is not a number above 0 and of at most 600 s")
            for n in ("0", "-1", "nan", "inf", "1e9")
        ),
        *(
            (f"run --robots={n}", f"--robots {n} is not from 1 to 64")
            for n in ("0", "-3", "1000000")
        ),
        *((f"run --command {n} 0 0", "is not three numbers") for n in ("nan", "inf", "1e6")),
        ("run --out a.avi", "--out 'a.avi' does not end in .mp4"),
        ("run --out robot/root.yaml/a.mp4", "root.yaml is not a folder"),
        ("run --out folder.mp4", "--out 'folder.mp4' is a folder"),
        ("run --strip ''", "--strip '' does not end in .png"),
        ("run --onnx policy", "--onnx 'policy' does not end in .onnx"),
        ("run --onnx robot", "--onnx 'robot' is a folder"),
        ("run --onnx folder.onnx", "--onnx 'folder.onnx' is a folder"),
        ("run --onnx a.onnx b.onnx", "--onnx takes one file"),
        ("cheetah --robots 3", "--robots is for runs of 'draft train'"),
        ("cheetah --checkpoint 3", "--checkpoint is for runs of 'draft train'"),
        ("cheetah --skill climb --step 2", "--step 2 is not a number from 0 to 0.6 m"),
        ("cheetah --kick nan", "--kick nan is not a number from 0 to 100 m/s"),
        ("cheetah --out a.avi", "--out 'a.avi' does not end in .mp4"),
        ("run --skill run", "--skill is for designs"),
        ("run --kick 2", "--kick is for designs"),
        ("run --policy x.onnx", "--policy is for designs"),
        # The policy of a family is no file for another robot.
        ("quadruped --onnx", "--onnx is for runs, for bear, "),
        (
            "humanoid --skill climb",
            "no policy drives the joints of humanoid: the robot has 2 legs, and the policy drives "
            "4\n  train one: draft train humanoid\n",
        ),
        (
            f"humanoid --policy {SHIPPED}",
            f"the policy {SHIPPED} does not drive the joints of humanoid: the robot has 2",
        ),
    ],
)
@pytest.mark.usefixtures("run")
def test_bad_input_is_refused_at_once(words: str, said: str, refused: Callable[..., str]) -> None:
    create(Path("new"), plan(), {})
    Path("folder.mp4").mkdir()
    Path("folder.onnx").mkdir()
    assert said in refused(*shlex.split(words))


def test_the_policy_of_all_legs_is_written_for_one_robot(command: Command) -> None:
    pytest.importorskip("onnx")
    assert "hexapod-walk.onnx" in command("play hexapod --onnx").out
    written, shipped = open_policy("hexapod-walk.onnx"), draft.policy("hexapod")
    seen = np.random.default_rng(0).normal(size=(5, 66))
    assert written(seen) == pytest.approx(shipped(seen), abs=1e-6)
    for name in ("joints", "terms", "control_period", "contact_time"):
        assert getattr(written, name) == getattr(shipped, name)
    for name in ("home", "stiffness", "damping", "stall_torque", "no_load_speed", "action_scale"):
        assert getattr(written, name) == pytest.approx(getattr(shipped, name))


def test_a_shipped_policy_is_copied_as_onnx(command: Command) -> None:
    out = command("play quadruped:cheetah --skill run --onnx").out
    assert "cheetah-run.onnx: the policy of quadruped:cheetah after" in out
    assert Path("cheetah-run.onnx").read_bytes() == draft.policy("cheetah", "run").file.read_bytes()
    assert not Path("cheetah-run.mp4").exists()


def filmed(*words: str) -> subprocess.CompletedProcess[str]:
    """Run `draft play` in a process that films small pictures: how MuJoCo draws is settled there.

    Besides, Triton, which tests of learning load, cannot be loaded after Mesa's LLVM.
    """
    pytest.importorskip("imageio_ffmpeg")
    done = subprocess.run(
        [sys.executable, "-c", SMALL, *words], capture_output=True, text=True, check=False
    )
    if "MuJoCo cannot draw on this machine" in done.stderr:
        pytest.skip(done.stderr)
    assert done.returncode == 0, done.stderr
    return done


def test_a_shipped_policy_is_filmed() -> None:
    done = filmed("cheetah", "--seconds", "0.4", "--strip", "a.png")
    assert "quadruped:cheetah, walk: 0.4 s at (0.50, 0.00) m/s" in done.stdout
    assert Path("cheetah-walk.mp4").stat().st_size > 1000
    assert Path("a.png").is_file()


def test_an_import_is_filmed_and_what_lies_outside_is_said(tmp_path: Path) -> None:
    draft.import_robot(GO2, out=tmp_path / "dog")
    design = tmp_path / "dog/designs/loaded.yaml"
    design.parent.mkdir(exist_ok=True)
    design.write_text("doc: With a load.\nvalues: {payload: 40}\n", encoding="utf-8")
    done = filmed(f"{tmp_path / 'dog'}:loaded", "--seconds", "0.4")
    assert "warning: outside the region of the policy of the family of quadrupeds" in done.stderr
    assert "loaded, walk: 0.4 s at (0.47, 0.00) m/s" in done.stdout
    (video,) = Path().glob("*-walk.mp4")
    assert video.stat().st_size > 1000


@pytest.mark.usefixtures("run")
def test_a_gpu_that_is_not_there_is_reported(refused: Callable[..., str]) -> None:
    torch = pytest.importorskip("torch")
    if torch.cuda.is_available():
        pytest.skip("there is a GPU")
    assert "PyTorch finds no GPU" in refused("run", "--device", "cuda")


@pytest.mark.filterwarnings("ignore")
@pytest.mark.usefixtures("run")
def test_a_broken_checkpoint_is_reported(refused: Callable[..., str]) -> None:
    pytest.importorskip("mjlab")
    err = refused("run", "--ground", "flat")
    assert "model_10.pt cannot be read as a checkpoint" in err


@pytest.mark.filterwarnings("ignore")
def test_an_untrained_policy_is_written_as_onnx_and_not_filmed_without_a_renderer(
    refused: Callable[..., str], command: Command, monkeypatch: pytest.MonkeyPatch
) -> None:
    pytest.importorskip("mjlab")
    from draft.learn.training.ppo.trainer import Trainer

    trainer = Trainer(create(Path("walk"), plan(ground="flat"), {}), "cpu")
    trainer.keep()
    trainer.close()
    monkeypatch.setenv("MUJOCO_GL", "disabled")
    monkeypatch.setattr(picture, "_failures", ["there is no renderer"])
    err = refused("walk", "--ground", "flat", "--seconds", "0.1")
    assert "error: MuJoCo cannot draw on this machine (MUJOCO_GL is disabled)" in err
    assert "policy of quadruped:cheetah after 0 iterations" in command("play walk --onnx").out
    assert Path("walk/policy.onnx").is_file()
    assert not Path("walk/play.mp4").exists()
