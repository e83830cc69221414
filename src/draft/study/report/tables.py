"""Tables of the designs of a study: capability, orders, inertia errors, utilisation, variation."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace

from draft.learn.bodies.legged import CLASSES
from draft.learn.measuring.utilisation import NEAR
from draft.metrics.capabilities import CAPABILITIES, RANKED, of_table
from draft.study.report import errors, ordering, run_tables
from draft.study.report.occupancy import QUANTITIES, TESTS, Limit, Utilisation
from draft.study.report.ordering import Ordering, by_chance
from draft.study.report.records import Study
from draft.study.report.spread import ARM_WORDS, by_seed, few, spread, variation
from draft.study.report.table import Cell, Column, Strong, Table

NOT_MEASURED = "not evaluated"
NONE = "none"
NOT_LIMITED = "No design is limited by its actuators in any test."
BEST = "Bold: the highest median of an arm."
# Captions of the tables of capabilities.
CAPTIONS = {
    "capability": f"Capability: median over seeds, and the least to the greatest of them. {BEST}",
    "capability_normalised": (
        "Capability by leg length L (thigh plus shank), with g = 9.81 m/s²: median over seeds, and "
        f"the least to the greatest of them. {BEST}"
    ),
    "walking": (
        f"Walking at 0.4 m/s, base policy: median over seeds, and the least to the greatest. {BEST}"
    ),
    "energy": (
        "Energy of the motors alone, walking at 0.4 m/s and at top speed, on the battery of the "
        "design (stated, or usual for its mass within a factor of two): median over seeds, and the "
        "least to the greatest. Bold: the best median of an arm."
    ),
}
# Number of seeds up to which an order is uncertain.
FEW = 4


def all_tables(study: Study, used: Utilisation) -> dict[str, Table]:
    """Return every table that the study has numbers for, by name."""
    makers = (
        *(designs, seed_variation, protocols, orders, pairs, changes),
        *(run_tables.spent, run_tables.training, run_tables.evaluations),
        *(run_tables.provenance, run_tables.versions),
    )
    of_skills = (capability(study, name) for name in CAPTIONS)
    found = *of_skills, utilisation(study, used), *(make(study) for make in makers)
    return {table.name: table for table in found if table is not None}


def capability(study: Study, name: str = "capability") -> Table | None:
    """Return a table of `CAPTIONS`; None if none of its scalars was measured."""
    scalars = _recorded(study, name)
    known = {
        (design, arm, scalar): by_seed(study, design, arm, scalar)
        for design in study.members
        for arm in study.arms
        for scalar in scalars
    }
    if not any(values.measured for values in known.values()):
        return None
    rows: list[list[Cell]] = []
    notes: list[str] = []
    medians: dict[tuple[str, str], set[float]] = {}
    for (_, arm, scalar), values in known.items():
        if values.spread:
            medians.setdefault((arm, scalar), set()).add(values.spread.median)
    # The best is marked where two designs have different medians.
    best = {
        (arm, scalar): (min if CAPABILITIES[scalar].better == "less" else max)(found)
        for (arm, scalar), found in medians.items()
        if len(found) > 1
    }
    for design, title in study.titles.items():
        for arm in study.arms:
            found = {scalar: known[design, arm, scalar] for scalar in scalars}
            cells: list[Cell] = [
                replace(values.spread, best=values.spread.median == best.get((arm, scalar)))
                if values.spread
                else (NONE if values.measured else NOT_MEASURED)
                for scalar, values in found.items()
            ]
            why: dict[str, list[str]] = {}
            for scalar, values in found.items():
                for words in values.why():
                    why.setdefault(words, []).append(CAPABILITIES[scalar].label)
            notes += [
                f"{title}, {ARM_WORDS[arm]}: no {_listed(names)} for {words}"
                for words, names in why.items()
            ]
            counts = {values.count for values in found.values()} - {0}
            seeds = few(counts or {0})
            member = study.members[design]
            rows.append([title, member.leg_length, member.mass, ARM_WORDS[arm], seeds, *cells])
    columns = [Column("design"), Column("L", "m", 2), Column("mass", "kg", 1)]
    columns += [Column("arm"), Column("seeds")]
    columns += [_column(scalar) for scalar in scalars]
    return Table(name, CAPTIONS[name], columns, rows, notes)


def _column(scalar: str) -> Column:
    return Column(CAPABILITIES[scalar].label, CAPABILITIES[scalar].unit)


def utilisation(study: Study, used: Utilisation) -> Table | None:
    """Return the 95th percentiles of torque, speed and their sum, the limiting joint marked."""
    rows: list[list[Cell]] = []
    limited: list[bool] = []
    for design, title in study.titles.items():
        for test in TESTS:
            use = used.of(design, test)
            if use is None or not use.shares:
                continue
            limit = use.limiting
            joint, by = (limit.joint, limit.by) if limit is not None and limit.near else ("", "")
            cells: list[Cell] = []
            for one in CLASSES:
                for quantity in QUANTITIES:
                    value = use.shares.get((one, quantity))
                    strong = value is not None and (one, quantity) == (joint, by)
                    cells.append(Strong(value) if strong and value is not None else value)
            words = _limit(limit)
            limited += [] if limit is None else [limit.near]
            at = few(set(use.levels)) if use.levels else ""
            rows.append([title, test, at, *cells, words])
    if not rows:
        return None
    columns = [Column("design"), Column("test"), Column("level")]
    columns += [Column(q, "", 2, joint) for joint in CLASSES for q in QUANTITIES]
    columns.append(Column("limiting joint (seeds)"))
    caption = (
        "Utilisation, nominal arm: 95th percentiles over all samples, replicas and seeds of torque "
        "per peak torque, of speed per no-load speed, and of the sum of both in each sample, which "
        "is not the sum of the percentiles. Levels are those of each seed: its peak command [m/s], "
        f"its step [m], its kick [m/s]. Bold: what limits the design in most seeds, at {NEAR:g} of "
        "its limit or above; below that, nothing does."
    )
    notes = [NOT_LIMITED] if limited and not any(limited) else []
    return Table("utilisation", caption, columns, rows, notes)


def _limit(limit: Limit | None) -> str:
    """Return what limits a design, or what is nearest to its limit, with its seeds."""
    if limit is None:
        return "unknown"
    seeds = f"({limit.seeds} of {limit.of})"
    if limit.near:
        return f"{limit.joint}, {limit.by} {seeds}"
    return f"none; nearest {limit.joint}, {limit.by} {limit.value:.2f} {seeds}"


def _recorded(study: Study, table: str) -> list[str]:
    """Capabilities of a table, without optional ones that no evaluation of the study has."""
    recorded = {name for one in study.evaluations for name in one.summary.scalars}
    return [n for n in of_table(table) if n in recorded or not CAPABILITIES[n].optional]


def seed_variation(study: Study) -> Table | None:
    """Return the coefficient of variation of every scalar over seeds."""
    scalars = (*_recorded(study, "capability"), *_recorded(study, "walking"))
    rows: list[list[Cell]] = []
    for design, title in study.titles.items():
        for arm in study.arms:
            cells: list[Cell] = []
            for scalar in scalars:
                values = list(by_seed(study, design, arm, scalar).known.values())
                varies = variation(values)
                few = "one seed" if len(values) == 1 else ("mean of 0" if values else NONE)
                cells.append(few if varies is None else 100 * varies)
            rows.append([title, ARM_WORDS[arm], *cells])
    if not any(isinstance(cell, float) for row in rows for cell in row):
        return None
    columns = [Column("design"), Column("arm")]
    columns += [Column(CAPABILITIES[scalar].label, "%", 1) for scalar in scalars]
    kept = [i for i in range(len(columns)) if i < 2 or any(isinstance(r[i], float) for r in rows)]
    caption = "Variation over seeds: standard deviation (of a sample) per mean."
    thinned = [[row[i] for i in kept] for row in rows]
    return Table("seed_variation", caption, [columns[i] for i in kept], thinned)


def protocols(study: Study) -> Table | None:
    """Return the published protocol beside ours, if both were run."""
    if len({one.protocol for one in study.evaluations}) < 2:
        return None
    scalars = [
        s
        for s in of_table("capability")
        if s in {k for e in study.evaluations for k in e.summary.scalars}
    ]
    rows: list[list[Cell]] = []
    for design, title in study.titles.items():
        for protocol in ("walking", "published"):
            found = [by_seed(study, design, "nominal", scalar, protocol) for scalar in scalars]
            cells = [v.spread or (NONE if v.measured else NOT_MEASURED) for v in found]
            rows.append([title, protocol, *cells])
    caption = (
        "Both protocols, nominal arm: every robot walking, and the published one, in which 10 % "
        "stand still. Median over seeds, and the least to the greatest of them."
    )
    columns = [Column("design"), Column("protocol"), *(_column(s) for s in scalars)]
    return Table("protocols", caption, columns, rows)


def _listed(names: Sequence[str]) -> str:
    """Join names for a sentence: "a, b or c"."""
    *others, last = names
    return f"{', '.join(others)} or {last}" if others else last


def designs(study: Study) -> Table | None:
    """Return the sizes and limits of the designs."""
    if not study.members:
        return None
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
