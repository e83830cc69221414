"""Files that an MJCF model includes, put in the place of their <include>."""

from __future__ import annotations

import os
from pathlib import Path, PurePosixPath

from draft.description.mesh_paths import package
from draft.description.xmlfile import MAX_BYTES, MAX_ELEMENTS, DescriptionError, Element, read_file
from draft.errors import Problem

MAX_FILES = 64


def expand(root: Element, path: Path) -> Element:
    """Replace every <include> below `root` by the children of the root of the file it names.

    A name is relative to the folder of the model at `path`, else to that of the file that includes
    it, and must stay inside the robot's package; a file may be included once, as in MuJoCo.

    Raises:
        DescriptionError: a file that is missing, outside, unreadable or included again.
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
            raise element.error(f"more than {MAX_FILES} files are included", "save it as one file")
        root = read_file(path, str(self.shown / name))
        self._bound(root, path, element)
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
        cause = f"it includes '{name}', which is not there"
        raise element.error(cause, "copy the file beside the model, or remove the <include>")

    def _bound(self, root: Element, path: Path, element: Element) -> None:
        """Bound what all files have together."""
        self.bytes += path.stat().st_size
        waiting = [root]
        while waiting:
            one = waiting.pop()
            self.elements += 1
            waiting.extend(one.children)
        if self.bytes > MAX_BYTES or self.elements > MAX_ELEMENTS:
            raise DescriptionError(
                Problem("its files are too large together", element.where, "split the model")
            )
