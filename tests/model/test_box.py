"""A box link is a block that is carried: it weighs what is stated, everywhere, and takes up space.

MuJoCo's compiled inertia, Pinocchio's reading of the URDF and textbook formulas are the judges.
"""

# pyright: reportAttributeAccessIssue=false
# (MuJoCo's and Pinocchio's compiled modules carry no types.)
from __future__ import annotations

import math
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import mujoco
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import draft
from draft.cli import main
from draft.design.legs import legs
from draft.design.report import mass_parts, report
from draft.spec.primitives import colors
from draft.spec.primitives.base import Form, Geom
from draft.studio.skins import skins
from tests.helpers import ids, leg, parameter, robot
from tests.model.test_masses import inertia

SIZE = [0.2, 0.1, 0.05]
PACK: dict[str, Any] = {"name": "pack", "type": "box", "at": [0, 0, 0.1]}
LEGS = {"chain": "leg", "at": [0, 0, -0.2]}
positive = st.floats(0.01, 1.0)
# Whole micrometres: MuJoCo's reader takes a subnormal number for one that is too large.
components = st.integers(-500_000, 500_000).map(lambda micro: micro * 1e-6)


def carrying(box: dict[str, Any], **link: Any) -> draft.Spec:
    """A one-legged robot with a block on its trunk."""
    return robot(children=[LEGS, {**PACK, **link, "box": {"size": SIZE, **box}}])


@pytest.mark.parametrize("stated", [{"mass": 2.5}, {"density": 2500.0}])
def test_a_block_weighs_what_is_stated(stated: dict[str, float]) -> None:
    design, bare = carrying(stated).resolve(), robot(children=[LEGS]).resolve()
    assert design.carried_mass == pytest.approx(2.5)
    assert design.mass == pytest.approx(float(bare.mass) + 2.5)
    assert design.structure_mass == bare.structure_mass
    assert design.segments == bare.segments
    assert design.build().mujoco.body("pack").mass[0] == pytest.approx(2.5)


# MuJoCo takes a mass below 1e-15 kg for none.
@given(st.tuples(positive, positive, positive), st.just(0.0) | st.floats(1e-3, 50.0))
@settings(max_examples=15)
def test_the_inertia_of_a_block_is_that_of_the_textbook(
    size: tuple[float, float, float], mass: float
) -> None:
    declared = {name: parameter(0.1) for name in "xyz"} | {"m": parameter(1.0)}
    box = {"size": ["x", "y", "z"], "mass": "m"}
    spec = robot(children=[{**PACK, "rpy": [0.3, 0.2, 0.1], "box": box}], parameters=declared)
    model = spec.resolve({**dict(zip("xyz", size, strict=True)), "m": mass}).build().mujoco
    x, y, z = size
    expected = np.diag([y * y + z * z, z * z + x * x, x * x + y * y]) * mass / 12
    assert inertia(model, "pack") == pytest.approx(expected, rel=1e-6, abs=1e-9 * mass)
    assert model.body("pack").mass[0] == pytest.approx(mass)


@pytest.mark.parametrize(
    ("form", "size", "halves"),
    [
        ("box", (0.3, 0.2, 0.1), (0.15, 0.1, 0.05)),
        ("sphere", (0.2,), (0.2, 0, 0)),
        ("cylinder", (0.2, 0.5), (0.2, 0.25, 0)),
    ],
)
def test_volume_and_moments_of_a_geom_are_mujocos(
    form: Form, size: tuple[float, ...], halves: tuple[float, ...]
) -> None:
    geom = Geom("", "carried", form, (0.0, 0.0, 0.0), size, 3.0)
    spec = mujoco.MjSpec()
    kind = getattr(mujoco.mjtGeom, f"mjGEOM_{form.upper()}")
    body = spec.worldbody.add_body(name="solid")
    body.add_geom(type=kind, size=halves, density=3.0 / float(geom.volume))
    body.add_freejoint()
    model = spec.compile()
    assert model.body("solid").mass[0] == pytest.approx(3.0)
    assert np.diag(inertia(model, "solid")) == pytest.approx(np.array(geom.inertia, dtype=float))


MIRRORED = robot(
    leg(
        thigh={
            "rpy": [0.1, -0.2, 0.4],
            "children": [
                {
                    "name": "pack",
                    "type": "box",
                    "at": ["x", "y", "z"],
                    "rpy": ["r", "p", "w"],
                    "link": {"axis": [0.1, 0.5, -1], "length": 0.1, "mass": 0.2},
                    "box": {
                        "size": [0.1, 0.2, 0.3],
                        "density": "d",
                        "shift": ["z", "x", "y"],
                        "site": "hold",
                    },
                }
            ],
        }
    ),
    children=[
        {"chain": "leg", "prefix": "L_", "at": [0.1, 0.4, -0.2], "rpy": [0.3, 0.1, -0.2]},
        *(
            {
                "chain": "leg",
                "prefix": f"{mirror}_",
                "at": [0.1, 0.4, -0.2],
                "rpy": [0.3, 0.1, -0.2],
                "mirror": mirror,
            }
            for mirror in ("x", "y", "xy")
        ),
    ],
    parameters={name: parameter(0.1) for name in ("x", "y", "z", "r", "p", "w", "d")},
    allow=["actuator_overlap", "cannot_stand"],  # by the heaviest blocks
)
REFLECTIONS = {"x": [-1.0, 1.0, 1.0], "y": [1.0, -1.0, 1.0], "xy": [-1.0, -1.0, 1.0]}


