"""Triangles of STL and OBJ files, read by trimesh, with limits of their own.

trimesh is given no name of a file and no resolver, so it opens nothing else. Of OBJ it sees only
what places triangles: materials, textures and references to other files are taken out.
"""

from __future__ import annotations

import io
import re
import warnings
from typing import Any

import numpy as np

from draft.values import Array

# A file as text takes several times its size while it is read.
MAX_BYTES = {".stl": 60_000_000, ".obj": 50_000_000}
MAX_TRIANGLES = 1_000_000
MAX_SOLIDS = 1_000
_BACK = re.compile(rb"-\d+")


def read_triangles(data: bytes, kind: str) -> Array:
    """Triangles of an STL or OBJ file in its own unit, shape (n, 3, 3); polygons are cut into fans.

    Args:
        data: the file's bytes.
        kind: ending of its name, a key of `MAX_BYTES`.

    Raises:
        ValueError: it is not of that kind, or its numbers do not fit together.
    """
    stream: Any = io.BytesIO(_stl(data)) if kind == ".stl" else io.StringIO(_obj(data))
    return placed_triangles(stream, kind[1:])


def placed_triangles(stream: Any, kind: str) -> Array:
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
