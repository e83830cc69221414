"""The folder that an assistant reads and writes below."""

from __future__ import annotations

import os
import re
from collections.abc import Mapping
from itertools import chain
from pathlib import Path

from draft.design import Design
from draft.design.references import DesignChoice, find_design
from draft.errors import DraftError, SpecError
from draft.spec.field_types import MAX_NAME, NAME_PATTERN
from draft.spec.load import FOLDERS, shipped
from draft.spec.problems import NAME_RULE

Values = Mapping[str, float | str | None]


class Folder:
    """A folder of robots; it is the current folder while it is served.

    Attributes:
        root: its path, without symbolic links.
    """

    def __init__(self, root: Path) -> None:
        """Check the folder.

        Raises:
            DraftError: it is none.
        """
        if not root.is_dir():
            raise DraftError(f"there is no folder '{root}'", "make it, or name another one")
        self.root = Path(os.path.realpath(root))

    def path(self, name: str) -> Path:
        """Path of a file or folder below, from the root.

        Raises:
            DraftError: it leads out of the folder.
        """
        try:
            found = Path(os.path.realpath(self.root / name))
        except ValueError:  # of a name with a null character
            found = Path()
        if not found.is_relative_to(self.root):
            cause = f"'{name}' is outside the folder that is served"
            raise DraftError(cause, "name a place below it: no .., no links that lead out of it")
        return found.relative_to(self.root)

    def robots(self) -> list[str]:
        """References of the shipped robots, and of those in the folder and two levels below."""
        files = (self.root.glob(f"{below}parameters.yaml") for below in ("", "*/", "*/*/"))
        inside = (file for file in chain(*files) if file.resolve().is_relative_to(self.root))
        own = {str(file.parent.relative_to(self.root)) for file in inside}
        return [*shipped(), *sorted(own - {*shipped()})]

    def choice(self, reference: str) -> DesignChoice:
        """Robot and design of a reference.

        Raises:
            DraftError: it names none, or one outside.
        """
        for part in reference.split(":"):
            self.path(part)
        choice = find_design(reference)
        if not _is_shipped(choice):
            self.path(str(choice.spec.folder))  # A built model names its robot.
        return choice

    def design(self, reference: str, values: Values | None = None) -> Design:
        """Design of a reference, with values that override its own.

        Raises:
            DraftError: it names none, one outside, or the values give no design.
        """
        return self.choice(reference).resolve(values)

    def new_design(self, reference: str, name: str) -> Path:
        """Path of the file of a new named design.

        Raises:
            DraftError: the robot is shipped, the name is invalid, or the design exists.
        """
        choice = self.choice(reference)
        if _is_shipped(choice):
            cause = f"'{choice.spec.name}' ships with Draft and is not changed"
            raise DraftError(cause, "copy it first, by the tool `new_robot`")
        if not re.fullmatch(NAME_PATTERN, name) or len(name) > MAX_NAME:
            raise SpecError(f"'{name}' is not a design's name", NAME_RULE)
        path = self.path(f"{choice.spec.folder}/designs/{name}.yaml")
        if os.path.lexists(self.root / path):
            raise DraftError(f"'{path}' exists; it is kept", "choose another name")
        return path


def _is_shipped(choice: DesignChoice) -> bool:
    """Whether the robot is of Draft or an extension, by its place."""
    place = os.path.realpath(choice.spec.folder or "")
    return place in map(os.path.realpath, FOLDERS.values())
