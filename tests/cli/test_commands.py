"""Building, exporting, checking and showing a robot, called as a shell would call them."""

# pyright: reportAttributeAccessIssue=false
# (MuJoCo's compiled modules carry no types.)
from __future__ import annotations

import importlib.metadata
import json
import os
import shutil
import sys
from pathlib import Path

import mujoco
import pytest
import yaml

import draft
from draft import files
from draft.cli import COMMANDS, main
from draft.spec import shipped
from draft.spec.jsonschema import FILES
from tests.commands import Command
from tests.warm import Warm
from tests.written import append, edit, files_below

RECORD = {
    *("name", "design", "mass_kg", "n_joints", "accepted", "findings", "parameters", "actuators"),
    *("machine", "bodies"),
    *("timings_ms", "out"),
}
ALWAYS = {"design.yaml", "report.json"}
MJCF = {"robot.xml", "scene.xml"}
URDF = {"robot.urdf", "meshes", "meshes/trunk.stl", "actuators.json"}
MODEL = ALWAYS | MJCF
TOO_STRONG = ("--set", "actuators.leg.peak_torque=600")

# --- build and export ----------------------------------------------------------------------


def test_build_writes_a_model_that_mujoco_loads(command: Command) -> None:
    assert "written to out/monoped" in command("build robot").out
    for name in MJCF:
        assert mujoco.MjModel.from_xml_path(f"out/monoped/{name}").njnt == 3


@pytest.mark.parametrize(
    ("words", "folder", "written"),
    [
        ("build robot", "out/monoped", MODEL),
        ("build robot --design long", "out/monoped-long", MODEL),
        ("build robot --set thigh_length=0.2", "out/monoped-custom", MODEL),
        ("build robot --design long --set shank_length=0.2", "out/monoped-long_custom", MODEL),
        ("build robot --out a/b", "a/b", MODEL),
        ("export robot --out model", "model", MODEL | URDF | {"robot.glb"}),
        ("export robot --out model --format urdf", "model", ALWAYS | URDF),
        ("export robot --out model --format glb mjcf", "model", MODEL | {"robot.glb"}),
        ("export robot --design long --format glb", "out/monoped-long", ALWAYS | {"robot.glb"}),
        *((f"build {name}", f"out/{name}", MODEL) for name in shipped()),
    ],
)
def test_models_are_written_to_the_folder_of_the_design(
    words: str, folder: str, written: set[str], command: Command
) -> None:
    told = command.json(words)
    assert (told["accepted"], told["out"]) == (True, folder)
    assert files_below(Path(folder)) == written


def test_build_prints_one_json_object(command: Command) -> None:
    said = command("build robot --design long --json")
    assert said.err == ""
    told = json.loads(said.out)
    assert set(told) == RECORD
    design = draft.load("robot").resolve("long")
    assert (told["name"], told["design"], told["n_joints"]) == ("monoped", "long", 2)
    assert told["mass_kg"] == pytest.approx(float(design.mass))
    assert sum(told["bodies"].values()) == pytest.approx(told["mass_kg"])
    assert told["actuators"]["leg"]["peak_torque"] == 60
    assert set(told["timings_ms"]) == {"load", "resolve", "build", "save"}
    written = yaml.safe_load(Path("out/monoped-long/design.yaml").read_text())
    assert written["values"]["thigh_length"] == 0.45
    assert written["resolved"]["mass_kg"] > 0


def test_set_takes_several_values_and_wins_over_the_design(command: Command) -> None:
    values = ("--set", "thigh_length=0.2", "actuators.leg.peak_torque=2 * 25")
    told = command.json("build robot --design long", *values)
    design = draft.load("robot").resolve({"thigh_length": 0.2, "actuators.leg.peak_torque": 50})
    assert told["actuators"]["leg"]["peak_torque"] == 50
    assert told["bodies"] == pytest.approx(design.body_masses())


def test_set_to_null_takes_a_stated_quantity_back(command: Command) -> None:
    told = command.json("build robot --set actuators.leg.gear_ratio=null")
    assert told["actuators"]["leg"]["gear_ratio"] != 15


