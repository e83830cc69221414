"""Points and triangles of a description's meshes, read for their dimensions only.

Binary and text STL and OBJ are read; a file that is missing, of another kind, or outside the
description's package is noted and left out. Nothing outside the package is ever opened.
"""

from __future__ import annotations

import itertools
import os
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from draft.errors import Location, Problem
from draft.survey.description import Geometry
from draft.values import Array

MAX_BYTES = 200_000_000
MAX_TRIANGLES = 3_000_000
# Folders of a package that descriptions stand in, beside its meshes.
FOLDERS = ("urdf", "xml", "mjcf", "robots", "model", "models")
_RECORD = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("rest", "<u2")])


@dataclass
class Meshes:
    """The meshes of one description.

    Attributes:
        folder: the description's folder.
        notes: what could not be read, one entry per file.
        count: meshes that were read.
    """

    folder: Path
    notes: list[Problem] = field(default_factory=list)
    count: int = 0
    _known: dict[str, Array | None] = field(default_factory=dict)

    @property
    def package(self) -> Path:
        """Folder that meshes may lie in: the description's, or the one above its `urdf`."""
        top = self.folder.parent if self.folder.name.lower() in FOLDERS else self.folder
        return Path(os.path.realpath(top))

    def triangles(self, shape: Geometry, where: Location) -> Array | None:
        """Triangles of a mesh in its link's frame [m], shape (n, 3, 3); None if there are none."""
        name = shape.mesh or ""
        if name not in self._known:
            self._known[name] = self._read(name, where)
        found = self._known[name]
        if found is None:
            return None
        turned = found * np.array(shape.scale, float) @ np.array(shape.rotation, float).T
        return turned + np.array(shape.position, float)

    def _read(self, name: str, where: Location) -> Array | None:
        path = self._find(name, where)
        if path is None:
            return None
        try:
            if path.stat().st_size > MAX_BYTES:
                raise ValueError("it is too large")
            triangles = _reader(path)(path.read_bytes())
        except (OSError, ValueError, IndexError) as error:
            self.notes.append(Problem(f"mesh '{name}' cannot be read: {error}", where))
            return None
        if not len(triangles) or not np.all(np.isfinite(triangles)):
            self.notes.append(Problem(f"mesh '{name}' has no finite triangles", where))
            return None
        self.count += 1
        return triangles

    def _find(self, name: str, where: Location) -> Path | None:
        """File of a mesh inside the package, by `package://`, by its path, or by what ends it."""
        plain = name.split("://", 1)[-1] if "://" in name else name
        parts = [part for part in plain.replace("\\", "/").split("/") if part not in ("", ".")]
        top = self.package
        ways = [self.folder.joinpath(*parts)]
        inner = [part for part in parts if part != ".."]
        if "://" in name:
            ways += [top.joinpath(*inner[i:]) for i in range(min(3, len(inner)))]
        inside = [way for way in ways if Path(os.path.realpath(way)).is_relative_to(top)]
        for way in inside:
            if way.is_file():
                return way
        if not inside or (plain.startswith("/") and "package" not in name):
            cause = f"mesh '{name}' leads outside the robot's folder: it is not read"
            self.notes.append(Problem(cause, where, "copy it beside the description"))
        else:
            self.notes.append(Problem(f"mesh '{name}' is missing", where))
        return None


def _reader(path: Path):
    kind = path.suffix.lower()
    if kind == ".stl":
        return read_stl
    if kind == ".obj":
        return read_obj
    raise ValueError(f"'{kind}' is not read: save it as STL or OBJ")


def read_stl(data: bytes) -> Array:
    """Triangles of an STL file, shape (n, 3, 3).

    Raises:
        ValueError: it is not STL, or has too many triangles.
    """
    if len(data) >= 84:
        count = int.from_bytes(data[80:84], "little")
        if len(data) == 84 + 50 * count:
            if count > MAX_TRIANGLES:
                raise ValueError(f"more than {MAX_TRIANGLES} triangles")
            return np.frombuffer(data, _RECORD, count, 84)["corners"].astype(float)
    words = [line.split()[1:4] for line in data.splitlines() if line.strip().startswith(b"vertex")]
    corners = np.array(words, float).reshape(-1, 3)
    if not len(corners) or len(corners) % 3:
        raise ValueError("it is not an STL file")
    return corners.reshape(-1, 3, 3)


def read_obj(data: bytes) -> Array:
    """Triangles of an OBJ file, shape (n, 3, 3); polygons are cut into fans.

    Raises:
        ValueError: it is not OBJ.
    """
    points: list[list[bytes]] = []
    faces: list[tuple[int, int, int]] = []
    for line in data.splitlines():
        if line.startswith(b"v "):
            points.append(line.split()[1:4])
        elif line.startswith(b"f "):
            corners = [int(word.split(b"/", 1)[0]) for word in line.split()[1:]]
            corners = [i - 1 if i > 0 else len(points) + i for i in corners]
            faces += [(corners[0], a, b) for a, b in itertools.pairwise(corners[1:])]
    if not faces:
        raise ValueError("it is not an OBJ file")
    return np.array(points, float)[np.array(faces)]
