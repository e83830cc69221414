"""Named designs of a robot: those of its folder, and those that the studio has saved."""

from __future__ import annotations

import re
from collections.abc import Mapping
from pathlib import Path

import yaml

from draft.errors import DraftError, Problem
from draft.files import write
from draft.spec import Spec
from draft.spec.field_types import MAX_NAME, NAME_PATTERN
from draft.spec.load import ROBOTS, read_design
from draft.spec.problems import NAME_RULE
from draft.spec.spec import NamedDesign

Setting = float | str | None


def check_name(name: str) -> None:
    """Refuse what is not a name, and with it every path.

    Raises:
        DraftError: it is not a name.
    """
    if not re.fullmatch(NAME_PATTERN, name) or len(name) > MAX_NAME:
        raise DraftError(Problem(f"'{name[:MAX_NAME]}' is not a name", None, NAME_RULE))


class Library:
    """The named designs of one robot.

    Attributes:
        spec: the robot.
        folder: where designs are saved: `designs` of the robot's own folder, or another folder
            where the robot is a shipped one.
    """

    def __init__(self, spec: Spec, folder: Path | None = None) -> None:
        shipped = spec.folder.is_relative_to(ROBOTS)
        own = Path(f"{spec.name}_designs") if shipped else spec.folder / "designs"
        self.spec = spec
        self.folder = folder or own
        self._read: dict[str, tuple[int, NamedDesign]] = {}

    def names(self) -> list[str]:
        """Names of all designs, the robot's own first."""
        saved = sorted(path.stem for path in self.folder.glob("*.yaml"))
        return list(dict.fromkeys([*self.spec.designs, *saved]))

    def read(self, name: str) -> NamedDesign:
        """Read a design; what was saved last wins.

        Raises:
            DraftError: there is no such design, or its file is none.
        """
        check_name(name)
        path = self.folder / f"{name}.yaml"
        try:
            changed = path.stat().st_mtime_ns
        except OSError:
            return read_design(self.spec, name)
        # Every step of a slider asks for it, so it is read again only when it has changed.
        known = self._read.get(name)
        if known is None or known[0] != changed:
            known = self._read[name] = (changed, read_design(self.spec, path))
        return known[1]

    def save(self, name: str, values: Mapping[str, Setting], replace: str = "") -> Path:
        """Write a design, whole or not at all.

        Args:
            name: its name.
            values: its table of values.
            replace: name of a design that may be written over.

        Returns:
            The file.

        Raises:
            DraftError: it is no name, there is such a design, or the file cannot be written.
        """
        check_name(name)
        if name != replace and name in self.names():
            cause = f"there is a design '{name}' already; it is kept"
            raise DraftError(Problem(cause, None, "choose another name"))
        path = self.folder / f"{name}.yaml"
        data = {"doc": f"{self.spec.name}, saved in the studio.", "values": dict(values)}
        write(path, yaml.safe_dump(data, sort_keys=False, allow_unicode=True))
        return path
