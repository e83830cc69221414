"""Inertia errors in mjlab: every world's model, alone and with all else that is drawn."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

pytest.importorskip("mjlab")
import mujoco
import torch

from draft.errors import DraftError
from draft.learn.bodies import inertia
from draft.learn.measuring.evaluation_options import Options
from draft.learn.measuring.levels import skill_tests
from draft.learn.measuring.results import make_request
from draft.learn.measuring.rollout.trial import trial
from draft.learn.task.mdp import events
from draft.learn.training.run import create
from tests.learn.conftest import WORLDS
from tests.learn.small import plan
from tests.learn.task.states import place, roots

FIELDS = ("body_mass", "body_inertia", "body_ipos", "body_iquat", "body_subtreemass")


def built(members: Any, source: str = "survey", worlds: int = WORLDS, **task: Any) -> Any:
    """An environment on a plane whose robots have inertia errors."""
    from mjlab.envs import ManagerBasedRlEnv

    from draft.learn.task.mdp.environment import environment
    from draft.learn.task.world.task import Task

    cfg = environment(Task(members=members, ground="flat", **task), worlds)
    terms = dict(cfg.events)
    designs = {"designs": terms.pop("designs")} if "designs" in terms else {}
    cfg.events = designs | events.inertia_errors(members, source) | terms
    env = ManagerBasedRlEnv(cfg, "cpu")
    env.reset()
    return env


@pytest.fixture(scope="module")
def family(members: Any) -> Any:
    """All three designs with inertia errors."""
    return built(members)


@pytest.fixture(scope="module")
def alone(members: Any) -> Any:
    """One design with inertia errors."""
    return built(members[:1], worlds=4)


def numbers(env: Any, name: str) -> torch.Tensor:
    """A field of the robot's bodies, shape (worlds, bodies, ...), in the order of Links."""
    robot = env.scene["robot"]
    names = [body.name for body in robot.spec.bodies[1:]]
    ids = [env.sim.mj_model.body(f"robot/{name.removeprefix('robot/')}").id for name in names]
    return getattr(env.sim.model, name)[:, ids].double()


def dense(model: Any, entries: Any) -> Any:
    """A mass matrix from its entries as MuJoCo stores them."""
    full = np.zeros((model.nv, model.nv))
    places = (model.M_rownnz, model.M_rowadr, model.M_colind)
    mujoco.mju_sym2dense(full, np.asarray(entries, dtype=float), *places)
    return full


def expected(members: Any, worlds: int, source: str = "survey", seed: int = 0) -> Any:
    """What the seed's draw does."""
    rng = np.random.default_rng((events.STREAM, seed))
    drawn = inertia.draw(inertia.extents(source), worlds, rng)
    member = np.arange(worlds) % len(members)
    change = inertia.change(inertia.links(members), member, drawn)
    return [torch.from_numpy(values) for values in change]


def test_every_world_of_a_family_has_its_designs_numbers_times_its_own_errors(
    family: Any, flat: Any, members: Any
) -> None:
    ratio, factor, shift = expected(members, WORLDS)
    mass, moments, centre, axes, _ = (
        (numbers(flat, name), numbers(family, name)) for name in FIELDS
    )
    close = torch.testing.assert_close
    close(mass[1], mass[0] * ratio, rtol=1e-6, atol=0)
    close(moments[1], moments[0] * factor[..., None], rtol=1e-6, atol=0)
    # Centres of mass have the shift that training draws too, and the same one.
    close(centre[1], centre[0] + shift, rtol=0, atol=1e-6)
    close(axes[1], axes[0].expand_as(axes[1]), rtol=0, atol=0)
    assert len(ratio[:, 0].unique()) == WORLDS


def test_errors_and_the_trunks_own_shift_add_up(family: Any, members: Any) -> None:
    trunk = numbers(family, "body_ipos")[:, 0]
    models = [mujoco.MjModel.from_xml_string(one.xml) for one in members]
    nominal = torch.tensor(np.array([model.body_ipos[1] for model in models]))
    errors = expected(members, WORLDS)[2][:, 0]
    left = trunk - nominal[family.scene["robot"].member] - errors
    share = left / (0.02 * roots(family)[:, None] ** 2)
    assert share.abs().max() < 1 + 1e-4
    assert share.abs().max() > 0.8
    assert errors.abs().max() > 0.01


