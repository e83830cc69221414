"""A twin beside its vendor's robot: masses, M(q), g(q), hinges; checked by Pinocchio."""

# pyright: reportAttributeAccessIssue=false
# (MuJoCo's and Pinocchio's compiled modules carry no types.)
from __future__ import annotations

import json
import math
from dataclasses import replace
from pathlib import Path

import mujoco
import numpy as np
import pytest

from draft.description.read import describe
from draft.errors import DraftError
from draft.imports.importer import import_robot
from draft.twins.compare import compare_twin
from draft.twins.dynamics import Errors, Machine
from draft.twins.every import Row, score, table_csv
from draft.twins.record import record
from draft.twins.vendor import vendor_model
from tests.commands import printed, refusal
from tests.imports.written import LEGS, joint, link, notes, quadruped, written
from tests.twins.test_vendors import ROBOTS
from tests.written import edit

pinocchio = pytest.importorskip("pinocchio")
SHARED = pytest.mark.skipif(not ROBOTS.is_dir(), reason="the robots are not beside this folder")
# Robot -> file, mass ratio, median errors of M(q) and g(q) [%].
TWINS = {
    "g1": ("g1/g1_29dof_rev_1_0.urdf", 1.085, 9.8, 8.4),
    "h2": ("h2/H2.urdf", 0.993, 10.5, 10.4),
    "go2": ("go2/go2_description.urdf", 0.987, 8.0, 14.2),
    "b2": ("b2/b2_description.urdf", 0.918, 15.0, 15.1),
}
# The same by the published sum, `structure: paper`.
PUBLISHED = {
    "g1": (1.09, 9.8, 8.2),
    "h2": (0.94, 14.4, 14.2),
    "go2": (0.99, 8.0, 14.2),
    "b2": (0.84, 15.0, 15.1),
}


@pytest.fixture
def vendor() -> Path:
    """A sound quadruped in the working directory."""
    return written(quadruped())


