"""Whatever is wrong with a vendor's file is named with its line; nothing is left half-written.

Each message is pinned. `pytest --force-regen` accepts changed words.
"""

from __future__ import annotations

import os
import re
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from pytest_regressions.file_regression import FileRegressionFixture

import draft
from tests.commands import printed, refusal
from tests.imports.written import CUBE, imported, joint, link, notes, quadruped, written

FILE = "beast.urdf"


def having(old: str, new: str) -> str:
    """The sound quadruped with its first `old` replaced."""
    text = quadruped()
    assert old in text
    return text.replace(old, new, 1)


def rod(limit: str, reach: str = 'lower="-1" upper="1"') -> str:
    """The sound quadruped with a joint of these limits, which is no wheel's, on line 35."""
    turn = joint("turn", "body", "rod", (0, 0, 0.1), axis="0 0 1", limit=f"{limit} {reach}")
    return quadruped(link("rod") + turn)


def boxed(size: str) -> str:
    """The sound quadruped with a box of a size on its trunk."""
    shape = f'<visual><geometry><box size="{size} 1 1"/></geometry></visual>'
    return having("</inertial></link>", f"</inertial>{shape}</link>")


ORIGIN, AXIS = 'xyz="0.2 0.1 0"', 'axis xyz="1 0 0"'
LAUGHS = '<!DOCTYPE r [<!ENTITY a "ha"><!ENTITY b "&a;&a;&a;">]>\n<robot>&b;</robot>'
LONG = "".join(
    link(f"l{i}") + joint(f"j{i}", f"l{i - 1}" if i else "body", f"l{i}", (0, 0, 0.01))
    for i in range(250)
)
# What the reader refuses in any description is in tests/description.
REFUSED: dict[str, str | bytes] = {
    "an empty file": "",
    "a binary file": bytes(range(256)),
    "another encoding": '<?xml version="1.0" encoding="x-none"?><robot/>',
    "a loop through the root": quadruped(joint("back", "FL_calf", "body", (0, 0, 0))),
    "a link that hangs on itself": quadruped(
        link("ring") + joint("round", "ring", "ring", (0, 0, 0))
    ),
    "a link twice": quadruped(link("body")),
    "a joint twice": quadruped(link("rod") + joint("FL_roll", "body", "rod", (0, 0, 0))),
    "an origin that is not a number": having(ORIGIN, 'xyz="nan 0.1 0"'),
    "a comma between numbers": having(ORIGIN, 'xyz="0.2, 0.1 0"'),
    "an axis that is not a number": having(AXIS, 'axis xyz="nan 0 0"'),
    "an axis of zero": having(AXIS, 'axis xyz="0 0 0"'),
    "an inertia that is not a number": having("ixx=", 'ixx="nan" was='),
    "a size that is not a number": boxed("nan"),
    "an origin far away": having(ORIGIN, 'xyz="1e300 0.1 0"'),
    "origins in millimetres": having(ORIGIN, 'xyz="200 100 0"'),
    "a mass beyond all": having('mass value="8.0"', 'mass value="1e300"'),
    "an inertia beyond all": having("ixx=", 'ixx="1e308" was='),
    "a centre of mass far away": having("<inertial>", '<inertial><origin xyz="0 -1e200 0"/>'),
    "a box beyond all": boxed("1e300"),
    "an effort that is not a number": rod('effort="nan"'),
    "a speed that is not a number": rod('effort="9" velocity="nan"'),
    "a limit that is not a number": rod('effort="1"', 'lower="nan"'),
    "an effort that is a word": rod('effort="much"'),
    "more links than a spec may have": quadruped(LONG),
}


@pytest.mark.parametrize("name", REFUSED)
def test_what_no_robot_can_be_is_refused_with_its_line(
    name: str, file_regression: FileRegressionFixture
) -> None:
    text = REFUSED[name]
    Path(FILE).write_bytes(text if isinstance(text, bytes) else text.encode())
    told = refusal("import", FILE, "--out", "deep/mine")
    assert os.listdir() == [FILE]
    file_regression.check(told, basename=name.replace(" ", "_"))


