"""Places where a description's meshes may lie: inside its package, and nowhere else."""

from __future__ import annotations

import os
from functools import cached_property
from itertools import takewhile
from pathlib import Path

# Folders of a package that descriptions lie in, beside its meshes.
FOLDERS = ("urdf", "xml", "mjcf", "robots", "model", "models", "xacro")
# Folders that packages keep meshes in, beside that of the description.
MESHES = ("meshes", "mesh", "assets", "visual", "stl", "obj", "dae")
MANIFEST = "package.xml"
ABOVE = 4
# Most entries and levels of folders that are searched for a mesh.
MOST_FILES, DEEPEST = 20_000, 8


def package(folder: Path) -> Path:
    """Folder that the meshes of a description in `folder` may lie in.

    The nearest folder with a package.xml, at most four levels up; else the folder itself, or the
    one above it if that has a folder of meshes and this has none, or this is called `urdf` or the
    like.
    """
    real = Path(os.path.realpath(folder))
    for place in (real, *real.parents[:ABOVE]):
        if os.path.isfile(place / MANIFEST):
            return place
    above = real.parent
    if above == real:
        return real
    beside = _has_meshes(above) and not _has_meshes(real)
    return above if beside or real.name.lower() in FOLDERS else real


def find(name: str, folder: Path) -> tuple[Path | None, bool]:
    """Find a mesh by the name that a description in `folder` gives it; see `Package.find`."""
    return Package(folder).find(name)


class Package:
    """Meshes of a description in a folder."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.top = package(folder)

    def find(self, name: str) -> tuple[Path | None, bool]:
        """Find a mesh by the name that the description gives it.

        A name is a path from the folder, an absolute path, or a URI such as `package://NAME/...`,
        of which any leading part may name the package and the folders it lies in. Where no such
        file is there, the package is searched for the file whose path has most last parts in
        common with the name, its letters in either case; none is taken where two have as many.

        Returns:
            The real path of the file, or None; and whether the name leads outside the package.
            Links are followed before that is judged, so that a link out of the package finds
            nothing.
        """
        top, folder = self.top, self.folder
        scheme, _, rest = name.rpartition("://")
        plain = rest.replace("\\", "/")
        parts = [part for part in plain.split("/") if part not in ("", ".")]
        inner = [part for part in parts if part != ".."]
        if plain.startswith("/") and scheme in ("", "file"):
            ways = [Path("/", *parts)]
        else:
            bases = (top, folder) if scheme else ()
            ways = [folder.joinpath(*parts)]
            ways += [base.joinpath(*inner[i:]) for i in range(len(inner)) for base in bases]
        real = [Path(os.path.realpath(way)) for way in ways]
        inside = [way for way in real if way.is_relative_to(top)]
        for way in inside:
            # `os.path` says no, where `Path` raises, for a name too long or not to be entered.
            if os.path.isfile(way):
                return way, False
        outside = not inside or any(way not in inside and os.path.exists(way) for way in real)
        if real[0] not in inside and os.path.exists(real[0]):
            return None, True
        alike = self._alike(inner)
        return (alike, False) if alike is not None else (None, outside)

    def _alike(self, parts: list[str]) -> Path | None:
        """File whose path ends most like a name; None for none or several."""
        if not parts:
            return None
        wanted = [part.lower() for part in reversed(parts)]
        best: list[Path] = []
        most = 0 if self._is_known else 1
        for path in self._files.get(wanted[0], ()):
            own = [part.lower() for part in reversed(path.relative_to(self.top).parts)]
            same = sum(
                1
                for _ in takewhile(lambda pair: pair[0] == pair[1], zip(wanted, own, strict=False))
            )
            if same > most:
                best, most = [], same
            if same == most:
                best.append(path)
        if len(best) != 1:
            return None
        real = Path(os.path.realpath(best[0]))
        return real if real.is_relative_to(self.top) and os.path.isfile(real) else None

    @property
    def _is_known(self) -> bool:
        """Whether the folder is a robot's, and not one in which files happen to lie."""
        return os.path.isfile(self.top / MANIFEST) or _has_meshes(self.top)

    @cached_property
    def _files(self) -> dict[str, list[Path]]:
        """Files below the package by their name in lower case, folder by folder."""
        found: dict[str, list[Path]] = {}
        count = 0
        for place, folders, names in os.walk(self.top):
            folders.sort()
            if len(Path(place).parts) - len(self.top.parts) >= DEEPEST:
                folders.clear()
            for name in sorted(names):
                count += 1
                found.setdefault(name.lower(), []).append(Path(place, name))
            if count > MOST_FILES:
                break
        return found


def _has_meshes(folder: Path) -> bool:
    return any(os.path.isdir(folder / name) for name in MESHES)
