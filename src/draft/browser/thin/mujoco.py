"""MuJoCo by the names that Draft uses for a page's robots, over MuJoCo for browsers.

Python in a worker of a page has no bindings of MuJoCo. The worker puts the folder of this file on
its path, so that `import mujoco` finds it; nothing else does. It asks `bridge.js` through the
module `mujoco_js`, whose `ask` takes and returns JSON. Arrays are copies: those that were read go
to MuJoCo before a call, and come back after it.
"""

from __future__ import annotations

import json
from enum import IntEnum
from typing import Any

import mujoco_js  # type: ignore[import-not-found]
import numpy as np
from numpy.typing import NDArray

_DTYPES = {"Float64Array": "f8", "Float32Array": "f4", "Int32Array": "i4", "Uint8Array": "u1"}
# Counts of the rows of arrays, by the start of their names; of a state, by their names.
_ROWS = {"body": "nbody", "jnt": "njnt", "dof": "nv", "geom": "ngeom", "site": "nsite"}
_ROWS |= {"mesh_vert": "nmeshvert", "mesh_face": "nmeshface"}
_BODY = dict.fromkeys(("xpos", "xmat", "xquat", "xipos", "ximat", "subtree_com"), "nbody")
_OF_DATA = {**_BODY, **dict.fromkeys(("xanchor", "xaxis"), "njnt")}
_KINDS = {"body": "BODY", "jnt": "JOINT", "geom": "GEOM", "site": "SITE"}


_gone: list[int] = []  # Models and states that Python has forgotten since the last question.


def _ask(what: str, *given: Any) -> Any:
    """Answer of the bridge.

    Raises:
        ValueError: MuJoCo refuses.
    """
    while _gone and what != "free":
        _ask("free", _gone.pop())
    found = json.loads(mujoco_js.ask(json.dumps([what, *given])))
    if "problem" in found:
        raise ValueError(found["problem"])
    return found["answer"]


__version__: str = _ask("version")


def __getattr__(name: str) -> Any:
    """Enumerations such as mjtGeom."""
    if not name.startswith("mjt"):
        raise AttributeError(f"MuJoCo of the page has no '{name}' that Draft uses")
    made = globals()[name] = IntEnum(name, _ask("members", name))
    return made


class _Struct:
    """A model or a state; its arrays and numbers by their names."""

    def __init__(self, key: int) -> None:
        self._key, self._arrays = key, {}

    def __del__(self) -> None:
        if "_key" in self.__dict__:
            _gone.append(self._key)  # It may be forgotten while another question is asked.

    def __getattr__(self, name: str) -> Any:
        if name.startswith("_"):
            raise AttributeError(name)
        if name not in self._arrays:
            value = _ask("read", self._key, name)
            if value is None:
                raise AttributeError(f"MuJoCo of the page has no '{name}' that Draft reads")
            if not isinstance(value, list):
                return value
            kind, numbers = value
            flat = np.array(numbers, _DTYPES[kind])
            rows = self._rows(name)
            wide = len(flat) // rows if rows else 1
            self._arrays[name] = flat.reshape(rows, wide) if wide > 1 else flat
        return self._arrays[name]

    def _rows(self, name: str) -> int:
        raise NotImplementedError

    def _send(self) -> None:
        for name, values in self._arrays.items():
            _ask("write", self._key, name, values.ravel().tolist())

    def _receive(self) -> None:
        for name, values in self._arrays.items():
            values.reshape(-1)[:] = _ask("read", self._key, name)[1]


class _Named:
    """A joint, geom, site or body; its numbers by the names that the model's have."""

    def __init__(self, model: MjModel, prefix: str, key: str | int) -> None:
        self._model, self._prefix, kind = model, prefix, f"mjOBJ_{_KINDS[prefix]}"
        self.id = key if isinstance(key, int) else _ask("id", model._key, kind, key)
        if self.id < 0:
            raise KeyError(f"Invalid name '{key}'")
        self.name = key if isinstance(key, str) else _ask("name", model._key, kind, self.id)

    def __getattr__(self, name: str) -> NDArray:
        return np.atleast_1d(getattr(self._model, f"{self._prefix}_{name}")[self.id])


class MjModel(_Struct):
    """A compiled model."""

    @staticmethod
    def from_xml_string(xml: str) -> MjModel:
        """Compile a text.

        Raises:
            ValueError: MuJoCo does not accept it.
        """
        try:
            return MjModel(_ask("model", xml))
        except ValueError as error:  # Bindings for Python say the cause alone.
            raise ValueError(str(error).removeprefix("MuJoCo Error: Loading error: ")) from None

    def joint(self, key: str | int) -> _Named:
        """Joint of a name or an index."""
        return _Named(self, "jnt", key)

    def geom(self, key: str | int) -> _Named:
        """Geom of a name or an index."""
        return _Named(self, "geom", key)

    def site(self, key: str | int) -> _Named:
        """Site of a name or an index."""
        return _Named(self, "site", key)

    def body(self, key: str | int) -> _Named:
        """Body of a name or an index."""
        return _Named(self, "body", key)

    def _rows(self, name: str) -> int:
        return next((getattr(self, n) for start, n in _ROWS.items() if name.startswith(start)), 0)


class MjData(_Struct):
    """A state of a model."""

    def __init__(self, model: MjModel) -> None:
        super().__init__(_ask("data", model._key))
        self._model = model

    def _rows(self, name: str) -> int:
        count = _OF_DATA.get(name) or _ROWS.get(name.partition("_")[0])
        return getattr(self._model, count) if count else 0


def mj_kinematics(model: MjModel, data: MjData) -> None:
    """Compute places from positions."""
    _call("mj_kinematics", model, data)


def mj_geomDistance(  # noqa: N802
    model: MjModel, data: MjData, first: int, second: int, most: float, _: None
) -> float:
    """Smallest distance of two geoms [m], at most `most`."""
    return _ask("distance", model._key, data._key, int(first), int(second), most)


def _call(name: str, model: MjModel, data: MjData) -> None:
    model._send()
    data._send()
    _ask("call", name, model._key, data._key)
    data._receive()


class MjLogConfig:
    """Settings of a log file, which a page cannot write."""

    logfile, logto_file = "", False

    @staticmethod
    def get() -> MjLogConfig:
        """Return the settings."""
        return MjLogConfig()