SOUND = 'effort="9" velocity="9"'
# The range that is then taken, in turns to either side.
TURNS = dict.fromkeys(
    ("a range of nothing", "no range", "a range upside down", "a range beyond all"), 1
) | {"a range in degrees": 2, "a range beyond two turns": 1}
NOTED = {
    "a closed loop": quadruped(joint("again", "FR_calf", "FL_foot", (0, 0, 0))),
    "an effort of zero": rod('effort="0"'),
    "no effort": rod('velocity="9"'),
    "an effort below zero": rod('effort="-5"'),
    "an effort without end": rod('effort="inf"'),
    "a placeholder of an effort": rod('effort="5000"'),
    "an effort of nearly nothing": rod('effort="1e-300"'),
    "a speed of zero": rod('effort="9" velocity="0"'),
    "a speed below zero": rod('effort="9" velocity="-1"'),
    "a speed without end": rod('effort="9" velocity="inf"'),
    "a speed of nearly nothing": rod('effort="9" velocity="1e-300"'),
    "a range of nothing": rod(SOUND, 'lower="0" upper="0"'),
    "no range": rod(SOUND, ""),
    "a range upside down": rod(SOUND, 'lower="1" upper="-1"'),
    "a range beyond all": rod(SOUND, 'lower="-1e9" upper="1e9"'),
    "a range in degrees": rod(SOUND, 'lower="-90" upper="90"'),
    "a range beyond two turns": rod(SOUND, 'lower="100" upper="200"'),
    "a mass of zero": quadruped().replace('mass value="1.0"', 'mass value="0"'),
    "a trunk of no mass": having('mass value="8.0"', 'mass value="0"'),
}


@pytest.mark.parametrize("name", NOTED)
def test_what_can_be_mended_is_a_warning_with_its_line(
    name: str, file_regression: FileRegressionFixture
) -> None:
    usual = notes(imported(quadruped(), out="sound"))
    told = [note for note in notes(imported(NOTED[name])) if note not in usual]
    file_regression.check("\n".join(told) + "\n", basename=name.replace(" ", "_"))
    model = draft.load("mine").resolve().build().mujoco
    if name in TURNS:
        edge = 2 * np.pi * TURNS[name]
        assert model.joint("turn").range == pytest.approx([-edge, edge], abs=1e-3)


READ = "mesh 'b.{}' cannot be read: "
THIN = "the trunk's meshes are too thin to cut: the box with its"
# Its name, what is in it or how many zeros, and what is said. What else the file of a mesh may have
# is in test_meshes.py and test_collada.py.
MESHES: dict[str, tuple[str, bytes | str | int, str]] = {
    "points that are no numbers": ("b.obj", CUBE.replace("0.3", "nan"), "mesh 'b.obj' has no fin"),
    "points without end": ("b.obj", CUBE.replace("0.3", "1e400"), "mesh 'b.obj' has no finite"),
    "points far away": ("b.obj", CUBE.replace("0.3", "1e300"), "mesh 'b.obj' reaches beyond"),
    "a flat mesh": ("b.obj", CUBE.replace("0.05", "0.0"), THIN),
    "no mesh": ("b.stl", "no mesh", READ.format("stl") + "it is not an STL file"),
    "an OBJ of 60 MB": ("b.obj", 60_000_000, READ.format("obj") + "it has more than 50 MB"),
    "an STL of 70 MB": ("b.stl", 70_000_000, READ.format("stl") + "it has more than 60 MB"),
    "entities": ("b.dae", LAUGHS, READ.format("dae") + "line 1: it has a DOCTYPE"),
    "another kind": ("b.glb", b"glTF", READ.format("glb") + "'.glb' is not read: save it as STL"),
    "a file above": ("../../b.stl", "", "mesh '../../b.stl' leads outside the robot's folder"),
    "a file elsewhere": ("/etc/b.stl", "", "mesh '/etc/b.stl' leads outside the robot's folder"),
    "no file": ("package://x/b.stl", "", "mesh 'package://x/b.stl' is missing"),
}


