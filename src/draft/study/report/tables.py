"""Tables of a study: capability, utilisation, variation over seeds, and what was run."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace

from draft.learn.bodies.legged import CLASSES
from draft.learn.measuring.summary import Summary
from draft.learn.measuring.utilisation import NEAR
from draft.learn.task.config import STAGES
from draft.metrics.capabilities import CAPABILITIES, of_table
from draft.study.report import errors
from draft.study.report.occupancy import BATTERIES, QUANTITIES, Limit, Utilisation
from draft.study.report.records import Study, Trained, seeds_in_words
from draft.study.report.spread import by_seed, spread, variation
from draft.study.report.table import Cell, Column, Strong, Table

ARM_WORDS = {"nominal": "nominal", "perturbed": "perturbed inertia"}
NOT_MEASURED = "not evaluated"
NONE = "none"
NOT_LIMITED = "No design is limited by its actuators in any battery."
BEST = "Bold: the highest median of an arm."
UNKNOWN = "not noted"


def all_tables(study: Study, used: Utilisation) -> dict[str, Table]:
    """Return every table that the study has numbers for, by name."""
    makers: tuple[Callable[[], Table | None], ...] = (
        lambda: capability(study),
        lambda: normalised(study),
        lambda: walking(study),
        lambda: energy(study),
        lambda: utilisation(study, used),
        lambda: seed_variation(study),
        lambda: protocols(study),
        lambda: training(study),
        lambda: evaluations(study),
        lambda: versions(study),
    )
    found = [table for make in makers if (table := make()) is not None]
    return {table.name: table for table in found}


def capability(study: Study) -> Table | None:
    """Return the table of top speed, step, kick and efficiency."""
    words = f"Capability: median over seeds, and the least to the greatest of them. {BEST}"
    return _capability(study, "capability", words)


def normalised(study: Study) -> Table | None:
    """Return the same table, normalised by leg length."""
    words = (
        "Capability by leg length L (thigh plus shank), with g = 9.81 m/s²: median over seeds, "
        f"and the least to the greatest of them. {BEST}"
    )
    return _capability(study, "capability_normalised", words)


def walking(study: Study) -> Table | None:
    """Return the table of the base policy at walking speed."""
    words = (
        f"Walking at 0.4 m/s, base policy: median over seeds, and the least to the greatest. {BEST}"
    )
    return _capability(study, "walking", words)


def energy(study: Study) -> Table | None:
    """Return the table of cost of transport, endurance and range, walking and at top speed."""
    words = (
        "Energy of the motors alone, walking at 0.4 m/s and at top speed, on the battery of the "
        "design (stated, or usual for its mass within a factor of two): median over seeds, and the "
        "least to the greatest. Bold: the best median of an arm."
    )
    return _capability(study, "energy", words)


def _any(study: Study, scalars: Iterable[str]) -> str | None:
    """Return the first of some scalars that was measured for any design."""
    for scalar in scalars:
        if any(
            by_seed(study, d, arm, scalar).measured for d in study.members for arm in study.arms
        ):
            return scalar
    return None


def _best(study: Study, scalar: str, arm: str) -> float | None:
    """Return the best median of the designs; None unless two of them have different ones."""
    medians = {
        own.median
        for design in study.members
        if (own := by_seed(study, design, arm, scalar).spread) is not None
    }
    best = min if CAPABILITIES[scalar].better == "less" else max
    return best(medians) if len(medians) > 1 else None


def _capability(study: Study, name: str, caption: str) -> Table | None:
    scalars = of_table(name)
    if _any(study, scalars) is None:
        return None
    rows: list[list[Cell]] = []
    notes: list[str] = []
    best = {(s, arm): _best(study, s, arm) for s in scalars for arm in study.arms}
    for design, title in study.titles.items():
        for arm in study.arms:
            found = {scalar: by_seed(study, design, arm, scalar) for scalar in scalars}
            cells: list[Cell] = [
                replace(values.spread, best=values.spread.median == best[scalar, arm])
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
            seeds = "–".join(str(n) for n in sorted({min(counts), max(counts)})) if counts else "0"
            member = study.members[design]
            rows.append([title, member.leg_length, member.mass, ARM_WORDS[arm], seeds, *cells])
    columns = [Column("design"), Column("L", "m", 2), Column("mass", "kg", 1)]
    columns += [Column("arm"), Column("seeds")]
    columns += [_column(scalar) for scalar in scalars]
    return Table(name, caption, columns, rows, notes)


def _column(scalar: str) -> Column:
    return Column(CAPABILITIES[scalar].label, CAPABILITIES[scalar].unit)


def utilisation(study: Study, used: Utilisation) -> Table | None:
    """Return the 95th percentiles of torque, speed and their sum, the limiting joint marked."""
    rows: list[list[Cell]] = []
    limited: list[bool] = []
    for design, title in study.titles.items():
        for battery in BATTERIES:
            use = used.of(design, battery)
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
            levels = sorted(set(use.levels))
            at = (
                "–".join(f"{level:g}" for level in dict.fromkeys((levels[0], levels[-1])))
                if levels
                else ""
            )
            rows.append([title, battery, at, *cells, words])
    if not rows:
        return None
    columns = [Column("design"), Column("battery"), Column("level")]
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


def seed_variation(study: Study) -> Table | None:
    """Return the coefficient of variation of every scalar over seeds."""
    scalars = (*of_table("capability"), *of_table("walking"))
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


def training(study: Study) -> Table:
    """Return the runs by design and stage."""
    groups: dict[tuple[str, str], list[Trained]] = {}
    for one in (*study.singles, *study.families):
        name = study.titles.get(one.key[0], one.key[0])
        if not one.single:
            name = f"family of {len(one.members)}"
        groups.setdefault((name, one.key[1]), []).append(one)
    order = list(dict.fromkeys([*study.titles.values(), *(name for name, _ in groups)]))
    rows: list[list[Cell]] = []
    for name, stage in sorted(groups, key=lambda g: (order.index(g[0]), STAGES.index(g[1]))):
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
        name = one.run.members[0].name
        name = study.titles.get(name, name) if one.run.single else "family"
        groups.setdefault((name, one.run.stage, one.protocol), []).append(one.summary)
    rows: list[list[Cell]] = []
    for (name, stage, protocol), found in groups.items():
        arms = ", ".join(f"{n} {a}" for a, n in sorted(Counter(map(errors.arm, found)).items()))
        batteries = list(dict.fromkeys(battery for one in found for battery in one.batteries))
        took = [one.took_s for one in found if one.took_s is not None]
        rows.append(
            [
                *(name, stage, arms, protocol, ", ".join(batteries)),
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
        key=lambda r: (order.index(str(r[0])) if r[0] in order else 99, STAGES.index(str(r[1])))
    )
    titles = ("design", "stage", "evaluations", "protocol", "batteries", "replicas")
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
    seeds: dict[tuple[str, str, str, str], list[int]] = {}
    for one in study.evaluations:
        run = one.run
        name = study.titles.get(run.members[0].name, run.members[0].name)
        name = name if run.single else f"family of {len(run.members)}"
        for flag in (*one.summary.flags, *errors.flags(study, one)):
            found = seeds.setdefault((name, run.stage, str(flag), ARM_WORDS[one.arm]), [])
            if run.seed not in found:
                found.append(run.seed)
    arms: dict[tuple[str, str, str, str], list[str]] = {}
    for (name, stage, flag, arm), own in seeds.items():
        arms.setdefault((name, stage, flag, seeds_in_words(own)), []).append(arm)
    names: dict[tuple[str, str, str, str], list[str]] = {}
    for (name, stage, flag, words), own in arms.items():
        names.setdefault((stage, flag, words, " and ".join(own)), []).append(name)
    return [
        f"{', '.join(own)}, {stage}, {arm}, {words}: {flag}"
        for (stage, flag, words, arm), own in names.items()
    ]


def _listed(names: Sequence[str]) -> str:
    """Join names for a sentence: "a, b or c"."""
    *others, last = names
    return f"{', '.join(others)} or {last}" if others else last


def few(values: set) -> str:
    """Return one value, or the range of several, as text."""
    known = sorted((v for v in values if v is not None), key=lambda v: (str(type(v)), v))
    if not known:
        return UNKNOWN
    if all(isinstance(v, str) for v in known):
        return ", ".join(known)
    ends = dict.fromkeys((known[0], known[-1]))
    return "–".join(f"{v:g}" for v in ends)
