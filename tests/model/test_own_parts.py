"""A part of one's own takes the place of a drawn solid: its inertia, its picture, its contacts.

Closed forms, MuJoCo's own inertia of a mesh, trimesh and the CAD kernel are the judges.
"""

# pyright: reportAttributeAccessIssue=false
# (MuJoCo's and the kernel's compiled modules carry no types.)
from __future__ import annotations

import math
import sys
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st

import draft
from draft.design.legs import _first_moment
from draft.design.report import mass_by_origin, own_parts, report
from draft.errors import ResolveError, SpecError
from draft.model.batch import build_batch
from draft.model.model import preview
from draft.spec.primitives.mesh import closed
from draft.values import scalar
from tests.helpers import DRIVE, leg, parameter, robot
from tests.model import own_parts as written
from tests.model.own_parts import (
    BOTH,
    LENGTH,
    RADIUS,
    everything,
    hook,
    points_of,
    prism,
    stl,
    tensor,
    with_parts,
)

Array = np.ndarray
sizes = st.floats(0.01, 1.0)
places = st.tuples(*3 * [st.floats(-1.0, 1.0)])


def alone(shape: dict[str, Any], files: dict[str, bytes], **more: Any) -> mujoco.MjModel:
    """Model of a robot whose thigh is a part and carries nothing, so that its body is the part."""
    chain = leg(thigh={"shape": shape, "motor": None}, shank={"joint": None})[:2]
    hung = {"name": "shank", "type": "sphere", "joint": {**KNEE}, "link": {**SHANK}}
    return (
        with_parts(
            files, chain=[*chain, {**hung, "sphere": {"radius": 0.02, "site": "foot"}}], **more
        )
        .resolve()
        .build()
        .mujoco
    )


KNEE = {"name": "knee", "axis": "y", "range": [-2, 2]}
SHANK = {"axis": "-z", "length": 0.25, "segment": "shank"}


@given(st.tuples(sizes, sizes, sizes), places)
@settings(max_examples=30, deadline=None)
def test_a_box_has_the_mass_the_centre_and_the_inertia_of_the_textbook(
    size: tuple[float, float, float], at: tuple[float, float, float]
) -> None:
    mesh = trimesh.creation.box(size)
    mesh.apply_translation(at)
    found = closed(np.asarray(mesh.triangles), "box", "box.stl")
    x, y, z = size
    moments = np.array([y * y + z * z, z * z + x * x, x * x + y * y]) / 12 * x * y * z
    assert found.volume == pytest.approx(x * y * z, rel=1e-9)
    assert found.com == pytest.approx(np.array(at), abs=1e-9)
    assert np.diag(found.inertia) == pytest.approx(moments, rel=1e-9)
    assert np.abs(found.inertia - np.diag(moments)).max() <= 1e-9 * moments.max()


@pytest.mark.parametrize("sides", [3, 6, 64])
def test_a_prism_has_the_moments_of_its_closed_form(sides: int) -> None:
    triangles = np.asarray(prism(sides).triangles)
    found = closed(triangles, "prism", "prism.stl")
    volume, about, across = written.of_prism(sides, LENGTH, RADIUS)
    assert found.volume == pytest.approx(volume, rel=1e-9)
    assert found.com == pytest.approx(np.array([0, 0, -LENGTH / 2]), abs=1e-12)
    expected = volume * np.diag([across, across, about])
    assert np.abs(found.inertia - expected).max() <= 1e-9 * expected.max()


def test_a_cylinder_of_a_step_file_is_exact_and_its_triangles_are_near() -> None:
    pytest.importorskip("OCP")
    from draft.spec.step_file import DEFLECTION, read_step

    found = read_step(written.step(written.rod()), "rod", "rod.step")
    volume = math.pi * RADIUS**2 * LENGTH
    across = RADIUS**2 / 4 + LENGTH**2 / 12
    assert found.volume == pytest.approx(volume, rel=1e-9)
    assert found.com == pytest.approx(np.array([0, 0, -LENGTH / 2]), abs=1e-9)
    expected = volume * np.diag([across, across, RADIUS**2 / 2])
    assert np.abs(found.inertia - expected).max() <= 1e-9 * expected.max()
    drawn = closed(found.vertices[found.faces()], "rod", "rod.stl")  # closed and not inside out
    assert 0.98 * volume < drawn.volume < volume
    triangles = found.vertices[found.faces()]
    sides = np.ptp(triangles[:, :, 2], axis=1) > 0
    off = RADIUS - np.linalg.norm(triangles[sides].mean(axis=1)[:, :2], axis=1)
    assert 0 < off.max() <= DEFLECTION * math.hypot(LENGTH, 2 * RADIUS, 2 * RADIUS)


