"""Write type stubs of MuJoCo's compiled modules to `typings/mujoco`, for the type checker.

Run `python -m scripts.mujoco_stubs` after MuJoCo's version in `uv.lock` has changed.
"""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

TYPINGS = Path(__file__).parents[1] / "typings"
# Constants whose values are folders of the machine that the stubs were written on.
FOLDERS = re.compile(r"^(HEADERS_DIR|PLUGINS_DIR): str = .*$", re.MULTILINE)


def write(folder: Path = TYPINGS) -> None:
    """Write the stubs.

    Args:
        folder: folder that gets `mujoco`, one file per module.
    """
    words = [sys.executable, "-m", "pybind11_stubgen", "mujoco", "--ignore-all-errors"]
    subprocess.run([*words, "--output-dir", str(folder)], check=True)
    for path in (folder / "mujoco").rglob("*.pyi"):
        text = path.read_text(encoding="utf-8")
        path.write_text(FOLDERS.sub(r"\1: str", text), encoding="utf-8")


if __name__ == "__main__":
    write()
