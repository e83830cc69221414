"""Named designs of a robot: those in its folder, and those saved by the studio."""

from __future__ import annotations

import re
import threading
import time
from collections import deque
from collections.abc import Callable, Mapping
from pathlib import Path

import yaml

from draft.errors import DraftError
from draft.files import write
from draft.spec import Spec
from draft.spec.field_types import MAX_NAME, NAME_PATTERN
from draft.spec.load import FOLDERS, read_design
from draft.spec.problems import NAME_RULE
from draft.spec.spec import NamedDesign

Setting = float | str | None
# Files and folders that the tabs of a studio may write in a minute.
MAX_WRITES = 30
_MINUTE = 60.0  # [s]
DEFAULT = "default"  # What the values in parameters.yaml are called, as if they were a design.
ASK = "choose another name, or tick 'Replace'"


def check_name(name: str) -> None:
    """Check that a text is a name, which no path is.

    Raises:
        DraftError: it is not.
    """
    if not re.fullmatch(NAME_PATTERN, name) or len(name) > MAX_NAME:
        raise DraftError(f"'{name[:MAX_NAME]}' is not a name", NAME_RULE)


class Writes:
    """Limits how often browsers may write to the disk, all tabs together."""

    def __init__(self, most: int = MAX_WRITES, clock: Callable[[], float] = time.monotonic) -> None:
        """Start with nothing written.

        Args:
            most: files or folders that may be written in a minute.
            clock: returns the time [s].
        """
        self._most, self._clock = most, clock
        self._times: deque[float] = deque()
        self._lock = threading.Lock()

    def count(self) -> None:
        """Count one write.

        Raises:
            DraftError: there were too many in the last minute.
        """
        with self._lock:
            now = self._clock()
            while self._times and now - self._times[0] >= _MINUTE:
                self._times.popleft()
            if len(self._times) >= self._most:
                cause = f"nothing is written: {self._most} files were written in the last minute"
                raise DraftError(cause, "wait a minute")
            self._times.append(now)


class Library:
    """The named designs of one robot.

    Attributes:
        spec: the robot.
        folder: folder that designs are saved in: `designs` in the robot's folder, or
            `NAME_designs` in the working directory for a robot that is known by name.
        writes: limit of what all tabs write.
    """

    def __init__(self, spec: Spec, folder: Path | None = None) -> None:
        if folder is None and (spec.folder is None or spec.folder in FOLDERS.values()):
            folder = Path(f"{spec.name}_designs")
        self.spec = spec
        self.folder = folder or Path(spec.folder or "", "designs")
        self.writes = Writes()

    def names(self) -> list[str]:
        """Names of all designs, the robot's own first, without one called `DEFAULT`."""
        saved = sorted(path.stem for path in self.folder.glob("*.yaml"))
        names = dict.fromkeys([*self.spec.designs, *saved])
        names.pop(DEFAULT, None)  # An older Draft saved it; lists name it for parameters.yaml.
        return list(names)

    def read(self, name: str) -> NamedDesign:
        """Read a design; a saved design overrides one of the robot's folder.

        Raises:
            DraftError: there is no such design, or its file is invalid.
        """
        check_name(name)
        path = self.folder / f"{name}.yaml"
        return read_design(self.spec, path if path.is_file() else name)

    def save(self, name: str, values: Mapping[str, Setting], replace: bool = False) -> Path:
        """Write a design file atomically.

        Args:
            name: name of the design.
            values: values by name.
            replace: whether a design of this name may be replaced.

        Returns:
            The file.

        Raises:
            DraftError: the name is invalid, taken or `DEFAULT`, too much was written in the last
                minute, or the file cannot be written.
        """
        check_name(name)
        if name == DEFAULT:
            cause = f"'{DEFAULT}' stands for the values in parameters.yaml, which are kept"
            raise DraftError(cause, "choose another name")
        if not replace and name in self.names():
            raise DraftError(f"the design '{name}' exists already; it is kept", ASK)
        self.writes.count()
        path = self.folder / f"{name}.yaml"
        data = {"doc": f"{self.spec.name}, saved in the studio.", "values": dict(values)}
        write(path, yaml.safe_dump(data, sort_keys=False, allow_unicode=True))
        return path
