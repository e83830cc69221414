"""Collection of a study's finished runs into a results folder, all or none."""

from __future__ import annotations

import shutil
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path

from draft.errors import DraftError
from draft.files import new_folder, write
from draft.learn.task.stages import STAGES
from draft.learn.training.run import differences
from draft.study.report import folder as files
from draft.study.report.missing import missing
from draft.study.report.records import Planned, Study, Trained
from draft.study.store import FILE


@dataclass(frozen=True)
class Collected:
    """Outcome of a collection.

    Attributes:
        folder: folder of the results.
        study: everything that it holds now.
        new: names of runs that it did not hold before.
        changed: names of runs that it held with other content.
        omitted: what was found and not collected, in words.
        missing: what the study plans and the results lack, in words.
        written: whether a file has changed.
        size: size of all files [bytes].
    """

    folder: Path
    study: Study
    new: tuple[str, ...]
    changed: tuple[str, ...]
    omitted: tuple[str, ...]
    missing: tuple[str, ...]
    written: bool
    size: int


def collect(source: Path, out: Path) -> Collected:
    """Collect the finished runs of a study.

    Runs in the results folder stay there; a run of the same name is replaced.

    Args:
        source: folder of the study.
        out: results folder, which is created or updated.

    Raises:
        DraftError: the study has no finished run, a run has another plan than the others, the
            folder holds something else or is damaged, or it cannot be written.
    """
    target = out.resolve()
    old = _old(target)
    omitted: list[str] = []
    new = _finished(files.read(source), omitted)
    if not new.singles:
        remedy = "; ".join(omitted) or "resume the study"
        raise DraftError(f"'{source}' has no finished run", remedy)
    merged = _merged(old, new) if old else new
    _check_alike(merged, target)
    texts = files.texts(merged)
    if (source / FILE).is_file():
        texts[f"{merged.name}.yaml"] = (source / FILE).read_text(encoding="utf-8")
    before = {name: _text(target / name) for name in texts}
    written = texts != before
    if written:
        _write(target, texts)
    runs = [f"{files.RUNS}/{one.name}.json" for one in merged.singles]
    return Collected(
        folder=out,
        study=merged,
        new=tuple(Path(name).stem for name in runs if before[name] is None),
        changed=tuple(Path(name).stem for name in runs if before[name] not in (None, texts[name])),
        omitted=tuple(omitted),
        missing=tuple(missing(merged)),
        written=written,
        size=sum(len(text.encode()) for text in texts.values()),
    )


def _old(target: Path) -> Study | None:
    """Return the existing results; None for a new folder."""
    if not target.exists():
        return None
    if files.is_results(target):
        return files.read(target, results=True)
    if not target.is_dir() or any(target.iterdir()):
        cause = f"'{target}' exists and does not hold results of a study; it is kept"
        raise DraftError(cause, "choose another `out`")
    return None


def _finished(study: Study, omitted: list[str]) -> Study:
    """Return the finished runs of single designs, and their evaluations at the last iteration."""
    omitted += study.warnings
    for one in study.families:
        omitted.append(f"{one.name} is of a family; only single designs are collected")
    runs = []
    for one in study.singles:
        if one.iterations < one.planned:
            done = f"{one.iterations} of {one.planned} iterations"
            omitted.append(f"{one.name} is not finished: {done}")
            continue
        known = {}
        for name, each in one.evaluations.items():
            if each.summary.iteration in (None, one.planned):
                known[name] = each
            else:
                words = f"is of iteration {each.summary.iteration:g}, not {one.planned}"
                omitted.append(f"{one.name}, {name}: the evaluation {words}")
        runs.append(one.model_copy(update={"evaluations": known}))
    return replace(study, runs=tuple(runs))


def _merged(old: Study, new: Study) -> Study:
    """Return the results with the runs of a study.

    A run that was not trained again keeps evaluations that the study lacks now, as while they are
    repeated with more replicas.
    """
    runs = {one.name: one for one in old.runs}
    for one in new.runs:
        before = runs.get(one.name)
        kept = before.evaluations if before and _same_training(before, one) else {}
        evaluations = dict(sorted({**kept, **one.evaluations}.items()))
        runs[one.name] = one.model_copy(update={"evaluations": evaluations})
    planned = _joined(old.planned, new.planned)
    name = planned.name if planned else old.name
    return replace(new, name=name, runs=tuple(runs.values()), planned=planned)


def _same_training(a: Trained, b: Trained) -> bool:
    return (a.iterations, a.seconds, a.curve) == (b.iterations, b.seconds, b.curve)


def _joined(old: Planned | None, new: Planned | None) -> Planned | None:
    """Return the joint plan of two parts of a study, such as other seeds on another machine."""
    if old is None or new is None:
        return new or old
    seconds = {**old.seconds, **new.seconds}
    failed = [name for name in (*old.failed, *new.failed) if name not in seconds]
    return replace(
        new,
        designs=_union(old.designs, new.designs),
        seeds=tuple(sorted({*old.seeds, *new.seeds})),
        stages=tuple(stage for stage in STAGES if stage in {*old.stages, *new.stages}),
        arms=_union(old.arms, new.arms),
        protocols=_union(old.protocols, new.protocols),
        failed=_union(failed, ()),
        iterations={**old.iterations, **new.iterations},
        seconds=dict(sorted(seconds.items())),
    )


def _union(first: Iterable[str], second: Iterable[str]) -> tuple[str, ...]:
    return tuple(dict.fromkeys((*first, *second)))


def _check_alike(study: Study, target: Path) -> None:
    """Check that all runs have one plan apart from designs, stages and seeds.

    Raises:
        DraftError: one differs; the message says which, and in what.
    """
    by_stage: dict[str, Trained] = {}
    robots: dict[str, Trained] = {}
    for one in study.singles:
        first = by_stage.setdefault(one.stage, one)
        namesake = robots.setdefault(one.design, one)
        plans = [run.plan | {"iterations": run.planned} for run in (first, one)]
        numbers = [{"config": run.plan["config"]} for run in (study.singles[0], one)]
        differing = differences(*plans) + differences(*numbers)
        differing += ["robot"] * (namesake.robots != one.robots)
        if differing:
            what = ", ".join(name.replace("_", " ") for name in dict.fromkeys(differing[:6]))
            other = namesake if differing == ["robot"] else first
            cause = f"run {one.name} is of another plan than {other.name} of '{target}': {what}"
            remedy = "choose another `out`, or delete the folder and collect anew"
            raise DraftError(f"{cause} differ; nothing was written", remedy)


def _text(path: Path) -> str | None:
    try:
        return path.read_text(encoding="utf-8")
    except OSError:
        return None


def _write(target: Path, texts: Mapping[str, str]) -> None:
    """Write files of a folder, all or none; its other files stay."""
    with new_folder(target) as new:
        if target.exists():
            shutil.copytree(target, new, dirs_exist_ok=True)
        for name, text in texts.items():
            write(new / name, text)
