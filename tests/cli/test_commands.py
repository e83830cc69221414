"""The commands, called as a shell would call them."""

# pyright: reportAttributeAccessIssue=false
# (MuJoCo's compiled modules carry no types.)
from __future__ import annotations

import importlib.metadata
import json
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

import mujoco
import pytest
import yaml

import draft
from draft.cli import COMMANDS, main
from draft.spec import shipped
from draft.spec.jsonschema import FILES
from tests.written import append, edit, files_below

RECORD = {
    "name",
    "design",
    "mass_kg",
    "n_joints",
    "accepted",
    "findings",
    "actuators",
    "bodies",
    "timings_ms",
    "out",
}
MODEL = {"robot.xml", "scene.xml", "design.yaml", "report.json"}
TOO_STRONG = ("--set", "actuators.leg.peak_torque=600")


def record(capsys: pytest.CaptureFixture[str], *arguments: str) -> dict[str, Any]:
    """Run a command with --json and read its object."""
    main([*arguments, "--json"])
    out, err = capsys.readouterr()
    assert err == ""
    return json.loads(out)


def shell(*arguments: str) -> subprocess.CompletedProcess[str]:
    """Run the command in a process of its own."""
    start = "import sys; from draft.cli import main; sys.exit(main())"
    return subprocess.run(
        [sys.executable, "-c", start, *arguments],
        capture_output=True,
        text=True,
        check=False,
    )


# --- build ---------------------------------------------------------------------------------


def test_build_writes_a_model_that_mujoco_loads(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["build", "robot"]) == 0
    assert "written to out/monoped" in capsys.readouterr().out
    assert files_below(Path("out/monoped")) == MODEL
    for name in ("robot.xml", "scene.xml"):
        assert mujoco.MjModel.from_xml_path(f"out/monoped/{name}").njnt == 3


@pytest.mark.parametrize(
    ("arguments", "folder"),
    [
        ((), "out/monoped"),
        (("--design", "long"), "out/monoped-long"),
        (("--set", "thigh_length=0.2"), "out/monoped-custom"),
        (("--design", "long", "--set", "shank_length=0.2"), "out/monoped-long_custom"),
        (("--out", "a/b"), "a/b"),
    ],
)
def test_build_writes_to_the_folder_of_the_design(arguments: tuple[str, ...], folder: str) -> None:
    assert main(["build", "robot", *arguments]) == 0
    assert files_below(Path(folder)) == MODEL


def test_build_prints_one_json_object(capsys: pytest.CaptureFixture[str]) -> None:
    told = record(capsys, "build", "robot", "--design", "long")
    assert set(told) == RECORD
    design = draft.load("robot").resolve("long")
    assert (told["name"], told["design"], told["out"]) == ("monoped", "long", "out/monoped-long")
    assert told["mass_kg"] == pytest.approx(float(design.mass))
    assert sum(told["bodies"].values()) == pytest.approx(told["mass_kg"])
    assert told["n_joints"] == 2
    assert told["accepted"] is True
    assert told["actuators"]["leg"]["peak_torque"] == 60
    assert set(told["timings_ms"]) == {"load", "resolve", "build", "save"}


def test_set_takes_several_values(capsys: pytest.CaptureFixture[str]) -> None:
    values = ("thigh_length=0.2", "actuators.leg.peak_torque=2 * 25")
    told = record(capsys, "build", "robot", "--set", *values)
    design = draft.load("robot").resolve({"thigh_length": 0.2, "actuators.leg.peak_torque": 50})
    assert told["actuators"]["leg"]["peak_torque"] == 50
    assert told["bodies"] == pytest.approx(design.body_masses())


def test_set_wins_over_the_design(capsys: pytest.CaptureFixture[str]) -> None:
    told = record(capsys, "build", "robot", "--design", "long", "--set", "thigh_length=0.2")
    short = draft.load("robot").resolve({"thigh_length": 0.2})
    assert told["mass_kg"] == pytest.approx(float(short.mass))


def test_set_to_null_takes_a_stated_quantity_back(capsys: pytest.CaptureFixture[str]) -> None:
    told = record(capsys, "build", "robot", "--set", "actuators.leg.gear_ratio=null")
    assert told["actuators"]["leg"]["gear_ratio"] != 15


