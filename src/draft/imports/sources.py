"""Robot descriptions by path or by name: files, well-kept packages of robots, and xacro.

A name is `PACKAGE:ROBOT`. mujoco-menagerie and robot_descriptions download what they need when it
is used; example-robot-data has its files installed. Nothing is imported before a name asks for it.
"""

from __future__ import annotations

import contextlib
import importlib
import io
import os
import sys
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass
from importlib import metadata
from pathlib import Path, PurePath

from draft.errors import DraftError, Location, Problem, suggest
from draft.extras import missing, need

EXTRA = "robots"
XACRO = ".xacro"
DATA = "example-robot-data"
_DESCRIPTION = "name a maker's URDF, MJCF or xacro file, or a robot: menagerie:unitree_go2"
# Folders of example-robot-data are called after their robots, with one of these endings.
ENDINGS = ("_simple_description", "_description", "_data")


@dataclass(frozen=True, slots=True)
class Source:
    """A description.

    Attributes:
        path: its file; meshes are searched from there.
        name: name of the robot for the spec's folder.
        text: the file's text where it had to be made, such as from xacro; else None.
    """

    path: Path
    name: str
    text: str | None = None


def find_source(file: str | Path) -> Source:
    """Find a description by path, or by name in a package of robots.

    Args:
        file: a URDF, MJCF or xacro file; `menagerie:ROBOT`, `robot_descriptions:ROBOT_description`
            or `example-robot-data:ROBOT`.

    Raises:
        DraftError: there is no such file or robot, its package is not installed or cannot download
            it, or the xacro cannot be expanded.
    """
    package, colon, robot = str(file).partition(":")
    if not colon or package not in PACKAGES or Path(file).exists():
        path = _checked(Path(file))
        return Source(path, path.stem) if path.suffix != XACRO else _expanded(path)
    if not robot:
        raise DraftError(f"'{file}' names no robot", f"such as {EXAMPLES[package]}")
    return PACKAGES[package](robot)


def _checked(path: Path) -> Path:
    """Path of a description, which exists and is no folder."""
    if os.path.isdir(path):
        held: list[str] = []
        with contextlib.suppress(OSError):
            held = sorted(one for one in os.listdir(path) if one.endswith((".urdf", ".xml", XACRO)))
        remedy = f"name a file in it: {', '.join(held[:9])}" if held else _DESCRIPTION
        raise DraftError(Problem("this is a folder, not a file", Location(str(path)), remedy))
    if not os.path.exists(path):
        raise DraftError(Problem("file not found", Location(str(path)), _DESCRIPTION))
    return path


def _menagerie(robot: str) -> Source:
    """MJCF file of a robot of MuJoCo Menagerie, without its scene."""
    package = need("mujoco_menagerie", EXTRA)
    if robot not in package.names():
        raise _unknown(robot, package.names(), "mujoco-menagerie")
    with _downloading("menagerie", robot):
        entry = package.get(robot)
        return Source(Path(entry.xml(entry.default_model)), robot)


def _robot_descriptions(robot: str) -> Source:
    """URDF or MJCF file of a module of robot_descriptions."""
    need("robot_descriptions", EXTRA)
    known = importlib.import_module("robot_descriptions._descriptions").DESCRIPTIONS
    if robot not in known:
        raise _unknown(robot, known, "robot_descriptions")
    with _downloading("robot_descriptions", robot), _quiet():
        module = importlib.import_module(f"robot_descriptions.{robot}")
    name = robot.removesuffix("_description").removesuffix("_mj")
    for attribute in ("URDF_PATH", "MJCF_PATH"):
        path = getattr(module, attribute, None)
        if path is not None:
            return Source(Path(path), name)
    if getattr(module, "XACRO_PATH", None) is None:
        cause = f"robot_descriptions has no URDF, MJCF or xacro file of '{robot}'"
        raise DraftError(cause, "import a file of that robot by its path")
    arguments = getattr(module, "XACRO_ARGS", None) or {}
    return Source(Path(module.XACRO_PATH), name, _xacro(Path(module.XACRO_PATH), arguments))


