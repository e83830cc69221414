"""What a study would have when it is done, and has not yet."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from draft.learn.config import STAGES
from draft.learn.report.checks import ARMS
from draft.learn.report.gather import Study, Trained, seeds_in_words


def missing(study: Study) -> list[str]:
    """What is not there, in words.

    A study's own plan says what is to be there; without one all stages of every design that was
    begun, with all seeds of any.
    """
    plan = study.planned
    stages = plan.stages if plan else STAGES
    seeds = sorted({*study.seeds, *(plan.seeds if plan else ())})
    designs = study.titles
    said: list[str] = []
    for design, title in designs.items():
        own = [one for one in study.singles if one.key[0] == design]
        said += _untrained(title, own, stages, seeds)
        said += _unmeasured(study, design, title)
    if plan:
        said += [f"{name}: not begun" for name in plan.designs if name not in designs]
        for name in plan.families:
            own = [one for one in study.families if one.run.folder.name.rsplit("-", 2)[0] == name]
            said += _untrained(name, own, stages, seeds) if own else [f"{name}: not begun"]
        said += [f"{name}: failed; logs/{name}.log tells why" for name in plan.failed]
    return said


def _untrained(
    title: str, own: Sequence[Trained], stages: Sequence[str], seeds: Sequence[int]
) -> Iterator[str]:
    """Stages and seeds that were not begun."""
    for stage in stages:
        there = {one.run.plan.seed for one in own if one.run.plan.stage == stage}
        lacking = [seed for seed in seeds if seed not in there]
        if not there:
            yield f"{title}: no {stage} policy was trained"
        elif lacking:
            yield f"{title}: no {stage} policy of {seeds_in_words(lacking)}"


def _unmeasured(study: Study, design: str, title: str) -> Iterator[str]:
    """Policies of a design that lack an arm."""
    for stage in STAGES:
        seeds = {one.key[2] for one in study.singles if one.key[:2] == (design, stage)}
        for arm in ARMS:
            done = {
                one.run.plan.seed for one in study.of(design, arm) if one.run.plan.stage == stage
            }
            lacking = sorted(seeds - done)
            if lacking and lacking == sorted(seeds):
                yield f"{title}: the {stage} policy has no {arm} evaluation"
            elif lacking:
                of = f"the {stage} policy of {seeds_in_words(lacking)}"
                yield f"{title}: {of} has no {arm} evaluation"