def test_the_compiled_link_has_the_inertia_that_mujoco_gives_the_mesh() -> None:
    model = alone({"file": "hook.stl", "density": 2700}, {"hook.stl": stl(hook())})
    mesh = hook()
    points, faces = mesh.vertices.astype(np.float32), mesh.faces
    by_itself = mujoco.MjModel.from_xml_string(
        f"""<mujoco><asset><mesh name="m" inertia="exact" vertex="{_words(points)}"
        face="{_words(faces)}"/></asset><worldbody><body name="thigh"><freejoint/>
        <geom type="mesh" mesh="m" density="2700"/></body></worldbody></mujoco>"""
    )
    ours, theirs = model.body("thigh"), by_itself.body("thigh")
    # MuJoCo keeps the vertices of a mesh in single precision.
    assert ours.mass[0] == pytest.approx(theirs.mass[0], rel=1e-6)
    assert ours.ipos == pytest.approx(theirs.ipos, abs=1e-7)
    size = np.trace(tensor(by_itself, "thigh"))
    assert np.abs(tensor(model, "thigh") - tensor(by_itself, "thigh")).max() < 1e-6 * size


def _words(numbers: Array) -> str:
    return " ".join(f"{x:.9g}" for x in np.asarray(numbers).ravel().tolist())


def test_a_stated_inertia_is_that_of_the_compiled_link_whatever_the_mesh() -> None:
    stated = {"mass": 0.8, "com": [0.01, -0.02, -0.1], "moments": [0.006, 0.005, 0.002]}
    stated["products"] = [0.0005, -0.0003, 0.0008]
    model = alone({"file": "hook.stl", **stated}, {"hook.stl": stl(hook())})
    (xx, yy, zz), (xy, xz, yz) = stated["moments"], stated["products"]
    expected = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    assert model.body("thigh").mass[0] == pytest.approx(0.8)
    assert model.body("thigh").ipos == pytest.approx(np.array(stated["com"]))
    assert np.abs(tensor(model, "thigh") - expected).max() < 1e-9 * np.trace(expected)


def test_a_rod_of_step_in_place_of_the_same_rod_changes_nothing_but_the_mesh() -> None:
    pytest.importorskip("OCP")
    files = {"rod.step": written.step(written.rod())}
    mass = 2700 * math.pi * RADIUS**2 * LENGTH
    plain = {**leg()[1]["link"], "mass": mass, "radius": RADIUS}
    drawn = robot(leg(thigh={"link": plain}), children=BOTH).resolve()
    shape = {"file": "rod.step", "density": 2700}
    own = with_parts(files, {"thigh": shape}, children=BOTH).resolve()
    assert scalar(own.mass) == pytest.approx(scalar(drawn.mass), rel=1e-9)
    a, b = drawn.build(), own.build()
    for body in drawn.bodies:
        one, other = a.mujoco.body(body.name), b.mujoco.body(body.name)
        assert other.mass[0] == pytest.approx(one.mass[0], rel=1e-9)
        assert other.ipos == pytest.approx(one.ipos, abs=1e-9)
        expected = tensor(a.mujoco, body.name)
        assert np.abs(tensor(b.mujoco, body.name) - expected).max() <= 1e-8 * np.trace(expected)
    colliding = {g for g in range(b.mujoco.ngeom) if b.mujoco.geom_conaffinity[g]}
    assert {b.mujoco.geom(g).name for g in colliding} == {
        a.mujoco.geom(g).name for g in range(a.mujoco.ngeom) if a.mujoco.geom_conaffinity[g]
    }


