"""The folder of a study: its runs, read where they were made or as text that was collected.

A study's own folder has the plan in study.json, and a folder for each run in runs/. Collected
results are files of text, and the same records give the same bytes:

NAME.yaml           study file
study.json          plan of the study, numbers of its tasks, settings of its stages
designs/NAME.json   robots, each with its MJCF in NAME.xml
runs/NAME.json      one run: its training, its evaluations, its counted samples
"""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable, Mapping
from functools import cache
from pathlib import Path
from typing import Any, Literal, TypeVar

from pydantic import ValidationError

from draft.errors import DraftError
from draft.learn.bodies.legged import LeggedRobot
from draft.learn.measuring.summary import ARMS, PROTOCOLS, first_error, parse
from draft.learn.task.stages import STAGES
from draft.learn.training import progress
from draft.learn.training.members import robots_digest
from draft.learn.training.run import is_run, open_run, read_record, safe
from draft.study.report import samples
from draft.study.report.records import Key, Outcome, Planned, Record, Study, Trained, levels_of
from draft.study.store import DONE, FAILED
from draft.study.store import STATE as STUDY

RUNS, DESIGNS = "runs", "designs"
# Keys of a summary that repeat the run, or the rest of the summary.
_REPEATED: Any = {"evaluations": {"__all__": {"summary": {"asked", "members"}}}}
_Model = TypeVar("_Model", bound=Record)


class StageFile(Record):
    """Settings of a stage: see `draft.learn.training.run.Plan`."""

    environments: int
    ground: str
    see_design: bool
    see_ground: bool


class StudyFile(Record):
    """Content that all runs share."""

    format: Literal[1]
    name: str
    planned: Planned | None
    stages: dict[str, StageFile]
    config: dict[str, dict[str, Any]]


def read(folder: Path, results: bool = False) -> Study:
    """Read the runs of a study.

    Args:
        folder: folder of the study, any folder of runs in `runs/`, or collected results.
        results: whether these must be collected results.

    Returns:
        The study. Runs and evaluations that cannot be read where they were made are omitted, and
        listed in `Study.warnings`.

    Raises:
        DraftError: there is no run that can be read, a file of collected results is damaged, or
            the extra that reads Parquet is not installed.
    """
    paths = sorted(path for path in (folder / RUNS).glob("*") if is_run(path))
    if results and paths:
        cause = f"'{folder}' is the folder of a study, whose results are not collected yet"
        raise DraftError(cause, f'`draft.study.collect("{folder}", out="DIR")`')
    if results and not is_results(folder):
        remedy = "name a folder of collected results"
        raise DraftError(f"'{folder}' holds no results of a study", remedy)
    files = [] if paths else sorted((folder / RUNS).glob("*.json"))
    return _read_collected(folder, files) if results or files else _read_runs(folder, paths)


def is_results(folder: Path) -> bool:
    """Return whether a folder holds collected results."""
    return (folder / STUDY).is_file()


# --- runs where they were made -------------------------------------------------------------


def _read_runs(folder: Path, paths: Iterable[Path]) -> Study:
    planned = _planned(folder)
    warnings: list[str] = []
    found: list[Trained] = []
    for path in paths:
        if path.name.startswith("."):  # A killed process leaves such partial runs.
            continue
        try:
            found.append(_trained(path, planned))
        except DraftError as error:
            warnings += [f"{problem.cause}; it is omitted" for problem in error.problems]
    kept = _kept(found, warnings)
    if not kept:
        remedy = "; ".join(warnings) or "'draft study FILE.yaml' makes one"
        raise DraftError(f"'{folder}' has no run of a study to report on", remedy)
    for one in kept:
        one.evaluations.update(_evaluations(folder / RUNS / one.name, one, warnings))
    name = planned.name if planned else folder.resolve().name
    return Study(name, tuple(kept), tuple(warnings), planned)


def _planned(folder: Path) -> Planned | None:
    """Return the plan in study.json; None if it is missing or cannot be read."""
    try:
        plan = json.loads((folder / STUDY).read_text(encoding="utf-8"))
        groups, jobs = plan["designs"], plan["jobs"]
        return Planned(
            name=str(plan["name"]),
            toy=bool(plan["toy"]),
            designs=tuple(str(g["members"][0]) for g in groups if not g["family"]),
            families=tuple(str(g["name"]) for g in groups if g["family"]),
            seeds=tuple(int(seed) for seed in plan["seeds"]),
            stages=tuple(stage for stage in STAGES if stage in plan["stages"]),
            arms=(ARMS[0], *ARMS[1:] * bool(plan["evaluate"]["perturbed"])),
            protocols=(PROTOCOLS[0], *PROTOCOLS[1:] * bool(plan["evaluate"]["published"])),
            failed=tuple(name for name, job in jobs.items() if job["state"] == FAILED),
            recipe=plan.get("recipe"),
            iterations={str(s): int(n) for s, n in plan.get("iterations", {}).items()},
            seconds={n: float(job["seconds"]) for n, job in jobs.items() if _took(job)},
        )
    except (OSError, ValueError, TypeError, KeyError, IndexError, AttributeError):
        return None


def _took(job: Mapping[str, object]) -> bool:
    """Return whether the time of a training or an evaluation is known."""
    return job["state"] == DONE and job.get("kind") != "report" and bool(job.get("seconds"))


