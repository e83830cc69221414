"""Robots drawn in web pages from the geoms of their MuJoCo models, by three.js.

three.js (MIT) is version 0.180.0, unchanged, with its licence in `vendor`: no package on PyPI has
it as a module.
"""

from __future__ import annotations

import base64
from importlib.resources import files
from typing import Any

import mujoco
import numpy as np
from numpy.typing import ArrayLike, NDArray

_FOLDER = files("draft.drawing")
_OWN = ("figure", "packed", "view")
_FIELDS = ("geom_type", "geom_size", "geom_pos", "geom_quat", "geom_bodyid", "geom_rgba")
_MESH = ("mesh_vertadr", "mesh_vertnum", "mesh_faceadr", "mesh_facenum", "mesh_face")


def modules() -> dict[str, str]:
    """Texts of the modules by the names that `import` gives them."""
    core = (_FOLDER / "vendor" / "three.core.min.js").read_text("utf-8")
    main = (_FOLDER / "vendor" / "three.module.min.js").read_text("utf-8")
    own = {f"draft/{name}": (_FOLDER / f"{name}.js").read_text("utf-8") for name in _OWN}
    return {
        **own,
        "three": main.replace('"./three.core.min.js"', '"three/core"'),
        "three/core": core,
    }


def inlined(text: str) -> str:
    """Address of a module within the page itself, as browsers load none from the disk."""
    return f"data:text/javascript;base64,{base64.b64encode(text.encode()).decode()}"


def licence() -> str:
    """Licence of three.js."""
    return (_FOLDER / "vendor" / "LICENSE-three").read_text("utf-8")


def geoms(model: mujoco.MjModel) -> dict[str, Any]:
    """Geoms and meshes of a robot as plain data, by the names of MjModel; `figure.js` draws them.

    Numbers keep a hundredth of a millimetre.
    """
    names = (*_FIELDS, "geom_dataid", *_MESH)
    found = {name: _plain(getattr(model, name)) for name in names}
    return {"ngeom": int(model.ngeom), **found, "mesh_vert": _plain(model.mesh_vert)}


def packed(values: ArrayLike, kind: str) -> dict[str, str]:
    """Numbers as bytes of a kind, "f4" or "i2"; `packed.js` reads them."""
    raw = np.ascontiguousarray(values, dtype=f"<{kind}").tobytes()
    return {"dtype": kind, "bdata": base64.b64encode(raw).decode()}


def _plain(values: NDArray[Any]) -> list[float]:
    return [float(f"{value:.5f}") if value % 1 else int(value) for value in values.ravel()]
