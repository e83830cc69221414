"""Masses that the meshes of an MJCF model give, held against MuJoCo's own."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import mujoco
import numpy as np
import pytest

from draft.description.description import Description
from draft.description.read import describe
from draft.imports.mesh_masses import weighed
from draft.imports.meshes import Meshes
from draft.twins.compare import compare_twin
from tests.commands import line, printed
from tests.imports.written import written
from tests.twins.test_vendors import ROBOTS

# A prism whose base is an L, with its faces cut into triangles: no convex body.
L_SHAPE = [(0.0, 0.0), (0.3, 0.0), (0.3, 0.1), (0.1, 0.1), (0.1, 0.3), (0.0, 0.3)]
FAN = [(0, 1, 2), (0, 2, 3), (0, 3, 4), (0, 4, 5)]
LEGS = "".join(
    f'<body name="{name}_thigh" pos="{x} {y} 0">'
    f'<joint name="{name}_hip" axis="0 1 0" range="-60 60" actuatorfrcrange="-40 40"/>{{thigh}}'
    f'<body name="{name}_shank" pos="0 0 -.25">'
    f'<joint name="{name}_knee" axis="0 1 0" range="-120 -20" actuatorfrcrange="-40 40"/>'
    '<inertial pos="0 0 -.1" mass="1" diaginertia=".01 .01 .001"/>'
    '<geom type="sphere" size=".03" pos="0 0 -.25"/></body></body>'
    for name, x, y in (("FL", 0.2, 0.1), ("FR", 0.2, -0.1), ("HL", -0.2, 0.1), ("HR", -0.2, -0.1))
)
THIGH = '<inertial pos="0 0 -.1" mass="1.5" diaginertia=".01 .01 .001"/>'
SHAPE = '<geom type="mesh" mesh="part" pos=".1 .02 0" euler="10 20 30" {}/>'


def prism() -> str:
    """The L as an OBJ file."""
    points = [f"v {x} {y} {z}" for z in (0.0, 0.1) for x, y in L_SHAPE]
    faces = [(a, c, b) for a, b, c in FAN] + [(a + 6, b + 6, c + 6) for a, b, c in FAN]
    for i in range(6):
        j = (i + 1) % 6
        faces += [(i, j, j + 6), (i, j + 6, i + 6)]
    return "\n".join([*points, *(f"f {a + 1} {b + 1} {c + 1}" for a, b, c in faces)]) + "\n"


def model(
    trunk: str, asset: str = "", compiler: str = "", thigh: str = THIGH, mesh: bool = True
) -> Path:
    """A quadruped whose trunk has these geoms, its mesh beside it."""
    if mesh:
        written(prism(), "part.obj")
    return written(
        f'<mujoco><compiler {compiler}/><asset><mesh name="part" file="part.obj" {asset}/></asset>'
        f'<worldbody><body name="trunk" pos="0 0 .5"><freejoint/>{trunk}'
        f"{LEGS.format(thigh=thigh)}</body></worldbody></mujoco>",
        "beast.xml",
    )


def read(path: Path) -> Description:
    return weighed(describe(path), Meshes(path.parent))


GIVEN: dict[str, tuple[str, str, str]] = {
    "the density of water": (SHAPE.format(""), "", ""),
    "a density": (SHAPE.format('density="300"'), "", ""),
    "a mass": (SHAPE.format('mass="7"'), "", ""),
    "a mesh that is scaled": (SHAPE.format(""), 'scale=".5 2 1.5"', ""),
    "an exact volume": (SHAPE.format(""), 'inertia="exact"', ""),
    "a shell": (SHAPE.format('density="20"'), 'inertia="shell"', ""),
    "a mesh and a box": (SHAPE.format('mass="7"') + '<geom type="box" size=".1 .1 .2"/>', "", ""),
    "a mesh without mass": (SHAPE.format('mass="0"') + '<geom size=".1"/>', "", ""),
    "a mesh of a group that does not weigh": (
        SHAPE.format('group="2"') + '<geom size=".1"/>',
        "",
        'inertiagrouprange="0 1"',
    ),
    "geoms instead of what is declared": (
        '<inertial mass="99" pos="0 0 0" diaginertia="1 1 1"/>'
        + SHAPE.format("")
        + '<geom size=".1"/>',
        "",
        'inertiafromgeom="true"',
    ),
}


@pytest.mark.parametrize("name", GIVEN)
def test_masses_of_meshes_are_those_of_mujoco(name: str) -> None:
    trunk, asset, compiler = GIVEN[name]
    thigh = "" if "inertiafromgeom" in compiler else THIGH
    thigh += '<geom type="capsule" size=".02 .1" mass="1.5"/>'
    path = model(trunk, asset, compiler, thigh)
    found, theirs = read(path), mujoco.MjModel.from_xml_path(str(path))
    assert not found.unweighed
    assert not found.unplaced
    assert found.mass == pytest.approx(float(theirs.body_mass.sum()), rel=1e-6)
    own, i = found.links["trunk"].inertial, theirs.body("trunk").id
    assert own is not None
    assert own.com == pytest.approx(theirs.body_ipos[i].tolist(), abs=1e-6)
    moments = np.sort(np.linalg.eigvalsh(np.array(own.inertia)))
    assert moments == pytest.approx(np.sort(theirs.body_inertia[i]), rel=1e-4)


@pytest.mark.skipif(not ROBOTS.is_dir(), reason="the robots are not beside this folder")
@pytest.mark.parametrize("side", ["left", "right"])
def test_a_hand_that_only_meshes_weigh_weighs_what_mujoco_says(side: str) -> None:
    path = ROBOTS / "odd" / "wonik_allegro" / f"{side}_hand.xml"
    theirs = mujoco.MjModel.from_xml_path(str(path))
    found = read(path)
    for i in range(1, theirs.nbody):
        own = found.links[theirs.body(i).name].inertial
        assert own is not None
        assert own.mass == pytest.approx(float(theirs.body_mass[i]), rel=1e-6)
    twin = compare_twin(path, poses=2)
    assert twin.vendor_mass == pytest.approx(float(theirs.body_mass.sum()), rel=1e-6)


def test_a_stated_mass_needs_no_mesh() -> None:
    path = model(SHAPE.format('mass="7"'), mesh=False)
    found = read(path)
    assert found.mass == pytest.approx(7 + 4 * 2.5)
    assert found.unplaced == {"trunk"}
    out = line(printed("twin", path))
    assert "only meshes that are not read say where the mass is of 'trunk'" in out
    assert "M(q): nothing to compare" in out


UNKNOWN = SHAPE.format("") + '<geom size=".01"/>'


def test_no_ratio_is_printed_against_a_part_of_the_mass() -> None:
    path = model(UNKNOWN, mesh=False)
    found = compare_twin(path, poses=2)
    assert found.unstated == ("trunk",)
    assert np.isnan(found.mass_ratio)
    out = printed("twin", path)
    assert "the maker's file states no mass for 1 link, 'trunk'" in out
    lines = [words.split() for words in out.splitlines() if words.strip()]
    rows = {words[0]: words for words in reversed(lines)}
    for name in ("trunk", "total"):
        assert rows[name][1] == "unknown"
        assert len(rows[name]) == 3
    assert float(rows["shank"][3]) > 0
    assert "the maker's is outside" not in out
    record = json.loads(printed("twin", path, "--json"))
    assert record["mass_kg"]["ratio"] is None
    assert record["mass_kg"]["vendor"] is None
    assert record["mass_kg"]["links_without_mass"] == ["trunk"]
    assert record["inertia_error_percent"]["median"] is None


@pytest.mark.slow
def test_a_robot_of_unknown_mass_does_not_count_among_many_and_has_its_figure() -> None:
    pytest.importorskip("matplotlib")
    Path("many").mkdir()
    shutil.move(model(UNKNOWN, mesh=False), "many/unknown.xml")
    shutil.move(model('<geom size=".12"/>', mesh=False), "many/known.xml")
    all_of_them = ("twin", "--all", "many", "--workers", "1", "--poses", "5")
    record = json.loads(printed(*all_of_them, "--json", progress=True))
    robots = {row["robot"]: row for row in record["robots"]}
    assert robots["unknown"]["ratio"] is None
    assert robots["known"]["ratio"] > 0
    printed(*all_of_them, "--out", "figures", progress=True)
    printed("twin", "many/unknown.xml", "--poses", "5", "--out", "figures", progress=True)
    assert Path("figures/unknown.pdf").is_file()
