"""`draft play` with input that is wrong, and what it writes."""

from __future__ import annotations

import socket
import subprocess
import sys
from pathlib import Path

import pytest

import draft
from draft.cli import main
from draft.learn.policy.policy import designs
from draft.learn.training.run import Run, create
from draft.model import picture
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
GO2 = Path(__file__).parents[2] / "examples/descriptions/unitree_go2/go2.urdf"


@pytest.fixture
def run() -> Run:
    """A run with files that only look like checkpoints."""
    made = create(Path("run"), plan(), {"cheetah": "values: {}\n"})
    for iteration in (2, 10):
        (made.folder / f"model_{iteration}.pt").write_bytes(b"no checkpoint")
    return made


def refused(capsys: pytest.CaptureFixture[str], *arguments: str) -> str:
    """What is said of bad input, after which nothing new may be there."""
    before = sorted(Path().rglob("*"))
    assert main(["play", *arguments]) == 2
    assert sorted(Path().rglob("*")) == before
    err = capsys.readouterr().err
    assert "Traceback" not in err
    return err


@pytest.mark.parametrize("folder", ["nowhere", "run/model_2.pt"])
def test_what_is_no_run_is_reported(
    folder: str, run: Run, capsys: pytest.CaptureFixture[str]
) -> None:
    err = refused(capsys, folder)
    assert f"'{folder}' is neither a run of 'draft train' nor a design" in err
    assert f"{', '.join(designs())}; 'draft train DESIGN' makes a run" in err


def test_a_run_without_checkpoints_is_reported(capsys: pytest.CaptureFixture[str]) -> None:
    create(Path("new"), plan(), {})
    assert "new has no checkpoint yet" in refused(capsys, "new")


def test_checkpoints_are_listed_for_one_that_is_not_there(
    run: Run, capsys: pytest.CaptureFixture[str]
) -> None:
    err = refused(capsys, "run", "--checkpoint", "7")
    assert "run has no checkpoint of iteration 7\n  checkpoints: 2, 10" in err


@pytest.mark.parametrize("seconds", ["0", "-1", "nan", "inf", "1e9"])
def test_a_length_out_of_range_is_refused(
    seconds: str, run: Run, capsys: pytest.CaptureFixture[str]
) -> None:
    assert "is not a number above 0 and of at most 600 s" in refused(
        capsys, "run", f"--seconds={seconds}"
    )


@pytest.mark.parametrize("robots", ["0", "-3", "1000000"])
def test_a_number_of_robots_out_of_range_is_refused(
    robots: str, run: Run, capsys: pytest.CaptureFixture[str]
) -> None:
    assert f"--robots {robots} is not from 1 to 64" in refused(capsys, "run", f"--robots={robots}")


@pytest.mark.parametrize("speed", ["nan", "inf", "1e6"])
def test_a_command_out_of_range_is_refused(
    speed: str, run: Run, capsys: pytest.CaptureFixture[str]
) -> None:
    assert "is not three numbers" in refused(capsys, "run", "--command", speed, "0", "0")


@pytest.mark.parametrize(
    ("arguments", "cause"),
    [
        (("--out", "a.avi"), "--out 'a.avi' does not end in .mp4"),
        (("--out", "robot/root.yaml/a.mp4"), "root.yaml is not a folder"),
        (("--out", "folder.mp4"), "--out 'folder.mp4' is a folder"),
        (("--strip", ""), "--strip '' does not end in .png"),
        (("--onnx", "robot"), "--onnx 'robot' does not end in .onnx"),
        (("--onnx", "folder.onnx"), "--onnx 'folder.onnx' is a folder"),
        (("--onnx", "a.onnx", "b.onnx"), "--onnx takes one file"),
        (("--port", "70000"), "there is no port 70000"),
    ],
)
def test_a_place_that_cannot_be_written_is_refused_at_once(
    arguments: tuple[str, ...], cause: str, run: Run, capsys: pytest.CaptureFixture[str]
) -> None:
    Path("folder.mp4").mkdir()
    Path("folder.onnx").mkdir()
    assert cause in refused(capsys, "run", *arguments)


def test_a_port_that_is_taken_is_reported(run: Run, capsys: pytest.CaptureFixture[str]) -> None:
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = taken.getsockname()[1]
        err = refused(capsys, "run", "--web", "--port", str(port))
    assert f"cannot serve on 127.0.0.1 port {port}" in err


def test_an_address_of_another_machine_is_reported(
    run: Run, capsys: pytest.CaptureFixture[str]
) -> None:
    token = ("--token", "a-token-of-20-chars_")
    err = refused(capsys, "run", "--web", "--host", "192.0.2.1", *token)
    assert "cannot serve on 192.0.2.1 port 8080" in err


