"""Reading of robot descriptions, URDF or MJCF."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from draft.description import includes, mjcf, urdf, xmlfile
from draft.description.description import Description

READERS: dict[str, Callable[[xmlfile.Element, str], Description]] = {
    "robot": urdf.from_xml,
    "mujoco": mjcf.from_xml,
}


def read_root(path: Path, shown: str | None = None, text: str | None = None) -> xmlfile.Element:
    """Root element of a description, with the includes of an MJCF model expanded.

    Args:
        path: the file.
        shown: name of the file in messages; default the path.
        text: text to read instead of that of the file; its includes are not expanded.

    Raises:
        DescriptionError: it cannot be read; the message gives file and line.
    """
    if text is not None:
        return xmlfile.read_text(text, shown or str(path))
    root = xmlfile.read_file(path, shown)
    return includes.expand(root, path) if root.tag == "mujoco" else root


def describe(
    path: Path, shown: str | None = None, text: str | None = None, link: str = ""
) -> Description:
    """Read a URDF or MJCF file.

    Args:
        path: the file.
        shown: name of the file in messages; default the path.
        text: text to read instead of that of the file.
        link: link or body from which down the robot is read, of the only tree or of several; "" for
            all of it.

    Raises:
        DescriptionError: it is neither, or not a tree of links; the message gives file and line.
    """
    root = read_root(path, shown, text)
    if root.tag not in READERS:
        cause = f"the root element is <{root.tag}>; a URDF has <robot>, an MJCF model <mujoco>"
        raise root.error(cause)
    found = READERS[root.tag](root, link)
    return found.below(link) if link else found
