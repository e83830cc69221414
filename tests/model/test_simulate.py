"""The simulated home pose: what stands, what falls, and what is broken on purpose."""

# pyright: reportAttributeAccessIssue=false
# (MuJoCo's compiled modules carry no types.)
from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
import pytest

import draft
from docs import blocks
from draft.cli import main
from draft.model import simulate as simulation
from draft.values import scalar
from tests.helpers import ids, leg, robot
from tests.model.shipped import SHIPPED, built

SIMULATED = {"start_penetration", "unstable_servo", "weak_servo", "falls"}


def four(x: float = 0.2, y: float = 0.15) -> list[dict[str, Any]]:
    """Four legs below the corners of the trunk."""
    corners = [("FL", x, y), ("FR", x, -y), ("RL", -x, y), ("RR", -x, -y)]
    return [{"chain": "leg", "prefix": f"{n}_", "at": [a, b, -0.1]} for n, a, b in corners]


def simulated(spec: draft.Spec, **values: Any) -> dict[str, draft.Finding]:
    """Findings of a simulation, the first of each kind."""
    found = spec.resolve(values).build().simulate().findings
    return {finding.id: finding for finding in reversed(found) if finding.id in SIMULATED}


@pytest.mark.parametrize(("name", "design"), SHIPPED)
def test_shipped_robots_stand_except_the_one_on_one_leg(name: str, design: str | None) -> None:
    found = {one.id: one for one in built(name, design).simulate().findings if one.id in SIMULATED}
    assert set(found) == ({"falls"} if name == "hopper" else set())
    if name == "hopper":
        assert "one point takes a controller" in found["falls"].message


