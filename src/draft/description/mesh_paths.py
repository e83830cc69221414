"""Search for the meshes of a description, inside its package only."""

from __future__ import annotations

import os
from functools import cached_property
from itertools import takewhile
from pathlib import Path

# Folders of a package for descriptions, beside those of its meshes.
FOLDERS = ("urdf", "xml", "mjcf", "robots", "model", "models", "xacro")
# Folders of a package for meshes, beside that of the description.
MESHES = ("meshes", "mesh", "assets", "visual", "stl", "obj", "dae")
MANIFEST = "package.xml"
ABOVE = 4
# Largest number of files, and of levels of folders, in the search for a mesh.
MAX_FILES, MAX_DEPTH = 20_000, 8


def package(folder: Path) -> Path:
    """Root folder of the package of a description in `folder`.

    The nearest folder with a package.xml, at most four levels up; else the parent folder, if only
    that has a folder of meshes or if the folder is named `urdf` or the like; else the folder.
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
    """Find a mesh of a description in `folder`; see `Package.find`."""
    return Package(folder).find(name)


class Package:
    """Package of a description in a folder."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.top = package(folder)

    def find(self, name: str) -> tuple[Path | None, bool]:
        """Find a mesh by its name in the description.

        A name is a path relative to the folder, an absolute path, or a URI such as
        `package://NAME/...`, whose leading parts may name the package and the folders above it. If
        no such file exists, the package is searched for the file whose path shares the most
        trailing parts with the name, ignoring case; a tie finds none.

        Returns:
            The real path of the file, or None; and whether the name leads outside the package.
            Symbolic links are resolved first, so that a link out of the package finds nothing.
        """
        top, folder = self.top, self.folder
        scheme, _, rest = name.rpartition("://")
        plain = rest.replace("\\", "/")
        parts = [part for part in plain.split("/") if part not in ("", ".")]
        inner = [part for part in parts if part != ".."]
        if plain.startswith("/") and scheme in ("", "file"):
            candidates = [Path("/", *parts)]
        else:
            bases = (top, folder) if scheme else ()
            candidates = [folder.joinpath(*parts)]
            candidates += [base.joinpath(*inner[i:]) for i in range(len(inner)) for base in bases]
        real = [Path(os.path.realpath(path)) for path in candidates]
        inside = [path for path in real if path.is_relative_to(top)]
        for path in inside:
            # For a path that is too long or not accessible `os.path` is false, where `Path` raises.
            if os.path.isfile(path):
                return path, False
        outside = not inside or any(path not in inside and os.path.exists(path) for path in real)
        if real[0] not in inside and os.path.exists(real[0]):
            return None, True
        nearest = self._nearest(inner)
        return (nearest, False) if nearest is not None else (None, outside)

    def _nearest(self, parts: list[str]) -> Path | None:
        """File with the most trailing parts of a name; None without one, or for a tie."""
        if not parts:
            return None
        wanted = [part.lower() for part in reversed(parts)]
        best: list[Path] = []
        most = 1 if self._is_known else 2  # Elsewhere a file's name is too little.
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
        """Whether the folder is that of a robot: it has a package.xml or a folder of meshes."""
        return os.path.isfile(self.top / MANIFEST) or _has_meshes(self.top)

    @cached_property
    def _files(self) -> dict[str, list[Path]]:
        """Files of the package by name in lower case."""
        by_name: dict[str, list[Path]] = {}
        count = 0
        for place, folders, names in os.walk(self.top):
            folders.sort()
            if len(Path(place).parts) - len(self.top.parts) >= MAX_DEPTH:
                folders.clear()
            for name in sorted(names):
                count += 1
                by_name.setdefault(name.lower(), []).append(Path(place, name))
            if count > MAX_FILES:
                break
        return by_name


def _has_meshes(folder: Path) -> bool:
    return any(os.path.isdir(folder / name) for name in MESHES)
