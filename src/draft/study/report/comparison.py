"""Results beside those of another study: how far an answer depends on the choices of a study."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from statistics import median

from draft.errors import DraftError
from draft.learn.task.stages import STAGES
from draft.metrics.capabilities import CAPABILITIES, RANKED
from draft.study.report.anomalies import not_walking
from draft.study.report.records import Study, seeds_in_words
from draft.study.report.spread import by_seed, few, spread
from draft.study.report.table import Cell, Column, Table

ARM = "nominal"
MOST_NUMBERS = 4  # Differing numbers that a caption lists; beyond, it counts them.


def comparison(study: Study, other: Study) -> Table:
    """Return each skill in two studies, on the designs and seeds in common, nominal arm.

    Args:
        study: the results.
        other: results of the same designs by other choices.

    Raises:
        DraftError: they have no skill of a design and seed in common.
    """
    name = other.name if other.name != study.name else f"other {other.name}"
    rows: list[list[Cell]] = []
    notes, used = list[str](), set[int]()
    whole = [study, other] if set(other.seeds) - set(study.seeds) else [study]
    for scalar in RANKED:
        here, there = _common(study, other, scalar)
        if not here:
            continue
        used.update(*here.values())
        for design, values in here.items():
            ratios = [there[design][s] / value for s, value in values.items() if value]
            rows.append(
                [
                    CAPABILITIES[scalar].title,
                    study.titles[design],
                    spread(values.values()),
                    spread(there[design].values()),
                    spread(100 * (ratio - 1) for ratio in ratios),
                    *(by_seed(one, design, ARM, scalar).spread for one in whole),
                ]
            )
        notes += _ranking(study, name, scalar, here, there)
        notes += _lacking(study, other, scalar)
    if not rows:
        cause = f"'{other.name}' has no skill of a design and seed in common with '{study.name}'"
        remedy = f"compare studies of the same designs: {', '.join(study.members)}"
        raise DraftError(cause, remedy)
    notes += [f"{name}: {words}" for words in not_walking(other)]
    columns = [Column("skill"), Column("design"), Column(study.name, "", 2)]
    columns += [Column(name, "", 2), Column("change", "%", 0)]
    columns += [Column(f"{one}, all seeds", "", 2) for one in (study.name, name)[: len(whole)]]
    choices = "; ".join(_choices(study, other)) or "the same numbers"
    caption = (
        f"{study.name} and {name} ({choices}), {seeds_in_words(sorted(used))}, nominal arm. A "
        "change within the range over all seeds cannot be told from chance."
    )
    return Table(f"against_{name}".replace(" ", "_"), caption, columns, rows, notes)


def _common(
    study: Study, other: Study, scalar: str
) -> tuple[dict[str, dict[int, float]], dict[str, dict[int, float]]]:
    """Values of a skill by design and seed in both studies, where both have it."""
    here: dict[str, dict[int, float]] = {}
    there: dict[str, dict[int, float]] = {}
    for design in study.members:
        ours, theirs = (by_seed(one, design, ARM, scalar).known for one in (study, other))
        seeds = sorted(ours.keys() & theirs.keys())
        if seeds:
            here[design] = {seed: ours[seed] for seed in seeds}
            there[design] = {seed: theirs[seed] for seed in seeds}
    return here, there


def _lacking(study: Study, other: Study, scalar: str) -> Iterator[str]:
    """Name designs that have a skill in one study and not in the other, with the reason."""
    for design, title in study.titles.items():
        both = [by_seed(one, design, ARM, scalar) for one in (study, other)]
        if both[0].known and both[1].reasons:
            words = CAPABILITIES[scalar].label
            yield f"{title} has no {words} in {other.name}: {'; '.join(both[1].why())}"


def _ranking(
    study: Study,
    name: str,
    scalar: str,
    here: Mapping[str, Mapping[int, float]],
    there: Mapping[str, Mapping[int, float]],
) -> Iterator[str]:
    """Say whether both order the designs alike, by the median over seeds."""
    if len(here) < 2:
        return
    ours, theirs = (
        " > ".join(study.titles[d] for d in sorted(of, key=lambda d: -median(of[d].values())))
        for of in (here, there)
    )
    words = CAPABILITIES[scalar].label
    if ours == theirs:
        yield f"{words}: {ours} in both"
    else:
        yield f"{words}: {ours}, but {theirs} in {name}"


def _choices(study: Study, other: Study) -> Iterator[str]:
    """Say what the plans of two studies differ in."""
    recipes = [one.planned.recipe if one.planned else None for one in (study, other)]
    if recipes[0] != recipes[1]:
        yield f"recipe {recipes[1]} instead of {recipes[0]}"
    ours, theirs = (
        {stage: next((r for r in one.singles if r.stage == stage), None) for stage in STAGES}
        for one in (study, other)
    )
    robots = [{one.design: one.robots for one in each.singles} for each in (study, other)]
    for design in study.members:
        if robots[1].get(design, robots[0][design]) != robots[0][design]:
            yield f"another robot {study.titles[design]}"
    for stage in STAGES:
        a, b = ours[stage], theirs[stage]
        if a is None or b is None:
            continue
        if b.planned != a.planned:
            yield f"{b.planned} instead of {a.planned} iterations of stage {stage}"
        if b.environments != a.environments:
            yield f"{b.environments} instead of {a.environments} worlds in stage {stage}"
    yield from _numbers(study, other)
    replicas = [few({e.summary.replicas for e in one.evaluations}) for one in (study, other)]
    if replicas[0] != replicas[1]:
        yield f"{replicas[1]} instead of {replicas[0]} replicas"


def _numbers(study: Study, other: Study) -> Iterator[str]:
    """Say which numbers of the tasks differ, but for iterations and worlds."""
    ours, theirs = (one.singles[0].plan["config"] for one in (study, other))
    differing = [
        (f"{group}.{name}", value, theirs[group][name])
        for group, numbers in ours.items()
        for name, value in numbers.items()
        if name in theirs.get(group, {}) and theirs[group][name] != value
        if name != "environments" and not name.startswith("iterations_")
    ]
    if len(differing) > MOST_NUMBERS:
        yield f"{len(differing)} other numbers"
        return
    for name, old, new in differing:
        yield f"{name} {new} instead of {old}"
