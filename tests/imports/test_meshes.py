"""Meshes are read where they may lie, in the robot's units, and give their triangles."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np
import pytest

from draft.description import mesh_paths
from draft.imports import units
from draft.imports.importer import Files, translate
from draft.imports.mesh_files import read_mesh
from draft.values import Array
from tests.imports.test_collada import dae, shape
from tests.imports.written import CUBE, link, quadruped


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


def imported(folder: Path, mesh: str, more: str = "") -> Files:
    """What comes of a quadruped with a mesh on its trunk."""
    path = folder / "beast.urdf"
    path.write_text(quadruped(more, mesh=mesh), encoding="utf-8")
    return translate(path, "beast", shown="beast.urdf")


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
def test_a_mesh_in_other_units_is_put_right_or_left_out(name: str, tmp_path: Path) -> None:
    factor, scale, length, words = SIZES[name]
    (tmp_path / "b.obj").write_text(scaled(factor), encoding="utf-8")
    files = imported(tmp_path, f'b.obj" scale="{scale} {scale} {scale}')
    assert trunk(files) == length
    notes = [str(note) for note in files.reduced.notes]
    assert bool(notes) == bool(words)
    assert not words or any(note.startswith("beast.urdf:2: ") and words in note for note in notes)


def shaped(name: str, mesh: str) -> str:
    """A bolted link of the trunk with a mesh."""
    ends = f'<parent link="body"/><child link="{name}"/>'
    return link(name, 1.0, mesh) + f'<joint name="{name}_bolt" type="fixed">{ends}</joint>'


def test_a_mesh_in_metres_beside_one_in_millimetres_stays_as_it_is(tmp_path: Path) -> None:
    (tmp_path / "mm.obj").write_text(scaled(1000), encoding="utf-8")
    (tmp_path / "m.obj").write_text(scaled(0.3), encoding="utf-8")
    files = imported(tmp_path, "mm.obj", shaped("camera", "m.obj"))
    assert trunk(files) == "0.6"
    assert [note.where.line for note in files.reduced.notes if note.where] == [2]


def test_small_parts_in_millimetres_go_with_the_large_ones(tmp_path: Path) -> None:
    (tmp_path / "large.obj").write_text(scaled(1000), encoding="utf-8")
    (tmp_path / "small.obj").write_text(scaled(5), encoding="utf-8")  # 3 m, or 3 mm
    files = imported(tmp_path, "large.obj", shaped("logo", "small.obj"))
    assert trunk(files) == "0.6"
    assert len(files.reduced.notes) == 2


def test_a_small_part_in_metres_is_left_alone() -> None:
    assert units.factors([0.6, 0.001], [(1, 1, 1)] * 2, 0.7, 0.4, set()) == [1, 1]
    assert units.factors([0.6, 0.0003], [(1, 1, 1), (0.001,) * 3], 0.7, 0.4, set()) == [1, 1000]
    assert units.factors([600.0], [(1, 1, 1)], 0.0, 0.0, set()) == [1]
    assert units.factors([], [], 0.7, 0.4, set()) == []


def test_a_collada_file_counts_for_the_trunk(tmp_path: Path) -> None:
    ring = shape("polygons", "<p>0 1 2 3</p><p>4 5 6 7</p><p>0 1 5 4</p><p>2 3 7 6</p>")
    corners = [
        f"{x} {y} {z}" for z in (-5, 5) for x, y in ((-30, -10), (30, -10), (30, 10), (-30, 10))
    ]
    data = dae(ring, unit='<unit name="centimeter" meter="0.01"/>', points=" ".join(corners))
    (tmp_path / "b.dae").write_bytes(data)
    files = imported(tmp_path, "b.dae")
    assert trunk(files) == "0.6"
    assert not files.reduced.notes


# Where the description stands, what other files there are, the mesh's name, and where it is found.
PLACES: dict[str, tuple[str, tuple[str, ...], str, str | None]] = {
    "beside it": ("r", ("r/a.stl",), "a.stl", "r/a.stl"),
    "below it": ("r", ("r/meshes/a.stl",), "./meshes//a.stl", "r/meshes/a.stl"),
    "backslashes": ("r", ("r/meshes/a.stl",), "meshes\\a.stl", "r/meshes/a.stl"),
    "spaces": ("r", ("r/my meshes/a b.stl",), "my meshes/a b.stl", "r/my meshes/a b.stl"),
    "above urdf": ("r/urdf", ("r/meshes/a.stl",), "../meshes/a.stl", "r/meshes/a.stl"),
    "above another": ("r/stuff", ("r/meshes/a.stl",), "../meshes/a.stl", "r/meshes/a.stl"),
    "above another, of another name": ("r/stuff", ("r/other/a.stl",), "../other/a.stl", None),
    "a deep prefix": (
        "r/urdf",
        ("r/meshes/a.stl",),
        "package://vendor/robots/v2/r/meshes/a.stl",
        "r/meshes/a.stl",
    ),
    "a deep prefix beside it": (
        "r",
        ("r/meshes/visual/a.stl",),
        "package://vendor/models/r/meshes/visual/a.stl",
        "r/meshes/visual/a.stl",
    ),
    "another case of the extension": ("r", ("r/meshes/a.STL",), "meshes/a.stl", "r/meshes/a.STL"),
    "another folder of meshes": (
        "r/urdf",
        ("r/meshes/v1/a.stl",),
        "package://r/meshes/a.stl",
        "r/meshes/v1/a.stl",
    ),
    "the folder most like the name": (
        "r/urdf",
        ("r/meshes/v1/a.stl", "r/meshes/v2/a.stl"),
        "package://r/mesh/v2/a.stl",
        "r/meshes/v2/a.stl",
    ),
    "package": ("r/urdf", ("r/meshes/a.stl",), "package://r/meshes/a.stl", "r/meshes/a.stl"),
    "package of another name": (
        "r/urdf",
        ("r/meshes/a.stl",),
        "package://vendor/meshes/a.stl",
        "r/meshes/a.stl",
    ),
    "package without a name": ("r/urdf", ("r/m/a.stl",), "package://m/a.stl", "r/m/a.stl"),
    "model": ("r/urdf", ("r/meshes/a.stl",), "model://r/meshes/a.stl", "r/meshes/a.stl"),
    "a package.xml far above": (
        "r/a/b/c/d",
        ("r/package.xml", "r/m/a.stl"),
        "package://r/m/a.stl",
        "r/m/a.stl",
    ),
    "a package.xml too far above": (
        "r/a/b/c/d/e",
        ("r/package.xml", "r/m/a.stl"),
        "../../../../../m/a.stl",
        None,
    ),
    "the nearest package.xml": (
        "r/p/urdf",
        ("r/package.xml", "r/p/package.xml", "r/a.stl"),
        "../../a.stl",
        None,
    ),
    "file inside": ("r", ("r/a.stl",), "file://{top}/r/a.stl", "r/a.stl"),
    "an absolute path inside": ("r", ("r/a.stl",), "{top}/r/a.stl", "r/a.stl"),
    "file outside": ("r", ("a.stl",), "file://{top}/a.stl", None),
    "an absolute path outside": ("r", ("a.stl",), "{top}/a.stl", None),
    "a path outside": ("r", ("a.stl",), "../a.stl", None),
    "a package's path outside": ("r", ("a.stl",), "package://r/../../a.stl", None),
}


@pytest.mark.parametrize("name", PLACES)
def test_a_mesh_is_found_inside_its_package_only(name: str, tmp_path: Path) -> None:
    stands, files, mesh, expected = PLACES[name]
    top = Path(os.path.realpath(tmp_path))
    (top / stands).mkdir(parents=True)
    for file in files:
        (top / file).parent.mkdir(parents=True, exist_ok=True)
        (top / file).touch()
    found, outside = mesh_paths.find(mesh.format(top=top), top / stands)
    assert found == (top / expected if expected else None)
    assert outside == (expected is None)


def test_of_two_files_that_a_name_may_mean_none_is_taken(tmp_path: Path) -> None:
    for file in ("meshes/v1/a.stl", "meshes/v2/a.stl"):
        (tmp_path / file).parent.mkdir(parents=True)
        (tmp_path / file).touch()
    assert mesh_paths.find("package://r/meshes/a.stl", tmp_path) == (None, False)


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


def test_a_file_under_two_names_is_read_once(tmp_path: Path) -> None:
    (tmp_path / "b.obj").write_text(CUBE, encoding="utf-8")
    (tmp_path / "c.obj").symlink_to("b.obj")
    files = imported(tmp_path, "b.obj", shaped("camera", "./c.obj"))
    assert files.reduced.counts["meshes read for their size"] == 1
