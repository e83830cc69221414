"""Policies with other inputs: a history, and no velocity of the trunk."""

from __future__ import annotations

import re
from collections.abc import Sequence

import numpy as np
import pytest

from draft.errors import DraftError
from draft.learn.policy.policy import CLIMBING_FAMILY, FAMILY, FOLDER, Policy, open_policy
from draft.learn.policy.sensed import with_inputs

STEPS, ROWS = 5, 20
MEASURED = ("base_ang_vel", "projected_gravity", "joint_pos", "joint_vel", "actions")
Terms = list[tuple[str, int]]


def sensors(policy: Policy) -> tuple[Terms, list[int]]:
    """Terms of a machine, which has no velocimeter, and their numbers of steps."""
    rest = [term for term in policy.terms if term[0] != "base_lin_vel"]
    past = [STEPS if name in MEASURED else 1 for name, _ in rest]
    return [(name, length * n) for (name, length), n in zip(rest, past, strict=True)], past


def joined(values: dict[str, np.ndarray], names: Sequence[str]) -> np.ndarray:
    return np.concatenate([values[name] for name in names], axis=1)


@pytest.fixture(params=[FAMILY, CLIMBING_FAMILY, FOLDER / "cheetah-run.onnx"], ids=lambda f: f.stem)
def policy(request: pytest.FixtureRequest) -> Policy:
    return open_policy(request.param)


def test_it_acts_as_before_while_the_trunk_moves_as_commanded(policy: Policy) -> None:
    random = np.random.default_rng(0)
    terms, past = sensors(policy)
    seen = {name: random.normal(size=(ROWS, length)) for name, length in policy.terms}
    seen["base_lin_vel"] = np.c_[seen["command"][:, :2], np.zeros(ROWS)]
    old = joined(seen, [name for name, _ in policy.terms])
    for (name, length), steps in zip(terms, past, strict=True):
        # What was before the present one has no influence.
        before = random.normal(size=(ROWS, length * (steps - 1) // steps))
        seen[name] = np.concatenate([before, seen[name]], axis=1)
    found = with_inputs(policy, terms, past)
    assert found.terms == tuple(terms)
    assert found.history == tuple(past)
    new = joined(seen, [name for name, _ in terms])
    np.testing.assert_allclose(found(new), policy(old), atol=2e-5)


def test_a_history_alone_leaves_the_velocity(policy: Policy) -> None:
    random = np.random.default_rng(1)
    past = [3 if name == "joint_vel" else 1 for name, _ in policy.terms]
    terms = [(name, n * steps) for (name, n), steps in zip(policy.terms, past, strict=True)]
    seen = {name: random.normal(size=(ROWS, length)) for name, length in policy.terms}
    old = joined(seen, [name for name, _ in policy.terms])
    seen["joint_vel"] = np.c_[random.normal(size=(ROWS, 24)), seen["joint_vel"]]
    new = joined(seen, [name for name, _ in terms])
    np.testing.assert_allclose(with_inputs(policy, terms, past)(new), policy(old), atol=2e-5)


@pytest.mark.parametrize(
    ("left_out", "added", "message"),
    [
        ((), [("wind", 3)], "observes base_lin_vel 3, .*, and this training wind 3"),
        ((), [("joint_vel", 12)], "and this training joint_vel 12"),
        (("base_ang_vel",), [], "base_lin_vel, base_ang_vel, and this training does not"),
        (("command",), [], "base_lin_vel, command, and this training does not"),
    ],
)
def test_what_a_policy_does_not_know_is_refused(
    left_out: Sequence[str], added: Terms, message: str
) -> None:
    policy = open_policy(FAMILY)
    known = zip(*sensors(policy), strict=True)
    rows = [row for row in known if row[0][0] not in left_out] + [(one, 2) for one in added]
    with pytest.raises(DraftError, match=message):
        with_inputs(policy, *map(list, zip(*rows, strict=True)))


def test_a_history_does_not_become_another_one() -> None:
    terms, past = sensors(open_policy(FAMILY))
    remembers = with_inputs(open_policy(FAMILY), terms, past)
    with pytest.raises(DraftError, match=re.escape("no past")):
        with_inputs(remembers, terms, past)