def test_a_mesh_in_place_of_the_same_rod_differs_by_its_polygon_alone() -> None:
    shape = {"file": "rod.stl", "mass": 2.0}
    model = alone(shape, {"rod.stl": stl(prism(64))})
    across = 2.0 * (RADIUS**2 / 4 + LENGTH**2 / 12)
    polygon = 2 * (math.pi / 64) ** 2  # of the moments of a polygon of 64 sides
    assert tensor(model, "thigh")[0, 0] == pytest.approx(across, rel=polygon)
    assert tensor(model, "thigh")[2, 2] == pytest.approx(RADIUS**2, rel=polygon)


def test_a_mirrored_link_has_the_mirrored_part() -> None:
    model = everything().resolve().build()
    compiled, flip = model.mujoco, np.diag([1.0, -1.0, 1.0])
    left, right = (compiled.geom(f"{side}_thigh_link_shape") for side in "LR")
    inertias = [compiled.geom(f"{side}_thigh_link_inertia") for side in "LR"]
    assert inertias[1].pos == pytest.approx(flip @ inertias[0].pos)
    assert not np.allclose(inertias[0].pos, inertias[1].pos, atol=1e-4)  # one has a handedness
    boxes = [_box_tensor(one.size, one.quat) for one in inertias]
    assert boxes[1] == pytest.approx(flip @ boxes[0] @ flip, rel=1e-9, abs=1e-12)
    assert np.abs(boxes[0] - np.diag(np.diag(boxes[0]))).max() > 1e-6  # its axes are its own
    points = [points_of(compiled, one.id) for one in (left, right)]
    assert _sorted(points[1]) == pytest.approx(_sorted(points[0] @ flip), abs=1e-6)
    for side in "LR":
        mesh = compiled.geom_dataid[compiled.geom(f"{side}_thigh_link_shape").id]
        faces = slice(compiled.mesh_faceadr[mesh], None)
        own = compiled.mesh_face[faces][: compiled.mesh_facenum[mesh]]
        start = compiled.mesh_vertadr[mesh]
        corners = compiled.mesh_vert[start + own].astype(float)
        volume = np.einsum("ij,ij->i", corners[:, 0], np.cross(corners[:, 1], corners[:, 2]))
        assert volume.sum() / 6 == pytest.approx(hook().volume, rel=1e-5)  # outward on both sides


def _box_tensor(halves: Array, quat: Array) -> Array:
    """Inertia of a box per mass about its centre, in the frame of its body [m2]."""
    turn = np.empty(9)
    mujoco.mju_quat2Mat(turn, quat)
    square = halves**2 / 3
    return turn.reshape(3, 3) @ np.diag(square.sum() - square) @ turn.reshape(3, 3).T


def _sorted(points: Array) -> Array:
    return points[np.lexsort(np.round(points, 5).T)]


def test_an_actuator_has_its_z_along_the_shaft_and_is_the_same_part_on_both_sides() -> None:
    model = everything().resolve().build().mujoco
    part = trimesh.creation.box((0.1, 0.06, 0.05))
    part.apply_translation((0.01, 0.0, 0.005))
    local = np.asarray(part.vertices)
    for side, sign in (("L", 1.0), ("R", -1.0)):
        found = points_of(model, model.geom(f"{side}_thigh_motor_shape").id)
        # At the tip of the thigh, the shaft along y of the unmirrored leg, x back along the member.
        z, x = np.array([0, sign, 0]), np.array([0, 0, 1.0])
        turn = np.column_stack([x, np.cross(z, x), z])
        assert np.linalg.det(turn) == pytest.approx(1)
        expected = local @ turn.T + (0, 0, -LENGTH)
        assert _sorted(found) == pytest.approx(_sorted(expected), abs=1e-6)


def test_a_motor_says_where_the_side_of_its_part_is() -> None:
    block = trimesh.creation.box((0.1, 0.06, 0.05))
    block.apply_translation((0.02, 0.0, 0.0))
    motor = {"actuator": "leg", "axis": "y", "long": "-x"}
    shape = {"file": "m.stl"}
    chain = leg(thigh={"motor": motor})
    spec = with_parts({"m.stl": stl(block)}, motor=shape, chain=chain)
    model = spec.resolve().build().mujoco
    assert model.geom("thigh_motor_inertia").pos == pytest.approx(np.array([-0.02, 0, -LENGTH]))