@given(st.tuples(*[components] * 6), st.floats(1.0, 5000.0))
@settings(max_examples=15)
def test_a_block_on_a_mirrored_chain_is_the_mirror_image(
    numbers: tuple[float, ...], density: float
) -> None:
    table = dict(zip(("x", "y", "z", "r", "p", "w"), numbers, strict=True)) | {"d": density}
    model = MIRRORED.resolve(table).build().mujoco
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    one, base = model.body("L_pack"), data.body("trunk").xpos
    for name, signs in REFLECTIONS.items():
        two, mirror = model.body(f"{name}_pack"), np.diag(signs)
        assert two.mass == pytest.approx(one.mass, rel=1e-9)
        assert two.ipos == pytest.approx(mirror @ one.ipos, abs=1e-9)
        reflected = mirror @ inertia(model, "L_pack") @ mirror
        bound = 1e-9 * np.abs(reflected).max()
        assert inertia(model, f"{name}_pack") == pytest.approx(reflected, abs=bound)
        for part in ("geom", "site"):
            suffix = {"geom": "pack_box", "site": "hold"}[part]
            here = getattr(data, part)(f"L_{suffix}").xpos - base
            there = getattr(data, part)(f"{name}_{suffix}").xpos - base
            assert there == pytest.approx(mirror @ here, abs=1e-8)


SWEPT = robot(
    children=[LEGS, {**PACK, "box": {"size": ["s", "2 * s", 0.1], "mass": "m"}}],
    parameters={"s": parameter(0.1), "m": parameter(1.0)},
)


@given(st.lists(st.tuples(positive, st.floats(0.0, 30.0)), min_size=1, max_size=4))
@settings(max_examples=15)
def test_many_blocks_at_once_are_each_of_them(rows: list[tuple[float, float]]) -> None:
    sizes, masses = (np.array(column) for column in zip(*rows, strict=True))
    many = SWEPT.resolve({"s": sizes, "m": masses})
    low, high = many.mass_band()
    for i, (size, mass) in enumerate(rows):
        one = SWEPT.resolve({"s": size, "m": mass})
        assert np.broadcast_to(many.mass, len(rows))[i] == pytest.approx(one.mass, rel=1e-12)
        assert np.broadcast_to(many.carried_mass, len(rows))[i] == one.carried_mass
        band = [np.broadcast_to(end, len(rows))[i] for end in (low, high)]
        assert band == pytest.approx(list(one.mass_band()), rel=1e-9)
        said = {f.id for f in many.findings if np.broadcast_to(f.mask, len(rows))[i]}
        assert said == ids(one)


def test_a_size_that_cannot_be_marks_its_design_and_no_other() -> None:
    many = SWEPT.resolve({"s": np.array([0.1, -0.1, 0.2])})
    (wrong,) = (f for f in many.findings if f.id == "not_physical")
    assert list(np.asarray(wrong.mask)) == [False, True, False]


@pytest.mark.parametrize(("gap", "meet"), [(0.05, True), (0.25, False)])
@pytest.mark.parametrize("collides", [True, False])
def test_blocks_take_up_space(gap: float, meet: bool, collides: bool) -> None:
    box = {"size": [0.2, 0.2, 0.2], "mass": 1.0, "collides": collides}
    blocks = [
        {"name": name, "type": "box", "at": [0, y, 0.5], "box": box}
        for name, y in (("left", gap / 2), ("right", -gap / 2))
    ]
    assert ("limb_overlap" in ids(robot(children=blocks).resolve())) == meet


def test_a_heavy_block_is_no_heavy_link_and_makes_no_segment_longer() -> None:
    jointed = {"name": "wrist", "axis": "x", "range": [-1, 1]}
    box = {"size": SIZE, "mass": 500.0, "shift": [0, 0, -2.0], "site": "tool"}
    held = {"name": "tool", "type": "box", "box": box}
    for more in ({}, {"joint": jointed}):
        design = robot(leg(shank={"children": [{**held, **more}]})).resolve()
        bare = robot().resolve()
        assert "heavy_link" not in ids(design)
        assert [s.length for s in design.segments] == [s.length for s in bare.segments]
        assert [s.mass for s in design.segments] == [s.mass for s in bare.segments]
        # It reaches lower than the foot, and is no foot for all that.
        assert design.lowest() == bare.lowest()
        assert [kind.feet for kind in legs(design)] == [kind.feet for kind in legs(bare)]