def test_an_address_that_others_reach_needs_a_token(
    run: Run, capsys: pytest.CaptureFixture[str]
) -> None:
    err = refused(capsys, "run", "--web", "--host", "0.0.0.0")
    assert "'0.0.0.0' can be reached from other machines, and there is no --token" in err


@pytest.mark.parametrize(
    ("arguments", "cause"),
    [
        (("cheetah", "--robots", "3"), "--robots is for runs of 'draft train'"),
        (("cheetah", "--checkpoint", "3"), "--checkpoint is for runs of 'draft train'"),
        (("cheetah", "--step", "2"), "--step 2 is not a number from 0 to 0.6 m"),
        (("cheetah", "--kick", "nan"), "--kick nan is not a number from 0 to 100 m/s"),
        (("run", "--skill", "run"), "--skill is for designs"),
        (("run", "--kick", "2"), "--kick is for designs"),
        (("cheetah", "--out", "a.avi"), "--out 'a.avi' does not end in .mp4"),
    ],
)
def test_options_of_the_other_kind_of_policy_are_reported(
    arguments: tuple[str, ...], cause: str, run: Run, capsys: pytest.CaptureFixture[str]
) -> None:
    assert cause in refused(capsys, *arguments)


def test_a_shipped_policy_is_copied_as_onnx(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["play", "quadruped:cheetah", "--skill", "run", "--onnx"]) == 0
    assert "cheetah-run.onnx: the policy of quadruped:cheetah after" in capsys.readouterr().out
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
    done = filmed(str(tmp_path / "dog"), "--seconds", "0.4")
    assert "warning: outside the region of the policy of the family of quadrupeds" in done.stderr
    assert "dog, walk: 0.4 s at (0.47, 0.00) m/s" in done.stdout
    assert Path("dog-walk.mp4").stat().st_size > 1000


def test_a_robot_that_no_policy_drives_is_refused_in_one_line(
    capsys: pytest.CaptureFixture[str],
) -> None:
    err = refused(capsys, "humanoid")
    line = "no policy drives the joints of humanoid: the robot has 2 legs, and the policy drives 4"
    assert f"{line}\n  train one: draft train humanoid\n" in err
    shipped = str(draft.policy("cheetah").file)
    err = refused(capsys, "humanoid", "--policy", shipped)
    assert f"the policy {shipped} does not drive the joints of humanoid: the robot has 2" in err


def test_the_policy_of_a_family_is_no_file_for_another_robot(
    run: Run, capsys: pytest.CaptureFixture[str]
) -> None:
    assert "--onnx is for runs and for bear, " in refused(capsys, "quadruped", "--onnx")
    assert "--policy is for designs" in refused(capsys, "run", "--policy", "x.onnx")


def test_a_gpu_that_is_not_there_is_reported(run: Run, capsys: pytest.CaptureFixture[str]) -> None:
    torch = pytest.importorskip("torch")
    if torch.cuda.is_available():
        pytest.skip("there is a GPU")
    assert "PyTorch finds no GPU" in refused(capsys, "run", "--device", "cuda")


@pytest.mark.filterwarnings("ignore")
def test_a_broken_checkpoint_is_reported(run: Run, capsys: pytest.CaptureFixture[str]) -> None:
    pytest.importorskip("mjlab")
    err = refused(capsys, "run", "--ground", "flat")
    assert "model_10.pt cannot be read as a checkpoint" in err


@pytest.mark.filterwarnings("ignore")
def test_the_command_writes_onnx_alone_and_a_line_of_what_it_is(
    capsys: pytest.CaptureFixture[str],
) -> None:
    pytest.importorskip("mjlab")
    sound()
    assert main(["play", "walk", "--onnx"]) == 0
    assert "policy of quadruped:cheetah after 0 iterations" in capsys.readouterr().out
    assert Path("walk/policy.onnx").is_file()
    assert not Path("walk/play.mp4").exists()


def test_without_a_renderer_the_command_says_so_and_leaves_nothing(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    pytest.importorskip("mjlab")
    sound()
    monkeypatch.setenv("MUJOCO_GL", "disabled")
    monkeypatch.setattr(picture, "_failures", ["there is no renderer"])
    err = refused(capsys, "walk", "--ground", "flat", "--seconds", "0.1")
    assert "error: MuJoCo cannot draw on this machine (MUJOCO_GL is disabled)" in err


def sound() -> Run:
    """A run with an untrained policy."""
    from draft.learn.training.ppo.trainer import Trainer

    made = create(Path("walk"), plan(ground="flat"), {})
    trainer = Trainer(made, "cpu")
    trainer.keep()
    trainer.close()
    return made
