"""Whatever is wrong with a vendor's file is named with its line; nothing is left half-written."""

from __future__ import annotations

import os
import re
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

import draft
from draft.cli import main
from draft.imports.importer import import_robot
from tests.imports.test_meshes import binary
from tests.imports.written import CUBE, joint, link, quadruped

FILE = "beast.urdf"


@pytest.fixture(autouse=True)
def _in_a_folder_of_its_own(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)


def having(old: str, new: str) -> str:
    """The sound quadruped with its first `old` replaced."""
    text = quadruped()
    assert old in text
    return text.replace(old, new, 1)


def rod(limit: str) -> str:
    """The sound quadruped with a joint of these limits on line 35."""
    return quadruped(link("rod") + joint("turn", "body", "rod", (0, 0, 0.1), limit=limit))


ORIGIN, AXIS = 'xyz="0.2 0.1 0"', 'axis xyz="1 0 0"'
VISUAL = "</inertial></link>"
BOX = '</inertial><visual><geometry><box size="{} 1 1"/></geometry></visual></link>'
LAUGHS = '<!DOCTYPE r [<!ENTITY a "ha"><!ENTITY b "&a;&a;&a;">]>\n<robot>&b;</robot>'
METRES = "\n  lengths are in metres, at most 10 m"
DOCTYPE = "beast.urdf:1: it has a DOCTYPE\n  remove it: a description needs no entities"
REFUSED: dict[str, tuple[str | bytes, str]] = {
    "an empty file": ("", "beast.urdf:1:1: not well-formed XML: no element found"),
    "a binary file": (bytes(range(256)), "beast.urdf:1:1: not well-formed XML: not well-formed"),
    "another encoding": (
        '<?xml version="1.0" encoding="x-none"?><robot/>',
        "beast.urdf: not XML text: unknown encoding: x-none",
    ),
    "entities that multiply": (LAUGHS, DOCTYPE),
    "an entity from elsewhere": ('<!DOCTYPE r SYSTEM "file:///etc/passwd">\n<robot/>', DOCTYPE),
    "two roots": (
        quadruped(link("other")),
        "beast.urdf:35: 2 links have no parent: body, other\n  keep one as the root, and",
    ),
    "a loop through the root": (
        quadruped(joint("back", "FL_calf", "body", (0, 0, 0))),
        "beast.urdf:6: cyclic links: every link has a parent (FL_hip <- body <- FL_calf",
    ),
    "a link that hangs on itself": (
        quadruped(link("ring") + joint("round", "ring", "ring", (0, 0, 0))),
        "beast.urdf:35: cyclic links (ring <- ring)",
    ),
    "a joint to nothing": (
        quadruped(joint("out", "body", "none", (0, 0, 0))),
        "beast.urdf:35: joint 'out' names link 'none', which does not exist",
    ),
    "a link twice": (quadruped(link("body")), "beast.urdf:35: link 'body' occurs twice"),
    "a joint twice": (
        quadruped(link("rod") + joint("FL_roll", "body", "rod", (0, 0, 0))),
        "beast.urdf:35: joint 'FL_roll' occurs twice",
    ),
    "an origin that is not a number": (
        having(ORIGIN, 'xyz="nan 0.1 0"'),
        'beast.urdf:6: xyz="nan 0.1 0" of <origin> is not a finite number',
    ),
    "an axis that is not a number": (
        having(AXIS, 'axis xyz="nan 0 0"'),
        'beast.urdf:6: xyz="nan 0 0" of <axis> is not a finite number',
    ),
    "an axis of zero": (
        having(AXIS, 'axis xyz="0 0 0"'),
        "beast.urdf:6: axis of joint 'FL_roll' has no direction",
    ),
    "an inertia that is not a number": (
        having("ixx=", 'ixx="nan" was='),
        'beast.urdf:2: ixx="nan" of <inertia> is not a finite number',
    ),
    "a size that is not a number": (
        having(VISUAL, BOX.format("nan")),
        'beast.urdf:2: size="nan 1 1" of <box> is not a finite number',
    ),
    "an origin far away": (
        having(ORIGIN, 'xyz="1e300 0.1 0"'),
        "beast.urdf:6: joint 'FL_roll' lies 1e+300 m from its parent" + METRES,
    ),
    "origins in millimetres": (
        having(ORIGIN, 'xyz="200 100 0"'),
        "beast.urdf:6: joint 'FL_roll' lies 200 m from its parent" + METRES,
    ),
    "a mass beyond all": (
        having('mass value="8.0"', 'mass value="1e300"'),
        "beast.urdf:2: link 'body' weighs 1e+300 kg\n  at most 100000 kg",
    ),
    "an inertia beyond all": (
        having("ixx=", 'ixx="1e308" was='),
        "beast.urdf:2: link 'body' has an inertia of 1e+308 kg m2\n  at most 1e+07 kg m2",
    ),
    "a centre of mass far away": (
        having("<inertial>", '<inertial><origin xyz="0 -1e200 0"/>'),
        "beast.urdf:2: the centre of mass of link 'body' lies 1e+200 m from it" + METRES,
    ),
    "a box beyond all": (
        having(VISUAL, BOX.format("1e300")),
        "beast.urdf:2: a shape of link 'body' is 1e+300 m long or away" + METRES,
    ),
    "an effort that is not a number": (
        rod('lower="-1" upper="1" effort="nan"'),
        "beast.urdf:35: effort of joint 'turn' is not a number",
    ),
    "a speed that is not a number": (
        rod('lower="-1" upper="1" effort="9" velocity="nan"'),
        "beast.urdf:35: velocity of joint 'turn' is not a number",
    ),
    "an effort that is a word": (
        rod('lower="-1" upper="1" effort="much"'),
        'beast.urdf:35: effort="much" of <limit> is not a number',
    ),
    "more links than a spec may have": (
        quadruped(
            "".join(
                link(f"l{i}") + joint(f"j{i}", f"l{i - 1}" if i else "body", f"l{i}", (0, 0, 0.01))
                for i in range(250)
            )
        ),
        "beast.urdf:35: joint 'j199' is the 200th in series: a spec has at most 199\n  hold some",
    ),
}


