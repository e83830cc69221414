"""Where a description's meshes may lie: inside its package, and nowhere else."""

from __future__ import annotations

import os
from pathlib import Path

# Folders of a package that descriptions stand in, beside its meshes.
FOLDERS = ("urdf", "xml", "mjcf", "robots", "model", "models")
MANIFEST = "package.xml"
ABOVE = 4
# Leading parts of a URI that may name the package, or the package and the folder it lies in.
NAMES = 2


def package(folder: Path) -> Path:
    """Folder that the meshes of a description in `folder` may lie in.

    The nearest folder with a package.xml, at most four levels up; else the folder itself, or the
    one above it if it is called `urdf` or the like.
    """
    real = Path(os.path.realpath(folder))
    for place in (real, *real.parents[:ABOVE]):
        if os.path.isfile(place / MANIFEST):
            return place
    return real.parent if real.name.lower() in FOLDERS and real.parent != real else real


def find(name: str, folder: Path) -> tuple[Path | None, bool]:
    """Find a mesh by the name that a description in `folder` gives it.

    A name is a path from the folder, an absolute path, or a URI: `package://NAME/...` and
    `model://NAME/...` count from the package, with or without NAME; `file://` is a path.

    Returns:
        The real path of the file, or None; and whether the name leads outside the package. Links
        are followed before that is judged, so that a link out of the package finds nothing.
    """
    top = package(folder)
    scheme, _, rest = name.rpartition("://")
    plain = rest.replace("\\", "/")
    parts = [part for part in plain.split("/") if part not in ("", ".")]
    inner = [part for part in parts if part != ".."]
    ways: list[Path] = []
    if plain.startswith("/") and scheme in ("", "file"):
        ways.append(Path("/", *parts))
    else:
        ways.append(folder.joinpath(*parts))
        if scheme:
            ways += [top.joinpath(*inner[i:]) for i in range(min(NAMES + 1, len(inner)))]
    real = [Path(os.path.realpath(way)) for way in ways]
    inside = [way for way in real if way.is_relative_to(top)]
    for way in inside:
        # `os.path` says no, where `Path` raises, for a name that is too long or not to be entered.
        if os.path.isfile(way):
            return way, False
    outside = not inside or any(way not in inside and os.path.exists(way) for way in real)
    return None, outside
