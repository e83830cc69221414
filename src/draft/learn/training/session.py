"""Training from Python: create or reopen a run, and train it for a slice of time."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path

from draft.errors import DraftError, counted
from draft.extras import check
from draft.files import lock
from draft.learn.bodies.legged import check_family
from draft.learn.bodies.slots import slots_of
from draft.learn.engine import machine
from draft.learn.engine.machine import KINDS, NATIVE, Engine
from draft.learn.policy.reduced import LegsPolicy, open_for, open_legs_policy
from draft.learn.policy.sensed import VELOCITY
from draft.learn.policy.validity import check_policy
from draft.learn.silence import quiet
from draft.learn.task.constants import JOINTS
from draft.learn.task.stages import STAGES
from draft.learn.training.options import SliceOptions
from draft.learn.training.progress import Progress
from draft.learn.training.run import (
    Origin,
    Plan,
    Run,
    check_same,
    create,
    file_digest,
    is_run,
    open_run,
    policy_file,
    robots_digest,
)

SCRATCH = "scratch"
Report = Callable[[Progress], None]


def begin(
    folder: Path, plan: Plan, designs: Mapping[str, str], origin: str | Path | None = None
) -> Run:
    """Create a run, or open an existing one if it has the same plan.

    Args:
        folder: the run's folder; it may be missing or empty.
        plan: the training plan. Its `origin` is set here, and `see_ground` and `see_design` are set
            if the policy that it starts from sees the ground or its design.
        designs: each design's file as YAML, by name, such as "quadruped:cheetah".
        origin: folder of the run whose policy a stage starts from, its ONNX file, or "any" or
            "family" for one that ships; "scratch" for none; None for the run beside the folder of
            the stage that this one starts from. An existing run keeps its own if this is None.

    Raises:
        DraftError: the folder holds something else, or cannot be written; there is no run to
            start from, or it has other robots and does not see its design; the policy is to see the
            features of a design that has none, or what no policy of several topologies sees.
    """
    seen = plan.config.observations
    if plan.mixed and (seen.history > 1 or not seen.linear_velocity):
        cause = "a policy of several topologies observes the velocity, and no past steps"
        remedy = "omit observations.linear_velocity and observations.history, or train one robot"
        raise DraftError(cause, remedy)
    for member in plan.members:
        if plan.see_design and not plan.mixed and not member.is_quadruped:
            cause = f"{member.name} has no features that a policy could see: it is no quadruped"
            raise DraftError(cause, "omit `see_design`")
    if plan.config.actuation.support and not plan.mixed:
        try:
            slots_of(plan.members[0])
        except DraftError as error:
            cause = error.problems[0].cause
            cause = f"actuation.support is for hip pitch and knee of each leg: {cause}"
            raise DraftError(cause, "omit actuation.support") from None
    if not is_run(folder):
        return create(folder, _with_origin(folder, plan, origin), dict(designs))
    run = open_run(folder)
    if origin is None:
        plan = replace(plan, origin=run.plan.origin, see_ground=run.plan.see_ground)
        if run.plan.origin is not None:
            plan = replace(plan, see_design=run.plan.see_design)
            plan = with_support(plan, run.plan.config.actuation.support)
    else:
        plan = _with_origin(folder, plan, origin)
    check_same(run, plan)
    return run


def _with_origin(folder: Path, plan: Plan, origin: str | Path | None) -> Plan:
    """The plan with the run that it starts from."""
    before = STAGES[plan.stage].origin
    if origin == SCRATCH or (origin is None and before is None):
        return replace(plan, origin=None)
    beside = folder.with_name(folder.name.replace(f"-{plan.stage}-", f"-{before}-"))
    file = policy_file(origin) if origin else None
    if plan.mixed and file is None:
        cause = f"a training of several topologies does not start from the run '{origin}'"
        remedy = 'use `origin="any"` or an ONNX file of such a run'
        raise DraftError(cause, remedy)
    if file is not None:
        return with_exported(plan, str(origin), file)
    source = Path(origin) if origin else beside
    if origin is None and (source == folder or not is_run(source)):
        cause = f"stage {plan.stage} starts from a {before} policy, and there is no run {beside}"
        remedy = f'train the {before} stage first, or pass `origin=RUN` or `origin="scratch"`'
        raise DraftError(cause, remedy)
    if origin is not None and not is_run(source):
        cause = f"there is no policy '{origin}' to start from"
        remedy = "name the folder of a run, an ONNX file, 'any', 'family' or 'scratch'"
        raise DraftError(cause, remedy)
    run = open_run(source)
    if run.plan.see_design:  # Such a policy can continue with any body of the same topology.
        check_family([run.plan.members[0], *plan.members])
    elif plan.see_design:
        cause = f"{source} was trained without `see_design`"
        raise DraftError(cause, "omit `see_design`")
    elif robots_digest(run.plan.members) != robots_digest(plan.members):
        names = ", ".join(member.name for member in run.plan.members)
        cause = f"{source} is a run of {names}, which differs from the design to be trained"
        remedy = "name a run of the same design, or one that was trained with `see_design`"
        raise DraftError(cause, remedy)
    iteration, file = run.checkpoint()
    # A policy that sees the ground keeps seeing it; one that does not may start to.
    sees = plan.see_ground or run.plan.see_ground
    return replace(
        with_support(plan, run.plan.config.actuation.support),
        origin=Origin(str(source), iteration, file_digest(file)),
        see_ground=sees,
        see_design=run.plan.see_design,
    )


def with_support(plan: Plan, support: float) -> Plan:
    """Return a plan of one topology with the gains of the policy that it starts from.

    Args:
        plan: the plan.
        support: the policy's `actuation.support`.

    Raises:
        DraftError: the plan states another one.
    """
    own = plan.config.actuation.support
    if own and own != support:
        cause = f"actuation.support is {own:g}, and the policy to start from has {support:g}"
        raise DraftError(cause, "omit actuation.support, or start from scratch")
    return replace(plan, config=plan.config.with_values({"actuation.support": support}))


def with_exported(plan: Plan, name: str, file: Path) -> Plan:
    """Return a plan with the exported policy that it starts from.

    Args:
        plan: the plan.
        name: the policy's name or file, as users write it.
        file: its ONNX file.

    Raises:
        DraftError: it does not fit the robots or the networks of the plan.
    """
    if plan.mixed:
        policy = open_legs_policy(file)
    else:
        policy = open_for(file, plan.members)
        check_policy(policy, plan.members)
    layers = (policy.network.units(), plan.config.learning.hidden)
    if layers[0] != layers[1]:
        known, own = (", ".join(map(str, units)) for units in layers)
        cause = f"{file} has layers of {known} units, and this training has {own}"
        remedy = f"`values` learning.hidden={known.replace(' ', '')}"
        raise DraftError(cause, remedy)
    origin = Origin(name, policy.iterations, file_digest(file))
    if isinstance(policy, LegsPolicy):
        return replace(plan, origin=origin)
    sees_design = bool(len(policy.features))
    if plan.see_design and not sees_design:
        cause = f"{file} was trained without `see_design`"
        raise DraftError(cause, "omit `see_design`")
    return replace(
        with_support(plan, policy.support),
        origin=origin,
        see_ground=plan.see_ground or bool(len(policy.scan_points)),
        see_design=sees_design,
    )


@dataclass(frozen=True)
class Setting:
    """Devices, engine and processes that train a run.

    Attributes:
        devices: such as ("cpu",) or ("cuda:0", "cuda:1").
        engine: physics engine.
        processes: number of processes that share the run: one per core of a CPU, or per GPU.
    """

    devices: tuple[str, ...]
    engine: Engine
    processes: int

    @property
    def on_cpu(self) -> bool:
        """Whether no GPU is used."""
        return self.devices == ("cpu",)

    def describe(self, run: Run, iterations: int) -> str:
        """Engine, processes, iterations and expected minutes of a training, in one line.

        Args:
            run: the run.
            iterations: iterations in all slices.
        """
        plan, left = run.plan, iterations - run.done()
        where = "the CPU" if self.on_cpu else ", ".join(self.devices)
        kind = KINDS[self.engine.name]
        text = f"{kind} on {where} ({self.engine.why}), {counted(plan.environments, 'world')}"
        text += f" in {self.processes} processes" if self.processes > 1 else ""
        joints = sorted(len(member.joints) for member in plan.members)
        if joints[-1] > JOINTS:
            span = " to ".join(map(str, dict.fromkeys((joints[0], joints[-1]))))
            text += f"; {counted(iterations, 'iteration')} for {span} joints"
        before = run.engine()
        if before not in (None, self.engine.name):
            text += f"; resumed from {before}: the same run, to single precision"
        if not self.on_cpu:
            return text
        steps = left * plan.environments * plan.config.learning.steps
        physics = plan.config.physics.decimation
        mean = sum(joints) / len(joints)
        time_left = machine.minutes(steps, physics, self.engine, self.processes, plan.ground, mean)
        slow = "" if self.engine.name == NATIVE else "; too slow for more than a trial"
        return f"{text}; about {time_left:.0f} min{slow}" if time_left >= 1 else f"{text}{slow}"


def setting(plan: Plan, options: SliceOptions) -> Setting:
    """Choose devices, engine and processes for a plan.

    Raises:
        DraftError: there is no such device, the engine does not run on it, or there are fewer
            cores or worlds than processes.
    """
    chosen = machine.devices(options.device)
    stepper = machine.choose(options.engine, chosen)
    processes = machine.replicas(options.replicas, plan.environments, stepper, chosen)
    return Setting(tuple(chosen), stepper, processes)


def setting_of(run: Run, options: SliceOptions) -> Setting:
    """Choose devices, engine and processes for a run: see `setting`.

    A run that has a saved state resumes with as many processes as wrote it, unless the options
    say otherwise.
    """
    saved = run.processes() if options.replicas is None else None
    if saved is not None and machine.devices(options.device) == ["cpu"]:
        options = options.model_copy(update={"replicas": saved})
    return setting(run.plan, options)


def check_fits(plan: Plan, where: Setting) -> None:
    """Check that the worlds of a plan fit into the memory of a CPU.

    Raises:
        DraftError: they do not.
    """
    if where.on_cpu:
        points = plan.config.observations.scan_points() if plan.see_ground else 0
        seen = 48 * (1 + plan.config.observations.history) + 2 * points + 24
        steps = plan.config.learning.steps
        machine.check_memory(plan.environments, steps, seen, where.processes)


def origin_line(plan: Plan, beside: Path) -> str | None:
    """One line on the policy that a run starts from; None if it starts from scratch.

    Args:
        plan: plan of the run.
        beside: folder with the run; the one that it starts from may have been moved there with it.
    """
    origin = plan.origin
    if origin is None:
        return None
    source = origin.folder(beside)
    if origin.policy_file is not None or not is_run(source):
        line = f"starts from {origin.run}, policy: iteration {origin.iteration}"
        return line + _imitated(plan, origin.policy_file)
    return f"starts from {source}, {open_run(source).policy_line(origin.iteration)}"


def _imitated(plan: Plan, file: Path | None) -> str:
    """Words on the lessons that a policy with other observations gives; "" for none."""
    seen, lessons = plan.config.observations, plan.config.learning.lessons
    if plan.mixed or not lessons or file is None or not file.is_file():
        return ""
    policy = open_for(file, plan.members)
    known = VELOCITY in dict(policy.terms), max(policy.history)
    if known == (seen.linear_velocity, seen.history):
        return ""
    return f", which it imitates for {counted(lessons, 'iteration')}"


def finished(run: Run, options: SliceOptions) -> bool:
    """Return whether all iterations of a run are done and a checkpoint is there."""
    return run.done() >= options.total(run.plan) and bool(run.checkpoints())


def train_on(
    run: Run,
    options: SliceOptions,
    where: Setting,
    report: Report = lambda progress: None,
) -> bool:
    """Train a run on the devices and processes chosen with `setting_of`.

    Args:
        run: the run.
        options: options of this call.
        where: devices, engine and processes.
        report: called after every iteration; with several processes from another thread.

    Returns:
        Whether all iterations are done.

    Raises:
        DraftError: another process holds the run, it cannot be trained on this device, mjlab is
            missing, or a process failed.
    """
    until = math.inf if options.minutes is None else time.monotonic() + 60.0 * options.minutes
    quiet()
    check("mjlab", "learn")
    from draft.learn.training import launch

    with lock(run.folder, "training"):
        return launch.train_slice(run, options, where, until, report)
