"""Triangles of STL, OBJ and COLLADA files, read by trimesh, with limits of their own.

Of COLLADA, trimesh sees only what places triangles: materials, textures and references to other
files are taken out.
"""

from __future__ import annotations

import io
import math
import re
from collections.abc import Mapping
from dataclasses import replace
from xml.sax.saxutils import escape, quoteattr

from draft import meshes
from draft.description.xmlfile import Element, read_text
from draft.meshes import MAX_TRIANGLES, placed_triangles, read_triangles
from draft.values import Array

MAX_BYTES = meshes.MAX_BYTES | {".dae": 50_000_000}
# Nodes can be used many times by nodes that are used many times: what is placed is bounded.
MAX_NODES, MAX_NUMBERS = 20_000, 12 * MAX_TRIANGLES
NAMESPACE = "http://www.collada.org/2005/11/COLLADASchema"
SHAPES = ("triangles", "polylist", "polygons")
# Elements of a COLLADA file that place triangles.
PLACING = {
    *("COLLADA", "library_geometries", "geometry", "mesh", "source", "float_array"),
    *("technique_common", "accessor", "param", "vertices", "input"),
    *(*SHAPES, "vcount", "p"),
    *("library_nodes", "library_visual_scenes", "visual_scene", "node"),
    *("matrix", "translate", "rotate", "scale", "instance_geometry", "instance_node"),
    *("scene", "instance_visual_scene"),
}


def read_mesh(data: bytes, kind: str) -> Array:
    """Triangles of a file [m for COLLADA, else its own unit], shape (n, 3, 3).

    Polygons are cut into fans. The unit of COLLADA is applied and its up axis is not. RViz, MoveIt
    and Gazebo do the same: a robot's description places a mesh in the link's frame as the numbers
    in the file stand. (Assimp alone would turn Z_UP; ROS tools drop that turn.)

    Args:
        data: the file's bytes.
        kind: ending of its name, a key of `MAX_BYTES`.

    Raises:
        DescriptionError: a COLLADA file is not plain XML.
        ValueError: it is not of that kind, or its numbers do not fit together.
    """
    if kind in meshes.MAX_BYTES:
        return read_triangles(data, kind)
    text, scale = _dae(read_text(data, "", with_content=True))
    return placed_triangles(io.BytesIO(text.encode()), kind[1:]) * scale


def _dae(root: Element) -> tuple[str, float]:
    """What places triangles in a COLLADA file, written anew, and its unit [m]."""
    if root.tag != "COLLADA":
        raise ValueError("it is not a COLLADA file")
    root.attributes.setdefault("xmlns", NAMESPACE)
    asset = root.first("asset")
    unit = asset.first("unit") if asset is not None else None
    given = "1" if unit is None else unit.attributes.get("meter", "1")
    try:
        metres = float(given)
    except ValueError:
        metres = math.nan
    if not 0 < metres < math.inf:
        raise ValueError(f'its unit is "{given[:30]}" metres')
    if not any(scene.first("instance_visual_scene") for scene in root.all("scene")):
        root.children += _scene(root)
    try:
        nodes, size = _uses(root, _named(root), {})
    except RecursionError:
        nodes, size = math.inf, math.inf
    if nodes > MAX_NODES or size > MAX_NUMBERS:
        raise ValueError(f"it places more than {MAX_NODES} nodes or {MAX_TRIANGLES} triangles")
    return _text(root), metres


def _named(root: Element) -> dict[str, Element]:
    """Elements by the references to them."""
    found: dict[str, Element] = {}
    waiting = [root]
    while waiting:
        element = waiting.pop()
        found["#" + element.attributes.get("id", "")] = element
        waiting += element.children
    return found


def _scene(root: Element) -> list[Element]:
    """Scene for a file that names none: all nodes of its scenes, else all geometries."""

    def inside(library: str, tag: str) -> list[Element]:
        return [one for each in root.all(library) for one in each.all(tag)]

    scenes = inside("library_visual_scenes", "visual_scene")
    shown = [node for scene in scenes for node in scene.all("node")]
    if not shown:
        ids = [one.attributes.get("id", "") for one in inside("library_geometries", "geometry")]
        uses = [Element("instance_geometry", {"url": f"#{name}"}, root.where) for name in ids]
        shown = [Element("node", {}, root.where, uses)]
    scene = Element("visual_scene", {"id": "shown"}, root.where, shown)
    use = Element("instance_visual_scene", {"url": "#shown"}, root.where)
    return [
        Element("library_visual_scenes", {}, root.where, [scene]),
        Element("scene", {}, root.where, [use]),
    ]


