"""Capabilities of a real robot in three columns: the maker's masses, predicted ones, published."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from pathlib import Path

from draft.errors import DraftError
from draft.imports.options import Options
from draft.laws.survey import read
from draft.learn.measuring.evaluation import setting
from draft.learn.measuring.evaluation_options import Extras
from draft.learn.measuring.policies import Source, climbing_family, open_source
from draft.learn.training.progress import Progress
from draft.twins.compare import Comparison, compare_twin
from draft.validation.arms import by_maker, predicted
from draft.validation.capabilities import Estimate, in_closed_form, measured
from draft.validation.own import own_policy
from draft.validation.published import figures
from draft.validation.verdicts import Verdict, verdicts

Report = Callable[[str, int, int], object]


@dataclass(frozen=True, eq=False, repr=False)
class RealRobot:
    """A real robot's capabilities.

    Attributes:
        key: key of the robot in the survey, or its name.
        twin: the comparison of its masses.
        policy: name of the policy.
        maker: capabilities with the masses of its maker, by name.
        predicted: the same with the masses that Draft predicts.
        verdicts: the predictions beside what is published; none for a robot without figures.
        notes: what could not be measured, and doubts.
    """

    key: str
    twin: Comparison
    policy: str
    maker: dict[str, Estimate]
    predicted: dict[str, Estimate]
    verdicts: tuple[Verdict, ...]
    notes: tuple[str, ...]

    def __repr__(self) -> str:
        return f"RealRobot('{self.key}', {len(self.verdicts)} published figures)"


def real_robot(
    file: str | Path,
    *,
    policy: str | Path | None = None,
    train: str | Path | None = None,
    iterations: int | None = None,
    key: str = "",
    options: Options | None = None,
    population: str | None = None,
    replicas: int = 16,
    seconds: float = 9.0,
    seed: int = 0,
    conditions: Extras | None = None,
    device: str = "auto",
    engine: str = "auto",
    report: Report | None = None,
) -> RealRobot:
    """Measure what a real robot can do, by its maker's masses and by those that Draft predicts.

        >>> vendor = draft.export(draft.load("quadruped").resolve(), "vendor") / "robot.urdf"
        >>> found = draft.real_robot(vendor, replicas=1, seconds=0.6)  # doctest: +SKIP
        >>> found.predicted["top_speed"].value  # doctest: +SKIP
        4.1

    Args:
        file: the maker's description, as `draft.compare_twin` takes it.
        policy: folder of a run or ONNX file; None for the policy that ships for its legs.
        train: folder for the runs of two policies of its own, one with each masses and both of the
            same seed, which are measured instead; runs that it holds are resumed.
        iterations: iterations of each training; None for the recipe's.
        key: key of the robot in the survey, which is held out of the trends; "" for the name of the
            file.
        options: decisions that overrule the import's.
        population: "humanoid" or "quadruped"; None as imported.
        replicas: roll-outs at each level.
        seconds: duration of a roll-out [s].
        seed: seed of everything random.
        conditions: physics that differs from that of the training.
        device: device of the roll-outs.
        engine: physics engine.
        report: called after every step with the arm and tests, steps done and total steps.

    Raises:
        DraftError: the description cannot be used, or an argument is out of range.
    """
    key = key or Path(file).stem
    known = _surveyed(key)
    twin = compare_twin(
        file,
        population=population,
        options=options or Options(),
        without=(key,) if known else (),
        key=key if known else "",
    )
    notes = _guesses(twin)
    source, climber = _policies(policy, twin, notes)
    arms: dict[str, dict[str, Estimate]] = {}
    members = {"maker": by_maker(twin), "predicted": predicted(twin)}
    for arm, member in members.items():
        arms[arm] = in_closed_form(member, twin.design)
        own = source
        if train is not None:
            told = partial(_learnt, report, arm)
            folder = Path(train) / f"{key}-{arm}"
            family = source is not None and not source.of_any_legs
            chosen = {"family": family, "seed": seed, "iterations": iterations}
            own = own_policy(member, folder, **chosen, report=told)
        if own is None:
            continue
        arms[arm] |= measured(
            own,
            member,
            *setting(device, engine),
            replicas=replicas,
            seconds=seconds,
            seed=seed,
            conditions=conditions,
            climber=climber,
            report=partial(_told, report, arm),
        )
        if train is None and (words := own.warning(member)):
            notes.append(words)
    if not any(one.robot == key for one in figures()):
        notes.append(f"no published figures of '{key}' ship with Draft")
    return RealRobot(
        key=key,
        twin=twin,
        policy=str(train or ("" if source is None else source.name)),
        maker=arms["maker"],
        predicted=arms["predicted"],
        verdicts=tuple(verdicts(key, members["predicted"].leg_length, arms["predicted"])),
        notes=tuple(dict.fromkeys(notes)),
    )


def _told(report: Report | None, arm: str, what: str, step: int, steps: int) -> None:
    if report is not None:
        report(f"{arm}: {what}", step, steps)


def _guesses(twin: Comparison) -> list[str]:
    """A note on torques that are not the maker's, on which every capability depends."""
    drives = twin.files.drives.values()
    guessed = [one.joint for one in drives if one.guessed]
    if not guessed:
        return []
    cause = f"{len(guessed)} of {len(drives)} torques are guesses, as {guessed[0]}'s"
    return [f"{cause}: its capabilities are those of usual motors; state them with `torque`"]


def _learnt(report: Report | None, arm: str, stage: str, now: Progress) -> None:
    if report is not None:
        report(f"{arm}: training, {stage}", now.iteration, now.total)


def _policies(
    policy: str | Path | None, twin: Comparison, notes: list[str]
) -> tuple[Source | None, Source | None]:
    """The policy, and that of stairs, if they drive the robot; a note says why not."""
    try:
        robot = predicted(twin)
        source = open_source(policy, blind=True, robot=robot)
        source.drive.check(robot)
    except DraftError as error:
        if policy is not None:
            raise
        notes.append(f"not measured by roll-outs: {error.problems[0].cause}")
        return None, None
    if source.of_any_legs:  # It has not learnt to climb.
        notes.append("steps were not measured: the policy of all legs does not climb")
        return source, None
    return source, source if policy is not None else climbing_family()


def _surveyed(key: str) -> bool:
    return any(row.robot == key for row in read())
