"""Evaluation in mjlab: all levels of the skill tests that share a ground, in one simulation."""

from __future__ import annotations

import contextlib
import io
import re
from collections.abc import Callable, Iterator, Sequence
from functools import partial

import numpy as np
import torch
from mjlab.envs import ManagerBasedRlEnv
from rsl_rl.models import MLPModel
from tensordict import TensorDict

from draft.errors import DraftError
from draft.learn.engine.machine import WARP
from draft.learn.measuring.levels import SkillTest
from draft.learn.measuring.rollout.common_draws import CommonDraws
from draft.learn.measuring.rollout.measure import Measures, each_step
from draft.learn.measuring.rollout.trial import Trial, layout
from draft.learn.measuring.rollout.trial_env import build
from draft.learn.measuring.rollout.trimmed import Trimmed
from draft.learn.measuring.scalars import Worlds
from draft.learn.measuring.utilisation import Histograms
from draft.learn.policy.policy import Policy as NumpyPolicy
from draft.learn.task.world.access import robot_of
from draft.learn.training.ppo.agent import agent_settings
from draft.learn.training.ppo.checkpoint import misfit, read_checkpoint
from draft.learn.training.run import Run

Policy = Callable[[TensorDict], torch.Tensor]  # Observations to actions, shape (worlds, joints).
Report = Callable[[str, int, int], object]


def evaluate(
    trial: Trial,
    policy: Callable[[ManagerBasedRlEnv], Policy],
    device: str,
    report: Report = lambda *_: None,
    engine: str = WARP,
    threads: int = 1,
) -> tuple[Worlds, Histograms]:
    """Roll out all levels: in one environment for the flat tests, one for the stairs.

    Args:
        trial: settings of the evaluation.
        policy: returns the policy for an environment; see `trained`.
        device: "cpu" or "cuda:0" and the like.
        report: called after every step with the tests' names, steps done and total steps.
        engine: "native" or "warp".
        threads: threads of native MuJoCo.

    Returns:
        The roll-outs, and histograms of the joints' samples.

    Raises:
        DraftError: the policy does not fit, or the device has too little memory.
    """
    grounds = [
        [test for test in trial.tests if (test.ground == "flat") == flat] for flat in (True, False)
    ]
    make = partial(build, device=device, engine=engine, threads=threads)
    with _one_thread(device):
        parts = [_simulate(trial, own, policy, make, device, report) for own in grounds if own]
    (worlds, histograms), *others = parts
    return (
        worlds.with_rows(*(one for one, _ in others)),
        histograms.with_groups(*(one for _, one in others)),
    )


def trained(run: Run, iteration: int, device: str) -> Callable[[ManagerBasedRlEnv], Policy]:
    """Return a function that makes the policy of a run, with its mean action, for `evaluate`.

    Raises:
        DraftError: no such checkpoint, it cannot be read, or (later) it does not fit.
    """
    _, file = run.checkpoint(iteration)
    content = read_checkpoint(file, device)

    def make_policy(env: ManagerBasedRlEnv) -> Policy:
        seen = TensorDict(dict(env.get_observations()), batch_size=[env.num_envs])
        numbers = agent_settings(run.plan.config, run.plan.stage)["actor"]
        names = ("hidden_dims", "activation", "obs_normalization", "distribution_cfg")
        shape = {name: numbers[name] for name in names}
        actions = env.action_manager.total_action_dim
        actor = MLPModel(seen, {"actor": ["actor"]}, "actor", actions, **shape).to(device)
        try:
            actor.load_state_dict(content["actor_state_dict"], strict=True)
        except (KeyError, RuntimeError, TypeError, AttributeError) as error:
            raise misfit(file, error) from None
        actor.eval()
        return actor

    return make_policy