def _uses(
    element: Element, named: Mapping[str, Element], known: dict[int, tuple[float, float]]
) -> tuple[float, float]:
    """Nodes and shapes that an element places, and the numbers in lists of corners."""
    if id(element) in known:
        return known[id(element)]
    known[id(element)] = (math.inf, math.inf)  # A node that uses itself has no end.
    inner = list(element.children)
    if element.tag in ("instance_node", "instance_geometry"):
        url = element.attributes.get("url", "")
        if url not in named:
            raise _error(element, f"'{url[:60]}' is not in the file")
        inner = [named[url]]
    each = [_uses(child, named, known) for child in inner if child.tag in PLACING]
    nodes = (element.tag in ("node", *SHAPES)) + sum(one[0] for one in each)
    own = re.finditer(r"\S+", element.content) if element.tag == "p" else ()
    size = sum(1 for _ in own) + sum(one[1] for one in each)
    known[id(element)] = nodes, size
    return nodes, size


def _text(element: Element) -> str:
    """An element as XML without what places no triangles, and without what pycollada misreads."""
    given, content, children = element.attributes, element.content, list(element.children)
    if element.tag in SHAPES:
        children = _shape(element)
    elif element.tag == "vertices":
        children = [one for one in children if one.attributes.get("semantic") == "POSITION"]
    elif element.tag == "source":
        children = _points(element)
    elif element.tag == "rotate":  # It takes an axis as one of length 1.
        *axis, angle = element.content.split() or [""]
        length = math.hypot(*map(float, axis))
        content = " ".join([*(repr(float(one) / (length or 1.0)) for one in axis), angle])
    attributes = "".join(f" {key}={quoteattr(value)}" for key, value in given.items())
    inner = "".join(_text(child) for child in children if child.tag in PLACING)
    return f"<{element.tag}{attributes}>{escape(content)}{inner}</{element.tag}>"


def _shape(shape: Element) -> list[Element]:
    """Corners of a shape, by its points alone."""
    inputs = list(shape.all("input"))
    corner = next((one for one in inputs if one.attributes.get("semantic") == "VERTEX"), None)
    if corner is None:
        raise _error(shape, f"<{shape.tag}> has no vertices")
    for one in inputs:
        if not one.attributes.get("offset", "").isdecimal():
            raise _error(one, f'offset="{one.attributes.get("offset", "")[:20]}"')
    # Normals and the like become points, of which the first count.
    others = [
        replace(corner, attributes={**corner.attributes, "offset": one.attributes["offset"]})
        for one in inputs
        if one is not corner
    ]
    counts = list(shape.all("vcount"))
    lists = [p for one in shape.children for p in ([one] if one.tag == "p" else one.all("p"))]
    for one in (*lists, *counts):
        if re.search(r"[^\d\s]", one.content):
            raise _error(one, f"<{one.tag}> has something that names no point")
    if any(re.search(r"(?<!\S)0*1(?!\S)", one.content) for one in counts):
        raise _error(shape, f"<{shape.tag}> has a polygon of one corner")
    if shape.tag != "polygons" and lists:  # It reads the first list.
        lists = [replace(lists[0], content=" ".join(one.content for one in lists))]
    return [corner, *others, *counts, *lists]


def _points(source: Element) -> list[Element]:
    """Numbers of a source, and how many go together; of points, their x, y and z alone."""
    numbers, technique = source.first("float_array"), source.first("technique_common")
    accessor = technique.first("accessor") if technique is not None else None
    if numbers is None or technique is None or accessor is None:
        return source.children
    if re.search(r"[^\d\s.eE+-]", numbers.content):
        raise _error(numbers, "<float_array> has something that is no number")
    start = int(accessor.number("offset", 0))
    step = int(accessor.number("stride", 1))
    names = [one.attributes.get("name") for one in accessor.all("param")]
    if start == 0 and step == len(names) and all(names):
        return source.children
    words = numbers.content.split()[max(start, 0) :]
    kept = [word for i in range(0, len(words), max(step, 1)) for word in words[i : i + step][:3]]
    params = [Element("param", {"name": axis}, source.where) for axis in "XYZ"]
    return [
        replace(numbers, content=" ".join(kept)),
        replace(technique, children=[replace(accessor, children=params)]),
    ]


def _error(element: Element, cause: str) -> ValueError:
    return ValueError(f"line {element.where.line}: {cause}")