def test_subtree_masses_and_total_mass_follow(family: Any) -> None:
    total = numbers(family, "body_mass").sum(1)
    torch.testing.assert_close(numbers(family, "body_subtreemass")[:, 0], total, rtol=1e-6, atol=0)
    nominal = torch.tensor([one.mass for one in family.scene["robot"].cfg.members])
    ratio = total / nominal[family.scene["robot"].member]
    assert ratio.max() - ratio.min() > 0.1


def test_a_model_compiled_from_the_perturbed_inertials_moves_alike(
    family: Any, members: Any
) -> None:
    joints = torch.linspace(-0.5, 0.5, 12)
    place(family, (0.0, 0.0, 3.0), joints=joints.expand(WORLDS, 12))
    found = family.sim.data.M.numpy()
    mass, moments, centre, axes, _ = (numbers(family, name).numpy() for name in FIELDS)
    for world, member in enumerate([*members] * 4):
        spec = mujoco.MjSpec.from_string(member.xml)
        for i, body in enumerate(spec.bodies[1:]):
            body.explicitinertial = True
            body.mass, body.inertia = mass[world, i], moments[world, i]
            body.ipos, body.iquat = centre[world, i], axes[world if len(axes) > 1 else 0, i]
        model = spec.compile()
        data = mujoco.MjData(model)
        data.qpos[:3], data.qpos[7:] = (0.0, 0.0, 3.0), joints
        mujoco.mj_forward(model, data)
        full = dense(model, data.M)
        ours = dense(family.sim.mj_model, found[world])
        scale = np.sqrt(np.outer(np.diag(full), np.diag(full)))
        assert np.abs((ours - full) / scale).max() < 1e-5


def test_one_design_has_other_errors_in_every_world_and_equal_ones_for_equal_seeds(
    alone: Any, members: Any
) -> None:
    mass = numbers(alone, "body_mass")
    nominal = mujoco.MjModel.from_xml_string(members[0].xml).body_mass[1:]
    ratio = expected(members[:1], 4)[0]
    torch.testing.assert_close(mass, torch.tensor(nominal) * ratio, rtol=1e-6, atol=0)
    assert len(mass[:, 0].unique()) == 4
    torch.testing.assert_close(numbers(built(members[:1], worlds=4), "body_mass"), mass)
    other = numbers(built(members[:1], worlds=4, seed=1), "body_mass")
    assert not torch.isclose(other, mass).any()


def test_errors_are_drawn_once_and_survive_a_reset(alone: Any) -> None:
    before = [numbers(alone, name).clone() for name in FIELDS]
    alone.reset()
    alone.step(torch.zeros(4, 12))
    for name, values in zip(FIELDS, before, strict=True):
        torch.testing.assert_close(numbers(alone, name), values, rtol=0, atol=0)


def test_mjlabs_own_randomisation_starts_from_them(alone: Any) -> None:
    from mjlab.envs.mdp import dr
    from mjlab.managers.scene_entity_config import SceneEntityCfg

    centres = alone.sim.model.body_ipos
    before = centres.clone()
    legs: Any = SceneEntityCfg("robot", body_names=("F.*", "R.*"))
    legs.resolve(alone.scene)
    dr.body_com_offset(alone, None, ranges=(0.25, 0.25), operation="add", asset_cfg=legs)
    assert len(legs.body_ids) == 20
    ids = [alone.sim.mj_model.body(f"robot/{name}").id for name in legs.body_names]
    torch.testing.assert_close(centres[:, ids], before[:, ids] + 0.25)
    centres[:] = before


def test_an_unknown_source_is_refused_before_anything_is_built(members: Any) -> None:
    with pytest.raises(DraftError):
        events.inertia_errors(members, "none")


@pytest.mark.parametrize("source", [*inertia.SOURCES, None])
def test_an_evaluation_draws_the_requested_errors(
    tmp_path: Path, source: inertia.ErrorSource | None
) -> None:
    run = create(tmp_path / "run", plan(), {})
    (run.folder / "model_1.pt").write_bytes(b"weights")
    walk = skill_tests(("walk",))
    what = make_request(run, walk, Options(replicas=2, seconds=1.0, errors=source))
    ranges = [event.params["ranges"] for event in trial(run, walk, what).extra.values()]
    assert ranges == ([] if source is None else [inertia.extents(source)])
    assert (ranges == [inertia.PAPER]) == (source == "paper")