def _example_robot_data(robot: str) -> Source:
    """URDF file of example-robot-data, by its own name or that of its folder."""
    try:
        files = metadata.distribution(DATA).files or []
    except metadata.PackageNotFoundError:
        raise missing(DATA, EXTRA) from None
    table = _by_name([file for file in files if file.suffix == ".urdf" and "robots" in file.parts])
    if robot not in table:
        raise _unknown(robot, table, DATA)
    path = Path(str(metadata.distribution(DATA).locate_file(table[robot])))
    return Source(path.resolve(), robot)


def _by_name(files: list[metadata.PackagePath]) -> dict[str, PurePath]:
    """Files by the names that mean them: of each folder, and of a file that no other has."""
    folders: dict[str, list[PurePath]] = {}
    stems: dict[str, list[PurePath]] = {}
    for file in files:
        folder = file.parts[file.parts.index("robots") + 1]
        for ending in ENDINGS:
            folder = folder.removesuffix(ending)
        folders.setdefault(folder, []).append(file)
        stems.setdefault(file.stem, []).append(file)
    # A folder of several robots means the one of its name, else the one of the shortest.
    table = {
        name: min(own, key=lambda file: (file.stem != name, len(file.stem), file.stem))
        for name, own in folders.items()
    }
    return table | {name: own[0] for name, own in stems.items() if len(own) == 1}


def _expanded(path: Path) -> Source:
    """Source of a xacro file, expanded."""
    name = path.name.removesuffix(XACRO).removesuffix(".urdf")
    return Source(path, name, _xacro(path, {}))


def _xacro(path: Path, arguments: Mapping[str, str]) -> str:
    """URDF text of a xacro file."""
    package = need("xacrodoc", EXTRA)
    try:
        with contextlib.redirect_stderr(io.StringIO()):
            document = package.XacroDoc.from_file(path, subargs=dict(arguments))
            return str(document.to_urdf_string())
    except Exception as error:
        # Xacro runs expressions of the file: what goes wrong there has any type.
        cause = f"the xacro cannot be expanded: {_last_line(error)}"
        remedy = "expand it in its own workspace, xacro FILE > robot.urdf, and import that"
        raise DraftError(Problem(cause, Location(str(path)), remedy)) from None


@contextlib.contextmanager
def _downloading(package: str, robot: str) -> Iterator[None]:
    """Say what could not be downloaded: the packages raise whatever git and urllib raise."""
    try:
        yield
    except DraftError:
        raise
    except Exception as error:
        cause = f"cannot download {package}:{robot}: {_last_line(error)}"
        remedy = "is there a network? or import a file of that robot by its path"
        raise DraftError(cause, remedy) from None


@contextlib.contextmanager
def _quiet() -> Iterator[None]:
    """Keep stdout for results: what a package prints goes to stderr, its progress bars nowhere."""
    with contextlib.redirect_stdout(sys.stderr), contextlib.redirect_stderr(io.StringIO()):
        yield


def _last_line(error: Exception) -> str:
    """Last line of an error; of git's, without the name of the stream and its quotes."""
    lines = str(error).strip().splitlines()
    line = lines[-1].strip() if lines else type(error).__name__
    if line.startswith("stderr: '"):
        line = line.removeprefix("stderr: '").removesuffix("'")
    return line[:200]


def _unknown(robot: str, known: Iterable[str], package: str) -> DraftError:
    cause = f"{package} has no robot '{robot}'"
    return DraftError(cause, suggest(robot, known, "robots"))


PACKAGES: dict[str, Callable[[str], Source]] = {
    "menagerie": _menagerie,
    "robot_descriptions": _robot_descriptions,
    DATA: _example_robot_data,
}
EXAMPLES = {
    "menagerie": "menagerie:unitree_go2",
    "robot_descriptions": "robot_descriptions:go2_description",
    DATA: f"{DATA}:anymal_c",
}
