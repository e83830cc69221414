"""Families of more bodies than worlds: every body takes its turn, badly tracked ones more often."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

torch = pytest.importorskip("torch")
pytest.importorskip("mjlab")

from dataclasses import replace  # noqa: E402

from hypothesis import given  # noqa: E402
from hypothesis import strategies as st  # noqa: E402

from draft.errors import DraftError  # noqa: E402
from draft.learn.bodies.designs import open_bodies  # noqa: E402
from draft.learn.engine.machine import obstacle  # noqa: E402
from draft.learn.engine.worlds.turns import EVEN, Bodies, cells  # noqa: E402
from draft.learn.task.mdp.commands import command_term  # noqa: E402
from draft.learn.training import session  # noqa: E402
from draft.learn.training.ppo.trainer import Trainer  # noqa: E402
from draft.learn.training.progress import BODIES_ERROR, BODIES_WORST  # noqa: E402
from draft.learn.training.run import Plan, open_run  # noqa: E402
from tests.learn.runs import begin, same, train, weights  # noqa: E402
from tests.learn.small import plan  # noqa: E402

pytestmark = pytest.mark.skipif(obstacle() is not None, reason="needs mjbatch")
VARY = ("thigh_length=0.2:0.3", "actuators.leg.peak_torque=40:80")
MANY = 12


@pytest.fixture(scope="module")
def family() -> Plan:
    """A plan of twelve bodies in four worlds."""
    members = open_bodies(["cheetah"], VARY, MANY).members
    return replace(plan(), members=members, see_design=True)


def run(folder: Path, of: Plan, *slices: int) -> Trainer:
    return train(begin(folder, of), *slices)


@pytest.fixture(scope="module")
def first(tmp_path_factory: pytest.TempPathFactory, family: Plan) -> Trainer:
    """The family's trainer after one iteration, in the folder `family`."""
    return run(tmp_path_factory.mktemp("turns") / "family", family, 1)


def bodies(trainer: Trainer) -> Bodies:
    (found,) = trainer._worlds._bodies
    assert found is not None
    return found


@given(st.integers(1, 60), st.integers(1, 5), st.integers(0, 99))
def test_cells_have_the_same_size_and_every_body_has_one(
    count: int, features: int, seed: int
) -> None:
    found = cells(np.random.default_rng(seed).normal(size=(count, features)), 16)
    sizes = np.bincount(found)
    assert len(found) == count
    assert len(sizes) in (1, 2, 4, 8, 16)
    assert len(sizes) <= count
    assert sizes.max() - sizes.min() <= max(1, len(sizes).bit_length() - 1)


def test_similar_bodies_share_a_cell() -> None:
    ends = np.array([[0.0, 5.0], [100.0, 5.0]])
    features = np.repeat(ends, 8, axis=0) + np.random.default_rng(0).normal(size=(16, 2))
    found = cells(features, 2)
    assert len(set(found[:8])) == len(set(found[8:])) == 1
    assert found[0] != found[8]


def test_every_world_is_given_the_body_that_is_recorded(family: Plan, first: Trainer) -> None:
    member = bodies(first).member
    robot: Any = first.env.scene["robot"]
    torque = [family.members[i].peak_torque[0] for i in member]
    assert robot.peak_torque[:, 0].numpy() == pytest.approx(torque)
    assert len(set(member)) > 1
    # Speeds that grow do so for each cell on its own.
    term = command_term(first.env)
    assert term.group.tolist() == bodies(first).cell[member].tolist()
    assert len(term.grown) == len(bodies(first).error)


def test_a_run_in_slices_has_the_bodies_of_one_in_one_go(family: Plan, tmp_path: Path) -> None:
    whole = run(tmp_path / "whole", family, 3)
    sliced = run(tmp_path / "sliced", family, 1, 3)
    assert (bodies(whole).member == bodies(sliced).member).all()
    assert bodies(whole).error == pytest.approx(bodies(sliced).error, rel=0, abs=0)
    assert torch.equal(whole.env.sim.state, sliced.env.sim.state)  # type: ignore[attr-defined]
    assert same(weights(whole), weights(sliced))


def test_worlds_take_turns_and_the_worst_cell_is_in_the_log(family: Plan, tmp_path: Path) -> None:
    trainer = run(tmp_path / "run", family, 2)
    before = bodies(trainer).member.copy()
    turned = [bodies(trainer).turn(iteration).tolist() for iteration in range(40, 80)]
    assert sorted(world for worlds in turned for world in worlds) == list(
        range(family.environments)
    )
    assert (bodies(trainer).member != before).any()
    header, *rows = (tmp_path / "run/progress.csv").read_text(encoding="utf-8").splitlines()
    row = dict(zip(header.split(","), map(float, rows[-1].split(",")), strict=True))
    assert row[BODIES_WORST] >= row[BODIES_ERROR] > 0


def test_badly_tracked_cells_are_drawn_more_often(
    first: Trainer, monkeypatch: pytest.MonkeyPatch
) -> None:
    one = bodies(first)
    error = np.ones(len(one.error))
    error[0] = 9.0
    monkeypatch.setattr(one, "error", error)
    drawn = one.draw(20_000, 7)
    share = np.mean(one.cell[drawn] == 0)
    expected = EVEN / len(error) + (1 - EVEN) * 9.0 / error.sum()
    assert share == pytest.approx(expected, abs=0.02)
    assert set(drawn) == set(range(MANY))


def test_a_family_of_no_more_bodies_than_worlds_keeps_them(family: Plan, tmp_path: Path) -> None:
    few = replace(family, members=family.members[: family.environments])
    assert Trainer(begin(tmp_path / "run", few), "cpu", engine="native")._worlds._bodies == [None]


def another() -> tuple[Plan, dict[str, str]]:
    """A plan of stage velocity for a body that no family has, and its design."""
    (one,) = open_bodies(["cheetah"], values={"thigh_length": 0.31}).members
    return replace(plan(stage="velocity"), members=(one,)), {one.name: "values: {}\n"}


def test_a_policy_that_sees_its_design_continues_with_another_body(
    first: Trainer, tmp_path: Path
) -> None:
    """`draft train DESIGN --from FAMILY`: the policy keeps observing the design."""
    alone, design = another()
    made = session.begin(tmp_path / "one", alone, design, first._run.folder)
    assert made.plan.see_design
    trainer = Trainer(made, "cpu", engine="native")
    taken, given = (t.runner.alg.actor.state_dict() for t in (trainer, first))
    assert all(torch.equal(taken[name], given[name]) for name in given if "std" not in name)
    assert trainer.train(1)
    again = session.begin(tmp_path / "one", alone, design, None)
    assert again.plan == open_run(tmp_path / "one").plan


def test_a_policy_that_does_not_see_its_design_continues_with_its_own_body_only(
    tmp_path: Path,
) -> None:
    run(tmp_path / "blind", plan(), 1)
    with pytest.raises(DraftError, match="one that was trained with `see_design`"):
        session.begin(tmp_path / "one", *another(), tmp_path / "blind")
