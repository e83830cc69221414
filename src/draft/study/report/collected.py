"""Files of a results folder: the measurements of a study, as plain text.

NAME.yaml           study file
study.json          plan of the study, numbers of its tasks, settings of its stages
designs/NAME.json   robots, each with its MJCF in NAME.xml
runs/NAME.json      one run: its training, its evaluations, its counted samples

The same records give the same bytes, and each curve is on one line, so that diffs are short.
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Literal, Self, TypeVar

import numpy as np
from pydantic import BaseModel, ConfigDict, Field, ValidationError

from draft.errors import DraftError
from draft.learn.bodies.legged import LeggedRobot
from draft.learn.measuring.summary import Summary, first_error
from draft.learn.measuring.utilisation import BINS, CELLS
from draft.learn.task.stages import STAGES, StageName
from draft.learn.training.members import robots_digest
from draft.learn.training.run import is_run, safe
from draft.study.report.records import Evaluation, Planned, Samples, Study, Trained
from draft.values import Array

FORMAT = 1
STUDY, RUNS, DESIGNS = "study.json", "runs", "designs"
# Keys of a summary that repeat the run, or the rest of the summary.
_REPEATED = {"evaluations": {"__all__": {"summary": {"asked", "members"}}}}
# Fields of a file that are attributes of a `Trained`.
_COPIED = (
    *("stage", "seed", "robots", "planned", "iterations", "seconds", "engine", "processes"),
    "versions",
)
_Model = TypeVar("_Model", bound=BaseModel)
Joint = Literal["hip roll", "hip pitch", "knee"]
Quantity = Literal["torque", "speed", "sum"]
Counts = list[int]


class _File(BaseModel):
    """Part of a results file; unknown keys and infinite numbers are errors."""

    model_config = ConfigDict(extra="forbid", allow_inf_nan=False)


class SamplesFile(_File):
    """Counted samples of a skill test; trailing zeros are cut off."""

    bins: dict[Joint, dict[Quantity, Counts]]
    plane: dict[Joint, list[Counts]]

    @classmethod
    def of(cls, samples: Samples) -> Self:
        """Return the part of a file that holds some samples."""
        bins: dict[Any, dict[Any, Counts]] = {}
        for (joint, quantity), counts in samples.counts.items():
            bins.setdefault(joint, {})[quantity] = _cut(counts)
        plane: dict[Any, list[Counts]] = {
            joint: [_cut(row) for row in cells] for joint, cells in samples.plane.items()
        }
        return cls(bins=bins, plane=plane)

    def samples(self) -> Samples:
        """Return the samples.

        Raises:
            ValueError: more bins are counted than there are.
        """
        counts = {
            (str(joint), str(quantity)): _filled(counts, BINS)
            for joint, by_quantity in self.bins.items()
            for quantity, counts in by_quantity.items()
        }
        plane = {
            str(joint): np.array([_filled(row, CELLS) for row in rows]).reshape(CELLS, CELLS)
            for joint, rows in self.plane.items()
        }
        return Samples(counts, plane)


def _cut(counts: Array) -> Counts:
    """Return counts without trailing zeros."""
    return [int(count) for count in np.trim_zeros(counts, "b")]


def _filled(counts: Counts, length: int) -> Array:
    """Return counts with their trailing zeros.

    Raises:
        ValueError: there are too many.
    """
    return np.pad(np.array(counts, dtype=float), (0, length - len(counts)))


class EvaluationFile(_File):
    """Summary of an evaluation, with its samples by test."""

    summary: Summary
    samples: dict[str, SamplesFile]


class RunFile(_File):
    """A run: see `draft.study.report.records.Trained`."""

    format: Literal[1]
    run: str
    design: str
    stage: StageName
    seed: int
    robots: str
    planned: int = Field(ge=0)
    iterations: int = Field(ge=0)
    seconds: float | None
    engine: str | None
    processes: int | None
    versions: dict[str, str]
    curve: dict[str, list[float | None]]
    evaluations: dict[str, EvaluationFile]


class StageFile(_File):
    """Settings of a stage: see `draft.learn.training.run.Plan`."""

    environments: int
    ground: str
    see_design: bool
    see_ground: bool


class StudyFile(_File):
    """Content that all runs share."""

    format: Literal[1]
    name: str
    planned: Planned | None
    stages: dict[str, StageFile]
    config: dict[str, dict[str, Any]]


def texts(study: Study) -> dict[str, str]:
    """Return the files of a results folder by name, without the study file.

    Args:
        study: runs of single designs that agree in their plans; see `collect.check_alike`.
    """
    found = {STUDY: dumps(_study(study).model_dump(mode="json"))}
    for name, member in study.members.items():
        numbers = member.as_dict()
        found[f"{DESIGNS}/{safe(name)}.xml"] = numbers.pop("xml")
        found[f"{DESIGNS}/{safe(name)}.json"] = dumps(numbers)
    for one in study.singles:
        own = [evaluation for evaluation in study.evaluations if evaluation.run is one]
        found[f"{RUNS}/{one.name}.json"] = dumps(
            _run(one, own).model_dump(mode="json", exclude_unset=True, exclude=_REPEATED)
        )
    return found


def _study(study: Study) -> StudyFile:
    plans = {stage: one.plan for stage in STAGES for one in study.singles if one.stage == stage}
    return StudyFile(
        format=FORMAT,
        name=study.name,
        planned=study.planned,
        stages={
            stage: StageFile(**{name: plan[name] for name in StageFile.model_fields})
            for stage, plan in plans.items()
        },
        config=study.singles[0].plan["config"],
    )


def _run(one: Trained, evaluations: list[Evaluation]) -> RunFile:
    columns = dict.fromkeys(name for row in one.rows for name in row)
    return RunFile(
        format=FORMAT,
        run=one.name,
        design=one.key[0],
        curve={name: [row.get(name) for row in one.rows] for name in columns},
        evaluations={
            each.name: EvaluationFile(summary=each.summary, samples=_samples(each))
            for each in sorted(evaluations, key=lambda each: each.name)
        },
        **{name: getattr(one, name) for name in _COPIED},
    )


def _samples(one: Evaluation) -> dict[str, SamplesFile]:
    return {
        test: SamplesFile.of(samples)
        for test, samples in one.samples.items()
        if samples.counts or samples.plane
    }


def dumps(value: object) -> str:
    """Return JSON with one key per line, and each list of numbers or words on one line."""
    return _dumps(value, "\n") + "\n"


def _dumps(value: object, new_line: str) -> str:
    inner = new_line + " "
    if isinstance(value, dict) and value:
        pairs = (f"{json.dumps(key)}: {_dumps(item, inner)}" for key, item in value.items())
        return "{" + inner + f",{inner}".join(pairs) + new_line + "}"
    if isinstance(value, (list, tuple)) and any(isinstance(v, (list, dict)) for v in value):
        return (
            "[" + inner + f",{inner}".join(_dumps(item, inner) for item in value) + new_line + "]"
        )
    return json.dumps(value, separators=(",", ":"), ensure_ascii=False, allow_nan=False)


def is_results(folder: Path) -> bool:
    """Return whether a folder holds results."""
    return (folder / STUDY).is_file()


def study_command(words: Sequence[str]) -> str:
    """Return the line of a terminal that runs `draft study`."""
    return f"draft study {' '.join(words)}"


def read(folder: Path) -> Study:
    """Read a results folder.

    Raises:
        DraftError: the folder holds none, it is the folder of a study itself, or one of its files
            is damaged.
    """
    if any(map(is_run, (folder / RUNS).glob("*"))):
        cause = f"'{folder}' is the folder of a study, whose results are not collected yet"
        raise DraftError(cause, study_command(["collect", str(folder), "--out", "DIR"]))
    if not is_results(folder):
        remedy = "name a folder of collected results"
        raise DraftError(f"'{folder}' holds no results of a study", remedy)
    study = _read(folder / STUDY, StudyFile)
    robots = {path.stem: _robot(path) for path in sorted((folder / DESIGNS).glob("*.json"))}
    runs: list[Trained] = []
    evaluations: list[Evaluation] = []
    for path in sorted((folder / RUNS).glob("*.json")):
        file = _read(path, RunFile)
        run = _trained(path, file, study, robots)
        runs.append(run)
        evaluations += [_evaluation(path, run, name, e) for name, e in file.evaluations.items()]
    if not runs:
        raise _broken(folder / RUNS, "no run is in it")
    runs.sort(key=lambda one: one.place)
    return Study(study.name, tuple(runs), (), tuple(evaluations), (), study.planned)


def _read(path: Path, kind: type[_Model]) -> _Model:
    try:
        return kind.model_validate_json(path.read_text(encoding="utf-8"))
    except ValidationError as error:
        raise _broken(path, first_error(error)) from None
    except (OSError, ValueError) as error:
        raise _broken(path, str(error)) from None


def _robot(path: Path) -> LeggedRobot:
    try:
        numbers = json.loads(path.read_text(encoding="utf-8"))
        xml = path.with_suffix(".xml").read_text(encoding="utf-8")
        return LeggedRobot.from_dict(numbers | {"xml": xml})
    except KeyError as error:
        raise _broken(path, f"{error.args[0]} is missing") from None
    except (OSError, ValueError, TypeError) as error:
        raise _broken(path, str(error)) from None


def _trained(
    path: Path, file: RunFile, study: StudyFile, robots: Mapping[str, LeggedRobot]
) -> Trained:
    member = robots.get(safe(file.design))
    if member is None:
        raise _broken(path, f"{DESIGNS}/{safe(file.design)}.json is missing")
    if file.robots != robots_digest([member]):
        raise _broken(path, f"it is of another robot than {DESIGNS}/{safe(file.design)}.json")
    if file.stage not in study.stages:
        raise _broken(path, f"{STUDY} says nothing of stage {file.stage}")
    if file.run != path.stem:
        raise _broken(path, f"it is of run {file.run}")
    settings = study.stages[file.stage].model_dump()
    plan = {"stage": file.stage, "seed": file.seed} | settings | {"config": study.config}
    return Trained(
        name=file.run,
        members=(member,),
        plan=plan,
        planned=file.planned,
        iterations=file.iterations,
        seconds=file.seconds,
        engine=file.engine,
        processes=file.processes,
        versions=file.versions,
        rows=_rows(path, file.curve),
    )


def _rows(path: Path, curve: Mapping[str, list[float | None]]) -> list[dict[str, float]]:
    if len({len(values) for values in curve.values()}) > 1:
        raise _broken(path, "curve: its columns differ in length")
    rows = zip(*curve.values(), strict=True)
    return [{name: x for name, x in zip(curve, row, strict=True) if x is not None} for row in rows]


def _evaluation(path: Path, run: Trained, name: str, file: EvaluationFile) -> Evaluation:
    try:
        samples = {test: cut.samples() for test, cut in file.samples.items()}
    except ValueError:
        raise _broken(path, f"evaluations.{name}: it counts more bins than there are") from None
    made = Evaluation(run, file.summary, samples)
    if made.name != name:
        raise _broken(path, f"evaluations.{name}: it is of {made.name}")
    return made


def _broken(path: Path, why: str) -> DraftError:
    remedy = "restore it, or delete the folder and collect the results again"
    return DraftError(f"{path} cannot be read as results: {why}", remedy)
