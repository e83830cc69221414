"""A real robot with its maker's masses, and with predicted ones."""

# pyright: reportAttributeAccessIssue=false
# (MuJoCo's compiled modules carry no types.)
from __future__ import annotations

import mujoco
import numpy as np
import pytest

pytest.importorskip("mjlab", reason="arms are rolled out, and the text is that of its MuJoCo")

from draft.learn.bodies.legged import LeggedRobot
from draft.twins.compare import Comparison, compare_twin
from draft.validation.arms import ALL, CENTRE, INERTIA, MASS, by_maker, predicted
from draft.values import Array
from tests.twins.test_vendors import ROBOTS

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(not ROBOTS.is_dir(), reason="the robots are not beside this folder"),
]


@pytest.fixture(scope="module", params=["unitree_go2", "anymal_c"])
def found(request: pytest.FixtureRequest) -> Comparison:
    key = request.param
    return compare_twin(ROBOTS / f"survey/{key}.urdf", poses=2, without=(key,), key=key)


def mass_matrix(model: mujoco.MjModel, angles: Array, joints: list[str]) -> Array:
    """Entries of M(q) of some joints, without rotors, trunk upright at the origin."""
    data = mujoco.MjData(model)
    data.qpos[3] = 1.0
    for name, angle in zip(joints, angles, strict=True):
        data.qpos[model.joint(name).qposadr[0]] = angle
    mujoco.mj_forward(model, data)
    full = np.zeros((model.nv, model.nv))
    mujoco.mj_fullM(model, data, full)
    at = [model.joint(name).dofadr[0] for name in joints]
    return full[np.ix_(at, at)] - np.diag(model.dof_armature[at])


def compiled(member: LeggedRobot) -> mujoco.MjModel:
    return mujoco.MjModel.from_xml_string(member.xml)


def test_with_the_makers_masses_it_moves_like_the_makers_model(found: Comparison) -> None:
    """Draft's model of a vendor's file is made by other code, of which M(q) is compared."""
    member, names = by_maker(found), dict(found.joints)
    rng = np.random.default_rng(0)
    for _ in range(5):
        angles = rng.uniform(-0.6, 0.6, len(names))
        ours = mass_matrix(compiled(member), angles, list(names.values()))
        theirs = mass_matrix(found.vendor, angles, list(names))
        # MuJoCo's text has six digits.
        np.testing.assert_allclose(ours, theirs, atol=2e-5 * np.abs(theirs).max())
    assert member.mass == pytest.approx(found.vendor_mass, rel=1e-6)


def test_nothing_of_the_makers_is_the_prediction(found: Comparison) -> None:
    names = list(found.joints.values())
    angles = np.linspace(-0.5, 0.5, len(names))
    own = mass_matrix(compiled(predicted(found)), angles, names)
    for same in (by_maker(found, what=()), by_maker(found, groups=())):
        np.testing.assert_allclose(
            mass_matrix(compiled(same), angles, names), own, atol=2e-5 * np.abs(own).max()
        )


@pytest.mark.parametrize("what", [*((one,) for one in ALL), ALL])
def test_each_part_is_taken_alone(found: Comparison, what: tuple[str, ...]) -> None:
    trunk = found.design.bodies[0].name
    # Without any of the maker's, so that what is welded to the trunk is part of it on both sides.
    theirs, ours = compiled(by_maker(found)), compiled(by_maker(found, what=()))
    mixed = compiled(by_maker(found, what=what))
    body = [model.body(trunk).id for model in (theirs, ours, mixed)]
    mass = [model.body_mass[i] for model, i in zip((theirs, ours, mixed), body, strict=True)]
    assert mass[2] == pytest.approx(mass[0] if MASS in what else mass[1], rel=1e-5)
    if CENTRE in what:
        np.testing.assert_allclose(mixed.body_ipos[body[2]], theirs.body_ipos[body[0]], atol=1e-5)
    source = theirs if INERTIA in what else ours
    own = body[0] if INERTIA in what else body[1]
    share = mass[2] / source.body_mass[own]
    np.testing.assert_allclose(
        mixed.body_inertia[body[2]], source.body_inertia[own] * share, rtol=1e-3
    )
