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


def read_root(path: Path, shown: str | None = None, text: str | None = None) -> xmlfile.Element:
    """Root element of a description, with the files that an MJCF model includes.

    Args:
        path: its file.
        shown: the file's name in messages; default the path.
        text: the file's text, if it is not as it lies there.

    Raises:
        DescriptionError: it cannot be read; the message names file and line.
    """
    if text is not None:
        return xmlfile.read_text(text, shown or str(path))
    root = xmlfile.read_file(path, shown)
    return includes.expand(root, path) if root.tag == "mujoco" else root


def describe(path: Path, shown: str | None = None, text: str | None = None) -> Description:
    """Read a URDF or MJCF file, whichever it is; arguments as `read_root`.

    Raises:
        DescriptionError: neither, or not a tree of links; the message names file and line.
    """
    root = read_root(path, shown, text)
    if root.tag not in READERS:
        cause = f"the root is <{root.tag}>; a URDF has <robot>, an MJCF model <mujoco>"
        raise root.error(cause)
    return READERS[root.tag](root)
