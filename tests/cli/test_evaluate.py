"""`draft evaluate` as a newcomer uses it, in the same process."""

from __future__ import annotations

import importlib.util
import json
from pathlib import Path

import pytest

from draft.cli import BAD_INPUT, main
from draft.learn.training.run import create
from tests.learn.small import plan

needs_mjlab = pytest.mark.skipif(
    importlib.util.find_spec("mjlab") is None or importlib.util.find_spec("pyarrow") is None,
    reason="mjlab or pyarrow is not installed",
)

GO2 = Path(__file__).parents[2] / "examples/descriptions/unitree_go2/go2.urdf"


@pytest.fixture(autouse=True)
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)


def refused(capsys: pytest.CaptureFixture[str], *words: str) -> str:
    assert main(["evaluate", *words]) == BAD_INPUT
    return capsys.readouterr().err


@needs_mjlab
def test_a_run_is_evaluated_once(capsys: pytest.CaptureFixture[str]) -> None:
    small = [
        *("--ground", "flat", "--envs", "4", "--device", "cpu", "--replicas", "1", "--no-review"),
        *("--set", "learning.steps=4", "learning.hidden=16,16"),
    ]
    assert main(["train", "cheetah", "--iterations", "1", *small]) == 0
    capsys.readouterr()
    command = ["evaluate", "runs/cheetah-base-0", "--replicas", "2", "--seconds", "0.5"]
    command += ["--device", "cpu"]
    assert main(command) == 0
    said = capsys.readouterr().out
    assert said.startswith("runs/cheetah-base-0: policy: iteration 1 of 1\n")
    assert "runs/cheetah-base-0: walk on cpu" in said
    assert "survival" in said
    file = Path("runs/cheetah-base-0/evaluation/nominal-walking/summary.json")
    summary = json.loads(file.read_text())
    of_energy = {f"walk_{name}" for name in ("cost_of_transport", "endurance", "range")}
    assert set(summary["scalars"]) == {"walk_speed", "walk_survival"} | of_energy
    assert summary["supply"]["energy_wh"] == pytest.approx(531, abs=1)
    assert (summary["stage"], summary["replicas"], summary["device"]) == ("base", 2, "cpu")
    before = file.stat().st_mtime_ns
    assert main(command) == 0
    assert ": exists; add --again to repeat it" in capsys.readouterr().out
    assert file.stat().st_mtime_ns == before
    now = summary["versions"]["mujoco"]
    file.write_text(json.dumps(summary | {"versions": summary["versions"] | {"mujoco": "1.2.3"}}))
    assert main(command) == 0
    assert f": exists, made before mujoco 1.2.3 -> {now}; " in capsys.readouterr().out
    before = file.stat().st_mtime_ns
    # Other inertia errors are another question.
    perturbed = Path("runs/cheetah-base-0/evaluation/perturbed-walking/summary.json")
    for more, told, again in (
        ([], "twins", False),
        (["--errors", "twins"], "twins", True),
        (["--errors", "paper"], "paper", False),
    ):
        assert main([*command, "--perturbed", *more]) == 0
        assert (": exists" in capsys.readouterr().out) == again
        assert json.loads(perturbed.read_text())["errors"] == told
    assert file.stat().st_mtime_ns == before
    # A load is another question, answered beside it.
    assert main([*command, "--payload", "10"]) == 0
    assert "cheetah seed 0 with 10 kg" in " ".join(capsys.readouterr().out.split())
    loaded = Path("runs/cheetah-base-0/evaluation-payload-10kg/nominal-walking/summary.json")
    assert json.loads(loaded.read_text())["payload"] == 10
    assert file.stat().st_mtime_ns == before


