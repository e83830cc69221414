"""Tables of the runs of a study: trainings, evaluations, provenance, versions, time spent."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable, Sequence
from typing import Any

from draft.learn.measuring.summary import Summary
from draft.learn.task.stages import STAGES
from draft.study.jobs import evaluation_job
from draft.study.report import errors
from draft.study.report.records import Evaluation, Study, Trained, seeds_in_words
from draft.study.report.spread import ARM_WORDS, UNKNOWN, few, spread
from draft.study.report.table import Cell, Column, Table

# Packages whose versions affect what a policy learns.
PACKAGES = ("draft", "mujoco", "mjlab", "torch", "mjbatch", "mujoco-warp")


def training(study: Study) -> Table:
    """Return the runs by design and stage."""
    groups: dict[tuple[str, str], list[Trained]] = {}
    for one in (*study.singles, *study.families):
        groups.setdefault((study.title(one), one.stage), []).append(one)
    order = list(dict.fromkeys([*study.titles.values(), *(name for name, _ in groups)]))
    rows: list[list[Cell]] = []
    for name, stage in sorted(groups, key=lambda g: (order.index(g[0]), list(STAGES).index(g[1]))):
        runs = groups[name, stage]
        asked = {one.planned for one in runs}
        hours = [one.seconds / 3600 for one in runs if one.seconds is not None]
        steps = {one.steps for one in runs}
        rows.append(
            [
                *(name, stage, ", ".join(str(one.seed) for one in runs)),
                few({one.iterations for one in runs}),
                *(few(asked), few({one.environments for one in runs}), few(steps)),
                spread(one.total_steps / 1e6 for one in runs),
                spread(one.seconds / 60 for one in runs if one.seconds is not None) or UNKNOWN,
                sum(hours) if hours else UNKNOWN,
            ]
        )
    columns = [Column("design"), Column("stage"), Column("seeds"), Column("iterations done")]
    columns += [Column("planned"), Column("worlds"), Column("steps")]
    columns += [Column("steps in all", "million", 2), Column("training", "min", 1)]
    columns.append(Column("all seeds", "h", 2))
    caption = (
        "What was trained. Steps are those of each world in an iteration, and those of all worlds "
        "and iterations of a run; minutes are of a run, hours of all seeds."
    )
    return Table("training", caption, columns, rows)


def evaluations(study: Study) -> Table | None:
    """Return the evaluations by design, stage and protocol."""
    groups: dict[tuple[str, str, str], list[Summary]] = {}
    for one in study.evaluations:
        whose = study.title(one.run), one.run.stage, one.protocol
        groups.setdefault(whose, []).append(one.summary)
    rows: list[list[Cell]] = []
    for (name, stage, protocol), found in groups.items():
        arms = ", ".join(f"{n} {a}" for a, n in sorted(Counter(map(errors.arm, found)).items()))
        tests = list(dict.fromkeys(test for one in found for test in one.tests))
        took = [one.took_s for one in found if one.took_s is not None]
        rows.append(
            [
                *(name, stage, arms, protocol, ", ".join(tests)),
                *(few({getattr(one, name) for one in found}) for name in ("replicas", "seconds")),
                few({one.iteration for one in found}),
                few({one.device for one in found}),
                sum(took) / 60 if took else UNKNOWN,
            ]
        )
    if not rows:
        return None
    order = list(study.titles.values())
    rows.sort(
        key=lambda r: (
            order.index(str(r[0])) if r[0] in order else 99,
            list(STAGES).index(str(r[1])),
        )
    )
    titles = ("design", "stage", "evaluations", "protocol", "tests", "replicas")
    columns = [Column(title) for title in titles]
    columns += [Column("roll-out", "s"), Column("checkpoint"), Column("device")]
    columns.append(Column("took", "min", 1))
    caption = "Evaluations. The time is the sum of a row."
    whose = "; ".join(f"{source}: {errors.WORDS[source]}" for source in errors.sources(study))
    caption += f" Perturbed inertia, {whose}." if whose else ""
    return Table("evaluations", caption, columns, rows, words=True)


def versions(study: Study) -> Table:
    """Return the versions of the packages at the start of the runs."""
    found: dict[str, set[str]] = {}
    for one in (*study.singles, *study.families):
        for package, number in one.versions.items():
            found.setdefault(package, set()).add(number)
    rows: list[list[Cell]] = [[package, ", ".join(sorted(found[package]))] for package in found]
    caption = "Versions at the start of the runs."
    return Table("versions", caption, [Column("package"), Column("version")], rows, words=True)


def remarks(study: Study) -> list[str]:
    """Return the flags of the evaluations, each once, with its designs, arms and seeds."""
    rows: list[list[Any]] = [
        [study.title(one.run), one.run.stage, ARM_WORDS[one.arm], one.run.seed, flag]
        for one in study.evaluations
        for flag in (*one.summary.flags, *errors.flags(study, one))
    ]
    rows = _merged(rows, 3, seeds_in_words)
    rows = _merged(rows, 2, " and ".join)
    return [f"{', '.join(own)}: {flag}" for *own, flag in _merged(rows, 0, ", ".join)]


def _merged(
    rows: Iterable[list[Any]], at: int, joined: Callable[[Sequence[Any]], str]
) -> list[list[Any]]:
    """Return rows in which those that differ in one column alone are joined."""
    found: dict[tuple[Any, ...], dict[Any, None]] = {}
    for row in rows:
        found.setdefault((*row[:at], *row[at + 1 :]), {})[row[at]] = None
    return [[*key[:at], joined(list(own)), *key[at:]] for key, own in found.items()]


def provenance(study: Study) -> Table | None:
    """Return how runs of one design were trained and evaluated; those made alike share a row."""
    if not study.singles:
        return None
    recipe = study.planned.recipe if study.planned and study.planned.recipe else UNKNOWN
    groups: dict[tuple[str, ...], list[Trained]] = {}
    for one in study.singles:
        own = [evaluation for evaluation in study.evaluations if evaluation.run is one]
        groups.setdefault(_made(one, own, recipe), []).append(one)
    rows: list[list[Cell]] = [
        [
            ", ".join(t for d, t in study.titles.items() if d in {one.design for one in runs}),
            ", ".join(s for s in STAGES if s in {one.stage for one in runs}),
            ", ".join(map(str, sorted({one.seed for one in runs}))),
            len(runs),
            *made,
        ]
        for made, runs in groups.items()
    ]
    titles = ("design", "stage", "seeds", "runs", "Draft", "with", "recipe", "engine", "processes")
    columns = [*(Column(title) for title in titles), Column("replicas")]
    caption = (
        "How the runs were made: version of Draft and of what it stands on, recipe, physics engine "
        "and processes of the training, replicas per level of the evaluation."
    )
    return Table("provenance", caption, columns, rows, words=True)


def _made(one: Trained, evaluations: Sequence[Evaluation], recipe: str) -> tuple[str, ...]:
    """Return the last cells of a run's row: what it was made with."""
    known = [name for name in PACKAGES[1:] if one.versions.get(name, "none") != "none"]
    return (
        one.versions.get("draft", UNKNOWN),
        ", ".join(f"{name} {one.versions[name]}" for name in known) or UNKNOWN,
        recipe,
        one.engine or UNKNOWN,
        UNKNOWN if one.processes is None else str(one.processes),
        few({e.summary.replicas for e in evaluations}) if evaluations else "none",
    )


