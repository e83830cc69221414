"""`draft evaluate` as a newcomer uses it, in the same process."""

from __future__ import annotations

import importlib.util
import json
from dataclasses import replace
from pathlib import Path

import pytest

import draft
from draft.learn.training.run import create
from tests.commands import Command
from tests.learn.small import plan

needs_mjlab = pytest.mark.skipif(
    importlib.util.find_spec("mjlab") is None or importlib.util.find_spec("pyarrow") is None,
    reason="mjlab or pyarrow is not installed",
)

GO2 = Path(__file__).parents[2] / "examples/descriptions/unitree_go2/go2.urdf"


@needs_mjlab
def test_a_run_is_evaluated_once(command: Command) -> None:
    small = "--ground flat --envs 4 --device cpu --replicas 1 --no-review --set learning.steps=4"
    command(f"train cheetah --iterations 1 {small} learning.hidden=16,16")
    asked = "evaluate runs/cheetah-base-0 --replicas 2 --seconds 0.5 --device cpu"
    said = command(asked).out
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
    assert ": exists; add --again to repeat it" in command(asked).out
    assert file.stat().st_mtime_ns == before
    now = summary["versions"]["mujoco"]
    file.write_text(json.dumps(summary | {"versions": summary["versions"] | {"mujoco": "1.2.3"}}))
    assert f": exists, made before mujoco 1.2.3 -> {now}; " in command(asked).out
    before = file.stat().st_mtime_ns
    # Other inertia errors are another question.
    perturbed = Path("runs/cheetah-base-0/evaluation/perturbed-walking/summary.json")
    for more, told, again in (
        ("", "twins", False),
        ("--errors twins", "twins", True),
        ("--errors paper", "paper", False),
    ):
        said = command(f"{asked} --perturbed {more}").out
        assert (": exists" in said) == again
        assert json.loads(perturbed.read_text())["errors"] == told
    # A load is another question, answered beside it.
    said = command(f"{asked} --payload 10").out
    assert "cheetah seed 0 with 10 kg" in " ".join(said.split())
    loaded = Path("runs/cheetah-base-0/evaluation-payload-10kg/nominal-walking/summary.json")
    assert json.loads(loaded.read_text())["payload"] == 10
    assert file.stat().st_mtime_ns == before


@needs_mjlab
def test_a_design_is_evaluated_with_a_policy(command: Command) -> None:
    draft.import_robot(GO2, out="dog")
    asked = "evaluate dog --replicas 1 --seconds 0.5 --device cpu --levels 2"
    said = command(asked).out
    assert "out/dog-family: the family of quadrupeds: policy: iteration 1500\n" in said
    assert "out/dog-family: walk, speed, push on cpu" in said
    file = Path("out/dog-family/evaluation/nominal-walking/summary.json")
    summary = json.loads(file.read_text())
    assert (summary["design"], summary["members"]) == ("dog", ["dog"])
    assert summary["scalars"]["walk_survival"] == 1
    assert any(text.startswith("speed: trained up to 4.19 m/s") for text in summary["flags"])
    assert ": exists; add --again to repeat it" in command(asked).out
    policy = draft.policy("cheetah", "walk").file  # It does not observe its design.
    command(f"{asked} --test walk --policy {policy} --out there")
    assert Path("there/dog-cheetah-walk/nominal-walking/summary.json").is_file()
    assert "hopper cannot be trained: it has one leg" in command("evaluate hopper", code=2).err
    assert "--checkpoint is for runs" in command.refuses("evaluate dog --checkpoint 3")


@pytest.mark.parametrize(
    ("words", "message"),
    [
        ("run --policy x.onnx", "--policy is for designs"),
        ("", "no run is named"),
        ("nowhere", "'nowhere' is neither a run of 'draft train' nor a design"),
        ("run", "run has no checkpoint yet"),
        ("push --checkpoint 5", "push has no checkpoint of iteration 5\n  checkpoints: 2"),
        ("run --test swim", "--test 'swim' is not known\n  choose from: push, speed"),
        ("run --test ' , '", "--test [] is not names among walk"),
        ("run --test speed", "is for policies of stage velocity, and run is of stage"),
        # Each run takes the tests of its stage, and none is left.
        ("run push --test walk", "'walk' is for policies of stage base, any, and push"),
        ("run push --test walk,push,speed", "'speed' is for policies of stage velocity"),
        ("run odd", "run and odd cannot be evaluated together: odd has another topology"),
        ("run a/run --out results", "named 'run'"),
        ("run --levels x", "--levels 'x' is not a number of levels, or levels above 0"),
        ("run --replicas 0", "--replicas 0 is not a whole number from 1"),
        ("run --seconds 0.1", "--seconds 0.1 is not"),
        ("run --seed -1", "--seed -1 is not"),
        ("run --payload -1", "--payload -1 is not"),
        ("run --regeneration 2", "--regeneration 2 is not"),
        ("run --out ' '", "--out names no folder"),
        ("run --errors paper", "--errors paper has no effect without --perturbed"),
        ("run --errors twins", "add --perturbed, or omit --errors"),
    ],
)
def test_bad_input_is_reported(command: Command, words: str, message: str) -> None:
    of = plan()
    other = replace(of.members[0], name="odd", feet=("a", "b", "c", "d"))
    for name, made in {
        "run": of,
        "a/run": of,
        "push": plan(stage="push"),
        "odd": replace(of, members=(other,)),
    }.items():
        create(Path(name), made, {})
    Path("push/model_2.pt").write_bytes(b"")
    assert message in command.refuses(f"evaluate {words}")
