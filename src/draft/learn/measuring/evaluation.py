"""Evaluation from Python: run a policy through batteries, and save its capabilities."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import cast

from draft.design import Design
from draft.design.references import find_design, open_design
from draft.errors import DraftError, suggest
from draft.extras import need
from draft.learn.bodies.inertia import SOURCES, ErrorSource
from draft.learn.bodies.legged import legged_robot
from draft.learn.engine.machine import Engine, choose, cores, devices
from draft.learn.measuring.levels import Battery, batteries, named, of_stage, settle
from draft.learn.measuring.policies import Source, open_source
from draft.learn.measuring.results import (
    make_request,
    read,
    result_folder,
    save,
    summarise,
)
from draft.learn.measuring.summary import PROTOCOLS, Protocol, Request, Summary
from draft.learn.silence import quiet
from draft.learn.task.stages import is_like
from draft.learn.training.reached import Reached
from draft.learn.training.run import Run, is_run, open_run
from draft.spec import Spec
from draft.spec.payload import HEAVIEST

_FLAT = ("walk", "speed", "push")  # Batteries of a design.
Report = Callable[[str, int, int], None]


@dataclass(frozen=True, repr=False)
class Guest(Run):
    """A design that a policy of other robots drives, in the place of a run.

    Attributes:
        source: the policy.
    """

    source: Source

    @staticmethod
    def of(reference: Design | Spec | str | Path, policy: str | Path | None = None) -> Guest:
        """Return a design with a policy.

        Args:
            reference: the design, as `draft.design.references.open_design` takes it.
            policy: folder of a run or ONNX file; None for the policy that ships.

        Raises:
            DraftError: there is none of either, or the policy does not drive the design.
        """
        design = open_design(reference)
        source = open_source(policy, blind=True)
        member = legged_robot(design)
        source.match(member)
        config = source.plan.config
        if is_like(source.plan.stage, "push"):
            config = config.with_values({"push.forward": source.forward})
        name = Path(design.reference).name.replace(":", "-")
        stem = source.file.stem if policy is None else Path(policy).resolve().stem
        plan = replace(source.plan, members=(member,), config=config)
        return Guest(Path("out") / f"{name}-{stem}", plan, source)

    def policy_line(self, iteration: int) -> str:
        """One line on the policy, see `Run.policy_line`."""
        return self.source.line

    def checkpoint(self, iteration: int | None = None) -> tuple[int, Path]:
        """Return the iterations and the file of the policy.

        Raises:
            DraftError: another number of iterations is asked for.
        """
        if iteration not in (None, self.source.iteration):
            cause = f"`checkpoint` is for runs, and {self.plan.members[0].name} is a design"
            raise DraftError(cause, "omit `checkpoint`")
        return self.source.iteration, self.source.file

    def reached(self, iteration: int) -> Reached:
        """Largest speed that the policy was commanded."""
        return Reached(None, self.source.forward)


@dataclass(frozen=True)
class Evaluation:
    """An evaluation of a run's policy, or of a design with a policy, checked by `prepare`.

    Attributes:
        run: the run.
        batteries: batteries with their levels.
        request: everything that determines the result.
        folder: folder of the result.
    """

    run: Run
    batteries: tuple[Battery, ...]
    request: Request
    folder: Path

    def existing(self) -> Summary | None:
        """Return the summary of an existing result of this request; None if there is none."""
        summary = read(self.folder)
        return summary if summary is not None and summary.asked == self.request else None

    def measure(
        self, device: str, engine: Engine, report: Report = lambda names, step, steps: None
    ) -> tuple[Summary, int]:
        """Roll out all levels and save the result, replacing an older one.

        Args:
            device: "cpu" or "cuda:0" and the like.
            engine: physics engine from `setting`.
            report: called after every step with the batteries' names, steps done and total steps.

        Returns:
            The summary and the number of roll-outs.

        Raises:
            DraftError: the checkpoint cannot be read or does not fit, there is too little memory,
                or the result cannot be written.
        """
        from draft.learn.measuring.rollout.evaluate import evaluate, trained
        from draft.learn.measuring.rollout.trial import trial

        start = time.monotonic()
        if isinstance(self.run, Guest):
            policy = self.run.source.actor(device)
        else:
            policy = trained(self.run, self.request.iteration, device)
        settings = trial(self.run, self.batteries, self.request)
        worlds, histograms = evaluate(settings, policy, device, report, engine.name, cores())
        summary = summarise(
            self.run,
            self.request,
            self.batteries,
            worlds,
            histograms,
            device=_device_name(device),
            engine=engine.name,
            took_s=round(time.monotonic() - start, 1),
        )
        save(self.folder, summary, worlds, histograms)
        return summary, len(worlds.fell)


def usual(run: Run) -> tuple[str, ...]:
    """Names of the batteries for the policy of a run; for a design, those without stairs."""
    return _FLAT if isinstance(run, Guest) else of_stage(run.plan.stage)


def opened(run: Run | Design | Spec | str | Path, policy: str | Path | None = None) -> Run:
    """Open a run, or a design with a policy.

    Args:
        run: the run, its folder, or a design.
        policy: policy of a design, see `Guest.of`.

    Raises:
        DraftError: there is no such run or design, the policy does not drive the design, or a
            policy is given for a run, which has its own.
    """
    named = isinstance(run, str | Path)
    if policy is None and (isinstance(run, Run) or (named and is_run(Path(run)))):
        return run if isinstance(run, Run) else open_run(Path(run))
    if isinstance(run, Run) or (named and is_run(Path(run))):
        cause = f"`policy` is for designs, and {run} is a run, which has its own"
        raise DraftError(cause, "omit `policy`, or name a design")
    if named:
        try:
            find_design(run)
        except DraftError:
            cause = f"'{run}' is neither a run of `draft.train` nor a design"
            remedy = "name a folder of `draft.train`, or a robot"
            raise DraftError(cause, remedy) from None
    return Guest.of(run, policy)


def prepare(
    run: Run | Design | Spec | str | Path,
    battery: Sequence[str] | None = None,
    levels: int | Sequence[float] | None = None,
    *,
    checkpoint: int | None = None,
    replicas: int = 256,
    seconds: float = 12.0,
    seed: int = 0,
    errors: str | None = None,
    protocol: str = "walking",
    payload: float = 0.0,
    regeneration: float = 0.0,
    out: Path | None = None,
    policy: str | Path | None = None,
) -> Evaluation:
    """Check the settings of an evaluation, and find the folder of its result; see `evaluate`."""
    run = run if isinstance(run, Run) else opened(run, policy)
    check(replicas, seconds, seed, payload, regeneration)
    for what, name, known in (
        ("source of errors", errors, SOURCES),
        ("protocol", protocol, PROTOCOLS),
    ):
        if name is not None and name not in known:
            raise DraftError(f"there is no {what} '{name}'", suggest(name, known))
    names = usual(run) if battery is None else named(",".join(battery))
    chosen = batteries(names, levels)
    request = make_request(
        run,
        chosen,
        checkpoint,
        cast("Protocol", protocol),
        replicas=replicas,
        seconds=seconds,
        settle=settle(seconds),
        evaluation_seed=seed,
        errors=cast("ErrorSource | None", errors),
        payload=payload,
        regeneration=regeneration,
    )
    return Evaluation(run, chosen, request, result_folder(run, request, out))


def evaluate(
    run: Run | Design | Spec | str | Path,
    battery: Sequence[str] | None = None,
    levels: int | Sequence[float] | None = None,
    *,
    checkpoint: int | None = None,
    replicas: int = 256,
    seconds: float = 12.0,
    seed: int = 0,
    errors: str | None = None,
    protocol: str = "walking",
    payload: float = 0.0,
    regeneration: float = 0.0,
    out: str | Path | None = None,
    again: bool = False,
    device: str = "auto",
    engine: str = "auto",
    progress: Report | None = None,
    policy: str | Path | None = None,
) -> Summary:
    """Measure what a run's policy, or a design with a policy, can do, level by level, and save it.

        >>> run = draft.train("cheetah", "run", iterations=1, envs=4, replicas=1, device="cpu")
        >>> found = draft.evaluate(
        ...     run, ["walk"], levels=1, replicas=2, seconds=1.0, device="cpu"
        ... )
        >>> found.scalars["walk_speed"] < 3  # [m/s]
        True

    Args:
        run: the run or its folder, or a design.
        battery: names among "walk", "speed", "stairs" and "push"; None for those of its stage, and
            for all but the stairs of a design. Results of other stages' batteries are flagged.
        levels: number of levels per battery, or the levels of one, such as [0.4, 1.0]; None for
            all.
        checkpoint: iterations of the checkpoint; None for the last.
        replicas: roll-outs of each level, divided among the designs.
        seconds: duration of a roll-out, of which the first sixth is not measured [s].
        seed: seed of everything random.
        errors: source of the robots' inertia errors: "twins", "survey" or "paper"; None for
            robots as they were trained.
        protocol: "walking", or "published", in which one robot in ten is commanded to stand.
        payload: mass of a block on the trunk that the policy was not trained with [kg].
        regeneration: share of the power of braking joints that returns to the battery, 0 to 1.
        out: folder to write the result to, as OUT/RUN/ or OUT/DESIGN-POLICY/; None for evaluation/
            in the run's folder, or in out/DESIGN-POLICY.
        again: whether to evaluate even if the result exists.
        device: "auto", "cpu", "cuda" or "cuda:1".
        engine: "auto", "native" or "warp".
        progress: called after every step with the batteries' names, steps done and total steps.
        policy: policy of a design: folder of a run or ONNX file; None for the one that ships.

    Returns:
        Curves, scalars with reasons where there is none, utilisation, flags: the content of
        summary.json.

    Raises:
        DraftError: numbers out of range, an unknown name, no such checkpoint or device, too little
            memory, a library that is missing, or a result that cannot be written.
    """
    evaluation = prepare(
        run,
        battery,
        levels,
        checkpoint=checkpoint,
        replicas=replicas,
        seconds=seconds,
        seed=seed,
        errors=errors,
        protocol=protocol,
        payload=payload,
        regeneration=regeneration,
        out=None if out is None else Path(out),
        policy=policy,
    )
    summary = None if again else evaluation.existing()
    if summary is None:
        summary, _ = evaluation.measure(
            *setting(device, engine), progress or (lambda names, step, steps: None)
        )
    return summary


def setting(device: str = "auto", engine: str = "auto") -> tuple[str, Engine]:
    """Choose the device and the engine of an evaluation.

    Args:
        device: "auto", "cpu", "cuda" or "cuda:1".
        engine: "auto", "native" or "warp".

    Raises:
        DraftError: there is no such device, or there are several; the engine does not run on it;
            mjlab or pyarrow is missing.
    """
    quiet()
    need("mjlab", "learn")
    need("pyarrow", "learn")  # Checked before the work, not after it.
    chosen = devices(device)
    if len(chosen) > 1:
        cause = f"`device` {device} names {len(chosen)} GPUs, and an evaluation uses one"
        raise DraftError(cause, 'pass `device="cuda:0"`, and others for other runs')
    return chosen[0], choose(engine, chosen)


def check(
    replicas: int,
    seconds: float,
    seed: int,
    payload: float = 0.0,
    regeneration: float = 0.0,
) -> None:
    """Check that numbers of an evaluation are within their ranges.

    Args:
        replicas: roll-outs of each level.
        seconds: duration of a roll-out [s].
        seed: seed of everything random.
        payload: mass on the trunk [kg].
        regeneration: share of the power of braking joints that returns to the battery.

    Raises:
        DraftError: one is out of range.
    """
    if not 0 < replicas <= 10**6:
        cause = f"`replicas` {replicas} is not above 0 and at most {10**6}"
        raise DraftError(cause, "such as 256")
    if not 0.5 <= seconds <= 3600:
        cause = f"`seconds` {seconds:g} is not from 0.5 to 3600"
        raise DraftError(cause, "omit it for 12")
    if not 0 <= seed < 2**31:
        raise DraftError(f"`seed` {seed} is not from 0 to 2**31 - 1", "such as 0")
    if not 0 <= payload <= HEAVIEST:
        cause = f"`payload` {payload:g} is not from 0 to {HEAVIEST:g} kg"
        raise DraftError(cause, "omit it for no payload")
    if not 0 <= regeneration <= 1:
        cause = f"`regeneration` {regeneration:g} is not a share from 0 to 1"
        raise DraftError(cause, "omit it for no regeneration, or give 0.5")


def _device_name(device: str) -> str:
    """Name of a device for the record."""
    if device == "cpu":
        return "cpu"
    return need("torch", "learn").cuda.get_device_name(device)
