"""Training: rsl-rl's PPO on an environment, in slices that are equivalent to one long run."""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import torch

from draft.errors import DraftError, counted
from draft.learn.engine.machine import WARP
from draft.learn.engine.worlds.ranks import Ranks, rank_seed
from draft.learn.policy.matching import Match, match_of
from draft.learn.policy.policy import Policy
from draft.learn.policy.reduced import open_for
from draft.learn.policy.sensed import with_inputs
from draft.learn.training.ppo.agent import Runner, agent_settings
from draft.learn.training.ppo.checkpoint import first_sentence, read_checkpoint, write_checkpoint
from draft.learn.training.ppo.log import Row, Table
from draft.learn.training.ppo.ppo import Ppo
from draft.learn.training.ppo.warm_start import (
    ALONE,
    check_unchanged,
    load_exported,
    load_of_legs,
    load_policy,
    teacher,
    widened,
)
from draft.learn.training.ppo.worlds import Worlds
from draft.learn.training.progress import PROGRESS, Progress
from draft.learn.training.run import Origin, Run

SAVE_SECONDS = 60.0
SCAN = "height_scan"
_BROKEN = (
    "delete the run's folder and train again, or start another run from its policy: "
    "`origin=RUN` `out=DIR`"
)


class Trainer:
    """One process of a run: an environment, a policy, and their progress.

    Attributes:
        env: the environment, of a mixture that of the first topology.
        runner: rsl-rl's runner.
        iteration: iterations done.
        seconds: seconds of training so far, in all slices [s].
    """

    def __init__(
        self, run: Run, device: str, rank: int = 0, engine: str = WARP, replicas: int = 1
    ) -> None:
        """Make the environment and the policy, and restore the saved state of the run.

        Args:
            run: the run.
            device: "cpu" or "cuda:0" and the like.
            rank: number of this process among those that share the run.
            engine: "native" or "warp".
            replicas: number of processes on a CPU, which share the run's worlds.

        Raises:
            DraftError: the saved state cannot be read, or is that of another run.
        """
        self._run, self._engine, plan = run, engine, run.plan
        self._worlds = Worlds(plan, device, engine, rank, replicas)
        self.env, self._wrapped = self._worlds.envs[0], self._worlds.wrapped
        self._numbers = agent_settings(plan.config, plan.stage, rank_seed(plan.seed, rank))
        self.runner = Runner(self._wrapped, self._numbers, None, device)
        self._ranks = Ranks(rank, self.runner.gpu_world_size, device)
        self._seen = self._wrapped.get_observations()
        self._worlds.observe(plan, self._ranks)
        self.iteration, self.seconds = 0, 0.0
        self._total = run.total()
        file = plan.origin.policy_file if plan.origin is not None else None
        self._alone = ALONE if file is not None else 0  # Iterations without rewards for the actor.
        self._saved = self._resume()
        self._first: tuple[Policy, Match] | None = None
        lessons = plan.config.learning.lessons
        taught = lessons > 0 and self.iteration < max(ALONE, lessons)
        if (
            plan.origin is not None
            and file is not None
            and not plan.mixed
            and (taught or self._saved is None)
        ):
            self._first = self._exported(plan.origin, file)
        if self._saved is None:
            self._turn()
            self._start(plan.origin)
        self._table = Table(run.folder / PROGRESS, self.iteration) if rank == 0 else None

    def train(
        self,
        total: int,
        until: float = math.inf,
        report: Callable[[Progress], None] = lambda _: None,
        stop: Callable[[], bool] = lambda: False,
    ) -> bool:
        """Train until a number of iterations is done, until a time, or until asked to stop.

        A checkpoint of the iteration reached is kept.

        Args:
            total: iterations in all slices.
            until: time limit, as `time.monotonic()` gives it [s].
            report: called after every iteration.
            stop: returns whether to stop before the next iteration; the first process's decides.

        Returns:
            Whether all iterations are done.

        Raises:
            DraftError: observations or losses are not finite; the last checkpoint is kept.
        """
        saved, longest, self._total = time.monotonic(), 0.0, total
        kept = {n for n, _ in self._run.checkpoints()}
        if self._saved is None:
            self.save()
        while self.iteration < total:
            start = time.monotonic()
            if self._ranks.of_first(stop() or start + 1.5 * longest > until):
                break
            losses = self._iterate()
            taken = time.monotonic() - start
            longest = max(longest, taken)
            self.iteration += 1
            self.seconds += taken
            row = self._record(losses, taken)
            self._turn()
            report(self._progress(total, taken, row))
            keep = self.iteration % self._numbers["save_interval"] == 0 or self.iteration == total
            if keep and self.iteration not in kept:
                self.keep()
                kept.add(self.iteration)
            if self._ranks.of_first(keep or time.monotonic() - saved > SAVE_SECONDS):
                self.save()
                saved = time.monotonic()
        if self.iteration and self.iteration not in kept:
            self.keep()
        self.save()
        return self.iteration >= total

    def keep(self) -> None:
        """Write a checkpoint: policy, value function and optimiser, in mjlab's format."""
        if self._ranks.rank:
            return
        steps = {"common_step_counter": self.env.common_step_counter}
        infos = {"env_state": steps}
        content = self.runner.alg.save() | {"iter": self.iteration, "infos": infos}
        write_checkpoint(self._run.folder / f"model_{self.iteration}.pt", content)

    def save(self) -> None:
        """Write the state to resume from.

        The first process writes last, and only then do the others remove older files: whenever
        they are killed, all processes have the state of the iteration that the first one has.
        """
        content = {
            "iteration": self.iteration,
            "seconds": self.seconds,
            "processes": self._ranks.count,
            "agent": self.runner.alg.save(),
            "seen": dict(self._seen.items()),
            **self._worlds.state(),
        }
        rank = self._ranks.rank
        if rank:
            write_checkpoint(self._run.state(rank, self.iteration), content)
        self._ranks.wait()
        if rank == 0:
            write_checkpoint(self._run.resume, content)
            processes = self._ranks.count
            self._run.note(self.iteration, self.seconds, processes, self._engine, self._total)
        self._ranks.wait()
        for iteration, file in self._run.states(rank):
            if iteration != self.iteration:
                file.unlink(missing_ok=True)
        self._saved = self.iteration

    def close(self) -> None:
        """Close the environment."""
        self._worlds.close()

    def _iterate(self) -> dict[str, float]:
        """Collect steps and update the policy; return the losses."""
        alg, seen = self.runner.alg, self._seen
        alg.train_mode()
        finite = torch.ones((), dtype=torch.bool, device=self.env.device)
        with torch.inference_mode():
            for _ in range(self._numbers["num_steps_per_env"]):
                seen, rewards, dones, extras = self._wrapped.step(alg.act(seen))
                for group in seen.keys():  # noqa: SIM118, a TensorDict iterates over rows.
                    finite &= seen[group].isfinite().all()
                alg.process_env_step(seen, rewards, dones, extras)
                self._worlds.add(rewards, dones, extras)
            alg.compute_returns(seen)
        self._seen = seen
        if not self._ranks.all(bool(finite)):
            raise self._diverged("observations")
        if isinstance(alg, Ppo):
            begins = self.iteration >= self._alone
            if begins and not alg.learns_actor:
                # At the rate of a new policy the first steps would undo what it can do.
                alg.learning_rate = alg.least_rate
            alg.learns_actor = begins
            if begins:
                alg.teacher = None
            alg.decay(self._decayed())
        losses = alg.update()
        if not self._ranks.all(all(math.isfinite(value) for value in losses.values())):
            raise self._diverged("losses")
        return losses

    def _decayed(self) -> float:
        """Share of the decay of the learning rate that is done."""
        last = self._run.plan.config.learning.decay * self._total
        return max(0.0, 1.0 - (self._total - self.iteration) / last) if last else 0.0

    def _turn(self) -> None:
        """Give some worlds new bodies of their family."""
        if self._worlds.turn(self.iteration):
            self._seen = self._wrapped.get_observations()

    def _record(self, losses: dict[str, float], taken: float) -> Row:
        steps = self._numbers["num_steps_per_env"] * self._worlds.count
        row = {
            "iteration": float(self.iteration),
            "seconds": self.seconds,
            "steps_per_s": steps * self._ranks.count / taken,
            **self._worlds.fetch(),
            "learning_rate": self.runner.alg.learning_rate,
            "action_std": self.runner.alg.get_policy().output_std.mean().item(),
            **{f"loss/{name}": value for name, value in losses.items()},
        }
        if self._table is not None:
            self._table.add(row)
        return row

    def _progress(self, total: int, taken: float, row: Row) -> Progress:
        left = (total - self.iteration) * taken
        return Progress(self.iteration, total, row["steps_per_s"], left, row)

    def _start(self, origin: Origin | None) -> None:
        """Start with the policy of another run, or with the random one of the first process."""
        file = origin.policy_file if origin is not None else None
        if origin is not None and file is not None and self._run.plan.mixed:
            load_of_legs(self.runner.alg, file, origin)
        elif origin is not None and self._first is not None:
            policy, of_joints = self._first
            load_exported(self.runner.alg, policy, origin, of_joints, self._fit)
        elif origin is not None:
            source = origin.folder(self._run.folder.parent)
            load_policy(self.runner.alg, source, origin, self.env.device, self._fit)
        if self._ranks.count > 1:
            self.runner.alg.broadcast_parameters()

    def _exported(self, origin: Origin, file: Path) -> tuple[Policy, Match]:
        """Return the exported policy to start from, with the inputs of this run, and its joints.

        If those are other inputs, it is the teacher of the first iterations.

        Raises:
            DraftError: it has changed, does not drive the robot, or observes something else.
        """
        plan, alg = self._run.plan, self.runner.alg
        check_unchanged(file, origin)
        policy = open_for(file, plan.members)
        of_joints = match_of(policy, plan.members[0])
        if isinstance(of_joints, str):
            raise DraftError(f"{file} does not drive the robot: {of_joints}", _BROKEN)
        manager = self.env.observation_manager
        names, dims = manager.active_terms["actor"], manager.group_obs_term_dim["actor"]
        terms = [(name, dim[0]) for name, dim in zip(names, dims, strict=True)]
        if SCAN not in dict(policy.terms):  # It is added to the policy by `_fit`.
            terms = [term for term in terms if term[0] != SCAN]
        past = [manager.get_term_cfg("actor", name).history_length or 1 for name, _ in terms]
        if (tuple(terms), tuple(past)) == (policy.terms, policy.history):
            return policy, of_joints
        if isinstance(alg, Ppo) and plan.config.learning.lessons:
            self._alone = max(ALONE, plan.config.learning.lessons)
            alg.teacher = teacher(policy, of_joints)
        return with_inputs(policy, terms, past), of_joints

    def _fit(self, content: dict[str, Any]) -> dict[str, Any]:
        """Add the height scan, without influence yet, to a policy that does not observe it."""
        manager = self.env.observation_manager
        for group in ("actor", "critic"):
            names = manager.active_terms[group]
            if SCAN not in names or f"{group}_state_dict" not in content:
                continue
            sizes = [dims[0] for dims in manager.group_obs_term_dim[group]]
            at = names.index(SCAN)
            state = content[f"{group}_state_dict"]
            if state["mlp.0.weight"].shape[1] == sum(sizes) - sizes[at]:
                seen = self._seen[group]
                new = (sum(sizes[:at]), sizes[at], seen, self._run.plan.see_design)
                content[f"{group}_state_dict"] = widened(state, *new)
        return content

    def _resume(self) -> int | None:
        """Restore the last state that all processes have; return its iteration, None for none."""
        file, content = self._run.resume, None
        if self._ranks.rank == 0 and file.is_file():
            content = read_checkpoint(file, self.env.device, _BROKEN)
            _check_processes(file, content, self._ranks.count)
        elif self._ranks.rank == 0 and self._run.checkpoints():
            cause = f"{self._run.folder} has checkpoints, but no {file.name} to resume from"
            raise DraftError(cause, f"restore it, or {_BROKEN}")
        saved = self._ranks.of_first(int(content.get("iteration", 0)) if content else -1)
        if saved < 0:
            return None
        if self._ranks.rank:
            file = self._run.state(self._ranks.rank, saved)
            content = read_checkpoint(file, self.env.device, _BROKEN)
        self._restore(file, content or {})
        return saved

    def _restore(self, file: Path, content: dict[str, Any]) -> None:
        """Restore a saved state of policy and environment."""
        try:
            self.runner.alg.load(content["agent"], None, strict=True)
            self._worlds.restore(content)
            for name, values in content["seen"].items():
                self._seen[name] = values
            self.iteration, self.seconds = int(content["iteration"]), float(content["seconds"])
        except (KeyError, RuntimeError, ValueError, TypeError) as error:
            cause = f"{file} is of another design, or of another version: {first_sentence(error)}"
            remedy = "start a new run from its policy: `origin=RUN`"
            raise DraftError(cause, remedy) from None

    def _diverged(self, what: str) -> DraftError:
        cause = (
            f"iteration {self.iteration + 1}: {what} are not finite; stopped, with "
            f"{self._run.folder} at its last checkpoint"
        )
        remedy = "try another `seed` or a lower learning.learning_rate, or check the design"
        return DraftError(cause, remedy)


def _check_processes(file: Path, content: dict[str, Any], count: int) -> None:
    """Check that as many processes wrote a state: each resumes with its own worlds."""
    wrote = content.get("processes", 1)
    if wrote != count:
        cause = f"{file} was written by {counted(wrote, 'process')}, and this run has {count}"
        remedy = (
            "use as many with `device` (GPUs) or `replicas` (a CPU), or start a new run from its "
            "policy: `origin=RUN`"
        )
        raise DraftError(cause, remedy)
