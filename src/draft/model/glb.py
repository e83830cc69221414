"""Model -> binary glTF 2.0, the robot in its home pose, for whatever shows three dimensions.

Nodes are called after bodies, joints and geoms. A body's node is where it is mounted; its joint's
node below it turns or moves by the joint's value, so a viewer that animates turns that one about
the axis in its `extras`. glTF's y points up: the node of the robot turns z there.
"""

from __future__ import annotations

import json
import math
import struct
from importlib.metadata import version
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from draft.geometry import about, quaternion
from draft.model.mjcf import colors
from draft.model.shapes import Shape, shapes
from draft.model.solids import triangles
from draft.values import Array, scalar

if TYPE_CHECKING:
    from draft.model.model import Model

_MAGIC, _JSON, _BIN = 0x46546C67, 0x4E4F534A, 0x004E4942
_FLOAT, _UINT = 5126, 5125
_VERTICES, _INDICES = 34962, 34963
_HALF = math.sqrt(0.5)


class _Buffer:
    """The binary part: arrays, each with its view and accessor."""

    def __init__(self) -> None:
        self.data = bytearray()
        self.views: list[dict[str, Any]] = []
        self.accessors: list[dict[str, Any]] = []

    def vectors(self, values: Array) -> int:
        """Add vectors, shape (n, 3); returns the accessor."""
        short = values.astype("<f4")
        low, high = short.min(axis=0).tolist(), short.max(axis=0).tolist()
        made = {"componentType": _FLOAT, "type": "VEC3", "min": low, "max": high}
        return self._add(short.tobytes(), _VERTICES, made | {"count": len(values)})

    def indices(self, values: NDArray[np.int64]) -> int:
        """Add corners of triangles; returns the accessor."""
        made = {"componentType": _UINT, "type": "SCALAR", "count": values.size}
        return self._add(values.astype("<u4").tobytes(), _INDICES, made)

    def _add(self, raw: bytes, target: int, accessor: dict[str, Any]) -> int:
        self.views.append(
            {"buffer": 0, "byteOffset": len(self.data), "byteLength": len(raw), "target": target}
        )
        self.data += raw
        self.accessors.append({"bufferView": len(self.views) - 1, **accessor})
        return len(self.accessors) - 1


def robot_glb(model: Model) -> bytes:
    """The robot in its home pose, standing on y = 0, as the bytes of a .glb file [m]."""
    buffer = _Buffer()
    nodes, meshes = _nodes(model), []
    kinds = colors(model.design)
    loft = model.design.trunk.loft
    holders = {node["extras"]["body"]: k for k, node in enumerate(nodes) if "extras" in node}
    for shape in shapes(model.mujoco, model.design):
        solid = triangles(shape, loft)
        primitive = {
            "attributes": {
                "POSITION": buffer.vectors(solid.points),
                "NORMAL": buffer.vectors(solid.normals),
            },
            "indices": buffer.indices(solid.faces),
            "material": list(kinds).index(shape.kind),
        }
        meshes.append({"name": shape.name, "primitives": [primitive]})
        _hang(nodes, holders[shape.body], _shape_node(shape) | {"mesh": len(meshes) - 1})
    scene = {
        "asset": {"version": "2.0", "generator": f"Draft {version('draft')}"},
        "scene": 0,
        "scenes": [{"name": model.design.name, "nodes": [0]}],
        "nodes": nodes,
        "meshes": meshes,
        "materials": [_material(name, color) for name, color in kinds.items()],
        "accessors": buffer.accessors,
        "bufferViews": buffer.views,
        "buffers": [{"byteLength": len(buffer.data)}],
    }
    return _packed(scene, bytes(buffer.data))


def _nodes(model: Model) -> list[dict[str, Any]]:
    """Nodes of the robot, its bodies and joints; one that carries a body's shapes says so."""
    design, compiled = model.design, model.mujoco
    name = f"{design.name}_{design.label}"
    nodes: list[dict[str, Any]] = [{"name": name, "rotation": [-_HALF, 0.0, 0.0, _HALF]}]
    carriers: list[int] = []
    for i, body in enumerate(design.bodies, start=1):
        place = {"translation": compiled.body_pos[i].tolist()}
        if body.parent is None:
            place = {"translation": [0.0, 0.0, scalar(design.lowest(home=True))]}
        turn = _gltf(compiled.body_quat[i].tolist())
        above = 0 if body.parent is None else carriers[body.parent]
        carrier = _hang(nodes, above, {"name": f"{body.name}_body", **place, "rotation": turn})
        if body.joint is not None:
            joint: Any = body.joint
            axis = [float(x) for x in body.joint_axis]
            if joint.slide:
                moved: dict[str, Any] = {"translation": [x * float(joint.home) for x in axis]}
            else:
                home = quaternion(about(body.joint_axis, scalar(joint.home)))
                moved = {"rotation": _gltf(home)}
            extras = {"joint": joint.kind, "axis": axis, "range": [float(x) for x in joint.range]}
            extras |= {"home": float(joint.home)}
            node = {"name": body.prefix + joint.name, **moved, "extras": extras}
            carrier = _hang(nodes, carrier, node)
        nodes[carrier].setdefault("extras", {})["body"] = i
        carriers.append(carrier)
    return nodes


def _hang(nodes: list[dict[str, Any]], parent: int, node: dict[str, Any]) -> int:
    """Put a node under another one; returns its index."""
    nodes.append(node)
    nodes[parent].setdefault("children", []).append(len(nodes) - 1)
    return len(nodes) - 1


def _shape_node(shape: Shape) -> dict[str, Any]:
    rows: Any = tuple(tuple(row) for row in shape.rotation.tolist())
    return {
        "name": shape.name,
        "translation": shape.position.tolist(),
        "rotation": _gltf(quaternion(rows)),
    }


def _gltf(wxyz: Any) -> list[float]:
    """A quaternion in glTF's order, x, y, z, w."""
    w, x, y, z = (float(c) for c in wxyz)
    return [x, y, z, w]


def _material(name: str, color: tuple[float, ...]) -> dict[str, Any]:
    """A dull material; glTF wants linear light, the colours are those of a screen (sRGB)."""
    linear = [c / 12.92 if c <= 0.04045 else ((c + 0.055) / 1.055) ** 2.4 for c in color[:3]]
    return {
        "name": name,
        "pbrMetallicRoughness": {
            "baseColorFactor": [*linear, 1.0],
            "metallicFactor": 0.0,
            "roughnessFactor": 0.7,
        },
    }


def _packed(scene: dict[str, Any], data: bytes) -> bytes:
    """Both chunks behind their heads, each filled up to four bytes."""
    text = json.dumps(scene, separators=(",", ":")).encode()
    text += b" " * (-len(text) % 4)
    data += b"\0" * (-len(data) % 4)
    size = 12 + 8 + len(text) + 8 + len(data)
    head = struct.pack("<III", _MAGIC, 2, size)
    chunks = struct.pack("<II", len(text), _JSON) + text
    return head + chunks + struct.pack("<II", len(data), _BIN) + data