@pytest.mark.parametrize(
    "arguments",
    [
        (),
        ("--design", "long"),
        ("--set", "thigh_length=shank_length / 2 + 0.1", "foot_radius=0.03"),
        ("--set", "actuators.leg.gear_ratio=null"),
        ("--set", "actuators.leg.like=MIT U12", "actuators.leg.mass=0.7"),
    ],
    ids=["default", "named", "expression", "taken_back", "part"],
)
def test_a_written_design_gives_the_same_model_again(
    arguments: tuple[str, ...], command: Command
) -> None:
    first = command.json("build robot --out first", *arguments)
    again = command.json("build robot --design first/design.yaml --out again")
    assert again["bodies"] == pytest.approx(first["bodies"], rel=1e-12)
    assert again["actuators"] == first["actuators"]
    assert Path("again/robot.xml").read_text() == Path("first/robot.xml").read_text()


def test_a_part_that_was_taken_back_stays_away(robot: Path, command: Command) -> None:
    edit(robot, "parameters.yaml", "    gear_ratio", "    like: MIT U12\n    gear_ratio")
    first = command.json("build robot --set actuators.leg.like=null --out first")
    again = command.json("build robot --design first/design.yaml --out again")
    assert first["actuators"]["leg"]["like"] is None
    assert again["actuators"] == first["actuators"]


# --- what is on the disk already -----------------------------------------------------------


def test_a_model_is_replaced_whole(command: Command) -> None:
    Path("model").mkdir()  # An empty folder is filled.
    texts = set()
    for words, written in (
        ("build robot", MODEL),
        ("export robot", MODEL | URDF | {"robot.glb"}),
        ("build robot --set thigh_length=0.2", MODEL),
    ):
        command(f"{words} --out model")
        assert files_below(Path("model")) == written
        texts.add(Path("model/robot.xml").read_text())
    assert len(texts) == 2
    assert {path.name for path in Path().iterdir()} == {"robot", "model"}


def test_folders_with_other_files_are_kept(command: Command) -> None:
    command("build robot --out model")
    Path("thesis").mkdir()
    for place in ("thesis", "model"):
        Path(place, "chapter.tex").write_text("precious")
        before = {path: path.read_bytes() for path in Path().rglob("*") if path.is_file()}
        command.refuses(f"build robot --out {place} --set thigh_length=0.2")
        assert {path: path.read_bytes() for path in before} == before
    assert files_below(Path("thesis")) == {"chapter.tex"}