@pytest.mark.parametrize("name", REFUSED)
def test_what_no_robot_can_be_is_refused_with_its_line(
    name: str, capsys: pytest.CaptureFixture[str]
) -> None:
    text, words = REFUSED[name]
    Path(FILE).write_bytes(text if isinstance(text, bytes) else text.encode())
    assert main(["import", FILE, "--out", "deep/mine"]) == 2
    captured = capsys.readouterr()
    assert captured.out == ""
    assert captured.err.startswith(f"error: {words}")
    assert os.listdir() == [FILE]


HELD = "beast.urdf:35: joint 'turn' declares {}: it is held\n  usable: 0.001 N m and more, or"
SPEED = "beast.urdf:35: joint 'turn' declares a speed of {} rad/s: it is not used\n  usable: 0.01"
RANGE = "beast.urdf:35: range [{}] of joint 'turn' is {} is taken"
SOUND = 'effort="9" velocity="9"'
NOTED: dict[str, tuple[str, str]] = {
    "a closed loop": (
        quadruped(joint("again", "FR_calf", "FL_foot", (0, 0, 0))),
        "beast.urdf:35: closed loop 'again' between 'FR_calf' and 'FL_foot' is cut\n  the drive",
    ),
    "an effort of zero": (rod('effort="0"'), HELD.format("an effort of 0")),
    "no effort": (rod('velocity="9"'), HELD.format("no effort")),
    "an effort below zero": (rod('effort="-5"'), HELD.format("an effort of -5")),
    "an effort without end": (rod('effort="inf"'), "beast.urdf: 1 of 13 drives declare no torque"),
    "a placeholder of an effort": (
        rod('effort="5000"'),
        "beast.urdf:35: joint 'turn': 5000 N m is implausible and replaced by 2.5",
    ),
    "an effort of nearly nothing": (rod('effort="1e-300"'), HELD.format("an effort of 1e-300")),
    "a speed of zero": (rod('effort="9" velocity="0"'), SPEED.format("0")),
    "a speed below zero": (rod('effort="9" velocity="-1"'), SPEED.format("-1")),
    "a speed without end": (rod('effort="9" velocity="inf"'), SPEED.format("inf")),
    "a speed of nearly nothing": (rod('effort="9" velocity="1e-300"'), SPEED.format("1e-300")),
    "a range of nothing": (
        rod(f'lower="0" upper="0" {SOUND}'),
        RANGE.format("0, 0", "empty: a turn"),
    ),
    "no range": (rod(SOUND), RANGE.format("0, 0", "empty: a turn")),
    "a range upside down": (
        rod(f'lower="1" upper="-1" {SOUND}'),
        RANGE.format("1, -1", "empty: a turn"),
    ),
    "a range beyond all": (
        rod(f'lower="-1e9" upper="1e9" {SOUND}'),
        RANGE.format("-1e+09, 1e+09", "too wide: a turn"),
    ),
    "a range in degrees": (
        rod(f'lower="-90" upper="90" {SOUND}'),
        RANGE.format("-90, 90", "too wide: two turns at most"),
    ),
    "a range beyond two turns": (
        rod(f'lower="100" upper="200" {SOUND}'),
        RANGE.format("100, 200", "too wide: a turn"),
    ),
    "a mass of zero": (
        quadruped().replace('mass value="1.0"', 'mass value="0"'),
        "beast.urdf:3: link 'FL_hip' moves and weighs 0 kg",
    ),
    "a trunk of no mass": (
        having('mass value="8.0"', 'mass value="0"'),
        "beast.urdf:2: the trunk has no meshes to read: the extent of its shapes or joints stands",
    ),
}