def _trained(folder: Path, planned: Planned | None) -> Trained:
    """Read a run without its evaluations.

    Raises:
        DraftError: it cannot be read.
    """
    run = open_run(folder)
    plan, stage = run.plan.record(), run.plan.stage
    asked = planned.iterations.get(stage) if planned else None
    rows = progress.thin(progress.read(folder / progress.PROGRESS))
    columns = dict.fromkeys(name for row in rows for name in row)
    versions = read_record(folder).get("versions")
    return Trained(
        format=1,
        run=folder.name,
        design=run.plan.members[0].name,
        stage=stage,
        seed=run.plan.seed,
        robots=plan["robots"],
        planned=asked or run.plan.config.iterations(stage),
        iterations=run.done(),
        seconds=run.seconds() or None,
        engine=run.engine(),
        processes=run.processes(),
        versions={str(k): str(v) for k, v in dict(versions or {}).items()},
        curve={name: [row.get(name) for row in rows] for name in columns},
        evaluations={},
        members=run.plan.members,
        plan={name: plan[name] for name in (*StageFile.model_fields, "config")},
    )


def _kept(found: Iterable[Trained], warnings: list[str]) -> list[Trained]:
    """Return the runs without repetitions, and without other robots of the same name."""
    kept: list[Trained] = []
    robots: dict[str, str] = {}
    keys: dict[Key, str] = {}
    for one in found:
        if one.single and robots.setdefault(one.design, one.robots) != one.robots:
            words = f"{one.name} is of another robot that is also named {one.design}"
        elif one.single and keys.setdefault(one.key, one.name) != one.name:
            words = f"{one.name} repeats {keys[one.key]}"
        else:
            kept.append(one)
            continue
        warnings.append(f"{words}; it is omitted")
    return kept


def _evaluations(folder: Path, run: Trained, warnings: list[str]) -> dict[str, Outcome]:
    found: dict[str, Outcome] = {}
    for path in sorted((folder / "evaluation").glob("*/summary.json")):
        where = "/".join(path.parts[-4:])
        try:
            summary = parse(path.read_text(encoding="utf-8"))
        except (OSError, ValueError) as error:
            warnings.append(f"{where} cannot be read ({error}); it is omitted")
            continue
        if summary.robots not in (None, run.robots):
            warnings.append(f"{where} is of other robots than its run; it is omitted")
            continue
        one = Outcome(summary=summary, samples={})
        if run.single and one.arm == "nominal":  # Pages show no other counts.
            one.samples.update(samples.read(path.parent, levels_of(summary), warnings))
        found[one.name] = one
    return dict(sorted(found.items()))


# --- collected results ---------------------------------------------------------------------


def texts(study: Study) -> dict[str, str]:
    """Return the files of collected results by name, without the study file.

    Args:
        study: runs of single designs that agree in their plans; see `draft.study.report.collect`.
    """
    stages = {s: one.plan for s in STAGES for one in study.singles if one.stage == s}
    shared = StudyFile(
        format=1,
        name=study.name,
        planned=study.planned,
        stages={
            stage: StageFile(**{name: plan[name] for name in StageFile.model_fields})
            for stage, plan in stages.items()
        },
        config=study.singles[0].plan["config"],
    )
    found = {STUDY: dumps(shared.model_dump(mode="json"))}
    for name, member in study.members.items():
        numbers = member.as_dict()
        found[f"{DESIGNS}/{safe(name)}.xml"] = numbers.pop("xml")
        found[f"{DESIGNS}/{safe(name)}.json"] = dumps(numbers)
    for one in study.singles:
        data = one.model_dump(mode="json", by_alias=True, exclude_unset=True, exclude=_REPEATED)
        found[f"{RUNS}/{one.name}.json"] = dumps(data)
    return found


def dumps(value: object, new_line: str = "\n") -> str:
    """Return JSON with one key per line, and each list of numbers or words on one line."""
    inner = new_line + " "
    if isinstance(value, dict) and value:
        pairs = (f"{json.dumps(key)}: {dumps(item, inner)}" for key, item in value.items())
        text = "{" + inner + f",{inner}".join(pairs) + new_line + "}"
    elif isinstance(value, (list, tuple)) and any(isinstance(v, (list, dict)) for v in value):
        text = "[" + inner + f",{inner}".join(dumps(v, inner) for v in value) + new_line + "]"
    else:
        text = json.dumps(value, separators=(",", ":"), ensure_ascii=False, allow_nan=False)
    return text + "\n" * (new_line == "\n")


def _read_collected(folder: Path, paths: Iterable[Path]) -> Study:
    shared, robot = _read(folder / STUDY, StudyFile), cache(_robot)
    runs = tuple(_collected(path, shared, robot) for path in paths)
    if not runs:
        raise _broken(folder / RUNS, "no run is in it")
    return Study(shared.name, runs, (), shared.planned)


def _collected(path: Path, study: StudyFile, robot: Callable[[Path], LeggedRobot]) -> Trained:
    """Read a run.

    Raises:
        DraftError: it is damaged, or not of this study.
    """
    one = _read(path, Trained)
    name = f"{safe(one.design)}.json"
    member = robot(path.parents[1] / DESIGNS / name)
    if one.robots != robots_digest([member]):
        raise _broken(path, f"it is of another robot than {DESIGNS}/{name}")
    if one.stage not in study.stages:
        raise _broken(path, f"{STUDY} says nothing of stage {one.stage}")
    if one.name != path.stem:
        raise _broken(path, f"it is of run {one.name}")
    plan = study.stages[one.stage].model_dump() | {"config": study.config}
    return one.model_copy(update={"members": (member,), "plan": plan})


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


def _broken(path: Path, why: str) -> DraftError:
    remedy = "restore it, or delete the folder and collect the results again"
    return DraftError(f"{path} cannot be read as results: {why}", remedy)
