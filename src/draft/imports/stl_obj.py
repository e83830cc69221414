"""Triangles of STL files, binary and text, and of OBJ files."""

from __future__ import annotations

import re
from collections.abc import Sequence

import numpy as np

from draft.imports.collada import MAX_TRIANGLES, Integers, fans, floats, integers
from draft.values import Array

_RECORD = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("rest", "<u2")])
HEADER = 84


def read_stl(data: bytes) -> Array:
    """Triangles of an STL file, shape (n, 3, 3).

    Raises:
        ValueError: it is not STL, is cut short, or has too many triangles.
    """
    count = int.from_bytes(data[80:HEADER], "little")
    whole = len(data) >= HEADER and len(data) == HEADER + _RECORD.itemsize * count
    if not whole and data[:512].lstrip()[:5].lower() == b"solid" and b"vertex" in data:
        return _text_stl(data)
    if not whole:
        if len(data) < HEADER or b"\0" not in data[:4096]:
            raise ValueError("it is not an STL file")
        held = (len(data) - HEADER) // _RECORD.itemsize
        raise ValueError(f"its header says {count} triangles, it holds {held}")
    if count > MAX_TRIANGLES:
        raise ValueError(f"more than {MAX_TRIANGLES} triangles")
    return np.frombuffer(data, _RECORD, count, HEADER)["corners"].astype(float)


def _text_stl(data: bytes) -> Array:
    text = b" ".join(re.findall(rb"^\s*vertex\s+(.*)$", data, re.MULTILINE))
    corners = floats(text, "a vertex")
    if not len(corners) or len(corners) % 9:
        raise ValueError("a triangle of it has not three corners: it is cut short")
    return corners.reshape(-1, 3, 3)


def read_obj(data: bytes) -> Array:
    """Triangles of an OBJ file, shape (n, 3, 3); polygons are cut into fans.

    Raises:
        ValueError: it is not OBJ, or a face names a point that is not there.
    """
    lines = data.replace(b"\\\n", b" ").splitlines()
    points = [line[2:] for line in lines if line.startswith((b"v ", b"v\t"))]
    faces = [line[2:] for line in lines if line.startswith((b"f ", b"f\t"))]
    if not faces or not points:
        raise ValueError("it is not an OBJ file")
    places = _points(points)
    # A corner is `point`, `point/texture`, `point//normal` or `point/texture/normal`.
    corners = integers(re.sub(rb"/\S*", b"", b" ".join(faces)), "a face")
    counts = np.array([len(face.split()) for face in faces])
    if counts.sum() != len(corners) or corners.min(initial=1) == 0:
        raise ValueError("a face has something that names no point")
    negative = corners < 0
    if negative.any():
        above = np.repeat(_points_above(lines), counts)
        corners = np.where(negative, corners + above + 1, corners)
    if corners.min() < 1 or corners.max() > len(places):
        raise ValueError(f"a face names a point that is not there; it has {len(places)}")
    if np.maximum(counts - 2, 0).sum() > MAX_TRIANGLES:
        raise ValueError(f"more than {MAX_TRIANGLES} triangles")
    return places[fans(corners - 1, counts)]


def _points(lines: Sequence[bytes]) -> Array:
    """Points of `v` lines: three numbers each, perhaps with a weight or a colour after them."""
    numbers = floats(b" ".join(lines), "a point")
    width = len(lines[0].split())
    if width < 3 or len(numbers) != width * len(lines):
        cut = b" ".join(b" ".join(line.split()[:3]) for line in lines)
        width, numbers = 3, floats(cut, "a point")
    if len(numbers) != width * len(lines):
        raise ValueError("a point has not three numbers")
    return numbers.reshape(len(lines), width)[:, :3]


def _points_above(lines: Sequence[bytes]) -> Integers:
    """Number of points above each face, from which its negative indices count."""
    points = [i for i, line in enumerate(lines) if line.startswith((b"v ", b"v\t"))]
    faces = [i for i, line in enumerate(lines) if line.startswith((b"f ", b"f\t"))]
    return np.searchsorted(points, faces)