def test_a_class_takes_its_mass_from_the_density_of_its_part() -> None:
    block = trimesh.creation.box((0.1, 0.1, 0.04))
    files = {"m.stl": stl(block)}
    design = with_parts(files, motor={"file": "m.stl", "density": 3000}).resolve()
    actuator = design.actuators["leg"]
    assert actuator.mass == pytest.approx(3000 * 0.1 * 0.1 * 0.04, rel=1e-6)
    assert actuator.origins["mass"].kind == "stated"
    lighter = with_parts(files, motor={"file": "m.stl", "density": 3000}).resolve(
        {"actuators.leg.mass": 0.9}
    )
    assert lighter.actuators["leg"].mass == 0.9
    drawn = with_parts(files, motor={"file": "m.stl"}).resolve()
    assert drawn.actuators["leg"].mass == robot().resolve().actuators["leg"].mass


def test_a_part_leaves_the_rest_of_its_segment_as_it_is() -> None:
    second = {"name": "brace", "link": {"axis": "-z", "length": 0.1, "segment": "thigh"}}
    chain = [*leg(thigh={"motor": None})[:2], {**second, "motor": leg()[1]["motor"]}, leg()[2]]
    plain = robot(chain).resolve()
    chain[1]["shape"] = {"file": "rod.stl", "mass": 0.5}
    own = robot(chain, files={"rod.stl": stl(prism())}).resolve()
    masses = {body.name: body.member_mass for body in plain.bodies}
    found = {body.name: body.member_mass for body in own.bodies}
    assert found == {**masses, "thigh": 0.5}
    (segment,) = (one for one in own.segments if "thigh" in one.bodies)
    assert (segment.trend, segment.of_parts) == ("thigh", 0.5)


def test_the_part_of_a_trunk_weighs_all_that_is_in_it() -> None:
    design = everything().resolve()
    assert design.base_mass == 9.0
    assert design.trunk.density_stated
    model = design.build().mujoco
    assert model.body("trunk").mass[0] == pytest.approx(9.0)
    assert model.body("trunk").ipos == pytest.approx(np.array([0.02, 0, 0.01]))
    expected = np.array([[0.05, 0.01, 0.002], [0.01, 0.14, 0], [0.002, 0, 0.16]])
    assert np.abs(tensor(model, "trunk") - expected).max() < 1e-9
    stated = with_parts({"box.stl": stl(hook())}, trunk={"file": "box.stl"}).resolve()
    assert stated.base_mass == robot().resolve().base_mass  # by the law, and drawn by the part


@pytest.mark.parametrize("collides", [False, True])
def test_a_part_collides_if_that_is_asked(collides: bool) -> None:
    shape = {"file": "hook.stl", "density": 1500, "collides": collides}
    files = {"hook.stl": stl(hook())}
    model = with_parts(files, {"thigh": shape}, trunk=shape).resolve().build().mujoco
    for name in ("thigh_link", "trunk_trunk"):
        solid = model.geom(name)
        mesh = solid.id if collides else model.geom(f"{name}_shape").id
        assert bool(solid.conaffinity[0])
        assert bool(model.geom_conaffinity[mesh]) == collides
        assert model.geom_rgba[mesh, 3] == 1
        assert bool(solid.rgba[3]) == collides
        assert model.geom_type[mesh] == mujoco.mjtGeom.mjGEOM_MESH
    # The loft of a trunk stays, unseen, where its part does not collide.
    assert model.nmesh == 2


VARIED = {
    "length": np.array([0.25, 0.3, 0.36]),
    "density": np.array([900.0, 2700.0, 1500.0]),
    "wide": np.array([0.006, 0.007, 0.0065]),
}


