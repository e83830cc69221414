"""Parts of a study that are missing."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import product

from draft.learn.measuring.summary import ARMS
from draft.learn.task.stages import PUBLISHED, STAGES
from draft.study.report.records import Study, Trained, seeds_in_words


def missing(study: Study) -> list[str]:
    """Return the missing parts, in words.

    Without a plan, all stages of every design that was started are expected, with all seeds that
    any of them has.
    """
    plan = study.planned
    stages = plan.stages if plan else [stage.name for stage in PUBLISHED]
    seeds = sorted({*study.seeds, *(plan.seeds if plan else ())})
    designs = study.titles
    found: list[str] = []
    for design, title in designs.items():
        own = [one for one in study.singles if one.design == design]
        found += _untrained(title, own, stages, seeds)
        found += _unmeasured(study, own, title)
    if plan:
        found += [f"{name}: not started" for name in plan.designs if name not in designs]
        for name in plan.families:
            own = [one for one in study.families if one.name.rsplit("-", 2)[0] == name]
            found += _untrained(name, own, stages, seeds) if own else [f"{name}: not started"]
            found += _unmeasured(study, own, name)
        found += [f"{name}: failed; see logs/{name}.log" for name in plan.failed]
    return found


def _untrained(
    title: str, own: Sequence[Trained], stages: Sequence[str], seeds: Sequence[int]
) -> Iterator[str]:
    """Yield stages and seeds that were not started."""
    for stage in stages:
        there = {one.seed for one in own if one.stage == stage}
        absent = [seed for seed in seeds if seed not in there]
        if not there:
            yield f"{title}: no {stage} policy was trained"
        elif absent:
            yield f"{title}: no {stage} policy of {seeds_in_words(absent)}"


def _unmeasured(study: Study, own: Sequence[Trained], title: str) -> Iterator[str]:
    """Yield policies that lack an evaluation by an arm or protocol."""
    plan = study.planned
    protocols = plan.protocols if plan else (study.protocol,)
    for stage, protocol, arm in product(STAGES, protocols, plan.arms if plan else ARMS):
        seeds = {one.seed for one in own if one.stage == stage}
        done = {
            one.run.seed
            for one in study.evaluations
            if one.run in own and (one.run.stage, one.protocol, one.arm) == (stage, protocol, arm)
        }
        absent = sorted(seeds - done)
        of = f"the {stage} policy"
        if absent and absent != sorted(seeds):
            of += f" of {seeds_in_words(absent)}"
        if absent:
            how = " by the published protocol" * (protocol == "published")
            yield f"{title}: {of} has no {arm} evaluation{how}"
