"""Sweeps: compiled models and their metrics, in batches of designs, into a folder of parts."""

from __future__ import annotations

import time
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from draft import metrics as m
from draft.design import Design
from draft.design.findings import refusal
from draft.errors import DraftError
from draft.explore.engines import Engine, LocalEngine, RayEngine
from draft.explore.job import Job, Robot, checked_folder, make, needs_policy, opened
from draft.explore.parquet_parts import Parts, Summary
from draft.explore.rows import Part, Rows, Watch, Work, check_size, column, fill, total
from draft.explore.settings import SweepSettings
from draft.extras import need
from draft.learn.measuring.policy_metrics import of_policy
from draft.settings import takes
from draft.values import Array

if TYPE_CHECKING:
    import mujoco

LEARNED_CHUNK = 64  # designs per part with a policy: about half a minute
# Errors of one design that do not end the run.
_FAULTS = (DraftError, ArithmeticError, np.linalg.LinAlgError)


@takes(SweepSettings)
def sweep(robot: Robot, settings: SweepSettings) -> Rows:
    """Build designs and measure their models, into a folder of Parquet parts.

    Every model is compiled and checked by MuJoCo, so that metrics of the joint-space inertia M(q)
    are available. A call that was interrupted resumes when it is repeated.

        >>> rows = draft.sweep(
        ...     "hopper",
        ...     vary={"actuators.leg.peak_torque": [60, 80]},
        ...     sampler="grid",
        ...     n=2,
        ...     metrics=["mass", "impact_mitigation"],
        ...     out="sweep",
        ... )
        >>> rows.designs, rows.table()["accepted"].to_pylist()
        (2, [True, True])

    Args:
        robot: a spec or a design, or its reference, as `screen` takes it.
        settings: fields of `SweepSettings`, by keyword.

    Returns:
        Counts, and the table by `Rows.table`: the columns of `screen`, and `error`, the reason why
        a design has no model; its metrics of the model are NaN and `accepted` is false.

    Raises:
        DraftError: an argument is invalid, the folder belongs to another run, the disk is full, or
            the extra `explore` is not installed.
    """
    out = checked_folder(settings.out)
    if settings.address is not None and settings.engine != "ray":
        cause = "`address` is for a Ray cluster"
        raise DraftError(cause, "add `engine=ray`, or omit `address`")
    job = make(robot, "sweep", settings, chunk(settings.n), settings)
    workers = settings.workers
    if needs_policy(job.read):  # a policy uses all cores of one process
        job, workers = replace(job, chunk=min(job.chunk, LEARNED_CHUNK)), 1
    engine = LocalEngine(min(workers, job.parts))
    if settings.engine == "ray":
        engine = RayEngine(settings.address)
    return Rows(out, **run_sweep(job, out, engine, settings.watch(job.n)))


def run_sweep(job: Job, out: Path, engine: Engine, watch: Watch = lambda done: None) -> Summary:
    """Build designs and write a row for each into the parts of a folder.

    Designs that the filter refuses and models that MuJoCo rejects are rows with `accepted` false,
    the reason in `error`, and NaN for the metrics of a model.

    Args:
        job: job from `draft.explore.job.make`.
        out: folder to write; `_manifest.json` identifies its run.
        engine: engine that does the work.
        watch: called with the number of designs computed so far.

    Returns:
        Counts, as from `draft.explore.screen.run_screen`.

    Raises:
        DraftError: there are too many designs, the folder belongs to another run or program, or the
            disk is full.
    """
    need("pyarrow")
    if out.exists() and not out.is_dir():
        remedy = "choose another `out`"
        raise DraftError(f"`out` '{out}' exists and is not a folder", remedy)
    check_size(job, out)
    start = time.perf_counter()
    with Parts(out, job.manifest(), job.parts).held() as parts:
        computed = fill(parts, Work(job, measure), engine, watch)
        summary = total(parts.done)
    return summary | {"computed": computed, "seconds": time.perf_counter() - start}


def chunk(n: int) -> int:
    """Designs per part: many enough for array operations, few enough to lose little to a kill."""
    return max(20, min(1000, -(-n // 16)))


def measure(part: Part) -> tuple[dict[str, Array], dict[int, str]]:
    """Build and measure some of N designs."""
    names = part.job.read
    closed = [name for name in names if m.find(name).needs == "design" and name not in part.found]
    known = {**part.found, **m.of_design(part.design, closed)}
    rest = [name for name in names if name not in known]
    built, errors = build(part.job, part.design, part.drawn, part.rows, rest)
    return {name: column(value, part.count) for name, value in known.items()} | built, errors


def build(
    job: Job,
    design: Design,
    drawn: Mapping[str, Array],
    rows: NDArray[np.intp],
    names: list[str],
) -> tuple[dict[str, Array], dict[int, str]]:
    """Build and measure some of N designs: in one batch where possible, the others singly.

    Args:
        job: the run.
        design: N designs.
        drawn: their varied values by name, shape (N,).
        rows: designs to build.
        names: metrics to compute.

    Returns:
        Metrics by name, shape (N,), NaN for designs without a model; error messages by row.
    """
    found = {name: np.full(design.count or 1, np.nan) for name in names}
    accepted = np.broadcast_to(np.asarray(design.accepted), (design.count or 1,))[rows]
    errors = {int(row): refusal(design.findings, int(row)) for row in rows[~accepted]}
    learned = [name for name in names if m.find(name).needs == "policy"]
    names = [name for name in names if name not in learned]
    together = [name for name in names if m.find(name).batch]
    others = [name for name in names if name not in together]
    built = _together(job, design, rows[accepted], together, found)
    for row in map(int, rows[accepted]):
        rest = others if row in built else names
        if row not in built or rest:
            _alone(job, drawn, row, rest, found, errors)
    sound = rows[[int(row) not in errors for row in rows]]
    if learned:
        more = {"outside": True} if job.outside else {}
        measured = of_policy(
            design, learned, job.policy or None, known=job.digest, rows=sound, **more
        )
        found |= {name: np.asarray(values) for name, values in measured.items()}
    return found, errors


def _together(
    job: Job, design: Design, rows: NDArray[np.intp], names: list[str], found: dict[str, Array]
) -> set[int]:
    """Compile designs as one batch and measure their models.

    Returns:
        Rows that this went for; the others have to be built to know what is wrong with them.
    """
    from draft.model.batch import build_batch

    if not len(rows):
        return set()
    try:
        batch = build_batch(design, rows, _template(job))
        measured = m.of_batch(batch, names)
    except _FAULTS:
        return set()
    _template(job, batch.template)
    for name, values in measured.items():
        found[name][batch.rows] = values
    return set(batch.rows.tolist())


def _alone(
    job: Job,
    drawn: Mapping[str, Array],
    row: int,
    names: list[str],
    found: dict[str, Array],
    errors: dict[int, str],
) -> None:
    """Build one design and measure its model."""
    spec, fixed = opened(job), dict(job.values)
    try:
        model = spec.resolve(fixed, {n: float(v[row]) for n, v in drawn.items()}).build()
        for name, value in m.of_model(model, names).items():
            found[name][row] = value
    except _FAULTS as error:
        errors[row] = " ".join(str(error).split())


_templates: dict[Job, mujoco.MjModel] = {}


def _template(job: Job, found: mujoco.MjModel | None = None) -> mujoco.MjModel | None:
    """Template of a job's batches, kept from the first one in this process."""
    if found is not None and job not in _templates:
        _templates.clear()
        _templates[job] = found
    return _templates.get(job)