def varied() -> draft.Spec:
    """A robot with parts whose masses, inertia and neighbours depend on parameters."""
    inertia = {"mass": "density / 1000", "com": [0, 0, -0.1], "products": [0.001, 0.0005, 0]}
    links = {
        "thigh": {"file": "hook.stl", "density": "density"},
        "shank": {"file": "rod.stl", **inertia, "moments": ["wide", 0.006, 0.003]},
    }
    chain = leg(**{name: {"shape": shape} for name, shape in links.items()})
    chain[1]["link"]["length"] = "length"
    block = trimesh.creation.box((0.1, 0.1, 0.04))
    return with_parts(
        {"hook.stl": stl(hook()), "rod.stl": stl(prism()), "m.stl": stl(block)},
        chain=chain,
        actuators={"leg": {**DRIVE, "shape": {"file": "m.stl", "density": "density + 1500"}}},
        trunk={"file": "hook.stl", "mass": "density / 100"},
        children=BOTH,
        parameters={name: parameter(float(values[0])) for name, values in VARIED.items()},
    )


def test_many_designs_are_what_each_is_alone() -> None:
    many = varied().resolve(VARIED)
    batch = build_batch(many, refused=True)
    assert len(batch) == 3, batch.outside
    for row, place in zip(batch.rows, range(len(batch)), strict=True):
        one = varied().resolve({name: float(x[row]) for name, x in VARIED.items()})
        assert scalar(one.mass) == pytest.approx(float(np.asarray(many.mass)[row]), rel=1e-12)
        expected, found = draft.model.model.preview(one).mujoco, batch.model(place)
        names = ("body_mass", "body_ipos", "geom_pos", "geom_quat", "geom_size", "bvh_aabb")
        for name in (*names, "geom_rbound", "body_invweight0"):
            a, b = getattr(expected, name), getattr(found, name)
            assert np.abs(a - b).max() <= 1e-9 * max(1.0, np.abs(a).max()), name
        for body in one.bodies:
            a, b = (tensor(model, body.name) for model in (expected, found))
            assert np.abs(a - b).max() <= 1e-9 * np.trace(a), body.name


def test_the_report_says_which_masses_are_stated_and_which_are_predicted() -> None:
    design = everything().resolve()
    record = report(design)
    parts = {one["file"]: one for one in record["own_parts"]}
    assert parts["hook.stl"]["bodies"] == ["L_thigh", "R_thigh"]
    assert parts["hook.stl"]["origin"] == "stated"
    assert parts["motor.obj"]["origin"] == "trend"  # by the law, spread over the part
    found = record["mass_by_origin_kg"]
    assert sum(map(scalar, found.values())) == pytest.approx(scalar(design.mass), rel=1e-12)
    of_parts = 9.0 + 2 * 2700 * hook().volume
    assert scalar(found["stated"]) == pytest.approx(of_parts, rel=1e-6)
    plain = robot().resolve()
    assert mass_by_origin(plain)["stated"] == 0.0
    assert own_parts(plain) == []
    low, high = design.mass_band()
    assert low > found["stated"]
    assert (high - low) / scalar(design.mass) < 0.6 * _width(robot(children=BOTH).resolve())


def _width(design: draft.Design) -> float:
    low, high = design.mass_band()
    return scalar((high - low) / design.mass)


def test_the_report_has_the_stated_centre_and_inertia_of_a_trunk() -> None:
    trunk = report(everything().resolve())["trunk"]
    assert trunk["com_m"] == pytest.approx([0.02, 0, 0.01])
    # Products have the signs of URDF.
    expected = [[0.05, 0.01, 0.002], [0.01, 0.14, 0], [0.002, 0, 0.16]]
    found = np.array(trunk["inertia_kg_m2"])
    assert found == pytest.approx(np.array(expected), rel=1e-9, abs=1e-12)


def test_loads_of_the_home_pose_count_the_centres_of_parts() -> None:
    design = everything().resolve()
    model = preview(design).mujoco
    for body in design.bodies[1:]:
        compiled = model.body(body.name)
        expected = compiled.mass[0] * compiled.ipos
        assert np.array(_first_moment(body)) == pytest.approx(expected, abs=1e-9)


def test_a_part_of_a_link_with_a_stated_mass_is_stated() -> None:
    chain = leg(thigh={"shape": {"file": "a.stl"}})
    chain[1]["link"] = {**chain[1]["link"], "mass": 0.31}
    design = with_parts({"a.stl": stl(prism())}, chain=chain).resolve()
    assert [one["origin"] for one in own_parts(design)] == ["stated"]


