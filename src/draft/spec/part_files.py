"""Reading of the parts that a robot's links and actuators have in place of drawn solids."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from functools import lru_cache
from pathlib import Path, PurePosixPath
from typing import Any

from draft.errors import DraftError, Location, Problem, SpecError, suggest
from draft.extras import remedy
from draft.files import Readable
from draft.meshes import MAX_BYTES, read_triangles
from draft.spec.primitives.base import Written
from draft.spec.primitives.mesh import Mesh, MeshError, closed
from draft.spec.primitives.shape import UNITS, is_part, is_step
from draft.spec.spec import ActuatorClass
from draft.spec.tree import Body

MAX_STEP = 60_000_000
Key = tuple[str, str | None]


def read_parts(
    bodies: Iterable[Body], actuators: Mapping[str, ActuatorClass], file: Callable[[str], Readable]
) -> tuple[dict[str, Readable], dict[Key, Mesh]]:
    """Read every part once.

    Args:
        bodies: bodies of the tree.
        actuators: actuator classes.
        file: gives a file by its path in the robot's folder.

    Returns:
        The files by path, and the meshes by file and unit [m].

    Raises:
        SpecError: a file is missing or too large, cannot be read, or is no solid.
    """
    links = {id(body.link): body.link for body in bodies}.values()
    shapes = [one.shape for one in (*links, *actuators.values()) if one.shape is not None]
    files: dict[str, Readable] = {}
    meshes: dict[Key, Mesh] = {}
    for shape in shapes:
        path, unit = shape.fields.file, shape.fields.unit
        if (path, unit) not in meshes:
            files[path] = file(path)
            stem = name = f"part.{PurePosixPath(path).stem}"  # No body has a dot.
            number = 1
            # Names of files that differ by case alone are one on some systems.
            taken = {mesh.name.casefold() for mesh in meshes.values()}
            while name.casefold() in taken:
                number += 1
                name = f"{stem}_{number}"
            meshes[path, unit] = _read(shape, files[path], name)
    return files, meshes


def _read(shape: Written[Any], file: Readable, name: str) -> Mesh:
    where, path, unit = shape.places["file"], shape.fields.file, shape.fields.unit
    try:
        data = _bytes(file, path, where)
        return _mesh(data, path, unit, name)
    except MeshError as error:
        raise SpecError(Problem(f"'{path}': {error}", where, error.remedy)) from None
    except ValueError as error:
        cause = f"'{path}' cannot be read: {error}"
        remedy_ = "correct it, or export it again as binary STL"
        raise SpecError(Problem(cause, where, remedy_)) from None


def _bytes(file: Readable, path: str, where: Location) -> bytes:
    """Content of a file that is not too large.

    Raises:
        SpecError: it is missing, too large or unreadable.
    """
    most = MAX_BYTES.get(PurePosixPath(path.lower()).suffix, MAX_STEP)
    try:
        if isinstance(file, Path) and file.is_file() and file.stat().st_size > most:
            cause = f"'{path}' has {file.stat().st_size / 1e6:.0f} MB"
            raise SpecError(Problem(cause, where, f"the limit is {most / 1e6:.0f} MB"))
        return file.read_bytes()
    except OSError as error:
        cause = f"'{path}' cannot be read: {error.strerror}"
        remedy = "give a file that can be read"
        if isinstance(file, Path) and isinstance(error, FileNotFoundError):
            cause = f"there is no file '{path}' in the robot's folder"
            remedy = "put it there"
            beside = [one.name for one in file.parent.glob("*") if is_part(one.name)]
            remedy = suggest(file.name, beside, "put it there; beside it are") if beside else remedy
        raise SpecError(Problem(cause, where, remedy)) from None


# A robot is read again at every edit, its parts only when they change.
@lru_cache(maxsize=16)
def _mesh(data: bytes, path: str, unit: str | None, name: str) -> Mesh:
    """Mesh of a file's content.

    Raises:
        DraftError: the extra `cad` is not installed.
        MeshError: it is no solid.
        ValueError: it is not of the kind that its name says.
    """
    if is_step(path):
        try:
            from draft.spec.step_file import read_step

            return read_step(data, name, path)
        except DraftError as error:
            missing = error.problems[0].cause
            raise MeshError(
                f"{missing}, which STEP files need", f"{remedy('cad')}, or export the part as STL"
            ) from None
    triangles = read_triangles(data, PurePosixPath(path.lower()).suffix)
    return closed(triangles * UNITS[unit or "m"], name, path)