@pytest.mark.parametrize("name", NOTED)
def test_what_can_be_mended_is_a_warning_with_its_line(
    name: str, capsys: pytest.CaptureFixture[str]
) -> None:
    text, words = NOTED[name]
    Path(FILE).write_text(text, encoding="utf-8")
    assert main(["import", FILE, "--out", "mine"]) == 0
    captured = capsys.readouterr()
    assert captured.err == ""
    assert f"warning: {words}" in captured.out
    draft.load("mine").resolve().build()


FLAT = CUBE.replace("0.05", "0.0")
READ = "mesh 'b.{}' cannot be read: {}"
MESHES: dict[str, tuple[str, bytes | str | int, str]] = {
    # Its suffix, what is in it or how many zeros, and what is said.
    "points that are no numbers": ("obj", CUBE.replace("0.3", "nan"), "mesh 'b.obj' has no finite"),
    "points without end": ("obj", CUBE.replace("0.3", "1e400"), "mesh 'b.obj' has no finite"),
    "points far away": ("obj", CUBE.replace("0.3", "1e300"), "mesh 'b.obj' reaches beyond"),
    "a flat mesh": ("obj", FLAT, "the trunk's meshes are too thin to cut: the box with its"),
    "a point that is not there": (
        "obj",
        CUBE + "\nf 1 2 9",
        READ.format("obj", "it names a point that is not there"),
    ),
    "a point before the first": (
        "obj",
        CUBE + "\nf -1 -2 -9",
        READ.format("obj", "a face is not the numbers of three points or more"),
    ),
    "a point zero": ("obj", CUBE + "\nf 1 2 0", READ.format("obj", "a face is not the numbers of")),
    "half a point": (
        "obj",
        CUBE + "\nf 1 2 2.5",
        READ.format("obj", "a face is not the numbers of"),
    ),
    "a point in a plane": ("obj", "v 1 2\n" + CUBE, READ.format("obj", "its numbers do not fit")),
    "an empty OBJ": ("obj", "", READ.format("obj", "it is not an OBJ file")),
    "an OBJ of 60 MB": ("obj", 60_000_000, READ.format("obj", "it has more than 50 MB")),
    "an empty STL": ("stl", "", READ.format("stl", "it is not an STL file")),
    "an STL of nothing": ("stl", 84, READ.format("stl", "it has no finite triangles")),
    "an STL that is cut": (
        "stl",
        84 + 13,
        READ.format("stl", "its header says 0 triangles, it holds 0"),
    ),
    "an STL whose header lies": (
        "stl",
        binary(np.zeros((7, 3, 3)), 2**32 - 1),
        READ.format("stl", "its header says 4294967295 triangles, it holds 7"),
    ),
    "a text STL that is cut": (
        "stl",
        "solid x\nvertex 0 0 0\nvertex 1 0 0\n",
        READ.format("stl", "its text is cut short"),
    ),
    "an STL of 70 MB": ("stl", 70_000_000, READ.format("stl", "it has more than 60 MB")),
    "a DAE with entities": ("dae", LAUGHS, READ.format("dae", "line 1: it has a DOCTYPE")),
    "a DAE of something else": ("dae", "<robot/>", READ.format("dae", "it is not a COLLADA file")),
    "another kind": ("glb", b"glTF", READ.format("glb", "'.glb' is not read: save it as STL, OBJ")),
}