def test_a_design_may_be_a_file(capsys: pytest.CaptureFixture[str]) -> None:
    Path("short.yaml").write_text("doc: Short.\nvalues: {thigh_length: 0.2}\n")
    told = record(capsys, "build", "robot", "--design", "short.yaml")
    assert told["design"] == "short"
    short = draft.load("robot").resolve({"thigh_length": 0.2})
    assert told["mass_kg"] == pytest.approx(float(short.mass))


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
    arguments: tuple[str, ...], capsys: pytest.CaptureFixture[str]
) -> None:
    first = record(capsys, "build", "robot", *arguments, "--out", "first")
    again = record(capsys, "build", "robot", "--design", "first/design.yaml", "--out", "again")
    assert again["bodies"] == pytest.approx(first["bodies"], rel=1e-12)
    assert again["actuators"] == first["actuators"]
    assert Path("again/robot.xml").read_text() == Path("first/robot.xml").read_text()


def test_a_part_that_was_taken_back_stays_away(
    robot: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    edit(robot, "parameters.yaml", "    gear_ratio", "    like: MIT U12\n    gear_ratio")
    first = record(capsys, "build", "robot", "--set", "actuators.leg.like=null", "--out", "first")
    again = record(capsys, "build", "robot", "--design", "first/design.yaml", "--out", "again")
    assert first["actuators"]["leg"]["like"] is None
    assert again["actuators"] == first["actuators"]


@pytest.mark.parametrize("name", shipped())
def test_a_shipped_robot_builds(name: str, capsys: pytest.CaptureFixture[str]) -> None:
    told = record(capsys, "build", name)
    assert told["accepted"] is True
    assert files_below(Path("out", name)) == MODEL


# --- refusals ------------------------------------------------------------------------------


def test_a_refused_build_names_the_class_and_writes_nothing(
    capsys: pytest.CaptureFixture[str],
) -> None:
    before = files_below(Path())
    assert main(["build", "robot", *TOO_STRONG]) == 1
    out = capsys.readouterr().out
    assert "peak torque 600 N m of 'leg' is beyond" in out
    assert "add 'torque:leg' to 'allow'" in out
    assert "monoped (custom): refused" in out
    assert files_below(Path()) == before


def test_a_refused_build_lists_its_findings(capsys: pytest.CaptureFixture[str]) -> None:
    told = record(capsys, "build", "robot", *TOO_STRONG)
    assert set(told) == RECORD
    assert (told["accepted"], told["out"]) == (False, None)
    errors = [finding for finding in told["findings"] if finding["severity"] == "error"]
    assert "torque" in {finding["id"] for finding in errors}
    assert all(finding["remedy"] for finding in errors)


def test_what_is_allowed_is_built_and_stays_a_warning(
    robot: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    told = record(capsys, "check", "robot", *TOO_STRONG)
    errors = [f"{f['id']}:{f['where']}" for f in told["findings"] if f["severity"] == "error"]
    append(robot, "parameters.yaml", f"allow: [{', '.join(errors)}]\n")
    told = record(capsys, "build", "robot", *TOO_STRONG)
    assert told["accepted"] is True
    allowed = [finding["allowed_by"] for finding in told["findings"] if finding["allowed_by"]]
    assert sorted(allowed) == sorted(errors)


@pytest.mark.parametrize("command", ["check", "show"])
def test_check_and_show_end_with_1_where_a_build_would(command: str) -> None:
    assert main([command, "robot"]) == 0
    assert main([command, "robot", *TOO_STRONG]) == 1


@pytest.mark.parametrize("command", ["build", "check", "show"])
def test_bad_input_ends_with_2_and_leaves_the_output_empty(
    command: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main([command, "robot", "--design", "lang", "--json"]) == 2
    out, err = capsys.readouterr()
    assert out == ""
    assert err.startswith("error: 'monoped' has no design 'lang'")


# --- check, show, list, new, schema --------------------------------------------------------


@pytest.mark.parametrize("command", ["check", "show"])
def test_check_and_show_write_nothing(command: str, capsys: pytest.CaptureFixture[str]) -> None:
    before = files_below(Path())
    told = record(capsys, command, "robot", "--design", "long")
    assert set(told) == RECORD
    assert told["out"] is None
    assert told["design"] == "long"
    assert files_below(Path()) == before


def test_check_gives_the_verdict_in_its_last_line(capsys: pytest.CaptureFixture[str]) -> None:
    main(["check", "robot"])
    last = capsys.readouterr().out.splitlines()[-1]
    mass = draft.load("robot").resolve().mass
    assert last == f"monoped (default): accepted, {mass:.1f} kg, 2 joints"


def test_show_names_every_body_joint_class_and_mass(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["show", "robot"]) == 0
    out = capsys.readouterr().out
    design = draft.load("robot").resolve()
    for name, mass in design.body_masses().items():
        assert f"{name}  {mass:.3f} kg" in out
    assert all(name in out for name in ("hip", "knee", "actuator leg", "rotor inertia"))
    assert f"{design.mass:.2f}" in out


def test_list_names_every_robot_and_design(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["list"]) == 0
    out = capsys.readouterr().out
    for name in shipped():
        assert name in out
        assert all(design in out for design in draft.load(name).designs)


def test_commands_may_follow_one_another_in_one_process() -> None:
    for _ in range(2):
        assert [main([name]) for name in ("list", "schema")] == [0, 2]


def test_new_makes_a_robot_that_builds(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["new", "mine", "--like", "quadruped"]) == 0
    assert "draft show mine" in capsys.readouterr().out
    assert record(capsys, "build", "mine")["name"] == "mine"


def test_new_keeps_what_exists(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["new", "robot", "--like", "quadruped"]) == 2
    assert "'robot' exists; it is kept" in capsys.readouterr().err
    assert draft.load("robot").name == "monoped"


@pytest.mark.parametrize("name", FILES)
def test_schema_prints_a_schema(name: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["schema", name]) == 0
    assert json.loads(capsys.readouterr().out)["type"] == "object"


def test_schema_writes_all_schemas() -> None:
    assert main(["schema", "--out", "schemas"]) == 0
    assert files_below(Path("schemas")) == {f"{name}.json" for name in FILES}


def test_schema_needs_the_name_of_one(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["schema"]) == 2
    assert "no schema is named" in capsys.readouterr().err


# --- the command itself --------------------------------------------------------------------


@pytest.mark.parametrize("arguments", [[], ["--help"], ["help"]])
def test_help_names_every_command(arguments: list[str], capsys: pytest.CaptureFixture[str]) -> None:
    assert main(arguments) == 0
    out = capsys.readouterr().out
    assert all(f"  {name} " in out for name in COMMANDS)


def test_an_option_that_does_not_exist_ends_with_2(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["build", "quadruped", "--desing", "bear"]) == 2
    err = capsys.readouterr().err
    assert "'draft build' has no option '--desing'\n  did you mean '--design'?" in err


def test_version_is_the_packages(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["--version"]) == 0
    assert capsys.readouterr().out == f"draft {importlib.metadata.version('draft-robotics')}\n"


@pytest.mark.parametrize(
    ("arguments", "code"),
    [(("build", "robot"), 0), (("check", "robot", *TOO_STRONG), 1), (("show", "nothing"), 2)],
)
def test_a_process_ends_with_the_exit_code(arguments: tuple[str, ...], code: int) -> None:
    ended = shell(*arguments)
    assert ended.returncode == code
    assert "Traceback" not in ended.stderr
    assert (ended.stderr == "") == (code < 2)


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


def test_a_written_design_says_what_it_came_to() -> None:
    assert main(["build", "robot", "--design", "long"]) == 0
    written = yaml.safe_load(Path("out/monoped-long/design.yaml").read_text())
    assert written["values"]["thigh_length"] == 0.45
    assert written["resolved"]["mass_kg"] > 0


def test_a_copy_with_the_name_of_another_robot_does_not_replace_its_model(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    assert main(["new", "mine", "--like", "hopper"]) == 0
    assert main(["build", "mine"]) == 0
    shutil.copytree("mine", "copy")
    kept = Path("out/mine/report.json").read_text()
    capsys.readouterr()
    assert main(["build", "copy"]) == 2
    err = capsys.readouterr().err
    assert "out/mine holds the model of the robot in 'mine', which is also 'mine'" in err
    assert "change 'name' in copy/parameters.yaml, or give --out" in err
    assert Path("out/mine/report.json").read_text() == kept
    assert main(["build", "copy", "--out", "out/copy"]) == 0
    assert main(["build", "mine"]) == 0
