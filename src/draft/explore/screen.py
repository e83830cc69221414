"""Screens: closed-form metrics of many designs by arrays, into one Parquet file."""

from __future__ import annotations

import time
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from draft import metrics as m
from draft.design.checks import kinds
from draft.errors import DraftError
from draft.explore.engines import Engine, LocalEngine
from draft.explore.job import Job, Robot, make
from draft.explore.parquet_parts import Parts, Summary, about, check_same
from draft.explore.rows import Part, Rows, Watch, Work, check_size, column, fill, total
from draft.explore.settings import ScreenSettings
from draft.extras import need
from draft.files import check_output
from draft.settings import takes
from draft.values import Array

CHUNK = 20_000  # designs per part; the fastest, because the arrays fit the caches
FEW = 0.3  # share of the designs of a part below which it is quicker to resolve them again


@takes(ScreenSettings)
def screen(robot: Robot, settings: ScreenSettings) -> Rows:
    """Screen designs by closed-form metrics and the design filter, into one Parquet file.

    Designs are computed by arrays, 20 000 at a time. A call that was interrupted resumes when it
    is repeated; a complete file is not computed again.

        >>> rows = draft.screen(
        ...     "quadruped",
        ...     vary={"thigh_length": (0.2, 0.4), "actuators.leg.peak_torque": (40, 500, "log")},
        ...     n=1000,
        ...     where="mass < 40 and accepted",
        ...     metrics=["mass", "jump_height"],
        ...     out="screen.parquet",
        ... )
        >>> rows.designs, rows.rows == rows.table().num_rows
        (1000, True)
        >>> rows.table().column_names[:4]
        ['index', 'thigh_length', 'actuators.leg.peak_torque', 'mass']

    Args:
        robot: a spec or a design, or its reference: "quadruped", "quadruped:bear", a folder. The
            values of a design hold for all designs drawn, except where they are varied.
        settings: fields of `ScreenSettings`, by keyword.

    Returns:
        Counts, and the table by `Rows.table`: `index`, the varied numbers, the metrics,
        `accepted`, `findings` (bit k for kind k of `draft.design.checks.kinds()`), `refused_by`.

    Raises:
        DraftError: an argument is invalid, the file belongs to another run, the disk is full, or
            the extra `explore` is not installed.
    """
    out = check_output(settings.out, ".parquet")
    job = make(robot, "screen", settings, CHUNK)
    engine = LocalEngine(min(settings.workers, job.parts))
    return Rows(out, **run_screen(job, out, engine, settings.watch(job.n)))


def run_screen(job: Job, out: Path, engine: Engine, watch: Watch = lambda done: None) -> Summary:
    """Screen designs into one Parquet file.

    Until the file is complete, its parts are in a folder beside it; a repeated run resumes.

    Args:
        job: job from `draft.explore.job.make`.
        out: file to write; its metadata contain the manifest.
        engine: engine that does the work.
        watch: called with the number of designs computed so far.

    Returns:
        `designs`, `rows`, `dropped`, `accepted` and `refused_by` of the whole run; `computed`, the
        designs computed by this call, and `seconds`.

    Raises:
        DraftError: there are too many designs, the file belongs to another run, or the disk is
        full.
    """
    need("pyarrow")
    check_size(job, out)
    start = time.perf_counter()
    manifest = job.manifest()
    if out.exists():
        found = about(out)
        if "manifest" not in found:
            cause = f"'{out}' exists and was not written by `draft.screen`; it is kept"
            raise DraftError(cause, "choose another `out`")
        check_same(found["manifest"], manifest, str(out))
        watch(job.n)
        return found["summary"] | {"computed": 0, "seconds": 0.0}
    with Parts(out.with_name(out.name + ".parts"), manifest, job.parts).held() as parts:
        computed = fill(parts, Work(job, measure), engine, watch)
        summary = total(parts.done)
        parts.merge(out, {"summary": summary, "findings": list(kinds())})
    return summary | {"computed": computed, "seconds": time.perf_counter() - start}


def measure(part: Part) -> tuple[dict[str, Array], None]:
    """Measure some of N designs by arrays.

    To resolve a few again and measure them takes less time than to measure all.
    """
    count, names, rows = part.count, part.job.metrics, part.rows
    if len(rows) < FEW * count:
        some = rows if len(rows) else np.array([0])
        few = part.job.resolve({name: values[some] for name, values in part.drawn.items()})
        measured = m.of_design(few, names)
        return {
            name: _spread(column(measured[name], len(some)), some, count) for name in names
        }, None
    more = m.of_design(part.design, [name for name in names if name not in part.found])
    measured = {**part.found, **more}
    return {name: column(measured[name], count) for name in names}, None


def _spread(values: Array, rows: NDArray[np.intp], count: int) -> Array:
    """Return N values, of which those of the other rows are zero."""
    found = np.zeros(count, values.dtype)
    found[rows] = values
    return found
