"""Evaluation from Python: run a policy through skill tests, and save its capabilities."""

from __future__ import annotations

import time
from dataclasses import dataclass, replace
from pathlib import Path

from draft.design import Design
from draft.design.references import find_design, open_design
from draft.errors import DraftError
from draft.extras import need
from draft.learn.bodies.legged import legged_robot
from draft.learn.engine.machine import Engine, choose, cores, devices
from draft.learn.measuring.conditions import with_conditions
from draft.learn.measuring.evaluation_options import Options, Report
from draft.learn.measuring.levels import SkillTest, of_stage, skill_tests
from draft.learn.measuring.policies import Source, open_source
from draft.learn.measuring.results import (
    make_request,
    read,
    result_folder,
    save,
    summarise,
)
from draft.learn.measuring.summary import Request, Summary
from draft.learn.silence import quiet
from draft.learn.task.stages import is_like
from draft.learn.training.reached import Reached
from draft.learn.training.run import Run, is_run, open_run
from draft.settings import takes
from draft.spec import Spec

_FLAT = ("walk", "speed", "push")  # Skill tests of a design.


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
            policy: folder of a run or ONNX file; None for the policy that ships for its legs.

        Raises:
            DraftError: there is none of either, or the policy does not drive the design.
        """
        design = open_design(reference)
        member = legged_robot(design)
        source = open_source(policy, blind=True, robot=member)
        source.drive.check(member)
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
        return Reached(None, self.source.forward_for(self.plan.members[0]))


@dataclass(frozen=True)
class Evaluation:
    """An evaluation of a run's policy, or of a design with a policy, checked by `prepare`.

    Attributes:
        run: the run.
        tests: skill tests with their levels.
        request: everything that determines the result.
        folder: folder of the result.
    """

    run: Run
    tests: tuple[SkillTest, ...]
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
            report: called after every step with the tests' names, steps done and total steps.

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
            policy = self.run.source.drive.actor(device)
        else:
            policy = trained(self.run, self.request.iteration, device)
        settings = trial(self.run, self.tests, self.request)
        worlds, histograms = evaluate(settings, policy, device, report, engine.name, cores())
        summary = summarise(
            self.run,
            self.request,
            self.tests,
            worlds,
            histograms,
            device=_device_name(device),
            engine=engine.name,
            took_s=round(time.monotonic() - start, 1),
        )
        save(self.folder, summary, worlds, histograms)
        return summary, len(worlds.fell)


def usual(run: Run) -> tuple[str, ...]:
    """Names of the tests for the policy of a run; for a design, those without stairs."""
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


def prepare(run: Run | Design | Spec | str | Path, options: Options) -> Evaluation:
    """Check the options of an evaluation, and find the folder of its result; see `evaluate`."""
    run = run if isinstance(run, Guest) else opened(run, options.policy)
    names = usual(run) if options.test is None else options.test
    chosen = skill_tests(names, options.levels)
    request = make_request(run, chosen, options)
    with_conditions(run.plan.config, request)  # Refused before anything is loaded.
    out = None if options.out is None else Path(options.out)
    return Evaluation(run, chosen, request, result_folder(run, request, out))


@takes(Options)
def evaluate(run: Run | Design | Spec | str | Path, options: Options) -> Summary:
    """Measure what a run's policy, or a design with a policy, can do, level by level, and save it.

        >>> run = draft.train("cheetah", "run", iterations=1, envs=4, replicas=1, device="cpu")
        >>> found = draft.evaluate(
        ...     run, test=["walk"], levels=1, replicas=2, seconds=1.0, device="cpu"
        ... )
        >>> found.scalars["walk_speed"] < 3  # [m/s]
        True

    Args:
        run: the run or its folder, or a design.
        options: fields of `Options`, by keyword.

    Returns:
        Curves, scalars with reasons where there is none, utilisation, flags: the content of
        summary.json. Results of other stages' tests are flagged.

    Raises:
        DraftError: numbers out of range, an unknown name, no such checkpoint or device, too little
            memory, a library that is missing, or a result that cannot be written.
    """
    evaluation = prepare(run, options)
    summary = None if options.again else evaluation.existing()
    if summary is None:
        where = setting(options.device, options.engine)
        summary, _ = evaluation.measure(*where, options.progress or (lambda *_: None))
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


def _device_name(device: str) -> str:
    """Name of a device for the record."""
    if device == "cpu":
        return "cpu"
    return need("torch", "learn").cuda.get_device_name(device)
