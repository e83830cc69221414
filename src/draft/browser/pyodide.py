"""Python in the browser of a visitor: Pyodide from its public host, and Draft as an archive.

The worker of a page fetches Pyodide's own files from the host of its npm package and compares them
with `HASHES`; NumPy, pydantic and PyYAML come from Pyodide's host by the hashes that its lock file
states. Draft itself is a part of the page.
"""

from __future__ import annotations

import io
import zipfile
from importlib.resources import files
from importlib.resources.abc import Traversable
from typing import Any

VERSION = "314.0.7"  # Python 3.14.
OWN = f"https://cdn.jsdelivr.net/npm/pyodide@{VERSION}/"
PACKAGES = f"https://cdn.jsdelivr.net/pyodide/v{VERSION}/full/"
# Of the files in the npm package of this version, as browsers compare them.
HASHES = {
    "pyodide.mjs": "sha256-bx1g979Sm+swDw9HmDySHTmCNjZAuiCvDjjv3dvGYQk=",
    "pyodide.asm.mjs": "sha256-983I7OgGeM63EvjmXr5tOoMgOhgMOZhl9JYSoFFpNjU=",
    "pyodide.asm.wasm": "sha256-zDbjyrBP38mmP/E+tS6uK5Eb9GwCXMeygfOUvT3h1eY=",
    "python_stdlib.zip": "sha256-+hlX5XdwaPxPdDf5bYYK4vvpwZcyugbITgBOwW3X3Xo=",
    "pyodide-lock.json": "sha256-XcL8EZEIvBSMdFfchudnW1yH4cr9QgucNMHq73s2wBA=",
}
NEEDED = ("numpy", "pydantic", "pyyaml")
ARCHIVE = "draft.zip"  # A part of the page, which is compressed as a whole.
# What Draft needs from files to a page's robot; a page has no ground to climb.
_FOLDERS = ("laws", "spec", "design", "model", "metrics", "variation", "learn")
_ROBOT = "robots/quadruped"
_FILES = ("browser/__init__.py", "browser/designer.py", "browser/robots.py")
_MORE = ("browser/thin/mujoco.py", "robots/policies/any.onnx")
_TIME = (1980, 1, 1, 0, 0, 0)  # The least that an archive can hold: the same page, the same bytes.


def settings() -> dict[str, Any]:
    """What the worker of a page needs to start Python."""
    return {"own": OWN, "packages": PACKAGES, "hashes": HASHES, "needed": NEEDED}


def archive() -> bytes:
    """Draft as a ZIP archive without compression, for `thin/mujoco.py` in place of MuJoCo."""
    package, found = files("draft"), io.BytesIO()
    chosen = {one.name: one for one in package.iterdir() if one.name.endswith(".py")}
    for name in (*_FILES, *_MORE):
        chosen[name] = package / name
    for folder in (*_FOLDERS, _ROBOT):
        _walk(package / folder, folder, chosen)
    with zipfile.ZipFile(found, "w") as zipped:
        for name in sorted(chosen):
            zipped.writestr(zipfile.ZipInfo(f"draft/{name}", _TIME), chosen[name].read_bytes())
    return found.getvalue()


def _walk(folder: Traversable, name: str, found: dict[str, Traversable]) -> None:
    for one in folder.iterdir():
        if one.is_dir() and one.name != "__pycache__":
            _walk(one, f"{name}/{one.name}", found)
        elif one.is_file() and "climb" not in one.name:
            found[f"{name}/{one.name}"] = one
