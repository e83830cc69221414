"""COLLADA files give the triangles that their scene shows, in metres, or say what is wrong."""

from __future__ import annotations

import re

import numpy as np
import pytest

from draft.description.xmlfile import DescriptionError
from draft.imports.mesh_files import read_mesh
from draft.values import Array

# Corners of a unit square in z = 0, then one above its first corner.
POINTS = "0 0 0  1 0 0  1 1 0  0 1 0  0 0 1"
ONE = (
    '<triangles count="1"><input semantic="VERTEX" source="#v" offset="0"/><p>1 2 4</p></triangles>'
)
SHOWN = '<node><instance_geometry url="#g"/></node>'


def dae(
    shapes: str = ONE,
    nodes: str = SHOWN,
    unit: str = "",
    up: str = "Z_UP",
    points: str = POINTS,
    library: str = "",
) -> bytes:
    """A file with one geometry, one element a line."""
    return f"""<COLLADA version="1.4.1" xmlns="http://www.collada.org/2005/11/COLLADASchema">
<asset>{unit}<up_axis>{up}</up_axis></asset>
<library_geometries><geometry id="g"><mesh>
<source id="p"><float_array id="a" count="15">{points}</float_array>
<technique_common><accessor source="#a" count="5" stride="3"/></technique_common></source>
<vertices id="v"><input semantic="POSITION" source="#p"/></vertices>
{shapes}
</mesh></geometry></library_geometries>
{library}
<library_visual_scenes><visual_scene id="s">{nodes}</visual_scene></library_visual_scenes>
<scene><instance_visual_scene url="#s"/></scene>
</COLLADA>""".encode()


def shape(tag: str, body: str, inputs: str = "") -> str:
    """A shape of the points above."""
    own = '<input semantic="VERTEX" source="#v" offset="0"/>'
    return f"<{tag}>{own}{inputs}{body}</{tag}>"


def read_dae(data: bytes) -> Array:
    return read_mesh(data, ".dae")


def test_a_triangle_has_its_corners() -> None:
    assert read_dae(dae()).tolist() == [[[1, 0, 0], [1, 1, 0], [0, 0, 1]]]


SQUARE = [[[0, 0, 0], [1, 0, 0], [1, 1, 0]], [[0, 0, 0], [1, 1, 0], [0, 1, 0]]]
NORMALS = '<input semantic="NORMAL" source="#n" offset="1"/>'
TEXTURE = '<input semantic="TEXCOORD" source="#t" offset="2"/>'
SHAPES = {
    "triangles": shape("triangles", "<p>0 1 2 0 2 3</p>"),
    "triangles in two lists": shape("triangles", "<p>0 1 2</p><p>0 2 3</p>"),
    "triangles with normals": shape("triangles", "<p>0 9 1 9 2 9 0 9 2 9 3 9</p>", NORMALS),
    "a polylist": shape("polylist", "<vcount>3 3</vcount><p>0 1 2 0 2 3</p>"),
    "a polylist of a square": shape("polylist", "<vcount>4</vcount><p>0 1 2 3</p>"),
    "a polylist with an edge": shape("polylist", "<vcount>2 4</vcount><p>0 1 0 1 2 3</p>"),
    "a polylist with normals and texture": shape(
        "polylist", "<vcount>4</vcount><p>0 7 8 1 7 8 2 7 8 3 7 8</p>", NORMALS + TEXTURE
    ),
    "polygons": shape("polygons", "<p>0 1 2 3</p>"),
    "polygons with a hole": shape("polygons", "<ph><p>0 1 2 3</p><h>1 2 3</h></ph>"),
    "two shapes": shape("triangles", "<p>0 1 2</p>") + shape("polygons", "<p>0 2 3</p>"),
}


@pytest.mark.parametrize("name", SHAPES)
def test_a_square_is_two_triangles_however_it_is_written(name: str) -> None:
    assert read_dae(dae(SHAPES[name])).tolist() == SQUARE


MOVES: dict[str, tuple[str, list[float]]] = {
    # Where the corner (1, 2, 3) goes.
    "nothing": ("", [1, 2, 3]),
    "a translation": ("<translate>10 0 0</translate>", [11, 2, 3]),
    "a scale": ("<scale>2 3 4</scale>", [2, 6, 12]),
    "a turn about z": ("<rotate>0 0 1 90</rotate>", [-2, 1, 3]),
    "a turn about an axis of any length": ("<rotate>5 0 0 90</rotate>", [1, -3, 2]),
    "a turn, then a translation in its frame": (
        "<rotate>0 0 1 90</rotate><translate>1 0 0</translate>",
        [-2, 2, 3],
    ),
    "a translation, then a turn": (
        "<translate>1 0 0</translate><rotate>0 0 1 90</rotate>",
        [-1, 1, 3],
    ),
    "a matrix by rows": ("<matrix>0 -1 0 5 1 0 0 6 0 0 1 7 0 0 0 1</matrix>", [3, 7, 10]),
}


@pytest.mark.parametrize("name", MOVES)
def test_a_node_moves_what_it_shows(name: str) -> None:
    moves, expected = MOVES[name]
    node = f'<node>{moves}<instance_geometry url="#g"/></node>'
    found = read_dae(dae(nodes=node, points="1 2 3 " * 5))
    assert found[0, 0] == pytest.approx(expected)


