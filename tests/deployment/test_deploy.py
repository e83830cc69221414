"""The folder of a controller: its files, what they say, and what is refused."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from contextlib import closing
from pathlib import Path

import numpy as np
import pytest

import draft
from draft.deployment.deploy import deploy
from draft.deployment.observations import TERMS
from draft.design.references import open_design
from draft.errors import DraftError, RefusedError
from draft.learn.policy.policy import FOLDER, open_policy
from draft.learn.policy.reduced import ANY
from draft.learn.policy.validity import fit
from draft.learn.policy.walk import Walk
from tests.commands import Command
from tests.deployment.conftest import Written
from tests.deployment.controllers import COMPILER, Compiled, Python, Seen, module, needs_compiler
from tests.deployment.machine import Machine
from tests.deployment.made_policies import SEEN, policy_file

FILES = [
    *("CMakeLists.txt", "README.md", "controller.hpp", "controller.py", "design.yaml"),
    *("main.cpp", "policy.npz", "report.json"),
]


def readme(folder: Path) -> str:
    return (folder / "README.md").read_text(encoding="utf-8")


def test_the_folder_has_the_controller_in_two_languages(written: Written) -> None:
    folder = written("cheetah", "run")
    assert sorted({path.name for path in folder.iterdir()} - {"__pycache__"}) == FILES
    for name in ("controller.py", "main.cpp", "controller.hpp"):
        text = (folder / name).read_text(encoding="utf-8")
        assert "import draft" not in text
        assert not re.search("@[A-Z]", text)


@pytest.mark.parametrize("history", [1, 4])
def test_past_steps_are_observed_as_in_drafts_own_runner(history: int, tmp_path: Path) -> None:
    design = open_design("cheetah")
    file = policy_file(tmp_path / "past.onnx", design, SEEN, history=history)
    found = deploy(file, tmp_path / "past")
    assert set(found.policy.history) == {history, 1}
    model = design.build()
    walk = Walk(model, fit(model, policies=[open_policy(file)]), (0.3, 0.0, 0.0))
    python = Python(found.folder)
    machine = Machine(model, walk.fit, python.own.names)
    others = [Compiled(found.folder)] if COMPILER is not None else []
    for i in range(12):
        if i == 8:  # A new start knows no past.
            for one in (python, *others):
                one.start(i * 0.02)
            walk.controller.reset(walk.data)
            walk.data.qpos[:], walk.data.qvel[:] = machine.data.qpos, machine.data.qvel
        seen = machine.seen(i * 0.02, (0.3, 0.0, 0.0))
        step = python.step(seen)
        expected = walk.controller.observe(walk.data, walk.command)
        np.testing.assert_allclose(step.observation, expected, atol=1e-4)
        for other in others:
            np.testing.assert_allclose(other.step(seen).observation, step.observation, atol=1e-6)
        for _ in range(4):
            machine.drive(python.torque(*machine.state(), i * 0.02))
            walk.controller.step(walk.data, walk.command)
        assert python.stop == ""
    text = f"the last {history} steps, the oldest first"
    assert (text in readme(found.folder)) == (history > 1)
    for other in others:
        other.close()


@pytest.mark.parametrize(
    ("name", "skill"),
    [("cheetah", "walk"), ("family", "run"), ("giraffe", "machine"), ("hexapod", "walk")],
)
def test_its_readme_says_what_every_entry_of_an_observation_is(
    name: str, skill: str, written: Written
) -> None:
    folder = written(name, skill)
    rows = re.findall(r"^\| (\d+) to (\d+) \| `(\w+)` \| (.+) \| (.+) \|$", readme(folder), re.M)
    at = 0
    for first, last, term, meaning, unit in rows:
        assert int(first) == at
        present = meaning.partition("; the last 5 steps, the oldest first")[0]
        assert (present, unit) == (TERMS[term].meaning, TERMS[term].unit)
        at = int(last) + 1
    controller = Python(folder).own
    assert [row[2] for row in rows] == controller.terms
    assert at == len(controller.numbers["mean"])
    joints = re.findall(r"^\| (\d+) \| `(\w+)` \|", readme(folder), re.M)
    assert [joint for _, joint in joints] == controller.names


def test_what_its_readme_shows_runs(written: Written) -> None:
    folder = written("cheetah", "run")
    (code,) = re.findall(r"```python\n(.*?)```", readme(folder), re.DOTALL)
    done = subprocess.run(
        [sys.executable, "-c", code], cwd=folder, capture_output=True, text=True, check=True
    )
    assert len(re.findall(r"-?\d+\.\d+", done.stdout)) == 12


@needs_compiler
def test_its_example_compiles_without_a_warning_and_stands(
    written: Written, tmp_path: Path
) -> None:
    folder, program = written("cheetah", "run"), tmp_path / "robot"
    words = ["-std=c++17", "-O2", "-Wall", "-Wextra", "-Wpedantic", "-Werror"]
    words += ["-o", str(program), str(folder / "main.cpp")]
    built = subprocess.run([str(COMPILER), *words], capture_output=True, text=True, check=False)
    assert built.returncode == 0, built.stderr
    done = subprocess.run([str(program), "0.1"], capture_output=True, text=True, check=False)
    # A machine that is busy may be late, which stops it.
    assert re.search(r"12 joints at 50 Hz for 0\.1 s: .* largest torque [\d.]+ N m\n", done.stdout)
    assert done.returncode == int("stop: the controller is late" in done.stdout)


@needs_compiler
@pytest.mark.parametrize("option", ["-ffast-math", "-ffinite-math-only"])
def test_its_header_refuses_options_that_would_hide_what_is_not_finite(
    option: str, written: Written
) -> None:
    source = str(written("cheetah", "run") / "main.cpp")
    words = ["-std=c++17", option, "-fsyntax-only", source]
    done = subprocess.run([str(COMPILER), *words], capture_output=True, text=True, check=False)
    assert done.returncode != 0
    assert "without -ffast-math and -ffinite-math-only" in done.stderr


def test_the_velocity_is_an_input_that_the_robot_must_estimate(
    tmp_path: Path, command: Command
) -> None:
    said = command("deploy cheetah --skill walk --out", tmp_path / "walk").out
    assert "\nestimated_base_lin_vel: no sensor gives it, so the robot must estimate it\n" in said
    text = readme(tmp_path / "walk")
    assert "**`estimated_base_lin_vel` is an input that no sensor gives" in text
    assert "Vector estimated_base_lin_vel" in (tmp_path / "walk/controller.hpp").read_text()
    assert "# PLACEHOLDER" in text
    assert "// PLACEHOLDER" in (tmp_path / "walk/main.cpp").read_text()


def test_unless_a_skill_is_named_the_policy_needs_no_velocity(
    tmp_path: Path, command: Command
) -> None:
    said = command("deploy giraffe --out", tmp_path / "giraffe").out
    assert "estimated" not in said
    assert "targets that arrive 0 to 20 ms late" in said
    assert "estimated" not in readme(tmp_path / "giraffe")
    # There is none for other legs.
    assert deploy("hexapod", tmp_path / "hexapod").estimated == ("estimated_base_lin_vel",)
    with pytest.raises(DraftError, match="no policy drives the joints of hexapod"):
        deploy("hexapod", tmp_path / "none", skill="machine")
    assert not (tmp_path / "none").exists()


NO_ESTIMATE = """
#include "controller.hpp"
#include <cstdio>
int main() {
  draft_policy::Controller controller;
  draft_policy::Sensors sensors;
  sensors.projected_gravity = {0, 0, -1};
  sensors.joint_pos = draft_policy::HOME;
  controller.start(0);
  controller.step(sensors, {}, 0);
  std::puts(text(controller.stop()));
}
"""


@pytest.mark.parametrize("language", ["python", pytest.param("c++", marks=needs_compiler)])
def test_it_stops_if_the_velocity_is_not_stated(
    language: str, written: Written, tmp_path: Path
) -> None:
    folder = written("cheetah", "run")
    if language == "python":
        made = module(folder)
        own, none = made.Controller(), np.zeros(3)
        level, home = (0, 0, -1), own.numbers["home"]
        own.step(made.Sensors(0, none, level, home, np.zeros(12)), made.Command(0, none), 0)
        stop = own.stop
    else:
        stop = ran(NO_ESTIMATE, folder, tmp_path).strip()
    assert stop == "a measurement, the command or a target is not finite"


# The example with a robot that misses an angle once, and prints what its drives get.
MISSES = {
    "sensors.joint_pos = policy::HOME;": """
    sensors.joint_pos = policy::HOME;
    static int count = 0;
    if (++count == std::atoi(std::getenv("MISSED"))) sensors.joint_pos[0] = std::nan("");""",
    "void write(const policy::Output&, const policy::Joints& torque) {": """
  void write(const policy::Output& out, const policy::Joints& torque) {
    std::printf("%g %g %g\\n", out.angle[0], out.stiffness[0], torque[0]);""",
    "rising = 2.0;": "rising = 0.2;",
}


@needs_compiler
@pytest.mark.parametrize("missed", [1, 10])
def test_a_stop_on_the_way_to_the_home_pose_holds(
    missed: int, written: Written, tmp_path: Path
) -> None:
    folder = written("cheetah", "run")
    code = (folder / "main.cpp").read_text(encoding="utf-8")
    for here, other in MISSES.items():
        assert code.count(here) == 1
        code = code.replace(here, other)
    said = ran(code, folder, tmp_path, "0.1", MISSED=str(missed))
    assert "stop: " in said  # A machine that is busy may be late before.
    given = np.array([line.split() for line in re.findall(r"^\S+ \S+ \S+$", said, re.M)], float)
    assert np.isfinite(given).all()
    stiff = given[:, 1] > 0
    assert not stiff[int(stiff.argmin()) :].any()
    assert stiff.sum() < missed
    assert len(stiff) > missed


def ran(code: str, folder: Path, place: Path, *words: str, **environment: str) -> str:
    """What a program of C++ with the header of a controller says."""
    source, program = place / "own.cpp", place / "own"
    source.write_text(code, encoding="utf-8")
    options = ["-std=c++17", f"-I{folder}", "-o", str(program), str(source)]
    subprocess.run([str(COMPILER), *options], check=True)
    done = subprocess.run(
        [str(program), *words],
        env=os.environ | environment,
        capture_output=True,
        text=True,
        check=False,
    )
    return done.stdout


def test_a_policy_that_sees_no_velocity_asks_for_none(tmp_path: Path) -> None:
    design = open_design("cheetah")
    file = policy_file(tmp_path / "blind.onnx", design, SEEN, delay=0.02)
    found = deploy(file, tmp_path / "blind")  # Of the robot that its file names.
    assert found.design == "quadruped:cheetah"
    assert found.estimated == ()
    assert "estimated_" not in readme(found.folder)
    assert "estimated" not in (found.folder / "controller.hpp").read_text(encoding="utf-8")
    home = found.policy.home
    seen = Seen(
        0, 0, 0, (0.3, 0, 0), (np.nan,) * 3, (0, 0.1, 0), (0, 0, -1), home + 0.1, np.ones(12)
    )
    python = Python(found.folder)
    step = python.step(seen)
    assert python.stop == ""
    np.testing.assert_allclose(step.action, found.policy(step.observation), atol=1e-5)
    if COMPILER is not None:
        with closing(Compiled(found.folder)) as other:
            np.testing.assert_allclose(other.step(seen).action, step.action, atol=1e-12)


def test_what_a_policy_does_not_know_is_said(tmp_path: Path) -> None:
    design = open_design("cheetah")
    (doubt,) = deploy(design, tmp_path / "walk", "walk").doubts
    assert "trained without a delay" in doubt
    assert f"- {doubt}\n" in readme(tmp_path / "walk")
    file = policy_file(tmp_path / "late.onnx", design, delay=0.02)
    (doubt,) = deploy(design, tmp_path / "late", policy=file).doubts
    assert "targets that arrive 0 to 20 ms late" in doubt
    # A body outside the region of its policy.
    longer = design.spec.resolve({"thigh_length": 0.5})
    first, *_ = deploy(longer, tmp_path / "longer").doubts
    assert first.startswith("The robot is outside the region of the policy of the family of")


def test_a_policy_that_sees_the_ground_is_refused(tmp_path: Path, command: Command) -> None:
    said = command.refuses("deploy cheetah --skill climb --out", tmp_path / "climb")
    assert "the policy observes height_scan" in said
    assert "walk, run, push and machine do" in said
    assert not (tmp_path / "climb").exists()


def test_what_is_no_controller_is_kept(tmp_path: Path, command: Command) -> None:
    folder = tmp_path / "mine"
    folder.mkdir()
    (folder / "robot.cpp").write_text("int main() {}")
    said = command.refuses("deploy cheetah --out", folder)
    assert "is not a folder of a controller (it holds robot.cpp)" in said
    assert [path.name for path in folder.iterdir()] == ["robot.cpp"]
    command("deploy cheetah --out", tmp_path / "walk")
    (tmp_path / "walk/__pycache__").mkdir()
    (tmp_path / "walk/__pycache__/controller.cpython-311.pyc").touch()  # It ran.
    command("deploy bear --out", tmp_path / "walk")  # Of Draft: it is replaced.
    assert "quadruped:bear" in readme(tmp_path / "walk")


def test_words_that_name_no_robot_or_policy_are_refused(tmp_path: Path, command: Command) -> None:
    out = tmp_path / "out"
    said = command.refuses("deploy", ANY, "--out", out)
    assert "is a policy of all legs" in said
    assert f"'draft deploy ROBOT --policy {ANY}'" in said
    walk = FOLDER / "bear-walk.onnx"
    said = command.refuses("deploy", walk, "--policy", walk, "--out", out)
    assert "--policy names another one" in said
    said = command.refuses("deploy bear --skill run --policy", walk, "--out", out)
    assert "--skill is for the policies that ship" in said
    assert "name a robot on legs" in command.refuses("deploy arm --out", out)
    assert "does not drive the joints" in command.refuses(
        "deploy hexapod --policy", walk, "--out", out
    )
    assert "no folder" in command.refuses("deploy bear --out ''")
    other = policy_file(tmp_path / "other.onnx", open_design("cheetah"))
    other.write_bytes(other.read_bytes().replace(b"quadruped:cheetah", b"quadruped:leopard"))
    said = command.refuses("deploy", other, "--out", out)
    assert "trained with quadruped:leopard, which is no robot that is known here" in said
    assert "'quadruped' has no design 'leopard'" in said
    with pytest.raises(RefusedError):
        deploy(draft.load("quadruped").resolve({"actuators.leg.peak_torque": 5}), out)
    with pytest.raises(DraftError, match="there is no skill 'fly'"):
        deploy("bear", out, skill="fly")
    assert not out.exists()


def test_a_run_is_exported_first(tmp_path: Path, command: Command) -> None:
    pytest.importorskip("pyarrow")
    from tests.learn.synthetic import trained

    run = trained(tmp_path, "cheetah", "base", 0).folder
    said = command.refuses("deploy", run, "--out", tmp_path / "out")
    assert f"'{run}' is a run of 'draft train'" in said
    assert "--onnx FILE.onnx" in said
