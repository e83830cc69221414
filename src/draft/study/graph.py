"""A study as a graph of jobs, with a key for each.

A job's key is a hash of everything that determines its output: numbers of the robots and of the
task, iterations, worlds, seed, stage, the key of the job it starts from, and Draft's version.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import partial

from draft.extras import own_version
from draft.learn.measuring.evaluation_options import Extras, Options, RollOuts
from draft.learn.measuring.summary import ARMS, FORMAT, PROTOCOLS
from draft.learn.task.stages import STAGES
from draft.learn.training import run as runs
from draft.learn.training.session import with_exported, with_support
from draft.study.file import Study, at_place
from draft.study.jobs import (
    REPORT,
    Evaluating,
    Group,
    Job,
    Reporting,
    Training,
    evaluation_job,
)


def graph(study: Study, groups: Sequence[Group]) -> dict[str, Job]:
    """Return the jobs of a study by name.

    Each job comes after those it needs; the first seed of all designs comes before the second.
    """
    jobs: dict[str, Job] = {}
    for seed in study.seeds:
        for group in groups:
            trained: dict[str, Training] = {}
            for stage in study.stages:
                origin = trained.get(STAGES[stage].origin or "")
                training = trained[stage] = _training(study, group, stage, seed, origin)
                for job in (training, *_evaluations(study, training)):
                    jobs[job.name] = job
    last = tuple(name for name, job in jobs.items() if job.kind == "evaluate")
    key = _hash({"evaluations": {name: jobs[name].key for name in last}})
    jobs[REPORT] = Reporting(REPORT, key, last)
    return jobs


def _training(
    study: Study, group: Group, stage: str, seed: int, origin: Training | None
) -> Training:
    numbers = study.trainings, study.recipe, study.config
    plan = runs.Plan.of(group.members, *numbers, stage, seed, group.see_design)
    start = study.start(stage)
    if start is not None:
        where, origin = study.place("start", stage), None
        make = partial(with_exported, plan, start, runs.SHIPPED[start])
        plan = at_place(make, where, "name one that fits; `recipe: tune` has their layers")
    elif origin is not None:
        # A policy that saw the ground keeps seeing it; one that did not may start to.
        sees = plan.see_ground or origin.plan.see_ground
        plan = replace(plan, see_ground=sees, see_design=origin.plan.see_design)
        plan = with_support(plan, origin.plan.config.actuation.support)
    iterations = study.iterations(stage)
    determinants = plan.record() | {"from": origin.key if origin else None, "code": _code()}
    return Training(
        name=f"{group.name}-{stage}-{seed}",
        key=_hash(determinants | {"iterations": iterations}),
        needs=(origin.name,) if origin else (),
        group=group,
        plan=plan,
        iterations=iterations,
        run_key=_hash(determinants),
    )


def _evaluations(study: Study, training: Training) -> list[Evaluating]:
    asked, found = study.evaluate, []
    test = STAGES[training.plan.stage].test
    for protocol in PROTOCOLS[: 1 + asked.published]:
        for arm in ARMS[: 1 + asked.perturbed]:
            options = Options.of(
                asked.model_dump(include={*RollOuts.model_fields, "levels"})
                | {
                    "test": (test,),
                    "checkpoint": training.iterations,
                    "errors": asked.errors if arm == "perturbed" else None,
                    "protocol": protocol,
                }
            )
            determinants = {
                "run": training.key,
                "battery": test,  # An older word, which keeps the keys of finished jobs.
                "arm": arm,
                "code": [*_code(), FORMAT],
                **options.model_dump(include={*RollOuts.model_fields, "levels", "protocol"}),
                **options.model_dump(
                    include={*Extras.model_fields, "errors"}, exclude_defaults=True
                ),
            }
            name = evaluation_job(training.name, arm, protocol)
            key, needs = _hash(determinants), (training.name,)
            found.append(Evaluating(name, key, needs, training, options))
    return found


def _code() -> list[str | int]:
    """Return what of the code determines a run: the versions of Draft and of the run format.

    Versions of libraries are left out, so that weeks of training are not repeated because a
    library was upgraded or a study moved to another machine. Their changes are reported instead.
    """
    return [own_version(), runs.FORMAT]


def _hash(determinants: Mapping[str, object]) -> str:
    return hashlib.sha256(json.dumps(determinants, sort_keys=True).encode()).hexdigest()[:16]
