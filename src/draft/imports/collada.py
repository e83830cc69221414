"""Triangles of a COLLADA file (.dae): its visual scene, in metres.

Source: COLLADA 1.4.1 and 1.5 specifications (Khronos): library_geometries, visual_scene, node.
Nothing outside the file is opened: a reference is an id within it.
"""

from __future__ import annotations

import math
import warnings
from collections.abc import Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from draft.description.xmlfile import Element, read_text
from draft.values import Array

Integers = NDArray[np.int64]
MAX_TRIANGLES = 1_000_000
# Nodes can be used many times by nodes that are used many times: what is placed is bounded.
MAX_NODES = 20_000
MAX_DEPTH = 100
SHAPES = ("triangles", "polylist", "polygons")


def read_dae(data: bytes) -> Array:
    """Triangles of a COLLADA file [m], shape (n, 3, 3); polygons are cut into fans.

    The unit is applied and the up axis is not. RViz, MoveIt and Gazebo do the same: a robot's
    description places a mesh in the link's frame as the numbers in the file stand, whichever
    way its author called up. (Assimp alone would turn Z_UP; ROS tools drop that turn.)

    Raises:
        DescriptionError: not plain XML.
        ValueError: it is not COLLADA, or its numbers do not fit together.
    """
    root = read_text(data, "", with_content=True)
    if root.tag != "COLLADA":
        raise ValueError("it is not a COLLADA file")
    scene = _Scene(root)
    found = [
        points @ pose[:3, :3].T + pose[:3, 3] for points, pose in scene.placed() if len(points)
    ]
    if not found:
        raise ValueError("its scene has no triangles")
    return np.concatenate(found) * _unit(root)


def _unit(root: Element) -> float:
    """Metres per unit of the file."""
    asset = root.first("asset")
    unit = asset.first("unit") if asset is not None else None
    text = "1" if unit is None else unit.attributes.get("meter", "1")
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not 0 < value < math.inf:
        raise ValueError(f'its unit is "{text[:30]}" metres')
    return value


