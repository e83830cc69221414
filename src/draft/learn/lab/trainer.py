"""Training: PPO of rsl-rl on an environment, in slices that add up to one long run."""

from __future__ import annotations

import math
import os
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import torch
from mjlab.rl import RslRlVecEnvWrapper

from draft.errors import DraftError, Problem
from draft.learn.lab.agent import Runner, agent_settings
from draft.learn.lab.env_cfg import Task, environment
from draft.learn.lab.log import Row, Table, Tally
from draft.learn.lab.ranks import Ranks, rank_seed
from draft.learn.lab.simulate import make
from draft.learn.lab.snapshot import capture, restore
from draft.learn.machine import WARP
from draft.learn.progress import Progress
from draft.learn.run import PROGRESS, Origin, Plan, Run, file_digest

SAVE_SECONDS = 60.0
SCAN = "height_scan"
_KNOWN_SAMPLES = 50_000
_BROKEN = (
    "delete the run's folder to begin anew, or start another run from its policy: "
    "--from RUN --out DIR"
)


def task_of(plan: Plan) -> Task:
    """The task of a plan."""
    return Task(
        members=plan.members,
        stage=plan.stage,
        config=plan.config,
        ground=plan.ground,  # type: ignore[arg-type]
        see_design=plan.see_design,
        see_ground=plan.see_ground,
        seed=plan.seed,
    )


def share(worlds: int, rank: int, replicas: int) -> int:
    """Worlds of one of several processes that share them; the first ones have those left over."""
    return worlds // replicas + (rank < worlds % replicas)


