"""Parts of one's own in pages, drawings, CAD, the studio and copies of their robot."""

# pyright: reportAttributeAccessIssue=false
# (MuJoCo's and the kernel's compiled modules carry no types.)
from __future__ import annotations

import csv
import importlib
import io
import json
import math
import re
import struct
from pathlib import Path

import mujoco
import numpy as np
import pytest
import trimesh
from hypothesis import strategies as st

import draft
from draft.cli import main
from draft.errors import ModelError
from draft.extensions import Registry
from draft.studio.skins import skins
from draft.values import scalar
from tests.helpers import leg, robot
from tests.model import own_parts as written
from tests.model.own_parts import (
    BOTH,
    LENGTH,
    RADIUS,
    everything,
    hook,
    points_of,
    stl,
    tensor,
    with_parts,
)

Array = np.ndarray
sizes = st.floats(0.01, 1.0)
places = st.tuples(*3 * [st.floats(-1.0, 1.0)])


def test_pages_and_the_command_line_show_the_parts(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    pytest.importorskip("plotly")
    written.folder(tmp_path / "own", everything(), {})
    assert main(["show", str(tmp_path / "own")]) == 0
    shown = capsys.readouterr().out
    assert re.search(r"stated +\d+\.\d+ +\d+ +parts/box.stl, hook.stl", shown), shown
    assert re.search(r"predicted +\d+\.\d+", shown)
    assert main(["report", str(tmp_path / "own"), "--out", str(tmp_path / "page.html")]) == 0
    page = (tmp_path / "page.html").read_text(encoding="utf-8")
    assert "Parts of your own" in page
    assert "hook.stl" in page


def test_a_drawing_has_the_part_and_not_what_is_hidden(tmp_path: Path) -> None:
    model = everything().resolve().build()
    folder = model.save(tmp_path / "out", ("glb", "urdf", "sdf"))
    data = (folder / "robot.glb").read_bytes()
    (length,) = struct.unpack("<I", data[12:16])
    scene = json.loads(data[20 : 20 + length])
    names = {mesh["name"] for mesh in scene["meshes"]}
    assert {"L_thigh_link_shape", "R_thigh_motor_shape", "trunk_trunk_shape"} <= names
    assert not names & {"L_thigh_link", "L_thigh_link_inertia", "trunk_trunk"}
    files = sorted(path.name for path in (folder / "meshes").glob("*.stl"))
    assert [f"{name[:-4]}.obj" for name in files] == sorted(
        path.name for path in (folder / "meshes").glob("*.obj")
    )
    assert files == [
        *("part.box.stl", "part.hook.stl", "part.hook.y.stl", "part.motor.stl", "trunk.stl")
    ]
    left, right = (trimesh.load_mesh(folder / "meshes" / files[k]) for k in (1, 2))
    assert left.volume == pytest.approx(hook().volume, rel=1e-5)
    assert right.volume == pytest.approx(left.volume, rel=1e-5)
    for file, kind in (("robot.urdf", "stl"), ("robot.sdf", "obj")):
        text = (folder / file).read_text(encoding="utf-8")
        assert f"meshes/part.hook.y.{kind}" in text
        assert "link_inertia" not in text
    assert model.save(folder, ("mjcf",)) == folder  # what it wrote before is its own


def test_cad_gets_the_parts_with_their_volumes_on_both_sides(tmp_path: Path) -> None:
    pytest.importorskip("OCP")
    from tests.model.test_step import read  # the kernel's reading of assemblies

    files = {"rod.step": written.step(written.rod()), "hook.stl": stl(hook())}
    links = {
        "thigh": {"file": "rod.step", "density": 2700},
        "shank": {"file": "hook.stl", "mass": 0.4},
    }
    model = with_parts(files, links, children=BOTH).resolve().build()
    folder = model.save(tmp_path / "out", ("step",))
    _, found = read(folder / "robot.step")
    for side in "LR":
        assert found[f"{side}_thigh"].volume == pytest.approx(
            1e9 * math.pi * RADIUS**2 * LENGTH, rel=1e-6
        )
    rows = list(csv.DictReader(io.StringIO((folder / "bom.csv").read_text(encoding="utf-8"))))
    (row,) = (one for one in rows if one["name"] == "R_thigh")
    assert row["mass_source"] == "rod.step: stated"
    assert float(row["density_kg_m3"]) == pytest.approx(2700)


def test_a_part_of_an_exported_assembly_comes_back_where_it_was(tmp_path: Path) -> None:
    pytest.importorskip("OCP")
    from OCP.TopLoc import TopLoc_Location

    from tests.model.test_step import read

    plain = {**leg()[1]["link"], "mass": 1.2, "radius": RADIUS}
    drawn = robot(leg(thigh={"link": plain}), children=BOTH).resolve().build()
    _, found = read(drawn.save(tmp_path / "out", ("step",)) / "robot.step")
    own = {name: found[f"L_{name}"].shape.Located(TopLoc_Location()) for name in PARTS}
    files = {f"{name}.step": written.step(shape) for name, shape in own.items()}
    back = with_parts(
        files,
        {"thigh": {"file": "thigh.step", "mass": 1.2}},
        {"file": "thigh_motor.step"},
        children=BOTH,
    )
    a, b = drawn.mujoco, back.resolve().build().mujoco
    for body in (one.name for one in drawn.design.bodies):
        assert b.body(body).ipos == pytest.approx(a.body(body).ipos, abs=1e-8), body
        expected = tensor(a, body)
        assert np.abs(tensor(b, body) - expected).max() <= 1e-7 * np.trace(expected), body


PARTS = ("thigh", "thigh_motor")


def test_a_mesh_that_cad_would_take_minutes_for_is_refused(tmp_path: Path) -> None:
    pytest.importorskip("OCP")
    ball = trimesh.creation.icosphere(subdivisions=5, radius=0.1)
    shape = {"file": "ball.stl", "density": 200}
    model = with_parts({"ball.stl": stl(ball)}, {"thigh": shape}).resolve().build()
    with pytest.raises(ModelError, match="20480 triangles"):
        model.save(tmp_path / "out", ("step",))
    assert not any(tmp_path.iterdir())


def test_the_studio_shows_the_parts_where_mujoco_has_them() -> None:
    model = everything().resolve().build()
    data = mujoco.MjData(model.mujoco)
    mujoco.mj_kinematics(model.mujoco, data)
    shown = np.vstack([skin.placed(data) for skin in skins(model).values()])
    geoms = [g for g in range(model.mujoco.ngeom) if model.mujoco.geom_rgba[g, 3]]
    meshes = [g for g in geoms if model.mujoco.geom_dataid[g] >= 0]
    assert len(meshes) == 7  # the trunk, two thighs, four motors
    for geom in meshes:
        body = model.mujoco.geom_bodyid[geom]
        own = points_of(model.mujoco, geom) @ data.xmat[body].reshape(3, 3).T + data.xpos[body]
        apart = np.linalg.norm(shown[:, None] - own[None], axis=2).min(axis=0)
        assert apart.max() < 1e-6, model.mujoco.geom(geom).name


def test_a_copy_of_a_robot_has_its_parts(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    loading, new = (importlib.import_module(f"draft.spec.{name}") for name in ("load", "new"))
    shipped: Registry[Path] = Registry("robot")
    for name, path in loading.FOLDERS.present.items():
        shipped.add(name, path, "draft.robots")
    source = written.folder(tmp_path / "tester", everything(), {})
    shipped.add("tester", source, "test")
    for module in (loading, new):
        monkeypatch.setattr(module, "FOLDERS", shipped)
    copy = draft.load(new.new_robot(tmp_path / "copied", "tester"))
    assert (copy.folder or Path()) == tmp_path / "copied"
    assert scalar(copy.resolve().mass) == scalar(everything().resolve().mass)