@pytest.mark.parametrize("data", [b"ISO-10303-21;\nnonsense", b"solid"])
def test_a_bad_step_file_says_nothing_on_stdout(
    data: bytes, capfd: pytest.CaptureFixture[str]
) -> None:
    pytest.importorskip("OCP")
    with pytest.raises(SpecError, match=r"finds no STEP|no solid"):
        with_parts({"a.step": data}, {"thigh": {"file": "a.step"}})
    assert capfd.readouterr().out == ""


def test_a_part_far_from_the_size_of_its_link_has_another_unit() -> None:
    files = {"hook.stl": stl(hook(1000))}
    with pytest.raises(ResolveError, match=r"is 250 m long.*\s.*'unit: mm'"):
        with_parts(files, {"thigh": {"file": "hook.stl"}}).resolve()
    with pytest.raises(ResolveError, match="the solid of leg"):
        with_parts(files, motor={"file": "hook.stl"}).resolve()
    with pytest.raises(ResolveError, match="the trunk that it replaces"):
        with_parts(files, trunk={"file": "hook.stl"}).resolve()
    many = {"thigh": {"file": "hook.stl", "unit": "mm"}}
    chain = leg(thigh={"shape": many["thigh"]})
    chain[1]["link"]["length"] = "length"
    spec = robot(chain, files=files, parameters={"length": parameter(0.3)})
    found = spec.resolve({"length": np.array([0.3, 3.0])})
    assert np.asarray(found.accepted).tolist() == [True, False]


def test_a_part_whose_link_has_grown_is_reported() -> None:
    chain = leg(thigh={"shape": {"file": "hook.stl", "density": 2700}})
    chain[1]["link"]["length"] = "length"
    spec = robot(chain, files={"hook.stl": stl(hook())}, parameters={"length": parameter(0.3)})
    lengths = np.array([0.15, 0.2, 0.3, 0.4])
    (finding,) = (f for f in spec.resolve({"length": lengths}).findings if f.id == "off_part")
    assert np.asarray(finding.mask).tolist() == [True, False, False, True]  # it ends at 0.25 m
    alone = [one.id for one in spec.resolve({"length": 0.4}).findings]
    assert "off_part" in alone


def test_moments_that_no_body_has_are_refused() -> None:
    stated = {"mass": 1.0, "com": [0, 0, 0], "moments": [1.0, 0.1, 0.1]}
    with pytest.raises(ResolveError, match="principal moment"):
        with_parts({"h.stl": stl(hook())}, {"thigh": {"file": "h.stl", **stated}}).resolve()


def test_without_the_extra_the_message_names_it(monkeypatch: pytest.MonkeyPatch) -> None:
    for name in [name for name in sys.modules if name.partition(".")[0] == "OCP"]:
        monkeypatch.setitem(sys.modules, name, None)
    monkeypatch.setitem(sys.modules, "OCP", None)
    with pytest.raises(
        SpecError, match=r"OCP is not installed, which STEP files need\n.*cad.*as STL"
    ):
        with_parts({"a.step": b"ISO-10303-21;"}, {"thigh": {"file": "a.step"}})


def test_what_is_read_again_is_read_as_it_is_now(tmp_path: Path) -> None:
    part = {"thigh": {"file": "hook.stl", "density": 2700}}
    spec = with_parts({"hook.stl": stl(hook())}, part)
    folder = written.folder(tmp_path / "own", spec, {})
    before = draft.load(folder).resolve().mass
    (folder / "hook.stl").write_bytes(stl(hook(1.1)))
    after = draft.load(folder).resolve().mass
    more = 2700 * hook().volume * (1.1**3 - 1)
    assert scalar(after) - scalar(before) == pytest.approx(more, rel=1e-5)


def test_a_link_out_of_the_folder_is_not_followed(tmp_path: Path) -> None:
    spec = with_parts({"hook.stl": stl(hook())}, {"thigh": {"file": "hook.stl"}})
    folder = written.folder(tmp_path / "own", spec, {})
    (folder / "hook.stl").rename(tmp_path / "elsewhere.stl")
    (folder / "hook.stl").symlink_to(tmp_path / "elsewhere.stl")
    with pytest.raises(SpecError, match="leads out of the robot's folder"):
        draft.load(folder)
