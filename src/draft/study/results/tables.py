"""Tables of results: effect of inertia errors, orderings, provenance, time spent."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from typing import NamedTuple

from draft.learn.task.config import STAGES
from draft.metrics.capabilities import CAPABILITIES, RANKED, of_table
from draft.study.report import errors
from draft.study.report.records import Evaluation, Study, Trained
from draft.study.report.spread import by_seed, spread
from draft.study.report.table import Cell, Column, Table
from draft.study.report.tables import ARM_WORDS, UNKNOWN, few
from draft.study.results import ordering
from draft.study.results.ordering import Ordering, by_chance

# Number of seeds up to which an order is uncertain.
FEW = 4
# Packages whose versions affect what a policy learns.
PACKAGES = ("draft", "mujoco", "mjlab", "torch", "mjbatch", "mujoco-warp")


def all_tables(study: Study) -> dict[str, Table]:
    """Return every table that the results have numbers for, by name."""
    makers: tuple[Callable[[Study], Table | None], ...] = (
        *(designs, orders, pairs, changes, provenance, spent),
    )
    found = [table for make in makers if (table := make(study)) is not None]
    return {table.name: table for table in found}


def designs(study: Study) -> Table:
    """Return the sizes and limits of the designs."""
    rows: list[list[Cell]] = [
        [
            title,
            *(study.members[name].leg_length, study.members[name].mass),
            few({round(torque, 1) for torque in study.members[name].peak_torque}),
            few({round(speed, 1) for speed in study.members[name].no_load_speed}),
            study.members[name].top_speed,
        ]
        for name, title in study.titles.items()
    ]
    columns = [Column("design"), Column("L", "m", 2), Column("mass", "kg", 1)]
    columns += [Column("peak torque", "N m"), Column("no-load speed", "rad/s")]
    columns.append(Column("estimated top speed", "m/s", 2))
    caption = "The designs. L is thigh plus shank; the estimate is that of the motors, made before."
    return Table("designs", caption, columns, rows)


def of_skill(study: Study, scalars: Iterable[str]) -> dict[tuple[str, str], Ordering]:
    """Return the orderings by skill and arm that at least two designs have."""
    found = {
        (scalar, arm): made
        for scalar in scalars
        for arm in study.arms
        if (made := ordering.of_study(study, arm, scalar)) is not None
    }
    return {key: made for key, made in found.items() if any(made.seeds.values())}


def orders(study: Study) -> Table | None:
    """Return the order of the designs by each skill, with its probability."""
    rows: list[list[Cell]] = []
    found = of_skill(study, dict.fromkeys((*RANKED, *of_table("capability_normalised"))))
    for (scalar, arm), made in found.items():
        other = f"{_order(study, made.other[0])} ({_share(made.other[1])})" if made.other else ""
        words = CAPABILITIES[scalar].label, ARM_WORDS[arm], _order(study, made.designs)
        # Draws from one seed are all alike, and say nothing.
        share, other = (_share(made.probability), other) if _several(made) else ("-", "")
        rows.append([*words, share, other, few(set(made.seeds.values()))])
    if not rows:
        return None
    titles = ("skill", "arm", "order by median", "probability", "next", "seeds")
    caption = (
        "Order of the designs by the median over seeds, how often a bootstrap over seeds gives "
        "just this order, and the order that it gives next most often. A seed that passes no level "
        "counts as below all others; ties are broken at random."
    )
    notes = [certainty([n for made in found.values() for n in made.seeds.values()])]
    return Table("orders", caption, [Column(title) for title in titles], rows, notes, words=True)


def certainty(seeds: Sequence[int]) -> str:
    """Return how certain an order is with a number of seeds, in words."""
    least, most = min(seeds), max(seeds)
    plural = "s" * (least != 1)
    count = f"{least} seed{plural}" if least == most else f"{least} to {most} seeds"
    few = f" {least} seed{plural} give{'s' * (least == 1)} little certainty." * (least <= FEW)
    return (
        f"Each design has {count}. A bootstrap knows no other seeds than these, and is too sure "
        f"where they are few.{few} Two designs that do not differ, with {least} of each, have "
        f"ranges that lie apart, in a given order, in {100 * by_chance(least, least):.2g} % of all "
        "studies."
    )


def pairs(study: Study) -> Table | None:
    """Return the neighbours in each order, nominal arm."""
    rows: list[list[Cell]] = []
    for (scalar, arm), made in of_skill(study, RANKED).items():
        for pair in made.pairs if arm == "nominal" else ():
            names = f"{study.titles[pair.better]} over {study.titles[pair.worse]}"
            apart = f"apart (by chance: {_share(pair.chance)})" if pair.apart else "overlap"
            share = _share(pair.probability) if _several(made) else "-"
            rows.append([CAPABILITIES[scalar].label, names, share, apart])
    if not rows:
        return None
    columns = [Column(title) for title in ("skill", "designs", "probability", "ranges over seeds")]
    caption = (
        "Neighbours in the order, nominal arm: how often the bootstrap puts the first ahead, and "
        "whether all of its seeds are above all seeds of the second. In brackets: how often two "
        "designs that do not differ would come out so."
    )
    return Table("pairs", caption, columns, rows, words=True)


def _order(study: Study, names: Sequence[str]) -> str:
    return " > ".join(study.titles[name] for name in names)


def _several(made: ordering.Ordering) -> bool:
    """Return whether each design has more than one seed."""
    return min(made.seeds.values()) > 1


def _share(probability: float) -> str:
    """Return a probability in per cent; that of a bootstrap is never exactly 0 or 1."""
    if probability > 0.995:
        return "> 99 %"
    return "< 1 %" if probability < 0.005 else f"{100 * probability:.0f} %"


def changes(study: Study) -> Table | None:
    """Return the change of each skill by inertia errors, seed by seed."""
    rows: list[list[Cell]] = []
    for design, title in study.titles.items():
        cells: list[Cell] = []
        for scalar in RANKED:
            right, wrong = (by_seed(study, design, arm, scalar).known for arm in ARM_WORDS)
            both = [seed for seed in right if seed in wrong and right[seed]]
            cells.append(spread(100 * (wrong[seed] / right[seed] - 1) for seed in both))
        rows.append([title, *cells])
    if not any(cell is not None for row in rows for cell in row[1:]):
        return None
    columns = [Column("design"), *(Column(CAPABILITIES[scalar].label, "%", 1) for scalar in RANKED)]
    whose = " and ".join(errors.WORDS[source] for source in errors.sources(study))
    caption = (
        "Change of each skill by inertia errors, of the same policies without retraining: median "
        f"over seeds of (perturbed / nominal - 1), and the least to the greatest ({whose})."
    )
    return Table("changes", caption, columns, rows)


class Made(NamedTuple):
    """Provenance of a run."""

    draft: str
    packages: str
    recipe: str
    engine: str
    processes: str
    replicas: str


def provenance(study: Study) -> Table:
    """Return how runs were trained and evaluated; runs made alike share a row."""
    recipe = study.planned.recipe if study.planned and study.planned.recipe else UNKNOWN
    groups: dict[Made, list[Trained]] = {}
    for one in study.singles:
        own = [evaluation for evaluation in study.evaluations if evaluation.run is one]
        groups.setdefault(_made(one, own, recipe), []).append(one)
    rows: list[list[Cell]] = [
        [
            ", ".join(t for d, t in study.titles.items() if d in {one.key[0] for one in runs}),
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


def _made(one: Trained, evaluations: Sequence[Evaluation], recipe: str) -> Made:
    known = [name for name in PACKAGES[1:] if one.versions.get(name, "none") != "none"]
    return Made(
        draft=one.versions.get("draft", UNKNOWN),
        packages=", ".join(f"{name} {one.versions[name]}" for name in known) or UNKNOWN,
        recipe=recipe,
        engine=one.engine or UNKNOWN,
        processes=UNKNOWN if one.processes is None else str(one.processes),
        replicas=few({e.summary.replicas for e in evaluations}) if evaluations else "none",
    )


def spent(study: Study) -> Table:
    """Return time and steps by stage, of training and of evaluation, with totals."""
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
                    _jobs(study, [_job(one) for one in own]),
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


def _job(one: Evaluation) -> str:
    """Return the name of the job of an evaluation; see `draft.study.graph`."""
    return f"{one.run.name}-{one.arm}" + "-published" * (one.protocol == "published")


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