def spent(study: Study) -> Table | None:
    """Return time and steps of one design's runs by stage, of both jobs, with totals."""
    if not study.singles:
        return None
    rows: list[list[Cell]] = []
    for stage in (*STAGES, None):
        runs = [one for one in study.singles if stage in (one.stage, None)]
        own = [one for one in study.evaluations if one.run in runs]
        if runs:
            rows.append(
                [
                    stage or "all",
                    len(runs),
                    sum(one.total_steps for one in runs) / 1e6,
                    _hours(one.seconds for one in runs),
                    _jobs(study, [one.name for one in runs]),
                    len(own),
                    _hours(one.summary.took_s for one in own),
                    _jobs(
                        study,
                        [evaluation_job(one.run.name, one.arm, one.protocol) for one in own],
                    ),
                ]
            )
    columns = [Column("stage"), Column("runs"), Column("steps", "million", 1)]
    columns += [Column("training", "h", 2), Column("with starts", "h", 2)]
    columns += [Column("evaluations"), Column("evaluating", "h", 2), Column("with starts", "h", 2)]
    caption = (
        "Time and steps spent, of all designs and seeds. With starts: the whole commands, with the "
        "loading of libraries and the compilation of models."
    )
    return Table("spent", caption, columns, rows)


def _jobs(study: Study, names: Iterable[str]) -> Cell:
    """Return the hours of some jobs, including their starts."""
    seconds = study.planned.seconds if study.planned else {}
    return _hours(seconds.get(name) for name in names)


def _hours(seconds: Iterable[float | None]) -> Cell:
    """Return the sum in hours, or words if not all are known."""
    given = list(seconds)
    known = [one for one in given if one is not None]
    if not known:
        return UNKNOWN
    hours = sum(known) / 3600
    return (
        hours if len(known) == len(given) else f"{hours:.2f} ({len(known)} of {len(given)} noted)"
    )
