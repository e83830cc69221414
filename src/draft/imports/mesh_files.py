"""Triangles of STL, OBJ and COLLADA files, read by trimesh, with limits of their own.

trimesh is given no name of a file and no resolver, so it opens nothing else. Of OBJ and COLLADA it
sees only what places triangles: materials, textures and references to other files are taken out.
"""

from __future__ import annotations

import io
import math
import re
import warnings
from collections.abc import Mapping
from dataclasses import replace
from typing import Any
from xml.sax.saxutils import escape, quoteattr

import numpy as np

from draft.description.xmlfile import Element, read_text
from draft.values import Array

# A file as text takes several times its size while it is read.
MAX_BYTES = {".stl": 60_000_000, ".obj": 50_000_000, ".dae": 50_000_000}
MAX_TRIANGLES = 1_000_000
# Nodes can be used many times by nodes that are used many times: what is placed is bounded.
MAX_NODES, MAX_NUMBERS = 20_000, 12 * MAX_TRIANGLES
MAX_SOLIDS = 1_000
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
_BACK = re.compile(rb"-\d+")


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
    scale = 1.0
    if kind == ".stl":
        stream: Any = io.BytesIO(_stl(data))
    elif kind == ".obj":
        stream = io.StringIO(_obj(data))
    else:
        text, scale = _dae(read_text(data, "", with_content=True))
        stream = io.BytesIO(text.encode())
    return _placed(stream, kind[1:]) * scale


def _placed(stream: Any, kind: str) -> Array:
    """Triangles of all geometries that a file's scene shows, where it shows them."""
    import trimesh

    with warnings.catch_warnings():
        # NumPy stops at what is no number and only warns; other warnings are the libraries' own.
        warnings.simplefilter("ignore", DeprecationWarning)
        unread = "string or file could not be read"
        warnings.filterwarnings("error", unread, DeprecationWarning)
        try:
            scene = trimesh.load_scene(stream, file_type=kind, process=False, ignore_broken=False)
            shown = [scene.graph[node] for node in scene.graph.nodes_geometry]
            with np.errstate(all="ignore"):
                parts = [
                    np.asarray(scene.geometry[str(name)].triangles) @ pose[:3, :3].T + pose[:3, 3]
                    for pose, name in shown
                ]
        except (DeprecationWarning, ValueError):
            raise ValueError("its numbers do not fit together") from None
        except IndexError:
            raise ValueError("it names a point that is not there") from None
        except Exception as error:  # Of whatever kind a library meets in a broken file.
            words = re.sub(r"^Dae\w+: ", "", " ".join(str(error).split())) or type(error).__name__
            raise ValueError(f"it is broken: {words[:120]}") from None
    count = sum(map(len, parts))
    if not 0 < count <= MAX_TRIANGLES:
        cause = f"more than {MAX_TRIANGLES}" if count else "it has no finite"
        raise ValueError(f"{cause} triangles")
    return np.concatenate(parts)


def _stl(data: bytes) -> bytes:
    """A file that is as long as its header says, or text with an end."""
    count = int.from_bytes(data[80:84], "little")
    held = (len(data) - 84) // 50
    if held >= 0 and len(data) == 84 + 50 * count:
        return data
    if held >= 0 and b"\0" in data[:4096]:
        raise ValueError(f"its header says {count} triangles, it holds {held}")
    if data[:512].lstrip()[:5].lower() != b"solid":
        raise ValueError("it is not an STL file")
    if b"endsolid" not in data.rstrip().rpartition(b"\n")[2].lower():
        raise ValueError("its text is cut short")
    if data.lower().count(b"endsolid") > MAX_SOLIDS:
        raise ValueError(f"more than {MAX_SOLIDS} solids")
    return data


def _obj(data: bytes) -> str:
    """Points and faces of an OBJ file alone, each corner as the number of its point."""
    lines: list[bytes] = []
    points = corners = 0
    for line in data.replace(b"\\\r\n", b" ").replace(b"\\\n", b" ").splitlines():
        if line[:2] in (b"v ", b"v\t"):
            points += 1
            lines.append(b" ".join(line.split()))
        elif line[:2] in (b"f ", b"f\t"):
            # A corner is `point`, `point/texture`, `point//normal` or `point/texture/normal`.
            words = [word.partition(b"/")[0] for word in line.split()]
            corners += len(words) - 1
            lines.append(b" ".join(words))
            if b"-" in lines[-1]:  # They count back from the last point above.
                lines[-1] = _BACK.sub(lambda x, n=points + 1: b"%d" % (n + int(x[0])), lines[-1])
    if not points or not corners:
        raise ValueError("it is not an OBJ file")
    if corners > 3 * MAX_TRIANGLES:
        raise ValueError(f"more than {MAX_TRIANGLES} triangles")
    text = b"\n".join(lines)
    if re.search(rb"^f(?!(?: 0*[1-9]\d{0,9}){3,}$)", text, re.MULTILINE):
        raise ValueError("a face is not the numbers of three points or more")
    return text.decode("utf-8", "replace")


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