@pytest.mark.parametrize("name", MESHES)
def test_a_bad_mesh_is_a_warning_and_the_inertia_stands_in(name: str) -> None:
    mesh, data, words = MESHES[name]
    path = Path(mesh)
    if isinstance(data, int):
        path.touch()
        os.truncate(path, data)
    elif data:
        path.write_bytes(data.encode() if isinstance(data, str) else data)
    written(quadruped(mesh=mesh))
    out = printed("import", FILE, "--out", "mine", "--no-preview")
    assert f"warning: beast.urdf:2: {words}" in out
    assert "the box with its inertia stands in" in out
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
    imported(NAMES[name](quadruped()))
    spec = draft.load("mine")
    for body in spec.bodies:
        assert re.fullmatch(r"\w+", body.name, re.ASCII)
    assert spec.resolve().build().mujoco.njnt == 13


@pytest.mark.parametrize(
    ("out", "words"),
    [
        ("there", "'there' exists; it is kept\n  choose another --out"),
        ("nowhere", "'nowhere' exists; it is kept"),
        ("new/..", "'new/..' exists; it is kept"),
        (f"{FILE}/mine", "cannot write beast.urdf/mine: not a directory\n  choose another place"),
        (f"{FILE}/a/b", "cannot write beast.urdf/a/b: not a directory"),
        ("x" * 300, f"cannot write {'x' * 300}: file name too long"),
    ],
)
def test_an_out_that_cannot_be_is_refused(out: str, words: str) -> None:
    written(quadruped())
    Path("there").mkdir()
    Path("nowhere").symlink_to("gone")
    assert refusal("import", FILE, "--out", out).startswith(words)
    assert sorted(os.listdir()) == [FILE, "nowhere", "there"]
    assert os.listdir("there") == []


@pytest.mark.parametrize(
    ("file", "words"),
    [
        ("folder.urdf", "folder.urdf: this is a folder, not a file\n  name a file in it: a.urdf"),
        ("pipe.urdf", "pipe.urdf: this is not a file"),
        ("gone.urdf", "gone.urdf: file not found"),
        ("large.urdf", "large.urdf: file of 200.0 MB\n  a description may have up to 50 MB"),
        (os.fsdecode(b"\xff.urdf"), "'\\udcff.urdf' is no name in UTF-8\n  rename it\n"),
    ],
    ids=ascii,
)
def test_a_file_that_cannot_be_read_is_refused(file: str, words: str) -> None:
    Path("folder.urdf").mkdir()
    Path("folder.urdf/a.urdf").touch()
    os.mkfifo("pipe.urdf")
    Path("large.urdf").touch()
    os.truncate("large.urdf", 200_000_000)
    written(quadruped(), os.fsdecode(b"\xff.urdf"))
    assert refusal("import", file, "--out", "mine").startswith(words)
    assert not os.path.lexists("mine")


@pytest.mark.skipif(os.name != "posix" or os.geteuid() != 0, reason="takes another user's rights")
def test_rights_that_are_missing_are_named(tmp_path: Path) -> None:
    # Root may read and write everything: what follows runs as another user, modules loaded before.
    tmp_path.chmod(0o755)
    written(quadruped())
    written(quadruped(), "closed.urdf").chmod(0)
    Path("fixed").mkdir(mode=0o555)
    printed("import", FILE, "--out", "mine")
    os.seteuid(65534)
    try:
        words = "closed.urdf: cannot read it: Permission denied\n"
        assert refusal("import", "closed.urdf", "--out", "fixed/a") == words
        words = "cannot write fixed/a: permission denied\n  choose another place\n"
        assert refusal("import", FILE, "--out", "fixed/a") == words
    finally:
        os.seteuid(0)


def test_a_finger_alone_has_hinges() -> None:
    """Fingers of a robot are held; where there is nothing else they are its limbs."""
    parts = [joint(f"finger_{i}", f"l{i}", f"l{i + 1}", (0, 0, -0.1)) for i in range(3)]
    links = [link(f"l{i}") for i in range(4)]
    text = '<robot name="f">' + "\n".join([*links, *parts]) + "</robot>"
    assert len(imported(text).joints) == 3


def test_a_floating_base_below_a_world_is_checked_too() -> None:
    world = '<link name="world"/><joint name="base" type="floating"><parent link="world"/>'
    found = imported(quadruped(f'{world}<child link="body"/></joint>')).geometry
    assert (found.joints, found.skipped) == (12, "")