class Trainer:
    """One process of a run: an environment, a policy, and how far they are.

    Attributes:
        iteration: iterations done.
        seconds: of training so far, in all slices.
    """

    def __init__(
        self, run: Run, device: str, rank: int = 0, engine: str = WARP, replicas: int = 1
    ) -> None:
        """Make the environment and the policy, and go to where the run was left.

        Args:
            run: the run.
            device: "cpu" or "cuda:0" and the like.
            rank: number of this process among those that share the run.
            engine: "native" or "warp".
            replicas: processes on a CPU, which share the run's worlds.

        Raises:
            DraftError: what the run left cannot be read, or is of something else.
        """
        self._run, self._engine, plan = run, engine, run.plan
        seed = rank_seed(plan.seed, rank)
        task = task_of(plan)
        settings = environment(task, share(plan.environments, rank, replicas))
        settings.seed = seed
        self.env = make(settings, device, engine)
        self._wrapped = RslRlVecEnvWrapper(self.env)
        self._numbers = agent_settings(plan.config.learning, plan.stage, seed)
        self.runner = Runner(self._wrapped, self._numbers, None, device)
        self._ranks = Ranks(rank, self.runner.gpu_world_size, device)
        self._seen = self._wrapped.get_observations()
        self._tally = Tally(self.env, self._ranks)
        self.iteration, self.seconds = 0, 0.0
        self._saved = self._go_on()
        if self._saved is None:
            self._begin(plan.origin)
        self._table = Table(run.folder / PROGRESS, self.iteration) if rank == 0 else None

    def train(
        self, total: int, until: float = math.inf, tell: Callable[[Progress], None] = lambda _: None
    ) -> bool:
        """Train until so many iterations are done, or until a time.

        Args:
            total: iterations in all slices.
            until: `time.monotonic()` to be done at.
            tell: called after every iteration.

        Returns:
            Whether all iterations are done.

        Raises:
            DraftError: the numbers are no longer finite; the last checkpoint is kept.
        """
        saved, longest = time.monotonic(), 0.0
        kept = {n for n, _ in self._run.checkpoints()}
        if self._saved is None:
            self.save()
        while self.iteration < total:
            start = time.monotonic()
            if self._ranks.of_first(start + 1.5 * longest > until):
                break
            losses = self._iterate()
            taken = time.monotonic() - start
            longest = max(longest, taken)
            self.iteration += 1
            self.seconds += taken
            row = self._record(losses, taken)
            tell(self._progress(total, taken, row))
            keep = self.iteration % self._numbers["save_interval"] == 0 or self.iteration == total
            if keep and self.iteration not in kept:
                self.keep()
            if self._ranks.of_first(keep or time.monotonic() - saved > SAVE_SECONDS):
                self.save()
                saved = time.monotonic()
        self.save()
        return self.iteration >= total

    def keep(self) -> None:
        """Write a checkpoint that stays: policy, value and optimiser, as mjlab reads them."""
        if self._ranks.rank:
            return
        steps = {"common_step_counter": self.env.common_step_counter}
        infos = {"env_state": steps}
        content = self.runner.alg.save() | {"iter": self.iteration, "infos": infos}
        _write(self._run.folder / f"model_{self.iteration}.pt", content)

    def save(self) -> None:
        """Write all that is needed to go on as if nothing had happened.

        The first process writes last, and only then do the others drop what is older: whenever
        they are killed, what it has of an iteration all others have too.
        """
        content = {
            "iteration": self.iteration,
            "seconds": self.seconds,
            "processes": self._ranks.count,
            "agent": self.runner.alg.save(),
            "environment": capture(self.env),
            "seen": dict(self._seen.items()),
            "length": self._tally.lengths,
        }
        rank = self._ranks.rank
        if rank:
            _write(self._run.state(rank, self.iteration), content)
        self._ranks.wait()
        if rank == 0:
            _write(self._run.resume, content)
            self._run.note(self.iteration, self.seconds, self._ranks.count, self._engine)
        self._ranks.wait()
        for iteration, file in self._run.states(rank):
            if iteration != self.iteration:
                file.unlink(missing_ok=True)
        self._saved = self.iteration

    def close(self) -> None:
        """Let go of the environment."""
        self.env.close()

    def _iterate(self) -> dict[str, float]:
        """Collect steps and learn from them; returns the losses."""
        alg, seen = self.runner.alg, self._seen
        alg.train_mode()
        finite = torch.ones((), dtype=torch.bool, device=self.env.device)
        with torch.inference_mode():
            for _ in range(self._numbers["num_steps_per_env"]):
                seen, rewards, dones, extras = self._wrapped.step(alg.act(seen))
                for values in seen.values():
                    finite &= values.isfinite().all()  # type: ignore[union-attr]
                alg.process_env_step(seen, rewards, dones, extras)
                self._tally.add(rewards, dones, extras)
            alg.compute_returns(seen)
        self._seen = seen
        if not self._ranks.all(bool(finite)):
            raise self._lost("observations")
        losses = alg.update()
        if not self._ranks.all(all(math.isfinite(value) for value in losses.values())):
            raise self._lost("losses")
        return losses

    def _record(self, losses: dict[str, float], taken: float) -> Row:
        steps = self._numbers["num_steps_per_env"] * self.env.num_envs
        row = {
            "iteration": float(self.iteration),
            "seconds": self.seconds,
            "steps_per_s": steps * self._ranks.count / taken,
            **self._tally.fetch(),
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

    def _begin(self, origin: Origin | None) -> None:
        """Start with the policy of another run, or with the first process's random one."""
        if origin is not None:
            source = Path(origin.run)
            # Runs of a study stand side by side, also where it was moved to.
            source = source if source.is_dir() else self._run.folder.parent / source.name
            load_policy(self.runner.alg, source, origin, self.env.device, self._fit)
        if self._ranks.count > 1:
            self.runner.alg.broadcast_parameters()

    def _fit(self, content: dict[str, Any]) -> dict[str, Any]:
        """A policy that did not see the ground, made to see it and to make nothing of it yet."""
        manager = self.env.observation_manager
        for group in ("actor", "critic"):
            names = manager.active_terms[group]
            if SCAN not in names:
                continue
            sizes = [dims[0] for dims in manager.group_obs_term_dim[group]]
            at = names.index(SCAN)
            state = content[f"{group}_state_dict"]
            if state["mlp.0.weight"].shape[1] == sum(sizes) - sizes[at]:
                seen = self._seen[group]
                content[f"{group}_state_dict"] = widened(state, sum(sizes[:at]), sizes[at], seen)
        return content

    def _go_on(self) -> int | None:
        """Take up the last state that all processes have; returns its iteration, None for none."""
        file, content = self._run.resume, None
        if self._ranks.rank == 0 and file.is_file():
            content = read_checkpoint(file, self.env.device, _BROKEN)
            _check_processes(file, content, self._ranks.count)
        elif self._ranks.rank == 0 and self._run.checkpoints():
            cause = f"{self._run.folder} has checkpoints, and no {file.name} to go on from"
            raise DraftError(Problem(cause, None, f"bring it back, or {_BROKEN}"))
        saved = self._ranks.of_first(int(content.get("iteration", 0)) if content else -1)
        if saved < 0:
            return None
        if self._ranks.rank:
            file = self._run.state(self._ranks.rank, saved)
            content = read_checkpoint(file, self.env.device, _BROKEN)
        self._restore(file, content or {})
        return saved

    def _restore(self, file: Path, content: dict[str, Any]) -> None:
        """Put policy and environment into a saved state."""
        try:
            self.runner.alg.load(content["agent"], None, strict=True)
            restore(self.env, content["environment"])
            for name, values in content["seen"].items():
                self._seen[name] = values
            self.iteration, self.seconds = int(content["iteration"]), float(content["seconds"])
            self._tally.lengths.copy_(content["length"])
        except (KeyError, RuntimeError, ValueError, TypeError) as error:
            cause = f"{file} is of another design, or of another version: {_first_sentence(error)}"
            remedy = "start a new run from its policy: --from RUN"
            raise DraftError(Problem(cause, None, remedy)) from None

    def _lost(self, what: str) -> DraftError:
        cause = (
            f"iteration {self.iteration + 1}: {what} that are no numbers; stopped, and "
            f"{self._run.folder} is as it was at its last checkpoint"
        )
        remedy = "try another --seed, a lower learning.learning_rate, or look at the design"
        return DraftError(Problem(cause, None, remedy))


def widened(
    state: dict[str, torch.Tensor], start: int, count: int, seen: torch.Tensor
) -> dict[str, torch.Tensor]:
    """A model's weights with inputs added that have no influence yet.

    Args:
        state: of rsl-rl's model with normalised observations.
        start: index of the first new input.
        count: how many there are.
        seen: observations with them, for their mean and variance, shape (worlds, inputs).
    """

    def joined(old: torch.Tensor, new: torch.Tensor) -> torch.Tensor:
        return torch.cat((old[:, :start], new.to(old), old[:, start:]), dim=1)

    weight, values = state["mlp.0.weight"], seen[:, start : start + count]
    found = dict(state)
    found["mlp.0.weight"] = joined(weight, torch.zeros(len(weight), count))
    mean, variance = values.mean(0, keepdim=True), values.var(0, unbiased=False, keepdim=True)
    for name, new in (("_mean", mean), ("_var", variance), ("_std", variance.sqrt())):
        found[f"obs_normalizer.{name}"] = joined(state[f"obs_normalizer.{name}"], new)
    # The statistics must soon follow the new inputs.
    count_name = "obs_normalizer.count"
    found[count_name] = state[count_name].clamp(max=_KNOWN_SAMPLES)
    return found


def load_policy(
    alg: Any,
    run: Path,
    origin: Origin,
    device: str,
    fit: Callable[[dict[str, Any]], dict[str, Any]] = lambda content: content,
) -> None:
    """Take actor and critic, with what they know of the observations' spread, from a run.

    Raises:
        DraftError: it cannot be read, has changed, or sees other observations.
    """
    file = run / f"model_{origin.iteration}.pt"
    content = read_checkpoint(file, device)
    if file_digest(file) != origin.digest:
        raise DraftError(
            Problem(f"{file} has changed since this run was begun", None, "start a new run")
        )
    try:
        alg.load(fit(content), {"actor": True, "critic": True}, strict=True)
    except (KeyError, RuntimeError) as error:
        cause = f"the policy of {file} does not fit: {_first_sentence(error)}"
        remedy = "it must see the same observations: same layers, --see-design and scan"
        raise DraftError(Problem(cause, None, remedy)) from None


def read_checkpoint(
    file: Path, device: str, remedy: str = "take another checkpoint"
) -> dict[str, Any]:
    """Read a checkpoint; nothing in it is run.

    Args:
        file: the checkpoint.
        device: to which its tensors go.
        remedy: what to do if it is broken.

    Raises:
        DraftError: there is none, or it is cut short or of something else.
    """
    try:
        content = torch.load(file, map_location=device, weights_only=True)
    except FileNotFoundError:
        raise DraftError(Problem(f"there is no {file}", None, "name a run that has it")) from None
    except Exception as error:  # Whatever a broken archive leads to.
        cause = f"{file} cannot be read as a checkpoint: {_first_sentence(error)}"
        raise DraftError(Problem(cause, None, remedy)) from None
    if not isinstance(content, dict):
        raise DraftError(Problem(f"{file} is no checkpoint", None, remedy))
    return content


def _check_processes(file: Path, content: dict[str, Any], count: int) -> None:
    """Check that a state was left by as many processes: each goes on with worlds of its own."""
    left = content.get("processes", 1)
    if left != count:
        cause = f"{file} was left by {left} processes, and here are {count}"
        remedy = (
            "give as many by --device (GPUs) or --replicas (a CPU), or start a new run from its "
            "policy: --from RUN"
        )
        raise DraftError(Problem(cause, None, remedy))


def unfit(file: Path, error: Exception) -> DraftError:
    """What is said of a checkpoint whose policy is not of its run."""
    cause = f"the policy of {file} does not fit the run's design and numbers: "
    return DraftError(Problem(cause + _first_sentence(error), None, "take another checkpoint"))


def _write(file: Path, content: dict[str, Any]) -> None:
    """Write a checkpoint beside its place, then move it there."""
    temporary = file.with_name(f".{file.name}.tmp{os.getpid()}")
    try:
        try:
            with temporary.open("wb") as stream:
                torch.save(content, stream)
                stream.flush()
                os.fsync(stream.fileno())  # A machine may be taken away at any moment.
            os.replace(temporary, file)
        finally:
            temporary.unlink(missing_ok=True)
    except (OSError, RuntimeError) as error:
        cause = f"cannot write {file}: {_first_sentence(error)}"
        raise DraftError(Problem(cause, None, "the last checkpoint is kept")) from None


def _first_sentence(error: Exception) -> str:
    """First sentence of what a library says."""
    line = (str(error).strip().splitlines() or [type(error).__name__])[0]
    return line.partition(". ")[0]
