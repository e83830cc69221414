"""Meshes are read where they may lie, in the robot's units, and give their triangles."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np
import pytest

from draft.description import mesh_paths
from draft.imports import units
from draft.imports.importer import Files
from draft.imports.mesh_files import read_mesh
from draft.values import Array
from tests.imports.test_collada import dae, shape
from tests.imports.written import CUBE, bolt, link, notes, quadruped, translated, written


def scaled(factor: float) -> str:
    """The cube so many times as large."""
    lines = [line.split() for line in CUBE.splitlines()]
    return "\n".join(
        " ".join(["v", *(f"{factor * float(x):.9g}" for x in words[1:])])
        if words[0] == "v"
        else " ".join(words)
        for words in lines
    )


def binary(triangles: Array, count: int | None = None) -> bytes:
    """An STL file whose header says `count` triangles."""
    record = np.zeros(len(triangles), [("n", "<f4", 3), ("c", "<f4", (3, 3)), ("rest", "<u2")])
    record["c"] = triangles
    said = len(triangles) if count is None else count
    return bytes(80) + said.to_bytes(4, "little") + record.tobytes()


def test_stl_and_obj_give_the_same_triangles() -> None:
    cube = read_mesh(CUBE.encode(), ".obj")
    assert cube.shape == (12, 3, 3)
    assert read_mesh(binary(cube), ".stl") == pytest.approx(cube)
    corners = "".join(f"  vertex {x} {y} {z}\n" for x, y, z in cube.reshape(-1, 3))
    text = f"solid\n{corners}endsolid\n"
    assert read_mesh(text.encode(), ".stl") == pytest.approx(cube)


POINTS = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n"
WRITTEN = {
    "points only": POINTS + "f 1 2 3 4",
    "texture": POINTS + "f 1/7 2/7 3/7 4/7",
    "normals": POINTS + "f 1//7 2//7 3//7 4//7",
    "both": POINTS + "f 1/8/7 2/8/7 3/8/7 4/8/7",
    "counted from below": POINTS + "f -4 -3 -2 -1",
    "counted from below, amid points": POINTS + "f -4/1 -3/1 -2/1 -1/1\nv 9 9 9\nv 8 8 8",
    "triangles": POINTS + "f 1 2 3\nf 1 3 4",
    "a weight": POINTS.replace("\n", " 1\n") + "f 1 2 3 4",
    "colours": POINTS.replace("\n", " .5 .5 .5\n") + "f 1 2 3 4",
    "some colours": POINTS.replace("\n", " .5 .5 .5\n", 2) + "f 1 2 3 4",
    "tabs and spaces": POINTS.replace(" ", "\t") + "f  1 2\t3 4 ",
    "lines of Windows": (POINTS + "f 1 2 3 4").replace("\n", "\r\n"),
    "a long line": POINTS + "f 1 2 \\\n3 4",
    "other things": "# a\nmtllib x.mtl\nvn 0 0 1\nvt 0 0\n" + POINTS + "g a\nusemtl b\nf 1 2 3 4",
}


@pytest.mark.parametrize("name", WRITTEN)
def test_an_obj_square_is_two_triangles_however_it_is_written(name: str) -> None:
    square = [[[0, 0, 0], [1, 0, 0], [1, 1, 0]], [[0, 0, 0], [1, 1, 0], [0, 1, 0]]]
    found = read_mesh(WRITTEN[name].encode(), ".obj").tolist()
    starts = [corners.index(min(corners)) for corners in found]
    turned = [c[at:] + c[:at] for c, at in zip(found, starts, strict=True)]
    assert turned == square


FACE = "a face is not the numbers of three points or more"
BAD: dict[str, tuple[str, str | bytes, str]] = {
    "a point that is not there": (".obj", "\nf 1 2 9", "it names a point that is not there"),
    "a point before the first": (".obj", "\nf -1 -2 -9", FACE),
    "a point zero": (".obj", "\nf 1 2 0", FACE),
    "half a point": (".obj", "\nf 1 2 2.5", FACE),
    "a point in a plane": (".obj", "\nv 1 2\nf 1 2 3", "its numbers do not fit together"),
    "an empty OBJ": (".obj", b"", "it is not an OBJ file"),
    "an empty STL": (".stl", b"", "it is not an STL file"),
    "an STL of nothing": (".stl", bytes(84), "it has no finite triangles"),
    "an STL that is cut": (".stl", bytes(97), "its header says 0 triangles, it holds 0"),
    "an STL whose header lies": (
        ".stl",
        binary(np.zeros((7, 3, 3)), 2**32 - 1),
        "its header says 4294967295 triangles, it holds 7",
    ),
    "a text STL that is cut": (
        ".stl",
        b"solid x\nvertex 0 0 0\nvertex 1 0 0\n",
        "its text is cut short",
    ),
}


@pytest.mark.parametrize("name", BAD)
def test_a_bad_file_is_refused(name: str) -> None:
    kind, data, words = BAD[name]
    whole = (CUBE + data).encode() if isinstance(data, str) else data
    with pytest.raises(ValueError, match=f"^{words}"):
        read_mesh(whole, kind)


CROWDED: dict[str, tuple[str, bytes, str]] = {
    # Each would have trimesh make very many meshes, or a mesh of very many triangles.
    "corners of faces": (".obj", (POINTS + "f" + " 1" * 3_000_001).encode(), "1000000 triangles"),
    "solids": (".stl", b"solid\nvertex 0 0 0\nendsolid\n" * 1001, "1000 solids"),
    "shapes": (".dae", dae(shape("triangles", "<p>0 1 2</p>") * 20_001), "20000 nodes"),
    "uses of a shape": (
        ".dae",
        dae(
            shape("triangles", "<p>" + "0 1 2 " * 10_000 + "</p>"),
            '<node><instance_geometry url="#g"/></node>' * 401,
        ),
        "1000000 triangles",
    ),
}


@pytest.mark.parametrize("name", CROWDED)
def test_more_than_can_be_placed_is_refused_before_it_is_made(
    name: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    kind, data, words = CROWDED[name]
    monkeypatch.setattr("trimesh.load_scene", None)
    with pytest.raises(ValueError, match=f"more than .*{words}"):
        read_mesh(data, kind)


def test_names_of_other_files_are_taken_out(monkeypatch: pytest.MonkeyPatch) -> None:
    library = "<library_images><image><init_from>secret</init_from></image></library_images>"
    used = '<node><instance_geometry url="#g"><bind_material>secret</bind_material>'
    data = {
        ".obj": f"mtllib secret\n{POINTS}usemtl secret\nf 1 2 3".encode(),
        ".dae": dae(nodes=f"{used}</instance_geometry></node>", library=library),
    }
    seen: list[str] = []
    monkeypatch.setattr("trimesh.load_scene", lambda stream, **_: seen.append(str(stream.read())))
    for kind, one in data.items():
        with pytest.raises(ValueError, match="it is broken"):
            read_mesh(one, kind)
    assert len(seen) == 2
    assert not any("secret" in text for text in seen)


def made(mesh: str, more: str = "") -> Files:
    """What comes of a quadruped with a mesh on its trunk."""
    return translated(quadruped(more, mesh=mesh))


def trunk(files: Files) -> str:
    text = files.texts["parameters.yaml"]
    return text.split("trunk_length: {value: ")[1].split(",")[0]


# The box with the trunk's inertia is 0.4 m long, its mesh 0.6 m.
SIZES: dict[str, tuple[float, str, str, str]] = {
    "metres": (1, "1", "0.6", ""),
    "millimetres with their scale": (1000, "0.001", "0.6", ""),
    "millimetres": (1000, "1", "0.6", "600 m long on a robot whose joints span 0.689 m: taken as"),
    "metres scaled to a thousandth": (1, "0.001", "0.6", "0.0006 m long on a robot whose joints"),
    "metres scaled by a thousand": (1, "1000", "0.6", "taken as millimetres"),
    "micrometres for metres": (0.001, "1", "0.6", "taken as 1000 times as large"),
    "centimetres": (100, "1", "0.4", "60 m long on a robot whose joints span 0.689 m: it is not"),
    "inches": (39.37, "1", "0.4", "23.6 m long on a robot whose joints span 0.689 m: it is not"),
    "kilometres": (1e6, "1", "0.4", "it is not used"),
    "nothing": (1e-9, "1", "0.4", "the trunk's meshes are too thin to cut"),
}


@pytest.mark.parametrize("name", SIZES)
def test_a_mesh_in_other_units_is_put_right_or_left_out(name: str) -> None:
    factor, scale, length, words = SIZES[name]
    written(scaled(factor), "b.obj")
    files = made(f'b.obj" scale="{scale} {scale} {scale}')
    assert trunk(files) == length
    assert bool(notes(files)) == bool(words)
    assert not words or any(one.startswith("beast.urdf:2: ") for one in notes(files, words))


def shaped(name: str, mesh: str) -> str:
    """A bolted link of the trunk with a mesh."""
    return link(name, 1.0, mesh) + bolt(f"{name}_bolt", "body", name)


# Sizes of the trunk's mesh and of a part's beside it, and the lines of those that are put right.
BESIDE = {"a part in metres": (1000, 0.3, [2]), "a small part in millimetres": (1000, 5, [2, 35])}


@pytest.mark.parametrize("name", BESIDE)
def test_a_mesh_beside_one_in_millimetres_is_put_right_if_it_is_longer_than_the_robot(
    name: str,
) -> None:
    large, small, lines = BESIDE[name]
    written(scaled(large), "large.obj")
    written(scaled(small), "small.obj")
    files = made("large.obj", shaped("camera", "small.obj"))
    assert trunk(files) == "0.6"
    assert [note.where.line for note in files.reduced.notes if note.where] == lines


def test_a_small_part_in_metres_is_left_alone() -> None:
    assert units.factors([0.6, 0.001], [(1, 1, 1)] * 2, 0.7, 0.4, set()) == [1, 1]
    assert units.factors([0.6, 0.0003], [(1, 1, 1), (0.001,) * 3], 0.7, 0.4, set()) == [1, 1000]
    assert units.factors([600.0], [(1, 1, 1)], 0.0, 0.0, set()) == [1]
    assert units.factors([], [], 0.7, 0.4, set()) == []
    assert units.factors([2.0], [(1, 1, 1)], 0.7, 0.4, set()) == [1]  # Of no scale that is known.


def test_a_collada_file_counts_for_the_trunk() -> None:
    ring = shape("polygons", "<p>0 1 2 3</p><p>4 5 6 7</p><p>0 1 5 4</p><p>2 3 7 6</p>")
    corners = [
        f"{x} {y} {z}" for z in (-5, 5) for x, y in ((-30, -10), (30, -10), (30, 10), (-30, 10))
    ]
    data = dae(ring, unit='<unit name="centimeter" meter="0.01"/>', points=" ".join(corners))
    Path("b.dae").write_bytes(data)
    files = made("b.dae")
    assert trunk(files) == "0.6"
    assert not files.reduced.notes


MANIFEST = "r/package.xml"
# Where the description stands, what files there are, the mesh's name, and whether it is the first.
PLACES: dict[str, tuple[str, tuple[str, ...], str, bool]] = {
    "beside it": ("r", ("r/a.stl",), "a.stl", True),
    "below it": ("r", ("r/meshes/a.stl",), "./meshes//a.stl", True),
    "backslashes": ("r", ("r/meshes/a.stl",), "meshes\\a.stl", True),
    "spaces": ("r", ("r/my meshes/a b.stl",), "my meshes/a b.stl", True),
    "above urdf": ("r/urdf", ("r/meshes/a.stl",), "../meshes/a.stl", True),
    "above another": ("r/stuff", ("r/meshes/a.stl",), "../meshes/a.stl", True),
    "above another, of another name": ("r/stuff", ("r/other/a.stl",), "../other/a.stl", False),
    "a deep prefix": ("r/urdf", ("r/meshes/a.stl",), "package://v/robots/2/r/meshes/a.stl", True),
    "a deep prefix beside it": (
        "r",
        ("r/meshes/visual/a.stl",),
        "package://vendor/models/r/meshes/visual/a.stl",
        True,
    ),
    "another case of the extension": ("r", ("r/meshes/a.STL",), "meshes/a.stl", True),
    "another folder of meshes": (
        "r/urdf",
        ("r/meshes/v1/a.stl",),
        "package://r/meshes/a.stl",
        True,
    ),
    "the folder most like the name": (
        "r/urdf",
        ("r/meshes/v2/a.stl", "r/meshes/v1/a.stl"),
        "package://r/mesh/v2/a.stl",
        True,
    ),
    "package": ("r/urdf", ("r/meshes/a.stl",), "package://r/meshes/a.stl", True),
    "package of another name": ("r/urdf", ("r/meshes/a.stl",), "package://v/meshes/a.stl", True),
    "package without a name": ("r/urdf", ("r/m/a.stl",), "package://m/a.stl", True),
    "model": ("r/urdf", ("r/meshes/a.stl",), "model://r/meshes/a.stl", True),
    "a package.xml far above": ("r/a/b/c/d", ("r/m/a.stl", MANIFEST), "package://r/m/a.stl", True),
    "a package.xml too far above": (
        "r/a/b/c/d/e",
        ("r/m/a.stl", MANIFEST),
        "../../../../../m/a.stl",
        False,
    ),
    "the nearest package.xml": (
        "r/p/urdf",
        ("r/a.stl", MANIFEST, "r/p/package.xml"),
        "../../a.stl",
        False,
    ),
    "file inside": ("r", ("r/a.stl",), "file://{top}/r/a.stl", True),
    "an absolute path inside": ("r", ("r/a.stl",), "{top}/r/a.stl", True),
    "file outside": ("r", ("a.stl",), "file://{top}/a.stl", False),
    "an absolute path outside": ("r", ("a.stl",), "{top}/a.stl", False),
    "a path outside": ("r", ("a.stl",), "../a.stl", False),
    "a package's path outside": ("r", ("a.stl",), "package://r/../../a.stl", False),
}


@pytest.mark.parametrize("name", PLACES)
def test_a_mesh_is_found_inside_its_package_only(name: str, tmp_path: Path) -> None:
    stands, files, mesh, inside = PLACES[name]
    top = Path(os.path.realpath(tmp_path))
    (top / stands).mkdir(parents=True)
    for file in files:
        (top / file).parent.mkdir(parents=True, exist_ok=True)
        (top / file).touch()
    found, outside = mesh_paths.find(mesh.format(top=top), top / stands)
    assert found == (top / files[0] if inside else None)
    assert outside == (not inside)


def test_of_two_files_that_a_name_may_mean_none_is_taken(tmp_path: Path) -> None:
    for file in ("meshes/v1/a.stl", "meshes/v2/a.stl"):
        (tmp_path / file).parent.mkdir(parents=True)
        (tmp_path / file).touch()
    assert mesh_paths.find("package://r/meshes/a.stl", tmp_path) == (None, False)


def test_a_file_of_another_project_is_not_taken_for_its_name_alone(tmp_path: Path) -> None:
    (tmp_path / "other/parts").mkdir(parents=True)
    (tmp_path / "other/parts/a.stl").touch()
    assert mesh_paths.find("shapes/a.stl", tmp_path) == (None, False)
    found, _ = mesh_paths.find("package://r/parts/a.stl", tmp_path)
    assert found == Path(os.path.realpath(tmp_path)) / "other/parts/a.stl"
    (tmp_path / "meshes").mkdir()  # Now it is the folder of a robot.
    assert mesh_paths.find("shapes/a.stl", tmp_path)[0] == found


def test_a_link_that_leads_outside_finds_nothing(tmp_path: Path) -> None:
    (tmp_path / "secret").mkdir()
    (tmp_path / "secret/a.stl").touch()
    robot = tmp_path / "robot"
    robot.mkdir()
    (robot / "a.stl").symlink_to("../secret/a.stl")
    (robot / "meshes").symlink_to("../secret")
    (robot / "b.stl").symlink_to("b.stl")
    (robot / "c.stl").touch()
    (robot / "d.stl").symlink_to("c.stl")
    for name in ("a.stl", "meshes/a.stl", "package://robot/meshes/a.stl"):
        assert mesh_paths.find(name, robot) == (None, True)
    assert mesh_paths.find("b.stl", robot) == (None, False)
    found, _ = mesh_paths.find("d.stl", robot)
    assert found is not None
    assert found.name == "c.stl"


def test_a_file_under_two_names_is_read_once() -> None:
    written(CUBE, "b.obj")
    Path("c.obj").symlink_to("b.obj")
    files = made("b.obj", shaped("camera", "./c.obj"))
    assert files.reduced.counts["meshes read for their size"] == 1