def test_what_a_leg_carries_hangs_on_its_joints() -> None:
    box = {"size": SIZE, "mass": 3.0, "shift": [0.03, 0.02, -0.01]}
    held = {"name": "pack", "type": "box", "at": [0.05, 0, -0.1], "rpy": [0, 0.3, 0], "box": box}
    model = robot(leg(thigh={"children": [held]})).resolve().build()
    data = mujoco.MjData(model.mujoco)
    data.qpos[3] = 1.0
    (kind,) = legs(model.design)
    for joint in kind.joints:
        data.joint(joint.names[0]).qpos[0] = joint.angle
    mujoco.mj_forward(model.mujoco, data)
    for joint in kind.joints:
        torque = data.joint(joint.names[0]).qfrc_bias[0]
        assert 9.81 * joint.hang == pytest.approx(torque, abs=1e-7)


@pytest.mark.parametrize("collides", [True, False])
def test_a_block_collides_unless_told_otherwise(collides: bool, tmp_path: Path) -> None:
    box = {"mass": 1.0} | ({} if collides else {"collides": False})
    model = carrying(box).resolve().build()
    geom = model.mujoco.geom("pack_box")
    assert (geom.conaffinity[0], geom.contype[0]) == (int(collides), 0)
    path = model.save(tmp_path / "out", ("urdf",)) / "robot.urdf"
    link = ElementTree.parse(path).getroot().find("link[@name='pack']")
    assert link is not None
    assert (link.find("collision/geometry/box") is not None) == collides
    drawn = link.find("visual/geometry/box")
    assert drawn is not None
    assert drawn.get("size") == "0.2 0.1 0.05"


def test_two_readers_of_the_urdf_weigh_a_block_as_the_model_does(tmp_path: Path) -> None:
    export = pytest.importorskip("tests.model.test_export")
    table = {"x": 0.1, "y": 0.2, "z": -0.3, "r": 0.4, "p": -0.2, "w": 0.9, "d": 800.0}
    export.agree(MIRRORED.resolve(table).build(), tmp_path)


def test_the_glb_has_the_block(tmp_path: Path) -> None:
    trimesh = pytest.importorskip("trimesh")
    model = carrying({"mass": 1.0, "shift": [0.1, 0, 0]}).resolve().build()
    read: Any = trimesh.load_scene(model.save(tmp_path / "out", ("glb",)) / "robot.glb")
    mesh = read.geometry[read.graph["pack_box"][1]]
    assert mesh.bounds == pytest.approx(np.array([[-0.1, -0.05, -0.025], [0.1, 0.05, 0.025]]))
    assert mesh.volume == pytest.approx(math.prod(SIZE))
    color = np.array(mesh.visual.material.baseColorFactor[:3]) / 255
    linear = np.array([((c + 0.055) / 1.055) ** 2.4 for c in colors()["carried"][:3]])
    assert color == pytest.approx(linear, abs=1 / 255)


def test_the_studio_draws_the_block_in_its_colour() -> None:
    model = carrying({"mass": 1.0}).resolve().build()
    red, green, blue, _ = (round(255 * c) for c in colors()["carried"])
    skin = skins(model)[red, green, blue]
    assert np.ptp(skin.vertices, axis=0) == pytest.approx(SIZE)


def test_a_robot_without_a_block_has_no_colour_for_one() -> None:
    assert "carried" not in robot().resolve().build().xml
    assert 'class="carried"' in carrying({"mass": 1.0}).resolve().build().xml


def test_the_report_and_the_table_of_masses_name_the_block(
    capsys: pytest.CaptureFixture[str],
) -> None:
    design = MIRRORED.resolve({"d": 100.0})
    assert dict(mass_parts(design))["4 × pack"] == pytest.approx(4 * 0.6)
    assert sum(mass for _, mass in mass_parts(design)) == pytest.approx(float(design.mass))
    (record,) = report(design)["carried"]
    assert record["copies"] == 4
    assert record["mass_kg"] == pytest.approx(0.6)
    assert record["density_kg_m3"] == pytest.approx(100.0)
    assert record["inertia_kg_m2"][0] == pytest.approx(0.6 * (0.2**2 + 0.3**2) / 12)
    with_pack = carrying({"mass": 2.5})
    assert report(with_pack.resolve())["carried_mass_kg"] == 2.5
    capsys.readouterr()


def test_draft_show_weighs_the_block(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    from tests.written import append, write_robot

    monkeypatch.chdir(tmp_path)
    folder = write_robot(tmp_path / "robot")
    block = "    - {name: battery, type: box, box: {size: [0.2, 0.1, 0.05], density: 2000}}\n"
    append(folder, "tree.yaml", block)
    assert main(["show", "robot"]) == 0
    shown = capsys.readouterr().out
    assert "battery  2.000 kg" in shown
    row = next(line for line in shown.splitlines() if line.startswith("1 × battery"))
    assert row.split()[3] == "2.00"
