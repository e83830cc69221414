"""Training from Python: make a run, or open it again, and train it for a slice of time."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path

from draft.errors import DraftError, Problem
from draft.extras import check
from draft.files import lock
from draft.learn.devices import devices
from draft.learn.engine import NATIVE, Engine, check_memory, choose
from draft.learn.engine import minutes as minutes_for
from draft.learn.engine import replicas as processes_of
from draft.learn.progress import Progress
from draft.learn.run import (
    Origin,
    Plan,
    Run,
    check_same,
    create,
    file_digest,
    is_run,
    open_run,
    robots_digest,
)
from draft.learn.silence import quiet

SCRATCH = "scratch"
Tell = Callable[[Progress], None]


def begin(
    folder: Path, plan: Plan, designs: Mapping[str, str], origin: str | Path | None = None
) -> Run:
    """Make a run, or open the one that is there if it is of the same plan.

    Args:
        folder: the run's; it may be missing or empty.
        plan: what is trained. Its `origin` is found here, and so is whether the policy sees the
            ground because the one that it starts from did.
        designs: each design's file as YAML, by name, such as "quadruped:cheetah".
        origin: folder of the run whose policy a stage starts from; "scratch" for none; None for
            the base run beside the folder, where the stage is not `base`. A run that is there
            keeps its own where this is None.

    Raises:
        DraftError: the folder holds something else, or cannot be written; there is no run to
            start from, or it is of other robots.
    """
    if not is_run(folder):
        return create(folder, _started(folder, plan, origin), dict(designs))
    run = open_run(folder)
    if origin is None:
        plan = replace(plan, origin=run.plan.origin, see_ground=run.plan.see_ground)
    else:
        plan = _started(folder, plan, origin)
    check_same(run, plan)
    return run


def _started(folder: Path, plan: Plan, word: str | Path | None) -> Plan:
    """A plan with the run that it starts from."""
    if word == SCRATCH or (word is None and plan.stage == "base"):
        return replace(plan, origin=None)
    beside = folder.with_name(folder.name.replace(f"-{plan.stage}-", "-base-"))
    source = Path(word) if word else beside
    if word is None and (source == folder or not is_run(source)):
        cause = f"stage {plan.stage} starts from a base policy, and there is no run {beside}"
        remedy = "train the base stage first, name its run with --from RUN, or --from scratch"
        raise DraftError(Problem(cause, None, remedy))
    run = open_run(source)
    if robots_digest(run.plan.members) != robots_digest(plan.members):
        theirs = ", ".join(member.name for member in run.plan.members)
        cause = f"{source} is a run of {theirs}, with other numbers than the design at hand"
        raise DraftError(Problem(cause, None, "name a run of the same design"))
    if run.plan.see_design != plan.see_design:
        cause = f"{source} was trained with{'' if run.plan.see_design else 'out'} --see-design"
        raise DraftError(Problem(cause, None, "do the same here"))
    iteration, file = run.checkpoint()
    # A policy that saw the ground goes on seeing it; one that did not may begin to.
    sees = plan.see_ground or run.plan.see_ground
    return replace(plan, origin=Origin(str(source), iteration, file_digest(file)), see_ground=sees)


@dataclass(frozen=True)
class Setting:
    """On what a run is trained.

    Attributes:
        devices: such as ("cpu",) or ("cuda:0", "cuda:1").
        engine: what steps the worlds.
        processes: that share the run: per core of a CPU, or one per GPU.
    """

    devices: tuple[str, ...]
    engine: Engine
    processes: int

    @property
    def on_cpu(self) -> bool:
        """Whether no GPU takes part."""
        return self.devices == ("cpu",)

    def words(self, run: Run, iterations: int) -> str:
        """Engine, processes and expected minutes of training a run, in a line.

        Args:
            run: the run.
            iterations: in all slices.
        """
        plan, left = run.plan, iterations - run.done()
        where = "the CPU" if self.on_cpu else ", ".join(self.devices)
        native = self.engine.name == NATIVE
        kind = "native MuJoCo" if native else "MuJoCo Warp"
        words = f"{kind} on {where} ({self.engine.why}), {plan.environments} worlds"
        words += f" in {self.processes} processes" if self.processes > 1 else ""
        before = run.engine()
        if before not in (None, self.engine.name):
            words += f"; resumed from {before}: the same run, to single precision"
        if not self.on_cpu:
            return words
        steps = left * plan.environments * plan.config.learning.steps
        took = minutes_for(steps, self.engine, self.processes, plan.ground)
        slow = "" if native else "; a try, not a training"
        return f"{words}; about {took:.0f} min{slow}" if took >= 1 else f"{words}{slow}"


def setting(
    plan: Plan, device: str = "auto", engine: str = "auto", replicas: int | None = None
) -> Setting:
    """Choose on what a plan is trained.

    Args:
        plan: what is trained.
        device: see `draft.learn.devices.devices`.
        engine: "auto", "native" or "warp".
        replicas: processes on a CPU; None for one per physical core.

    Raises:
        DraftError: there is no such device, the engine does not run on it, or there are fewer
            cores or worlds than processes.
    """
    chosen = devices(device)
    stepped = choose(engine, chosen)
    return Setting(
        tuple(chosen), stepped, processes_of(replicas, plan.environments, stepped, chosen)
    )


def setting_of(
    run: Run, device: str = "auto", engine: str = "auto", replicas: int | None = None
) -> Setting:
    """Choose on what a run goes on: see `setting`.

    A run that was begun goes on with as many processes as its state is of, unless told otherwise.
    """
    begun = run.processes() if replicas is None and devices(device) == ["cpu"] else None
    return setting(run.plan, device, engine, begun or replicas)


def check_fits(plan: Plan, where: Setting) -> None:
    """Check that the worlds of a plan fit into the memory of a CPU.

    Raises:
        DraftError: they do not.
    """
    if where.on_cpu:
        points = plan.config.observations.scan_points() if plan.see_ground else 0
        seen = 2 * (48 + points) + 24
        check_memory(plan.environments, plan.config.learning.steps, seen, where.processes)


def iterations_of(run: Run, iterations: int | None = None) -> int:
    """Iterations of a run in all slices: those that are asked for, or its stage's."""
    return iterations or run.plan.config.learning.iterations(run.plan.stage)


def finished(run: Run, iterations: int | None = None) -> bool:
    """Tell whether all iterations of a run are done and kept."""
    return run.done() >= iterations_of(run, iterations) and bool(run.checkpoints())


def train_on(
    run: Run,
    iterations: int,
    where: Setting,
    minutes: float | None = None,
    tell: Tell = lambda progress: None,
    wandb: str | None = None,
) -> bool:
    """Train a run on the devices and processes chosen with `setting_of`.

    Args:
        run: the run.
        iterations: iterations in all slices.
        where: devices, engine and processes.
        minutes: time limit of this call [min]; None for no limit.
        tell: called after every iteration; with several processes from another thread.
        wandb: project of Weights & Biases; None for TensorBoard alone.

    Returns:
        Whether all iterations are done.

    Raises:
        DraftError: another process has the run, it cannot be trained there, mjlab is missing,
            or a process failed.
    """
    until = math.inf if minutes is None else time.monotonic() + 60.0 * minutes
    quiet()
    check("mjlab", "learn")
    from draft.learn import launch

    with lock(run.folder, "draft train"):
        return launch.train(
            run,
            where.devices,
            iterations,
            until,
            tell,
            wandb,
            where.engine.name,
            where.processes,
        )
