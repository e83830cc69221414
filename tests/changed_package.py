"""A copy of the package with added code, which a process imports: for tests of recipes."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import draft

ROOT = Path(__file__).resolve().parents[1]


class ChangedPackage:
    """A copy of `draft` in which files differ; the others are links.

    Args:
        folder: folder to copy to.
        changes: by file below `src/draft`, text to insert before a text that occurs once in it; for
            a new file, its text before "".
    """

    def __init__(self, folder: Path, changes: Mapping[str, Mapping[str, str]]) -> None:
        copy, ignored = folder / "draft", shutil.ignore_patterns("__pycache__")
        shutil.copytree(Path(draft.__file__).parent, copy, ignore=ignored, copy_function=os.symlink)
        for name, inserted in changes.items():
            file = copy / name
            text = file.read_text(encoding="utf-8") if file.exists() else ""
            for place, more in inserted.items():
                assert text.count(place) == 1 or not text, f"{name} has no single {place!r}"
                text = text.replace(place, more + place) if text else more
            file.unlink(missing_ok=True)
            file.write_text(text, encoding="utf-8")
        self._environment = {**os.environ, "PYTHONPATH": f"{folder}{os.pathsep}{ROOT}"}

    def run(self, *arguments: str) -> Any:
        """Return the last line that Python prints with some arguments, read as JSON."""
        done = subprocess.run(
            [sys.executable, *arguments],
            env=self._environment,
            capture_output=True,
            text=True,
            check=True,
        )
        try:
            return json.loads(done.stdout)
        except json.JSONDecodeError:
            return json.loads(done.stdout.splitlines()[-1])