def exported(policy: NumpyPolicy, device: str) -> Callable[[ManagerBasedRlEnv], Policy]:
    """Return a function that makes the policy of an ONNX file, for `evaluate`.

    Raises:
        DraftError: (later) the environment has other observations.
    """

    def make_policy(env: ManagerBasedRlEnv) -> Policy:
        names = tuple(env.observation_manager.active_terms["actor"])
        expected = tuple(name for name, _ in policy.terms)
        if names != expected:
            cause = f"{policy.file} observes {', '.join(expected)}, not {', '.join(names)}"
            raise DraftError(cause, "use the folder of its run")

        ends = np.cumsum([0, *(length for _, length in policy.terms)])
        first = dict(zip(expected, ends.tolist(), strict=False))
        period = np.full((env.num_envs, 1), policy.control_period)
        trimmed = Trimmed(policy.trim, env, first, period) if policy.trim else None

        def act(seen: TensorDict) -> torch.Tensor:
            values = seen["actor"].cpu().numpy()
            if trimmed is not None:
                values = trimmed(values)
            return torch.from_numpy(policy(values)).to(device)

        return act

    return make_policy


def roll_out(env: ManagerBasedRlEnv, policy: Policy, trial: Trial, report: Report) -> Measures:
    """Run a policy from a fresh start.

    Args:
        env: environment from `draft.learn.measuring.rollout.trial_env.build`.
        policy: observations to actions.
        trial: settings of the evaluation.
        report: see `evaluate`.
    """
    steps, settle = (round(time / env.step_dt) for time in (trial.seconds, trial.settle))
    env.common_step_counter = 0
    with torch.no_grad():
        with contextlib.redirect_stdout(io.StringIO()):  # mjlab prints the seed.
            seen, _ = env.reset(seed=trial.seed)
        measures = Measures(robot_of(env), trial.task.members[0].joint_classes, settle)
        each_step(env).call = measures.sample
        for step in range(1, steps + 1):
            actions = policy(TensorDict(dict(seen), batch_size=[env.num_envs]))
            seen, _, fallen, _, _ = env.step(actions)
            measures.add(fallen)
            report("", step, steps)
    return measures


@contextlib.contextmanager
def _one_thread(device: str) -> Iterator[None]:
    """Let PyTorch use one thread on a CPU: more of them wait for each other and for the physics."""
    before = torch.get_num_threads()
    if device == "cpu":
        torch.set_num_threads(1)
    try:
        yield
    finally:
        torch.set_num_threads(before)


def _simulate(
    trial: Trial,
    tests: Sequence[SkillTest],
    policy: Callable[[ManagerBasedRlEnv], Policy],
    make: Callable[[Trial, Sequence[SkillTest]], ManagerBasedRlEnv],
    device: str,
    report: Report,
) -> tuple[Worlds, Histograms]:
    names = ", ".join(test.name for test in tests)
    rows = layout(trial, tests)
    shared = CommonDraws(rows.replica, trial.seed) if trial.common else contextlib.nullcontext()
    try:
        with shared:
            env = make(trial, tests)
            try:
                actor = policy(env)
                measures = roll_out(env, actor, trial, lambda _, step, of: report(names, step, of))
                columns = measures.fetch()
                each = 1 if trial.common else trial.each
                samples = measures.samples(each, len(trial.task.members))
            finally:
                env.close()
    except (RuntimeError, MemoryError) as error:
        # PyTorch says "out of memory", Warp "failed to allocate".
        text = " ".join(str(error).split())[:200]
        if not isinstance(error, MemoryError) and not re.search(
            "out of memory|failed to allocate|can't allocate|bad_alloc", text, re.I
        ):
            raise
        cause = f"{len(rows.level)} worlds do not fit into the memory of {device}: {text}"
        remedy = "use fewer `replicas`, fewer `levels`, or one `test` at a time"
        raise DraftError(cause, remedy) from None
    kept = {name: getattr(rows, name) for name in ("test", "level", "member", "replica", "kept")}
    # The first replica of each level and member gives the labels of its group.
    first = (rows.replica == 0) | trial.common
    groups = {name: getattr(rows, name)[first] for name in ("test", "level", "member")}
    classes = trial.task.members[0].classes
    counted = Histograms(**groups, counts=samples[0], plane=samples[1], classes=classes)
    return Worlds(**kept, **columns), counted
