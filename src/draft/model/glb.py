"""Export to binary glTF 2.0: the robot in its home pose, for 3D viewers.

Nodes are named after bodies, joints and geoms. The node of a body is its mounting frame; the node
of its joint below it has the joint's rotation or translation, so that a viewer can animate it about
or along the axis in its `extras`. In glTF the y axis points up; the root node turns z onto it.
"""

from __future__ import annotations

import json
import math
import struct
from collections.abc import Iterable
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from draft.extras import own_version
from draft.geometry import about, quaternion
from draft.model.mjcf import colors
from draft.model.shapes import Shape, shapes
from draft.model.solids import triangles
from draft.spec.primitives.mesh import Mesh
from draft.values import Array, Value, scalar

if TYPE_CHECKING:
    from draft.model.model import Model

_MAGIC, _JSON, _BIN = 0x46546C67, 0x4E4F534A, 0x004E4942
_FLOAT, _UINT = 5126, 5125
_VERTICES, _INDICES = 34962, 34963
_HALF = math.sqrt(0.5)
Node = dict[str, Any]  # an object of glTF's JSON


class _Buffer:
    """Binary chunk of arrays, each with its buffer view and accessor."""

    def __init__(self) -> None:
        self.data = bytearray()
        self.views: list[Node] = []
        self.accessors: list[Node] = []

    def vectors(self, values: Array) -> int:
        """Add vectors, shape (n, 3); return the index of the accessor."""
        single = values.astype("<f4")
        low, high = single.min(axis=0).tolist(), single.max(axis=0).tolist()
        accessor = {"componentType": _FLOAT, "type": "VEC3", "min": low, "max": high}
        return self._add(single.tobytes(), _VERTICES, accessor | {"count": len(values)})

    def indices(self, values: NDArray[np.int64]) -> int:
        """Add the vertex indices of triangles, shape (n, 3); return the index of the accessor."""
        accessor = {"componentType": _UINT, "type": "SCALAR", "count": values.size}
        return self._add(values.astype("<u4").tobytes(), _INDICES, accessor)

    def _add(self, raw: bytes, target: int, accessor: Node) -> int:
        self.views.append(
            {"buffer": 0, "byteOffset": len(self.data), "byteLength": len(raw), "target": target}
        )
        self.data += raw
        self.accessors.append({"bufferView": len(self.views) - 1, **accessor})
        return len(self.accessors) - 1


def robot_glb(model: Model) -> bytes:
    """Bytes of a .glb file of the robot in its home pose, with the floor at y = 0 [m]."""
    buffer = _Buffer()
    nodes, meshes = _nodes(model), []
    kinds = colors(model.design)
    body_nodes: dict[int, int] = {
        node["extras"]["body"]: k for k, node in enumerate(nodes) if "extras" in node
    }
    parts: dict[str, Node] = {}  # Copies of a part share its vertices.
    for shape in shapes(model.mujoco, model.design):
        if not shape.drawn:
            continue
        primitive = parts.get(shape.mesh.name) if isinstance(shape.mesh, Mesh) else None
        if primitive is None:
            solid = triangles(shape)
            primitive = {
                "attributes": {
                    "POSITION": buffer.vectors(solid.points),
                    "NORMAL": buffer.vectors(solid.normals),
                },
                "indices": buffer.indices(solid.faces),
            }
        if isinstance(shape.mesh, Mesh):
            parts[shape.mesh.name] = primitive
        primitive = primitive | {"material": list(kinds).index(shape.kind)}
        meshes.append({"name": shape.name, "primitives": [primitive]})
        _append(nodes, body_nodes[shape.body], _shape_node(shape) | {"mesh": len(meshes) - 1})
    scene = {
        "asset": {"version": "2.0", "generator": f"Draft {own_version()}"},
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


def _nodes(model: Model) -> list[Node]:
    """Nodes of the robot, its bodies and joints; `extras.body` marks those with shapes."""
    design, compiled = model.design, model.mujoco
    name = f"{design.name}_{design.label}"
    nodes: list[Node] = [{"name": name, "rotation": [-_HALF, 0.0, 0.0, _HALF]}]
    holders: list[int] = []  # node of the shapes and children of each body
    for i, body in enumerate(design.bodies, start=1):
        position = compiled.body_pos[i].tolist()
        if body.parent is None and design.floating:
            position = [0.0, 0.0, scalar(design.lowest(home=True))]
        rotation = _xyzw(compiled.body_quat[i].tolist())
        parent = 0 if body.parent is None else holders[body.parent]
        node = {"name": f"{body.name}_body", "translation": position, "rotation": rotation}
        holder = _append(nodes, parent, node)
        if body.joint is not None:
            joint, home = body.joint, scalar(body.joint.home)
            axis = [scalar(x) for x in body.joint_axis]
            if joint.slide:
                motion = {"translation": [x * home for x in axis]}
            else:
                motion = {"rotation": _xyzw(quaternion(about(body.joint_axis, home)))}
            extras = {"joint": joint.kind, "axis": axis}
            if not joint.rolls:
                extras["range"] = [scalar(x) for x in joint.range]
            node = {"name": body.prefix + joint.name, **motion, "extras": extras | {"home": home}}
            holder = _append(nodes, holder, node)
        nodes[holder].setdefault("extras", {})["body"] = i
        holders.append(holder)
    return nodes


def _append(nodes: list[Node], parent: int, node: Node) -> int:
    """Add a node below another one; return its index."""
    nodes.append(node)
    nodes[parent].setdefault("children", []).append(len(nodes) - 1)
    return len(nodes) - 1


def _shape_node(shape: Shape) -> Node:
    a, b, c = ((float(row[0]), float(row[1]), float(row[2])) for row in shape.rotation)
    return {
        "name": shape.name,
        "translation": shape.position.tolist(),
        "rotation": _xyzw(quaternion((a, b, c))),
    }


def _xyzw(wxyz: Iterable[Value]) -> list[float]:
    """Reorder a quaternion (w, x, y, z) to glTF's x, y, z, w."""
    w, x, y, z = (scalar(c) for c in wxyz)
    return [x, y, z, w]


def _material(name: str, color: tuple[float, ...]) -> Node:
    """Matte material; glTF uses linear colours, Draft's are sRGB."""
    linear = [c / 12.92 if c <= 0.04045 else ((c + 0.055) / 1.055) ** 2.4 for c in color[:3]]
    return {
        "name": name,
        "pbrMetallicRoughness": {
            "baseColorFactor": [*linear, 1.0],
            "metallicFactor": 0.0,
            "roughnessFactor": 0.7,
        },
    }


def _packed(scene: Node, data: bytes) -> bytes:
    """Join both chunks with their headers, padded to multiples of four bytes."""
    text = json.dumps(scene, separators=(",", ":")).encode()
    text += b" " * (-len(text) % 4)
    data += b"\0" * (-len(data) % 4)
    size = 12 + 8 + len(text) + 8 + len(data)
    head = struct.pack("<III", _MAGIC, 2, size)
    chunks = struct.pack("<II", len(text), _JSON) + text
    return head + chunks + struct.pack("<II", len(data), _BIN) + data
