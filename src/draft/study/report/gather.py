"""Reading a study's folder: its plan, runs, trainings and evaluations.

What cannot be read is omitted and listed in `Study.warnings`.
"""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from dataclasses import replace
from pathlib import Path

from draft.errors import DraftError
from draft.learn.measuring.summary import ARMS, PROTOCOLS, parse
from draft.learn.task.stages import STAGES
from draft.learn.training.progress import PROGRESS, read, thin
from draft.learn.training.run import RUN, Run, open_run, read_record
from draft.study.report import samples
from draft.study.report.records import Evaluation, Key, Planned, Study, Trained
from draft.study.store import DONE, FAILED
from draft.study.store import STATE as PLAN


def gather(folder: Path) -> Study:
    """Read a study's folder.

    Raises:
        DraftError: the folder holds no run that can be read, or the extra that reads Parquet is
            not installed.
    """
    warnings: list[str] = []
    found: dict[Path, Trained] = {}
    planned = _planned(folder)
    for path in sorted((folder / "runs").glob("*")):
        # A killed process leaves partial runs whose names start with a dot.
        if (path / RUN).is_file() and not path.name.startswith("."):
            try:
                found[path] = _trained(open_run(path), planned)
            except DraftError as error:
                warnings += [f"{problem.cause}; it is omitted" for problem in error.problems]
    kept = _kept(found, warnings)
    if not kept:
        remedy = "; ".join(warnings) or "name the folder of a study"
        raise DraftError(f"'{folder}' has no run of a study to report on", remedy)
    evaluations = [one for path, run in kept.items() for one in _evaluations(path, run, warnings)]
    runs = sorted(kept.values(), key=lambda one: one.place)
    return Study(
        name=planned.name if planned else folder.resolve().name,
        singles=tuple(one for one in runs if one.single),
        families=tuple(one for one in runs if not one.single),
        evaluations=tuple(evaluations),
        warnings=tuple(warnings),
        planned=planned,
    )


def _planned(folder: Path) -> Planned | None:
    """Return the plan in study.json; None if it is missing or cannot be read."""
    try:
        plan = json.loads((folder / PLAN).read_text(encoding="utf-8"))
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


def _trained(run: Run, planned: Planned | None) -> Trained:
    versions = read_record(run.folder).get("versions")
    record = run.plan.record()
    plan = {name: record[name] for name in record if name not in ("designs", "robots", "origin")}
    asked = planned.iterations.get(run.plan.stage) if planned else None
    return Trained(
        name=run.folder.name,
        members=run.plan.members,
        plan=plan,
        planned=asked or run.plan.config.iterations(run.plan.stage),
        iterations=run.done(),
        seconds=run.seconds() or None,
        engine=run.engine(),
        processes=run.processes(),
        versions={str(k): str(v) for k, v in dict(versions or {}).items()},
        rows=thin(read(run.folder / PROGRESS)),
    )


def _kept(found: dict[Path, Trained], warnings: list[str]) -> dict[Path, Trained]:
    """Return the runs without repetitions, and without other robots of the same name."""
    kept: dict[Path, Trained] = {}
    robots: dict[str, str] = {}
    keys: dict[Key, str] = {}
    for path, one in found.items():
        if one.single:
            if robots.setdefault(one.key[0], one.robots) != one.robots:
                warnings.append(
                    f"{one.name} is of another robot that is also named {one.key[0]}; it is omitted"
                )
                continue
            if one.key in keys:
                warnings.append(f"{one.name} repeats {keys[one.key]}; it is omitted")
                continue
            keys[one.key] = one.name
        kept[path] = one
    return kept


def _evaluations(folder: Path, run: Trained, warnings: list[str]) -> Iterator[Evaluation]:
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
        one = Evaluation(run, summary)
        if run.single and one.arm == "nominal" and one.levels:  # Pages show no other counts.
            found, unread = samples.read(path.parent, one.levels)
            warnings += unread
            one = replace(one, samples=found)
        yield one
