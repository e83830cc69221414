"""Points and triangles of a description's meshes, read for their dimensions only.

Binary and text STL, OBJ and COLLADA are read; a file that is missing, of another kind, or outside
the description's package is noted and left out. Nothing outside the package is ever opened.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path

import numpy as np

from draft.description.description import Geometry
from draft.description.mesh_paths import Package
from draft.description.xmlfile import DescriptionError
from draft.errors import Location, Problem
from draft.imports.mesh_files import MAX_BYTES, read_mesh
from draft.values import Array

LONGEST = 120
# One over the furthest that a point may lie [1/m].
FAR = 1e-9


@dataclass(frozen=True, slots=True)
class Mesh:
    """Triangles of a file as they stand there, shape (n, 3, 3), and their bounds, shape (3,)."""

    triangles: Array
    low: Array
    high: Array

    def extent(self, scale: Sequence[float]) -> float:
        """Longest edge of its box once scaled [m]."""
        return float(((self.high - self.low) * np.abs(scale)).max())


@dataclass
class Meshes:
    """The meshes of one description.

    Attributes:
        folder: the description's folder.
        notes: what could not be read, one entry per name.
    """

    folder: Path
    notes: list[Problem] = field(default_factory=list)
    _names: dict[str, Path | None] = field(default_factory=dict)
    _files: dict[Path, Mesh | None] = field(default_factory=dict)

    @cached_property
    def _package(self) -> Package:
        return Package(self.folder)

    @property
    def count(self) -> int:
        """Files that were read."""
        return sum(found is not None for found in self._files.values())

    def mesh(self, shape: Geometry, where: Location) -> Mesh | None:
        """A shape's mesh; None if it cannot be read. `where` is its link's place.

        Each file is read once, under whichever names it goes.
        """
        name = shape.mesh or ""
        if name not in self._names:
            self._names[name] = self._find(name, where)
        path = self._names[name]
        if path is None:
            return None
        if path not in self._files:
            self._files[path] = self._read(path, name, where)
        found = self._files[path]
        if found is None:
            return None
        if np.abs(np.stack((found.low, found.high)) * np.array(shape.scale) * FAR).max() < 1:
            return found
        fault = "reaches beyond a million kilometres: it is not used"
        self._note(name, fault, where, "correct its points or its scale")
        return None

    def _read(self, path: Path, name: str, where: Location) -> Mesh | None:
        kind = path.suffix.lower()
        try:
            if kind not in MAX_BYTES:
                raise ValueError(f"'{kind}' is not read: save it as STL, OBJ or DAE")
            most = MAX_BYTES[kind]
            with path.open("rb") as file:
                data = file.read(most + 1)
            if len(data) > most:
                raise ValueError(f"it has more than {most // 1_000_000} MB")
            triangles = read_mesh(data, kind)
        except (OSError, ValueError, DescriptionError) as error:
            self._note(name, f"cannot be read: {_words(error)}", where)
            return None
        if len(triangles):
            # By columns: NumPy takes thirty times as long over an axis of three.
            low, high = (
                np.array([take(triangles[:, :, i]) for i in range(3)]) for take in (np.min, np.max)
            )
            # Least and greatest are NaN where any number is.
            if np.isfinite(low).all() and np.isfinite(high).all():
                return Mesh(triangles, low, high)
        self._note(name, "has no finite triangles", where)
        return None

    def _find(self, name: str, where: Location) -> Path | None:
        path, outside = self._package.find(name)
        if path is None and outside:
            fault = "leads outside the robot's folder: it is not read"
            self._note(name, fault, where, "copy it beside the description")
        elif path is None:
            self._note(name, "is missing", where)
        return path

    def _note(self, name: str, fault: str, where: Location, remedy: str = "") -> None:
        problem = Problem(f"mesh '{shown(name)}' {fault}", where, remedy)
        if problem not in self.notes:
            self.notes.append(problem)


def shown(name: str) -> str:
    """A mesh's name in messages: its end, if it is long."""
    return name if len(name) <= LONGEST else f"...{name[-LONGEST:]}"


def _words(error: Exception) -> str:
    """Words of an error in a mesh; its line is one of the mesh's file."""
    if isinstance(error, OSError):
        return error.strerror or "it is not there"
    if not isinstance(error, DescriptionError):
        return str(error)
    problem = error.problems[0]
    line = problem.where.line if problem.where else None
    return f"line {line}: {problem.cause}" if line else problem.cause
