"""What a study would have when it is done, and has not yet."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import product

from draft.learn.config import STAGES
from draft.study.report.checks import ARMS
from draft.study.report.records import Study, Trained, seeds_in_words


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
        said += _unmeasured(study, own, title)
    if plan:
        said += [f"{name}: not begun" for name in plan.designs if name not in designs]
        for name in plan.families:
            own = [one for one in study.families if one.name.rsplit("-", 2)[0] == name]
            said += _untrained(name, own, stages, seeds) if own else [f"{name}: not begun"]
            said += _unmeasured(study, own, name)
        said += [f"{name}: failed; logs/{name}.log tells why" for name in plan.failed]
    return said


def _untrained(
    title: str, own: Sequence[Trained], stages: Sequence[str], seeds: Sequence[int]
) -> Iterator[str]:
    """Stages and seeds that were not begun."""
    for stage in stages:
        there = {one.seed for one in own if one.stage == stage}
        lacking = [seed for seed in seeds if seed not in there]
        if not there:
            yield f"{title}: no {stage} policy was trained"
        elif lacking:
            yield f"{title}: no {stage} policy of {seeds_in_words(lacking)}"


def _unmeasured(study: Study, own: Sequence[Trained], title: str) -> Iterator[str]:
    """Policies that lack an arm, or a protocol."""
    plan = study.planned
    protocols = plan.protocols if plan else (study.protocol,)
    for stage, protocol, arm in product(STAGES, protocols, plan.arms if plan else ARMS):
        seeds = {one.seed for one in own if one.stage == stage}
        done = {
            one.run.seed
            for one in study.evaluations
            if one.run in own and (one.run.stage, one.protocol, one.arm) == (stage, protocol, arm)
        }
        lacking = sorted(seeds - done)
        of = f"the {stage} policy"
        if lacking and lacking != sorted(seeds):
            of += f" of {seeds_in_words(lacking)}"
        if lacking:
            how = " by the published protocol" * (protocol == "published")
            yield f"{title}: {of} has no {arm} evaluation{how}"