@needs_mjlab
def test_a_design_is_evaluated_with_a_policy(capsys: pytest.CaptureFixture[str]) -> None:
    import draft

    draft.import_robot(GO2, out="dog")
    command = ["evaluate", "dog", "--replicas", "1", "--seconds", "0.5", "--device", "cpu"]
    assert main([*command, "--levels", "2"]) == 0
    said = capsys.readouterr().out
    assert "out/dog-family: the family of quadrupeds: policy: iteration 500\n" in said
    assert "out/dog-family: walk, speed, push on cpu" in said
    file = Path("out/dog-family/evaluation/nominal-walking/summary.json")
    summary = json.loads(file.read_text())
    assert (summary["design"], summary["members"]) == ("dog", ["dog"])
    assert summary["scalars"]["walk_survival"] == 1
    assert any(text.startswith("speed: trained up to 6.32 m/s") for text in summary["flags"])
    assert main([*command, "--levels", "2"]) == 0
    assert ": exists; add --again to repeat it" in capsys.readouterr().out
    policy = str(draft.policy("cheetah", "walk").file)  # It does not observe its design.
    more = ["--test", "walk", "--policy", policy, "--out", "there"]
    assert main([*command, *more]) == 0
    assert Path("there/dog-cheetah-walk/nominal-walking/summary.json").is_file()
    assert "humanoid: the robot has 2 legs" in refused(capsys, "humanoid")
    assert "--checkpoint is for runs" in refused(capsys, "dog", "--checkpoint", "3")


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["run", "--policy", "x.onnx"], "--policy is for designs"),
        ([], "no run is named"),
        (["nowhere"], "'nowhere' is neither a run of 'draft train' nor a design"),
        (["run"], "run has no checkpoint yet"),
        (["run", "--test", "swim"], "--test 'swim' is not known\n  choose from: push, speed"),
        (["run", "--test", " , "], "--test [] is not names among walk"),
        (["run", "--test", "speed"], "is for policies of stage velocity, and run is of stage"),
        (["run", "--levels", "x"], "--levels 'x' is not a number of levels, or levels above 0"),
        (["run", "--replicas", "0"], "--replicas 0 is not a whole number from 1"),
        (["run", "--seconds", "0.1"], "--seconds 0.1 is not"),
        (["run", "--seed", "-1"], "--seed -1 is not"),
        (["run", "--payload", "-1"], "--payload -1 is not"),
        (["run", "--regeneration", "2"], "--regeneration 2 is not"),
        (["run", "--out", " "], "--out names no folder"),
        (["run", "--errors", "paper"], "--errors paper has no effect without --perturbed"),
        (["run", "--errors", "twins"], "add --perturbed, or omit --errors"),
    ],
)
def test_bad_input_is_reported(
    capsys: pytest.CaptureFixture[str], words: list[str], message: str
) -> None:
    create(Path("run"), plan(), {})
    assert message in refused(capsys, *words)


def test_an_unknown_source_of_inertia_errors_is_reported_with_those_that_there_are(
    capsys: pytest.CaptureFixture[str],
) -> None:
    create(Path("run"), plan(), {})
    with pytest.raises(SystemExit) as ended:
        main(["evaluate", "run", "--perturbed", "--errors", "papr"])
    assert ended.value.code == BAD_INPUT
    said = capsys.readouterr().err
    assert all(word in said for word in ("papr", "twins", "survey", "paper"))


def test_a_checkpoint_that_is_not_there_is_reported(capsys: pytest.CaptureFixture[str]) -> None:
    create(Path("run"), plan(), {})
    Path("run/model_2.pt").write_bytes(b"")
    said = refused(capsys, "run", "--checkpoint", "5")
    assert "run has no checkpoint of iteration 5\n  checkpoints: 2" in said


def test_each_run_takes_the_tests_of_its_stage_and_none_is_left(
    capsys: pytest.CaptureFixture[str],
) -> None:
    create(Path("base"), plan(), {})
    create(Path("push"), plan(stage="push"), {})
    both = "base", "push"
    assert "'walk' is for policies of stage base, and push" in refused(
        capsys, *both, "--test", "walk"
    )
    left = refused(capsys, *both, "--test", "walk,push,speed")
    assert "'speed' is for policies of stage velocity" in left


def test_runs_of_other_topologies_are_refused(capsys: pytest.CaptureFixture[str]) -> None:
    from dataclasses import replace

    of = plan()
    other = replace(of.members[0], name="odd", feet=("a", "b", "c", "d"))
    create(Path("one"), of, {})
    create(Path("two"), replace(of, members=(other,)), {})
    said = refused(capsys, "one", "two")
    assert "one and two cannot be evaluated together: odd has another topology" in said


def test_runs_of_one_name_do_not_share_a_folder(capsys: pytest.CaptureFixture[str]) -> None:
    create(Path("a/run"), plan(), {})
    create(Path("b/run"), plan(), {})
    assert "named 'run'" in refused(capsys, "a/run", "b/run", "--out", "results")