# tests/model/test_folder.py and tests/test_files.py interrupt it at each of its steps.
@pytest.mark.parametrize(("fault", "code"), [(KeyboardInterrupt(), 130), (OSError(28, "full"), 2)])
@pytest.mark.parametrize("step", ["_flush", "_move_folder"])
def test_a_save_that_does_not_finish_leaves_the_old_model_or_nothing(
    step: str, fault: BaseException, code: int, command: Command, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fails(*_: object) -> None:
        raise fault

    command("build robot --out model")
    before = {name: Path("model", name).read_bytes() for name in MODEL}
    monkeypatch.setattr(files, step, fails)
    for out in ("model", "first"):
        command(f"build robot --out {out} --set thigh_length=0.2", code=code)
    assert {name: Path("model", name).read_bytes() for name in MODEL} == before
    assert {path.name for path in Path().iterdir()} == {"robot", "model"}


def test_a_copy_with_the_name_of_another_robot_does_not_replace_its_model(
    command: Command,
) -> None:
    command("new mine --like hopper")
    command("build mine")
    shutil.copytree("mine", "copy")
    kept = Path("out/mine/report.json").read_text()
    err = command.refuses("build copy")
    assert "out/mine holds the model of the robot in 'mine', which is also 'mine'" in err
    assert "change 'name' in copy/parameters.yaml, or give --out" in err
    assert Path("out/mine/report.json").read_text() == kept
    command("build copy --out out/copy")
    command("build mine")


# --- verdicts ------------------------------------------------------------------------------


def test_a_refused_design_is_named_with_its_findings_and_nothing_is_written(
    command: Command,
) -> None:
    before = files_below(Path())
    out = command("build robot", *TOO_STRONG, code=1).out
    assert "peak torque 600 N m of 'leg' is beyond" in out
    assert "add 'torque:leg' to 'allow'" in out
    assert "monoped (custom): refused" in out
    for words in ("build robot", "export robot", "check robot", "show robot"):
        assert "beyond" in command(words, *TOO_STRONG, code=1).out
        told = command.json(words, *TOO_STRONG, code=1)
        assert set(told) == RECORD
        assert (told["accepted"], told["out"]) == (False, None)
        errors = [finding for finding in told["findings"] if finding["severity"] == "error"]
        assert "torque" in {finding["id"] for finding in errors}
        assert all(finding["remedy"] for finding in errors)
    assert files_below(Path()) == before


def test_what_is_allowed_is_built_and_stays_a_warning(robot: Path, command: Command) -> None:
    told = command.json("check robot", *TOO_STRONG, code=1)
    errors = [f"{f['id']}:{f['where']}" for f in told["findings"] if f["severity"] == "error"]
    append(robot, "parameters.yaml", f"allow: [{', '.join(errors)}]\n")
    told = command.json("build robot", *TOO_STRONG)
    assert told["accepted"] is True
    allowed = [finding["allowed_by"] for finding in told["findings"] if finding["allowed_by"]]
    assert sorted(allowed) == sorted(errors)


# --- check, show, list, new, schema --------------------------------------------------------


@pytest.mark.parametrize("word", ["check", "show"])
def test_check_and_show_write_nothing(word: str, command: Command) -> None:
    before = files_below(Path())
    told = command.json(f"{word} robot --design long")
    assert set(told) == RECORD
    assert (told["design"], told["out"]) == ("long", None)
    assert command.refuses(f"{word} robot --design lang --json").startswith("error: ")
    assert files_below(Path()) == before


def test_check_gives_the_verdict_in_its_last_line(command: Command) -> None:
    mass = draft.load("robot").resolve().mass
    verdict = f"monoped (default): accepted, robot on 1 leg, {mass:.1f} kg, 2 joints"
    assert command("check robot").out.splitlines()[-1] == verdict


def test_show_names_every_body_joint_class_and_mass(command: Command) -> None:
    out = command("show robot").out
    design = draft.load("robot").resolve()
    for name, mass in design.body_masses().items():
        assert f"{name}  {mass:.3f} kg" in out
    assert all(name in out for name in ("hip", "knee", "actuator leg", "rotor inertia"))
    assert f"{design.mass:.2f}" in out


def test_list_names_every_robot_and_design(command: Command) -> None:
    out = command("list").out
    for name in shipped():
        assert name in out
        assert all(design in out for design in draft.load(name).designs)


def test_new_makes_a_robot_that_builds(command: Command) -> None:
    assert "draft show mine" in command("new mine --like quadruped").out
    assert command.json("build mine")["name"] == "mine"
    command.refuses("new robot --like quadruped")
    assert draft.load("robot").name == "monoped"


def test_schema_prints_and_writes_schemas(command: Command) -> None:
    for name in FILES:
        assert json.loads(command(f"schema {name}").out)["type"] == "object"
    command("schema --out schemas")
    assert files_below(Path("schemas")) == {f"{name}.json" for name in FILES}
    assert "no schema is named" in command.refuses("schema")


# --- the command itself --------------------------------------------------------------------


@pytest.mark.parametrize("words", ["", "--help", "help"])
def test_help_names_every_command(words: str, command: Command) -> None:
    out = command(words).out
    assert all(f"  {name} " in out for name in COMMANDS)


def test_commands_may_follow_one_another_in_one_process() -> None:
    for _ in range(2):
        assert [main([name]) for name in ("list", "schema")] == [0, 2]


def test_version_is_the_packages(command: Command) -> None:
    version = importlib.metadata.version("draft-robotics")
    assert command("--version").out == f"draft {version}\n"


def test_a_process_ends_with_the_exit_code() -> None:
    python = Warm(Path(sys.executable))
    for words, code in (("build robot", 0), ("check robot", 1), ("show nothing", 2)):
        more = TOO_STRONG if code == 1 else ()
        ended = python(["-m", "draft", *words.split(), *more], Path.cwd(), dict(os.environ))
        assert ended.returncode == code
        assert "Traceback" not in ended.stderr
        assert (ended.stderr == "") == (code < 2)
    python.close()


@pytest.mark.parametrize("traceback", [False, True])
@pytest.mark.parametrize("fault", [RecursionError("too deep"), KeyError("leg"), OSError(36, "x")])
def test_a_fault_of_draft_says_so_and_is_no_verdict(
    fault: Exception,
    traceback: bool,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    def fails(*_: object) -> None:
        raise fault

    monkeypatch.setattr("draft.cli.check.open_design", fails)
    monkeypatch.setenv("DRAFT_TRACEBACK", "1" if traceback else "0")
    assert main(["check", "robot"]) == 70
    err = capsys.readouterr().err
    assert f"error: this is a fault of Draft: {type(fault).__name__}: {fault}" in err
    assert "please report it" in err
    assert ("Traceback" in err) == traceback