@pytest.mark.parametrize(
    ("page", "robots"),
    [
        ("howto/biped", {"biped": set()}),
        ("howto/hexapod", {"hexapod": set()}),
        ("howto/arm", {"arm_dog": set()}),
        ("agents", {"monoped": {"falls"}, "rover": set()}),
    ],
)
def test_robots_of_the_pages_stand_as_the_pages_say(
    page: str, robots: dict[str, set[str]], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    blocks.copy_examples(tmp_path)
    for block in blocks.blocks(blocks.DOCS / f"{page}.md"):
        if block.language == "yaml" and block.mark != blocks.SHOWN:
            blocks.write(block.text)
        for words in blocks.commands(block) if block.language == "sh" else ():
            if words[:2] == ["draft", "new"]:
                assert main(words[1:]) == 0
    assert {name: set(simulated(draft.load(name))) for name in robots} == robots


def test_a_sound_robot_of_four_legs_stands() -> None:
    assert simulated(robot(children=four())) == {}


def test_a_part_below_the_feet_is_in_the_floor_by_its_depth() -> None:
    bag = {"name": "bag", "type": "box", "at": [0, 0, -0.5]}
    bag["box"] = {"size": [0.1, 0.1, 0.4], "mass": 2}
    found = simulated(robot(children=[*four(), bag]))["start_penetration"]
    # Feet end at 0.1 + 0.3 + 0.25 + 0.02 below the trunk, the box at 0.5 + 0.2.
    assert (found.severity, found.where) == ("warning", "bag")
    assert found.value == pytest.approx(30)
    assert "in the floor" in found.message


def test_legs_through_each_other_are_named() -> None:
    found = robot(children=four(y=0.02)).resolve().build().simulate().findings
    pairs = {f.where for f in found if f.id == "start_penetration"}
    assert {"RL_thigh/RR_thigh", "FL_thigh/FR_thigh"} <= pairs


def test_overlaps_are_those_of_the_home_pose_not_of_the_neutral_one() -> None:
    tucked = leg(shank={"joint": dict(leg()[2]["joint"], home=1.9)})
    both = [
        {"chain": "leg", "prefix": f"{n}_", "at": [x, 0, -0.1]}
        for n, x in (("F", 0.2), ("R", -0.05))
    ]
    assert "start_penetration" in simulated(robot(chain=tucked, children=both))
    assert "start_penetration" not in simulated(robot(children=both))


def test_legs_under_one_end_of_the_trunk_let_it_fall() -> None:
    front = [dict(child, at=[0.2, child["at"][1], -0.1]) for child in four()[:2]]
    found = simulated(robot(children=front))["falls"]
    assert found.severity == "warning"
    assert 0 < scalar(found.value) < 2
    assert "two points takes a controller" in found.message


def test_motors_that_cannot_carry_the_robot_are_weak() -> None:
    found = simulated(draft.load("quadruped"), **{"actuators.leg.peak_torque": 6})
    assert set(found) == {"weak_servo", "falls"}
    assert "the trunk sinks to" in found["falls"].message
    assert "knee" in found["weak_servo"].message or "hip" in found["weak_servo"].message
    assert scalar(found["weak_servo"].value) > scalar(found["weak_servo"].limit) == 0.1
    share = int(found["weak_servo"].message.split("for ")[-1].partition("%")[0])
    assert 1 <= share <= 100


SPOILT: dict[str, Callable[[mujoco.MjModel], None]] = {
    "stiff": lambda s: _scale(s, 1e6),
    "beyond numbers": lambda s: _scale(s, 1e12),
    "upside down": lambda s: s.opt.gravity.__setitem__(2, -1e15),
}


def _scale(scene: mujoco.MjModel, factor: float) -> None:
    scene.actuator_gainprm[:, 0] *= factor
    scene.actuator_biasprm[:, 1] *= factor
    scene.actuator_forcerange[:] *= 1e3 * factor
    scene.jnt_actfrclimited[:] = 0


@pytest.mark.parametrize("how", SPOILT)
def test_a_simulation_that_diverges_is_an_error_and_writes_no_log(
    how: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    model = robot(children=four()).resolve().build()
    scene = model.scene()
    SPOILT[how](scene)
    (found,) = simulation.simulate(model.design, scene)
    assert (found.id, found.severity) == ("unstable_servo", "error")
    assert "diverges within" in found.message
    assert list(tmp_path.iterdir()) == []


def test_a_servo_that_swings_is_an_error() -> None:
    model = robot(children=four()).resolve().build()
    scene = model.scene()
    # Soft, undamped, and pushed: the hips swing under the trunk.
    scene.actuator_biasprm[:, 2] *= -0.2
    scene.dof_damping[:] = scene.dof_frictionloss[:] = 0
    scene.key("home").ctrl[:] += 0.1
    found = simulation.simulate(model.design, scene)
    assert {f.id for f in found} >= {"unstable_servo"}
    assert "does not come to rest" in found[0].message


def test_turns_are_counted_from_a_least_swing_on() -> None:
    time = np.linspace(0, 1, 500)
    assert simulation._turns(np.sin(2 * np.pi * 5 * time), 0.1) in (9, 10)
    assert simulation._turns(0.01 * np.sin(2 * np.pi * 5 * time), 0.1) == 0
    assert simulation._turns(time, 0.1) == 0
    assert simulation._turns(np.zeros(0), 0.1) == 0


def test_the_scene_of_the_caller_is_not_changed() -> None:
    model = robot(children=four()).resolve().build()
    scene = model.scene()
    kept = scene.geom_contype.copy()
    simulation.simulate(model.design, scene)
    assert (scene.geom_contype == kept).all()


def test_check_prints_the_findings_and_exits_as_check_does(
    capsys: pytest.CaptureFixture[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    assert main(["check", "hopper", "--simulate"]) == 0
    out = capsys.readouterr().out
    assert "warning falls the robot falls within" in out
    assert out.splitlines()[-1].startswith("hopper (default): accepted")
    assert main(["check", "hopper", "--simulate", "--json"]) == 0
    record = json.loads(capsys.readouterr().out)
    assert record["simulated"]
    assert "falls" in {finding["id"] for finding in record["findings"]}
    assert main(["check", "hopper", "--json"]) == 0
    record = json.loads(capsys.readouterr().out)
    assert "simulated" not in record
    assert not SIMULATED & {finding["id"] for finding in record["findings"]}
    unstable = simulation.note("unstable_servo", "thigh", True, "swings", "a test")
    monkeypatch.setattr(simulation, "simulate", lambda *_: tuple(unstable))
    assert main(["check", "hopper", "--simulate"]) == 1
    assert "add 'unstable_servo:thigh' to 'allow'" in capsys.readouterr().out


def test_what_the_filter_refuses_is_not_simulated(capsys: pytest.CaptureFixture[str]) -> None:
    words = ["check", "quadruped", "--simulate", "--set", "actuators.leg.peak_torque=4000"]
    assert main(words) == 1
    assert capsys.readouterr().out.splitlines()[-1] == "not simulated: correct the errors first"
    assert main([*words, "--json"]) == 1
    assert not json.loads(capsys.readouterr().out)["simulated"]


def test_an_unstable_servo_can_be_allowed(monkeypatch: pytest.MonkeyPatch) -> None:
    model = robot(children=four(), allow=["unstable_servo:FL_thigh"]).resolve().build()
    found = [*simulation.note("unstable_servo", "FL_thigh", True, "swings", "a test")]
    monkeypatch.setattr(simulation, "simulate", lambda *_: tuple(found))
    design = model.simulate()
    assert design.accepted
    assert "unstable_servo" in ids(design)