def by_pinocchio(path: Path, joints: list[str], q: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """M(q) and g(q) of a URDF's own base held still, other joints at zero."""
    model = pinocchio.buildModelFromUrdf(str(path))
    data = model.createData()
    model.armature[:] = 0.0
    angles = pinocchio.neutral(model)
    dofs = []
    for name, angle in zip(joints, q, strict=True):
        one = model.joints[model.getJointId(name)]
        dofs.append(one.idx_v)
        if one.nq == 2:  # a continuous joint is a point on the circle
            angles[one.idx_q : one.idx_q + 2] = math.cos(angle), math.sin(angle)
        else:
            angles[one.idx_q] = angle
    pinocchio.crba(model, data, angles)
    full = np.triu(data.M) + np.triu(data.M, 1).T
    gravity = pinocchio.computeGeneralizedGravity(model, data, angles)
    return full[np.ix_(dofs, dofs)], gravity[dofs]


def agrees_with_pinocchio(path: Path) -> None:
    description = describe(path)
    names = list(compare_twin(path, poses=2).joints)
    machine = Machine(vendor_model(description, names), names, 1, np.eye(3))
    for q in np.random.default_rng(1).uniform(-1.2, 1.2, (5, len(names))):
        ours, theirs = machine.inertia_and_gravity(q), by_pinocchio(path, names, q)
        for a, b in zip(ours, theirs, strict=True):
            assert np.abs(a - b).max() < 1e-8 * max(np.abs(b).max(), 1.0)


def test_pinocchio_finds_the_same_dynamics(vendor: Path) -> None:
    agrees_with_pinocchio(vendor)


@SHARED
@pytest.mark.parametrize("name", TWINS)
def test_pinocchio_finds_the_same_dynamics_of_real_robots(name: str) -> None:
    agrees_with_pinocchio(ROBOTS / "twins" / TWINS[name][0])


@SHARED
@pytest.mark.parametrize("name", ["go2", "g1"])
def test_pinocchio_finds_the_same_dynamics_of_the_twin(name: str) -> None:
    """Draft's own model with a body other than its trunk held still."""
    found = compare_twin(ROBOTS / "twins" / TWINS[name][0], poses=2)
    model = found.model.mujoco
    own = list(found.joints.values())
    base = found.files.reduced.description.root
    body = next((b for b in range(model.nbody) if model.body(b).name == base), 1)
    machine = Machine(model, own, body, np.eye(3))
    free = pinocchio.buildModelFromMJCF(str(written(found.model.xml, "twin.xml")))
    free.inertias[1] = trunk_inertia(model)
    data = free.createData()
    free.armature[:] = 0.0
    for q in np.random.default_rng(2).uniform(-0.8, 0.8, (3, len(own))):
        inertia, gravity = machine.inertia_and_gravity(q)
        angles = pinocchio.neutral(free)
        for joint_name, angle in zip(own, q, strict=True):
            angles[free.joints[free.getJointId(joint_name)].idx_q] = angle
        dofs = [free.joints[free.getJointId(n)].idx_v for n in own]
        frame = free.getFrameId(model.body(body).name)
        pinocchio.computeAllTerms(free, data, angles, np.zeros(free.nv))
        pinocchio.updateFramePlacements(free, data)
        held = pinocchio.getFrameJacobian(free, data, frame, pinocchio.LOCAL)
        moves = np.zeros((free.nv, len(own)))
        moves[dofs, np.arange(len(own))] = 1.0
        moves[:6] = -np.linalg.solve(held[:, :6], held[:, dofs])
        full = np.triu(data.M) + np.triu(data.M, 1).T
        assert moves.T @ full @ moves == pytest.approx(inertia, abs=1e-8)
        free.gravity.linear = machine.model.opt.gravity
        bias = pinocchio.computeGeneralizedGravity(free, data, angles)
        assert moves.T @ bias == pytest.approx(gravity, abs=1e-8)


def trunk_inertia(model: mujoco.MjModel):
    """Inertia of the trunk and all that is welded to it; Pinocchio reads no inline meshes."""
    data = mujoco.MjData(model)
    data.qpos[:3] = 0.0
    mujoco.mj_kinematics(model, data)
    total = pinocchio.Inertia.Zero()
    for i in np.flatnonzero(model.body_weldid == 1):
        turn = data.ximat[i].reshape(3, 3)
        inertia = turn @ np.diag(model.body_inertia[i]) @ turn.T
        total += pinocchio.Inertia(model.body_mass[i], data.xipos[i], inertia)
    return total


@SHARED
@pytest.mark.parametrize("name", TWINS)
def test_the_calibrated_trunk_is_no_worse_for_the_inertia_of_the_four_twins(name: str) -> None:
    file, ours, of_ours, _ = TWINS[name]
    ratio, inertia, gravity = PUBLISHED[name]
    path = ROBOTS / "twins" / file
    spec = import_robot(path, "twin").spec
    assert spec.structure == "calibrated"
    found = compare_twin(path, replace(spec, structure="paper"))
    assert found.mass_ratio == pytest.approx(ratio, abs=0.006)
    assert found.inertia.median == pytest.approx(inertia, abs=0.06)
    assert found.gravity.median == pytest.approx(gravity, abs=0.06)
    # 0.1 is a digit of the table.
    assert of_ours < found.inertia.median + 0.1
    assert abs(math.log(ours)) < abs(math.log(found.mass_ratio)) + 0.006


@SHARED
@pytest.mark.parametrize("name", TWINS)
def test_the_errors_of_the_four_twins_are_as_told(name: str) -> None:
    file, ratio, inertia, gravity = TWINS[name]
    found = compare_twin(ROBOTS / "twins" / file)
    assert found.mass_ratio == pytest.approx(ratio, abs=0.001)
    assert found.inertia.median == pytest.approx(inertia, abs=0.06)
    assert found.gravity.median == pytest.approx(gravity, abs=0.06)
    assert max(math.degrees(pair.axis_gap) for pair in found.links) < 0.1
    assert max(pair.anchor_gap for pair in found.links) < 1e-4
    assert found.stance[1] == pytest.approx(found.stance[0], abs=0.005)
    assert sum(pair.vendor.mass for pair in found.links) == pytest.approx(found.vendor_mass)
    assert sum(pair.twin.mass for pair in found.links) == pytest.approx(found.design.mass)


@SHARED
def test_a_vendors_mjcf_gives_mujocos_own_dynamics() -> None:
    path = ROBOTS / "twins" / "go2" / "go2.xml"
    found = compare_twin(path, poses=2)
    names = list(found.joints)
    ours = Machine(found.vendor, names, 1, np.eye(3))
    theirs = Machine(mujoco.MjModel.from_xml_path(str(path)), names, 1, np.eye(3))
    for q in np.random.default_rng(3).uniform(-1, 1, (3, len(names))):
        for a, b in zip(ours.inertia_and_gravity(q), theirs.inertia_and_gravity(q), strict=True):
            assert a == pytest.approx(b, abs=1e-8)


def test_a_robot_is_its_own_perfect_twin(vendor: Path) -> None:
    found = compare_twin(vendor, poses=20)
    again = Machine(found.vendor, list(found.joints), 1, np.eye(3))
    for q in np.random.default_rng(0).uniform(-1, 1, (3, 12)):
        inertia, gravity = again.inertia_and_gravity(q)
        assert np.linalg.eigvalsh(inertia).min() > 0
        assert inertia == pytest.approx(inertia.T)
        assert np.isfinite(gravity).all()


def test_gravity_is_the_slope_of_the_potential(vendor: Path) -> None:
    """g(q) = dV/dq by central differences of MuJoCo's own energy, the trunk held still."""
    found = compare_twin(vendor, poses=2)
    machine = Machine(found.model.mujoco, list(found.joints.values()), 1, np.eye(3))
    q = np.random.default_rng(4).uniform(-0.5, 0.5, 12)
    _, gravity = machine.inertia_and_gravity(q)

    def potential(angles: np.ndarray) -> float:
        machine.pose(angles)
        mujoco.mj_comPos(machine.model, machine.data)
        mujoco.mj_energyPos(machine.model, machine.data)
        return float(machine.data.energy[0])

    step = 1e-5
    slopes = [(potential(q + step * e) - potential(q - step * e)) / (2 * step) for e in np.eye(12)]
    assert gravity == pytest.approx(slopes, abs=1e-6)


def test_an_edited_twin_is_compared_by_its_joints(vendor: Path) -> None:
    import_robot(vendor, Path("mine"))
    edit(
        Path("mine"), "parameters.yaml", "thigh_length: {value: 0.22", "thigh_length: {value: 0.33"
    )
    same, changed = compare_twin(vendor, poses=10), compare_twin(vendor, Path("mine"), poses=10)
    assert changed.design.mass > same.design.mass
    gaps = {pair.joint: pair.anchor_gap for pair in changed.links}
    assert gaps["FL_knee"] == pytest.approx(0.11, abs=1e-9)
    assert gaps["FL_pitch"] == pytest.approx(0.0, abs=1e-9)


def renamed(old: str, new: str) -> None:
    """Rename a joint of the imported twin."""
    tree = Path("mine/tree.yaml")
    tree.write_text(tree.read_text(encoding="utf-8").replace(old, new), encoding="utf-8")


def test_a_spec_of_another_robot_is_refused(vendor: Path) -> None:
    with pytest.raises(DraftError, match="the spec 'hopper' has none of the joints of beast"):
        compare_twin(vendor, "hopper")


@SHARED
@pytest.mark.parametrize("name", ["waist_yaw_joint", "waist_roll_joint", "waist_pitch_joint"])
def test_a_spec_that_lacks_a_joint_below_the_trunk_is_refused(name: str) -> None:
    path = ROBOTS / "twins" / "g1" / "g1_29dof_rev_1_0.urdf"
    import_robot(path, "mine")
    renamed(name, "twist")
    with pytest.raises(DraftError, match=f"lacks '{name}', which lies between"):
        compare_twin(path, "mine")


def test_a_joint_that_the_spec_lacks_is_told_and_left_out(vendor: Path) -> None:
    import_robot(vendor, Path("mine"))
    renamed("_knee", "_bend")
    renamed("name: knee", "name: bend")
    found = compare_twin(vendor, "mine", poses=3)
    assert found.unmatched == tuple(f"{leg}_knee" for leg in LEGS)
    assert len(found.joints) == 8


def test_a_body_without_a_mass_is_named() -> None:
    bare = quadruped().replace(link("FL_thigh"), '<link name="FL_thigh"></link>')
    found = compare_twin(written(bare), poses=3)
    assert notes(found.files, "states no mass for 1 link, 'FL_thigh'")


def test_a_slide_stays_still_while_hinges_are_compared() -> None:
    slides = quadruped().replace(
        'name="FL_pitch" type="revolute"', 'name="FL_pitch" type="prismatic"'
    )
    slides = slides.replace('lower="-1" upper="1.5"', 'lower="-0.1" upper="0.1"')
    found = compare_twin(written(slides), poses=3)
    assert "FL_pitch" in found.joints
    assert np.isfinite(found.inertia.values).all()


def test_a_robot_without_masses_is_refused() -> None:
    with pytest.raises(DraftError, match=r"light.urdf gives no masses"):
        compare_twin(written(quadruped(factor=0.0), "light.urdf"))


def test_a_held_part_counts_where_it_hangs(vendor: Path) -> None:
    more = link("tail", 2.0) + joint("wag", "body", "tail", (-0.3, 0, 0), limit='effort="0"')
    before = compare_twin(vendor, poses=2)
    after = compare_twin(written(quadruped(more)), poses=2)
    assert after.vendor_mass == pytest.approx(before.vendor_mass + 2.0)
    assert after.links[0].vendor.mass == pytest.approx(before.links[0].vendor.mass + 2.0)


def test_errors_are_the_same_for_the_same_seed(vendor: Path) -> None:
    one, same, other = (compare_twin(vendor, poses=15, seed=seed) for seed in (3, 3, 4))
    assert one.inertia.values.tolist() == same.inertia.values.tolist()
    assert one.inertia.values.tolist() != other.inertia.values.tolist()


def test_the_summary_of_errors_is_plain_statistics() -> None:
    errors = Errors(np.array([1.0, 2.0, 3.0, 4.0]))
    assert (errors.median, errors.variance) == (2.5, pytest.approx(5 / 3))
    assert errors.quantile(0.0) == 1.0


def test_the_record_is_plain_json_with_residuals(vendor: Path) -> None:
    table = json.loads(json.dumps(record(compare_twin(vendor, poses=5)), allow_nan=False))
    assert table["mass_kg"]["vendor"] == pytest.approx(20.0)
    assert set(table["residuals"]) == {"trunk", "hip_link", "thigh", "shank"}
    thigh = table["residuals"]["thigh"]
    assert thigh["bodies"] == 4
    twin = sum(one["twin"]["mass_kg"] for one in table["links"] if one["group"] == "thigh")
    assert thigh["mass"] == pytest.approx(4.0 / twin, rel=1e-5)
    assert abs(thigh["com_shift"][1]) > 0.01  # outboard, the same on both sides


def test_the_command_prints_and_writes(vendor: Path) -> None:
    out = printed("twin", vendor, "--poses", "5")
    assert "thigh" in out
    assert "M(q): median error" in out
    assert json.loads(printed("twin", vendor, "--poses", "5", "--json"))["poses"] == 5


BAD = {
    "nothing": ("", "no robot is named"),
    "both": ("beast.urdf --all .", "both FILE and --all are given"),
    "no file": ("none.urdf", "none.urdf: file not found"),
    "one pose": ("beast.urdf --poses 1", "--poses 1 is not from 2 to 100000"),
    "seed": ("beast.urdf --seed -1", "--seed -1 is below 0"),
    "robot": ("beast.urdf --without gg1", "there is no robot 'gg1' to hold out"),
    "spec": ("beast.urdf --spec none", "none"),
    "folder": ("--all empty", "no descriptions here"),
    "workers": ("--all . --workers 0", "--workers 0 is below 1"),
    "alone": ("beast.urdf --workers 2", "--workers cannot be combined with one FILE"),
    "mixed": ("--all . --spec mine", "--spec cannot be combined with --all"),
}


@pytest.mark.parametrize("name", BAD)
def test_what_cannot_be_compared_is_named(vendor: Path, name: str) -> None:
    Path("empty").mkdir()
    arguments, words = BAD[name]
    assert words in refusal("twin", *arguments.split())


@pytest.mark.slow
def test_all_twins_of_a_folder_make_one_table() -> None:
    Path("robots").mkdir()
    for name, factor in (("one", 1.0), ("two", 2.0)):
        written(quadruped(factor=factor), f"robots/{name}.urdf")
    written("<robot", "robots/bad.urdf")
    every = ("twin", "--all", "robots", "--workers", "2", "--poses", "5", "--json")
    table = json.loads(printed(*every, code=1, progress=True))
    assert [row["robot"] for row in table["robots"]] == ["one", "two"]
    assert table["robots"][0]["ratio"] == pytest.approx(2 * table["robots"][1]["ratio"], rel=1e-5)
    assert table["refused"][0]["robot"] == "bad"
    assert "bad.urdf:1" in table["refused"][0]["cause"]


def test_scores_are_geometric() -> None:
    rows = [
        Row(name, "quadruped", True, 10.0, mass, 8.0, 12.0, 1.0, 1.0, 12)
        for name, mass in (("a", 20.0), ("b", 5.0), ("c", 10.0))
    ]
    total = score(rows)
    assert (total.n, total.covered) == (3, 1.0)
    assert total.fold == pytest.approx(2 ** (2 / 3))
    assert total.bias == pytest.approx(0.0)
    assert table_csv(rows).splitlines()[1].startswith("a,quadruped,true,10,20,8,12,")