@pytest.mark.parametrize("name", MESHES)
def test_a_bad_mesh_is_a_warning_and_the_inertia_stands_in(
    name: str, capsys: pytest.CaptureFixture[str]
) -> None:
    suffix, data, words = MESHES[name]
    path = Path(f"b.{suffix}")
    if isinstance(data, int):
        path.touch()
        os.truncate(path, data)
    else:
        path.write_bytes(data.encode() if isinstance(data, str) else data)
    Path(FILE).write_text(quadruped(mesh=path.name), encoding="utf-8")
    assert main(["import", FILE, "--out", "mine", "--no-preview"]) == 0
    captured = capsys.readouterr()
    assert captured.err == ""
    assert f"warning: beast.urdf:2: {words}" in captured.out
    assert "the box with its inertia stands in" in captured.out
    draft.load("mine").resolve().build()


NAMES: dict[str, Callable[[str], str]] = {
    "other alphabets": lambda text: text.replace("FL_", "左_").replace('"body"', '"躯干"'),
    "spaces": lambda text: text.replace("FL_", "front left ").replace("body", "the body"),
    "slashes": lambda text: text.replace("FL_", "a/b/").replace("FR_", "../c/"),
    "equal once cleaned": lambda text: text.replace("FL_", "left-").replace("FR_", "left_"),
    "words of YAML": lambda text: text.replace("FL_", ": {x}# &amp;'").replace("body", "no"),
    "lines": lambda text: text.replace("FL_", "a&#10;b"),
    "functions": lambda text: text.replace("FL_thigh", "sqrt").replace("FR_thigh", "pi"),
    "very long": lambda text: text.replace("FL_", "x" * 5000),
    "nothing but signs": lambda text: text.replace("FL_hip", "--").replace("FR_hip", "..."),
}


@pytest.mark.parametrize("name", NAMES)
def test_names_of_any_kind_become_names_of_a_spec(name: str) -> None:
    Path(FILE).write_text(NAMES[name](quadruped()), encoding="utf-8")
    assert main(["import", FILE, "--out", "mine"]) == 0
    spec = draft.load("mine")
    for body in spec.bodies:
        assert re.fullmatch(r"\w+", body.name, re.ASCII)
    assert spec.resolve().build().mujoco.njnt == 13


def test_an_out_that_cannot_be_is_refused(capsys: pytest.CaptureFixture[str]) -> None:
    Path(FILE).write_text(quadruped(), encoding="utf-8")
    Path("there").mkdir()
    Path("nowhere").symlink_to("gone")
    for out, words in {
        "there": "'there' exists; it is kept\n  choose another --out",
        "nowhere": "'nowhere' exists; it is kept",
        "new/..": "'new/..' exists; it is kept",
        f"{FILE}/mine": "cannot write beast.urdf/mine: not a directory\n  choose another place",
        f"{FILE}/a/b": "cannot write beast.urdf/a/b: not a directory",
        "x" * 300: f"cannot write {'x' * 300}: file name too long",
    }.items():
        assert main(["import", FILE, "--out", out]) == 2
        assert capsys.readouterr().err.startswith(f"error: {words}")
    assert sorted(os.listdir()) == [FILE, "nowhere", "there"]
    assert os.listdir("there") == []


