"""Read a robot description in either format."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from draft.description import includes, mjcf, urdf, xmlfile
from draft.description.description import Description

READERS: dict[str, Callable[[xmlfile.Element], Description]] = {
    "robot": urdf.from_xml,
    "mujoco": mjcf.from_xml,
}


def describe(path: Path, shown: str | None = None) -> Description:
    """Read a URDF or MJCF file, whichever it is.

    Raises:
        DescriptionError: neither, or not a tree of links; the message names file and line.
    """
    root = xmlfile.read_file(path, shown)
    if root.tag == "mujoco":
        includes.expand(root, path)
    if root.tag not in READERS:
        cause = f"the root is <{root.tag}>; a URDF has <robot>, an MJCF model <mujoco>"
        raise root.error(cause)
    return READERS[root.tag](root)
