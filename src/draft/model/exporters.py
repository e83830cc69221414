"""Exporters: the formats of a model's files, and the registry to which `@exporter` adds one."""

from __future__ import annotations

import inspect
import json
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from pathlib import PurePosixPath
from typing import TYPE_CHECKING, Any

from draft.errors import DraftError, suggest
from draft.extensions import Registry, reason
from draft.values import plain

if TYPE_CHECKING:
    from draft.model.model import Model

Files = Mapping[str, str | bytes]
Write = Callable[["Model"], Files]
# Formats of `draft export` unless some are named.
FORMATS = ("urdf", "glb", "mjcf")
# Files of every folder, and of reports.
_OWN = ("design.yaml", "report.json", "report.html")


@dataclass(frozen=True, slots=True)
class Exporter:
    """A format of files.

    Attributes:
        name: name in commands.
        doc: description, one sentence.
        files: paths of its files in the folder of a model.
        function: function from a model to the contents of some of these files.
    """

    name: str
    doc: str
    files: tuple[str, ...]
    function: Write


EXPORTERS: Registry[Exporter] = Registry("exporter")


def exporter(*files: str) -> Callable[[Write], Write]:
    """Register a function from a model to the contents of files as a format of `draft export`.

    The format has the name of the function:

        @exporter("masses.csv")
        def masses(model: Model) -> dict[str, str]:
            \"\"\"Masses of the bodies [kg].\"\"\"
            return {"masses.csv": ",".join(map(str, model.mujoco.body_mass[1:]))}

    Args:
        files: paths of the files that it may write, in the folder of the model.

    Raises:
        DraftError: an exporter of this name exists already, or a file belongs to another one.
    """

    def register(function: Write) -> Write:
        name, origin = function.__name__, function.__module__
        taken = known_files(besides=name)
        for file in files:
            path = PurePosixPath(file)
            if path.is_absolute() or ".." in path.parts or str(path) != file or file in taken:
                cause = f"the exporter '{name}' of {origin} cannot write '{file}'"
                raise DraftError(cause, "choose another path in the folder of a model")
        doc = (inspect.getdoc(function) or "").partition("\n")[0]
        EXPORTERS.add(name, Exporter(name, doc, files, function), origin)
        return function

    return register


def known_files(besides: str = "") -> set[str]:
    """Paths of all that Draft and its extensions write into the folder of a model.

    Args:
        besides: an exporter whose files are left out.
    """
    paths = {*_OWN}
    for one in EXPORTERS.values():
        if one.name != besides:
            paths |= {*one.files}
    folders = {str(up) for path in paths for up in PurePosixPath(path).parents}
    return paths | folders - {"."}


def check_formats(formats: Iterable[str]) -> None:
    """Refuse a format that no exporter has.

    Raises:
        DraftError: there is one.
    """
    for name in formats:
        if name not in EXPORTERS:
            raise DraftError(f"unknown format '{name}'", suggest(name, EXPORTERS, "formats"))


def contents(model: Model, name: str) -> Files:
    """Contents of the files of a format, by path.

    Raises:
        DraftError: an exporter of an extension fails.
        ModelError: MuJoCo does not accept the scene.
    """
    one, origin = EXPORTERS[name], EXPORTERS.origin(name)
    if not origin:
        return one.function(model)
    try:
        files = {str(path): content for path, content in one.function(model).items()}
        if others := [path for path in files if path not in one.files]:
            raise ValueError(f"it writes '{others[0]}', which it does not name")
        if others := [path for path, text in files.items() if not isinstance(text, (str, bytes))]:
            raise ValueError(f"the content of '{others[0]}' is no text")
    except Exception as error:
        cause = f"the exporter '{name}' of {origin} fails: {reason(error)}"
        raise DraftError(cause, "correct it, or name other formats") from error
    return files


@exporter("robot.urdf", "meshes/trunk.stl", "actuators.json")
def urdf(model: Model) -> dict[str, str | bytes]:
    """URDF with the mesh of the trunk, and a table of what URDF cannot hold."""
    from draft.model import urdf as format_

    table: dict[str, Any] = plain(format_.actuators(model.design))
    return {
        "robot.urdf": format_.robot_urdf(model),
        format_.TRUNK: format_.trunk_stl(model.design.trunk.loft),
        "actuators.json": json.dumps(table, indent=2) + "\n",
    }


@exporter("robot.glb")
def glb(model: Model) -> dict[str, str | bytes]:
    """Binary glTF for viewers."""
    from draft.model.glb import robot_glb

    return {"robot.glb": robot_glb(model)}


@exporter("robot.xml", "scene.xml")
def mjcf(model: Model) -> dict[str, str | bytes]:
    """MJCF of the robot, and a scene with floor, light and servos."""
    model.scene()
    return {"robot.xml": model.xml, "scene.xml": model.scene_xml}