def test_nodes_stand_in_each_other_and_are_used_again() -> None:
    library = f'<library_nodes><node id="n"><scale>2 2 2</scale>{SHOWN}</node></library_nodes>'
    nodes = (
        "<node><translate>0 0 1</translate><node><translate>0 1 0</translate>"
        '<instance_node url="#n"/></node></node><node><instance_node url="#n"/></node>'
    )
    found = read_dae(dae(nodes=nodes, library=library))
    plain: Array = 2 * read_dae(dae())
    assert np.array_equal(found, np.concatenate([plain + np.array([0, 1, 1]), plain]))


def test_the_unit_is_applied_and_the_up_axis_is_not() -> None:
    inches = '<unit name="inch" meter="0.0254"/>'
    assert read_dae(dae(unit=inches)) == pytest.approx(0.0254 * read_dae(dae()))
    for up in ("X_UP", "Y_UP", "Z_UP"):
        assert np.array_equal(read_dae(dae(up=up)), read_dae(dae()))


def test_without_a_scene_the_geometries_count_as_they_stand() -> None:
    text = dae().decode()
    bare = text[: text.index("<library_visual_scenes>")] + "</COLLADA>"
    assert np.array_equal(read_dae(bare.encode()), read_dae(dae()))


def test_an_accessor_may_skip_numbers() -> None:
    text = dae(points="7 0 0 0 9 1 0 0 9 1 1 0 9 0 1 0 9 0 0 1 9").decode()
    text = text.replace('stride="3"', 'stride="4" offset="1"')
    assert np.array_equal(read_dae(text.encode()), read_dae(dae()))


LOOP = '<library_nodes><node id="n"><instance_node url="#n"/></node></library_nodes>'
# Each node uses the one below it twice: 2 ** 40 uses of a triangle in few lines.
MANY = "".join(
    f'<node id="n{i}">' + f'<instance_node url="#n{i + 1}"/>' * 2 + "</node>" for i in range(40)
)
BAD: dict[str, tuple[bytes, str]] = {
    "no COLLADA": (b"<robot/>", "it is not a COLLADA file"),
    "no triangles": (dae(""), "it has no finite triangles"),
    "nothing shown": (dae(nodes="<node/>"), "it has no finite triangles"),
    "a unit of zero": (dae(unit='<unit meter="0"/>'), 'its unit is "0" metres'),
    "a unit that is no number": (dae(unit='<unit meter="nan"/>'), 'its unit is "nan" metres'),
    "a point that is a word": (dae(points="0 0 x"), "line 4: <float_array> has something that is"),
    "no points": (dae(points=""), "it is broken: Indexes (maxindex=4) for source"),
    "a corner that is not there": (
        dae(shape("triangles", "<p>0 1 5</p>")),
        "it is broken: Indexes (maxindex=5) for source 'p' (len=5) go beyond",
    ),
    "a corner below zero": (
        dae(shape("triangles", "<p>0 1 -1</p>")),
        "line 7: <p> has something that names no point",
    ),
    "a corner that is a fraction": (dae(shape("triangles", "<p>0 1 1.5</p>")), "line 7: <p> has"),
    "corners that are too few": (
        dae(shape("triangles", "<p>0 1 2 3</p>")),
        "its numbers do not fit together",
    ),
    "polygons of other counts": (
        dae(shape("polylist", "<vcount>3 3</vcount><p>0 1 2 3</p>")),
        "it names a point that is not there",
    ),
    "no vertices": (dae("<triangles><p>0 1 2</p></triangles>"), "line 7: <triangles> has no vert"),
    "an offset below zero": (dae(ONE.replace('"0"', '"-1"')), 'line 7: offset="-1"'),
    "a matrix that is cut": (
        dae(nodes="<node><matrix>1 0</matrix></node>"),
        "it is broken: Corrupted matrix",
    ),
    "a geometry in another file": (
        dae(nodes='<node><instance_geometry url="file:///etc/passwd#g"/></node>'),
        "line 10: 'file:///etc/passwd#g' is not in the file",
    ),
    "a node in itself": (
        dae(nodes='<node><instance_node url="#n"/></node>', library=LOOP),
        "it places more than 20000 nodes or 1000000 triangles",
    ),
    "nodes that multiply": (
        dae(
            nodes='<node><instance_node url="#n0"/></node>',
            library=f"<library_nodes>{MANY}<node id='n40'>{SHOWN}</node></library_nodes>",
        ),
        "it places more than 20000 nodes or 1000000 triangles",
    ),
}


@pytest.mark.parametrize("name", BAD)
def test_a_bad_file_is_refused_with_its_line(name: str) -> None:
    data, words = BAD[name]
    with pytest.raises(ValueError, match=f"^{re.escape(words)}"):
        read_dae(data)


@pytest.mark.parametrize(
    "start",
    [
        '<!DOCTYPE c [<!ENTITY a "aaaa"><!ENTITY b "&a;&a;&a;&a;">]>',
        '<!DOCTYPE c SYSTEM "http://example.org/c.dtd">',
        '<!DOCTYPE c [<!ENTITY f SYSTEM "file:///etc/passwd">]>',
    ],
)
def test_entities_are_refused(start: str) -> None:
    with pytest.raises(DescriptionError, match="it has a DOCTYPE"):
        read_dae(start.encode() + dae(points="&b;&f;"))