def test_a_file_that_cannot_be_read_is_refused(capsys: pytest.CaptureFixture[str]) -> None:
    Path("folder.urdf").mkdir()
    os.mkfifo("pipe.urdf")
    Path("large.urdf").touch()
    os.truncate("large.urdf", 200_000_000)
    for file, words in {
        "folder.urdf": "folder.urdf: this is not a file",
        "pipe.urdf": "pipe.urdf: this is not a file",
        "gone.urdf": "gone.urdf: file not found",
        "large.urdf": "large.urdf: file of 200.0 MB\n  a description may have up to 50 MB",
    }.items():
        assert main(["import", file, "--out", "mine"]) == 2
        assert capsys.readouterr().err.startswith(f"error: {words}")
    assert not os.path.lexists("mine")


@pytest.mark.skipif(os.name != "posix" or os.geteuid() != 0, reason="takes another user's rights")
def test_rights_that_are_missing_are_named(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    # Root may read and write everything: what follows runs as another user, modules loaded before.
    tmp_path.chmod(0o755)
    Path(FILE).write_text(quadruped(), encoding="utf-8")
    Path("closed.urdf").write_text(quadruped(), encoding="utf-8")
    Path("closed.urdf").chmod(0)
    Path("fixed").mkdir(mode=0o555)
    assert main(["import", FILE, "--out", "mine"]) == 0
    capsys.readouterr()
    os.seteuid(65534)
    try:
        assert main(["import", "closed.urdf", "--out", "fixed/a"]) == 2
        words = "closed.urdf: cannot read it: Permission denied"
        assert capsys.readouterr().err == f"error: {words}\n"
        assert main(["import", FILE, "--out", "fixed/a"]) == 2
        words = "cannot write fixed/a: permission denied\n  choose another place"
        assert capsys.readouterr().err == f"error: {words}\n"
    finally:
        os.seteuid(0)


def test_a_file_name_that_is_no_text_is_refused(capsys: pytest.CaptureFixture[str]) -> None:
    name = os.fsdecode(b"\xff.urdf")
    Path(name).write_text(quadruped(), encoding="utf-8")
    assert main(["import", name, "--out", "mine"]) == 2
    assert capsys.readouterr().err == "error: '\\udcff.urdf' is no name in UTF-8\n  rename it\n"
    assert not os.path.lexists("mine")


def test_a_comma_between_numbers_is_named(capsys: pytest.CaptureFixture[str]) -> None:
    Path(FILE).write_text(having('xyz="0.2 0.1 0"', 'xyz="0.2, 0.1 0"'), encoding="utf-8")
    assert main(["import", FILE, "--out", "mine"]) != 0
    assert "separate numbers by spaces only" in capsys.readouterr().err


def test_a_finger_alone_has_hinges() -> None:
    """Fingers of a robot are held; where there is nothing else they are its limbs."""
    parts = [joint(f"finger_{i}", f"l{i}", f"l{i + 1}", (0, 0, -0.1)) for i in range(3)]
    links = [link(f"l{i}") for i in range(4)]
    text = '<robot name="f">' + "\n".join([*links, *parts]) + "</robot>"
    Path(FILE).write_text(text, encoding="utf-8")
    assert len(import_robot(FILE, "mine").joints) == 3


def test_a_floating_base_below_a_world_is_checked_too() -> None:
    world = '<link name="world"/><joint name="base" type="floating"><parent link="world"/>'
    text = quadruped(f'{world}<child link="body"/></joint>')
    Path(FILE).write_text(text, encoding="utf-8")
    found = import_robot(FILE, "mine").geometry
    assert (found.joints, found.skipped) == (12, "")
