"""MuJoCo for browsers: text and bytes of the module that a page loads.

MuJoCo in WebAssembly is that of the package mjswan (Apache-2.0), whose viewer is not used: it
evaluates policies with 14 MB of ONNX Runtime, where a page of Draft multiplies a few matrices.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from functools import cache
from importlib.metadata import distribution, requires
from pathlib import Path

import mujoco

from draft.errors import DraftError
from draft.extras import check

EXTRA = "page"
MOST = 6  # Robots of a page.
_RUNTIME = re.compile(r'import \{[^}]*\} from "\./rolldown-runtime-[\w-]+\.js";')


@dataclass(frozen=True)
class Engine:
    """MuJoCo for browsers.

    Attributes:
        version: its version, such as "3.11.0".
        script: module whose default export loads it.
        wasm: its WebAssembly.
    """

    version: str
    script: str
    wasm: bytes


@cache
def engine() -> Engine:
    """MuJoCo for browsers, of the version that is installed.

    Raises:
        DraftError: the extra `page` is not installed, is another version of MuJoCo than the
            installed one, or its package is laid out in another way than the known one.
    """
    check("mjswan", EXTRA)  # It is not imported: it would import mjlab and PyTorch.
    version = next(
        (line.partition("==")[2] for line in requires("mjswan") or () if "mujoco==" in line), "?"
    )
    if version != mujoco.__version__:
        cause = f"MuJoCo is {mujoco.__version__}, and that of pages is {version}"
        raise DraftError(cause, f"install mujoco=={version}")
    assets = Path(str(distribution("mjswan").locate_file("mjswan/template/dist/assets")))
    for path in sorted(assets.glob("mujoco-*.js")):
        text = path.read_text("utf-8")
        wasm = re.search(r"mujoco-[\w-]+\.wasm", text)
        # One thread, and a module that needs no other: its runtime serves Node alone.
        if wasm is None or "SharedArrayBuffer" in text or not _RUNTIME.match(text):
            continue
        return Engine(
            version, _RUNTIME.sub("const e = null;", text), (assets / wasm[0]).read_bytes()
        )
    raise DraftError(f"{assets} holds no MuJoCo that a page can load", "install mjswan 0.12.3")


def available() -> bool:
    """Whether the extra is installed, with the MuJoCo of this environment."""
    try:
        engine()
    except DraftError:
        return False
    return True