class _Scene:
    """Geometries and nodes of a file, by id."""

    def __init__(self, root: Element) -> None:
        self.root = root
        self.known: dict[str, Element] = {}
        waiting = [root]
        while waiting:
            element = waiting.pop()
            name = element.attributes.get("id")
            if name:
                self.known[name] = element
            waiting.extend(element.children)
        self.read: dict[int, Array] = {}
        self.total = 0

    def placed(self) -> Iterator[tuple[Array, Array]]:
        """Triangles of each geometry that the scene shows, and where: a 4 x 4 matrix."""
        tops = [node for scene in self._scenes() for node in scene.all("node")]
        if not tops:
            for library in self.root.all("library_geometries"):
                for geometry in library.all("geometry"):
                    yield self._geometry(geometry), np.eye(4)
            return
        waiting = [(node, np.eye(4), 0) for node in reversed(tops)]
        visited = 0
        while waiting:
            node, above, depth = waiting.pop()
            visited += 1
            if visited > MAX_NODES or depth > MAX_DEPTH:
                raise ValueError("its nodes use each other too often")
            pose = above @ _transform(node)
            for child in node.children:
                if child.tag == "instance_geometry":
                    yield self._geometry(self._named(child, "url")), pose
                elif child.tag == "instance_node":
                    waiting.append((self._named(child, "url"), pose, depth + 1))
                elif child.tag == "node":
                    waiting.append((child, pose, depth + 1))

    def _scenes(self) -> list[Element]:
        """The scene that the file shows; all of them if it does not say."""
        for scene in self.root.all("scene"):
            for use in scene.all("instance_visual_scene"):
                return [self._named(use, "url")]
        libraries = self.root.all("library_visual_scenes")
        return [scene for library in libraries for scene in library.all("visual_scene")]

    def _named(self, element: Element, attribute: str) -> Element:
        text = element.attributes.get(attribute, "")
        found = self.known.get(text[1:]) if text.startswith("#") else None
        if found is None:
            raise ValueError(f"line {element.where.line}: '{text[:60]}' is not in the file")
        return found

    def _geometry(self, geometry: Element) -> Array:
        """Triangles of a geometry in its own frame, read once."""
        key = id(geometry)
        if key not in self.read:
            parts: list[Array] = []
            for mesh in geometry.all("mesh"):
                for shape in mesh.all(*SHAPES):
                    parts += self._triangles(shape)
            self.read[key] = np.concatenate(parts) if parts else np.zeros((0, 3, 3))
        self.total += len(self.read[key])
        if self.total > MAX_TRIANGLES:
            raise ValueError(f"more than {MAX_TRIANGLES} triangles")
        return self.read[key]

    def _triangles(self, shape: Element) -> list[Array]:
        """Triangles of one <triangles>, <polylist> or <polygons>."""
        inputs = list(shape.all("input"))
        offsets = [int(_whole(one, "offset")) for one in inputs]
        corner = next((i for i, one in enumerate(inputs) if _means(one, "VERTEX")), None)
        if corner is None:
            raise ValueError(f"line {shape.where.line}: <{shape.tag}> has no vertices")
        step = max(offsets) + 1
        holders = [shape, *shape.all("ph")]
        lists = [_integers(p) for holder in holders for p in holder.all("p")]
        corners = [one[offsets[corner] :: step] for one in lists]
        if not sum(map(len, corners)):
            return []
        if shape.tag == "polygons":
            counts = np.array([len(one) for one in corners])
        else:
            counts = self._counts(shape, sum(map(len, corners)))
        flat = np.concatenate(corners)
        points = self._points(inputs[corner])
        if flat.min() < 0 or flat.max() >= len(points):
            cause = f"<{shape.tag}> names a point that is not there"
            raise ValueError(f"line {shape.where.line}: {cause}")
        return [points[fans(flat, counts)]]

    def _counts(self, shape: Element, corners: int) -> Integers:
        """Corners of each polygon."""
        given = shape.first("vcount")
        if shape.tag == "polylist" and given is not None:
            counts = _integers(given)
        else:
            counts = np.full(corners // 3, 3)
        if counts.sum() != corners or (len(counts) and counts.min() < 0):
            raise ValueError(f"line {shape.where.line}: <{shape.tag}> has another count of corners")
        return counts

    def _points(self, given: Element) -> Array:
        """Positions that a VERTEX input stands for, shape (n, 3)."""
        vertices = self._named(given, "source")
        holder = next((one for one in vertices.all("input") if _means(one, "POSITION")), None)
        source = self._named(holder, "source") if holder is not None else vertices
        values = source.first("float_array")
        if values is None:
            raise ValueError(f"line {source.where.line}: it has no numbers")
        numbers = _numbers(values)
        technique = source.first("technique_common")
        accessor = technique.first("accessor") if technique is not None else None
        step = int(_whole(accessor, "stride", 3)) if accessor is not None else 3
        start = int(_whole(accessor, "offset", 0)) if accessor is not None else 0
        count = (len(numbers) - start) // max(step, 1)
        if step < 3 or count < 1:
            raise ValueError(f"line {source.where.line}: it has no points in space")
        return numbers[start : start + count * step].reshape(count, step)[:, :3]


def fans(corners: Integers, counts: Integers) -> Integers:
    """Cut polygons, given as corners one after the other, into triangles: shape (n, 3)."""
    if np.all(counts == 3):
        return corners.reshape(-1, 3)
    firsts = np.cumsum(counts) - counts
    cuts = np.maximum(counts - 2, 0)
    owner = np.repeat(np.arange(len(counts)), cuts)
    place = np.arange(len(owner)) - np.repeat(np.cumsum(cuts) - cuts, cuts)
    start = firsts[owner]
    return corners[np.stack([start, start + place + 1, start + place + 2], axis=1)]


def _transform(node: Element) -> Array:
    """Matrix of a node: its transforms in order, the first outermost."""
    pose = np.eye(4)
    for child in node.children:
        own = np.eye(4)
        if child.tag == "matrix":
            own = _some(child, 16).reshape(4, 4)
        elif child.tag == "translate":
            own[:3, 3] = _some(child, 3)
        elif child.tag == "scale":
            own[:3, :3] = np.diag(_some(child, 3))
        elif child.tag == "rotate":
            own[:3, :3] = _turn(_some(child, 4))
        else:
            continue
        pose = pose @ own
    return pose


def _turn(numbers: Array) -> Array:
    """Rotation about an axis by an angle [degrees] (Rodrigues)."""
    length = float(np.linalg.norm(numbers[:3]))
    if length == 0:
        return np.eye(3)
    x, y, z = numbers[:3] / length
    angle = math.radians(float(numbers[3]))
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + math.sin(angle) * cross + (1 - math.cos(angle)) * cross @ cross


def _some(element: Element, count: int) -> Array:
    numbers = _numbers(element)
    if len(numbers) != count:
        raise ValueError(f"line {element.where.line}: <{element.tag}> has not {count} numbers")
    return numbers


def _numbers(element: Element) -> Array:
    return floats(element.content, f"line {element.where.line}: <{element.tag}>")


def _integers(element: Element) -> Integers:
    return integers(element.content, f"line {element.where.line}: <{element.tag}>")


def floats(text: str | bytes, what: str) -> Array:
    """Numbers of a text; as `integers`."""
    return _parsed(text, np.float64, what)


def integers(text: str | bytes, what: str) -> Integers:
    """Whole numbers of a text, separated by white space.

    Raises:
        ValueError: something in it is no number; `what` names it.
    """
    return _parsed(text, np.int64, what)


def _parsed(text: str | bytes, kind: type[Any], what: str) -> NDArray[Any]:
    with warnings.catch_warnings():
        # NumPy stops at what is no number and only warns.
        warnings.simplefilter("error")
        try:
            return np.fromstring(text, kind, sep=" ")
        except (DeprecationWarning, ValueError, UnicodeEncodeError):
            raise ValueError(f"{what} has something that is no number") from None


def _whole(element: Element, attribute: str, default: int = 0) -> int:
    text = element.attributes.get(attribute, str(default))
    if not text.isdigit() or len(text) > 9:
        raise ValueError(f'line {element.where.line}: {attribute}="{text[:20]}"')
    return int(text)


def _means(element: Element, semantic: str) -> bool:
    return element.attributes.get("semantic") == semantic
