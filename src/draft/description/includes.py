"""Expansion of the <include> elements of an MJCF model."""

from __future__ import annotations

import os
from pathlib import Path, PurePosixPath

from draft.description.mesh_paths import package
from draft.description.xmlfile import MAX_BYTES, MAX_ELEMENTS, DescriptionError, Element, read_file
from draft.errors import Problem

MAX_FILES = 64


def expand(root: Element, path: Path) -> Element:
    """Replace every <include> below `root` by the content of its file.

    A path is relative to the folder of the model at `path`, else to that of the including file, and
    must stay inside the package of the robot; a file may be included once, as in MuJoCo.

    Raises:
        DescriptionError: a file is missing, outside the package, unreadable, or included twice.
    """
    _Expander(path, root.where.file).expand(root, path.parent)
    return root


class _Expander:
    def __init__(self, path: Path, shown: str) -> None:
        self.folder = path.parent
        self.shown = PurePosixPath(shown).parent
        self.top = package(path.parent)
        self.read = {Path(os.path.realpath(path))}
        self.elements = self.bytes = 0

    def expand(self, root: Element, folder: Path) -> None:
        """Expand the includes below an element of a file in `folder`, depth first."""
        waiting = [(root, folder)]
        while waiting:
            element, folder = waiting.pop()
            children: list[Element] = []
            for child in element.children:
                if child.tag == "include":
                    inner, place = self._included(child, folder)
                    self.expand(inner, place)
                    children += inner.children
                else:
                    children.append(child)
                    waiting.append((child, folder))
            element.children = children

    def _included(self, element: Element, folder: Path) -> tuple[Element, Path]:
        """Root element of the file that an <include> names, and the file's folder."""
        name = element.text("file")
        path = self._find(element, name, folder)
        if path in self.read:
            cause = f"file '{name}' is included twice, or includes itself"
            raise element.error(cause, "include it once")
        self.read.add(path)
        if len(self.read) > MAX_FILES:
            cause = f"more than {MAX_FILES} files are included"
            raise element.error(cause, "save the model as one file")
        root = read_file(path, str(self.shown / name))
        self._check_size(root, path, element)
        return root, path.parent

    def _find(self, element: Element, name: str, folder: Path) -> Path:
        outside = False
        for base in (self.folder, folder):
            try:
                path = Path(os.path.realpath(base / name))
            except (OSError, ValueError):
                continue
            if not path.is_relative_to(self.top):
                outside = True
            elif os.path.isfile(path):
                return path
        if outside:
            cause = f"it includes '{name}', which is outside the robot's folder"
            raise element.error(cause, "copy the file beside the model")
        cause = f"it includes '{name}', which does not exist"
        raise element.error(cause, "copy the file beside the model, or remove the <include>")

    def _check_size(self, root: Element, path: Path, element: Element) -> None:
        """Check the total size of all files."""
        self.bytes += path.stat().st_size
        waiting = [root]
        while waiting:
            self.elements += 1
            waiting.extend(waiting.pop().children)
        if self.bytes > MAX_BYTES or self.elements > MAX_ELEMENTS:
            raise DescriptionError(
                Problem("the included files are too large", element.where, "split the model")
            )
