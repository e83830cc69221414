"""Exporters: the formats of a model's files, and the registry to which `@exporter` adds one."""

from __future__ import annotations

import inspect
import json
from collections.abc import Callable, Collection, Iterable, Mapping
from dataclasses import dataclass
from fnmatch import fnmatchcase
from pathlib import PurePosixPath
from typing import TYPE_CHECKING, Any

from draft.errors import DraftError, suggest
from draft.extensions import Registry
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
        files: paths of its files in the folder of a model, or patterns of them.
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
        files: paths of the files that it may write, in the folder of the model; `*` stands for
            any letters.

    Raises:
        DraftError: an exporter of this name exists already, or a file belongs to another one.
    """

    def register(function: Write) -> Write:
        name, origin = function.__name__, function.__module__
        taken = _paths(one for one in EXPORTERS.present.values() if one.name != name)
        for file in files:
            path = PurePosixPath(file)
            # Draft's own share the mesh of the trunk.
            others = origin != __name__ and file in taken
            if path.is_absolute() or ".." in path.parts or str(path) != file or others:
                cause = f"the exporter '{name}' of {origin} cannot write '{file}'"
                raise DraftError(cause, "choose another path in the folder of a model")
        doc = (inspect.getdoc(function) or "").partition("\n")[0]
        EXPORTERS.add(name, Exporter(name, doc, files, function), origin)
        return function

    return register


def known_files() -> set[str]:
    """Paths of all that Draft and its extensions write into the folder of a model."""
    return _paths(EXPORTERS.values())


def is_known(path: str, known: Collection[str]) -> bool:
    """Whether a path is one of some paths, or matches a pattern among them."""
    return path in known or any("*" in one and fnmatchcase(path, one) for one in known)


def _paths(exporters: Iterable[Exporter]) -> set[str]:
    """Paths of the files of every folder and of some exporters, with their folders."""
    paths = {*_OWN} | {path for one in exporters for path in one.files}
    return paths | {str(up) for path in paths for up in PurePosixPath(path).parents} - {"."}


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
    with EXPORTERS.calls(name, "correct it, or name other formats"):
        files = {str(path): content for path, content in EXPORTERS[name].function(model).items()}
        for path, content in files.items():
            if not is_known(path, EXPORTERS[name].files):
                raise ValueError(f"it writes '{path}', which it does not name")
            if not isinstance(content, (str, bytes)):
                raise TypeError(f"'{path}' is neither text nor bytes")
        return files


_MESHES = ("meshes/trunk.stl", "meshes/part.*.stl")


@exporter("robot.urdf", *_MESHES, "actuators.json")
def urdf(model: Model) -> dict[str, str | bytes]:
    """URDF with the meshes of trunk and parts, and a table of what URDF cannot hold."""
    from draft.model import urdf as format_

    table: dict[str, Any] = plain(format_.actuators(model.design))
    return {
        "robot.urdf": format_.robot_urdf(model),
        **format_.meshes(model.design),
        "actuators.json": json.dumps(table, indent=2) + "\n",
    }


@exporter("robot.sdf", "model.config", "meshes/trunk.obj", "meshes/part.*.obj")
def sdf(model: Model) -> dict[str, str | bytes]:
    """SDFormat with the meshes of trunk and parts, as a folder that Gazebo finds as a model."""
    from draft.model.sdf import meshes, model_config, robot_sdf

    return {
        "robot.sdf": robot_sdf(model),
        "model.config": model_config(model),
        **meshes(model.design),
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


@exporter("robot.step", "bom.csv")
def step(model: Model) -> dict[str, str | bytes]:
    """STEP assembly for CAD, and a bill of materials; needs the extra `cad`."""
    from draft.model.bom import bom_csv
    from draft.model.step import robot_step

    return {"robot.step": robot_step(model), "bom.csv": bom_csv(model.design)}


@exporter("robot.usda")
def usd(model: Model) -> dict[str, str | bytes]:
    """OpenUSD with physics and drives, for Isaac Sim and Newton; needs the extra `usd`."""
    from draft.model.usd import robot_usda

    return {"robot.usda": robot_usda(model)}


@exporter("mjlab_robot.py", "robot.xml")
def mjlab(model: Model) -> dict[str, str | bytes]:
    """Python file that configures the robot for mjlab, and its MJCF."""
    from draft.model.lab import mjlab_py

    return {"mjlab_robot.py": mjlab_py(model), "robot.xml": model.xml}


@exporter("isaaclab_robot.py", "robot.urdf", *_MESHES)
def isaaclab(model: Model) -> dict[str, str | bytes]:
    """Python file that configures the robot for Isaac Lab, and its URDF."""
    from draft.model.lab import isaaclab_py

    files = urdf(model)
    return {"isaaclab_robot.py": isaaclab_py(model)} | {
        name: content for name, content in files.items() if name != "actuators.json"
    }
