"""Rows of screens and sweeps: designs that are drawn, measured and written part by part."""

from __future__ import annotations

import shutil
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from draft import metrics as m
from draft.design import Design
from draft.design.checks import is_error, kinds
from draft.errors import DraftError
from draft.explore.engines import Engine
from draft.explore.job import MAX_ROWS, Job
from draft.explore.parquet_parts import Parts, Summary, encode
from draft.extras import need
from draft.values import Array, Value

if TYPE_CHECKING:
    import pyarrow

Watch = Callable[[int], object]


@dataclass(frozen=True)
class Rows:
    """Rows of a screen or a sweep, on disk.

    Attributes:
        out: the Parquet file, or the folder of Parquet parts.
        designs: designs drawn.
        rows: rows kept, one per design that meets the condition.
        accepted: rows of designs that the design filter accepts.
        dropped: designs that do not meet the condition.
        refused_by: rows by kind of the first error of the design filter.
        computed: designs computed by this call; 0 where the file was complete.
        seconds: time of this call [s].
    """

    out: Path
    designs: int
    rows: int
    accepted: int
    dropped: int
    refused_by: Mapping[str, int]
    computed: int
    seconds: float

    def table(self) -> pyarrow.Table:
        """Read all rows into memory, in the order of their column `index`."""
        files = sorted(self.out.glob("*.parquet")) if self.out.is_dir() else [self.out]
        parquet = need("pyarrow.parquet")
        return need("pyarrow").concat_tables([parquet.read_table(file) for file in files])


@dataclass(frozen=True, slots=True)
class Part:
    """N designs of a run.

    Attributes:
        job: the run.
        drawn: their varied values by name, shape (N,).
        design: the designs.
        rows: those to measure.
        found: metrics that are known for all, by name.
    """

    job: Job
    drawn: Mapping[str, Array]
    design: Design
    rows: NDArray[np.intp]
    found: Mapping[str, Value]

    @property
    def count(self) -> int:
        """Number of designs."""
        return self.design.count or 1


# Metrics by name, shape (N,), of which only `rows` count; and, where models are built, the reasons
# why designs have none, by row.
Measure = Callable[[Part], tuple[Mapping[str, Array], Mapping[int, str] | None]]


@dataclass(frozen=True, slots=True)
class Work:
    """Task of a run: from the number of a part to its Parquet file and its summary.

    Attributes:
        job: the run.
        measure: function that measures designs of a part.
    """

    job: Job
    measure: Measure

    def __call__(self, part: int) -> tuple[bytes, Summary]:
        """Draw and resolve the designs of a part, drop some by the condition, and measure them."""
        job = self.job
        start, count = job.span(part)
        drawn = job.draw(start, count)
        design = job.resolve(drawn)
        condition = job.condition()
        found: Mapping[str, Value] = {}
        rows = np.arange(count)
        if condition and not condition.needs_model:
            found = m.of_design(design, condition.metrics)
            rows = np.flatnonzero(condition.holds(design, found))
        measured, errors = self.measure(Part(job, drawn, design, rows, found))
        if condition and condition.needs_model:
            rows = np.flatnonzero(condition.holds(design, measured))
        columns: dict[str, Any] = {"index": rows + start}
        columns |= {name: values[rows] for name, values in drawn.items()}
        columns |= {name: measured[name][rows] for name in job.metrics}
        columns |= verdict(design, rows)
        if errors is not None:
            messages = [errors.get(int(row)) for row in rows]
            columns["accepted"] = np.asarray([text is None for text in messages], dtype=bool)
            columns["error"] = need("pyarrow").array(messages, type="string")
        summary = summarise(columns, count)
        return encode(columns, summary), summary


def column(value: Value, count: int) -> NDArray[Any]:
    """Return a metric as an array of shape (count,), also if all designs share its value."""
    return np.broadcast_to(np.asarray(value), (count,))


def verdict(design: Design, rows: NDArray[np.intp]) -> dict[str, Any]:
    """Columns with the verdict of the design filter for some rows of N designs.

    Returns:
        `accepted`, a mask; `findings`, with bit k for kind k of `kinds()`; `refused_by`, the kind
        of the first error, or null.
    """
    pa = need("pyarrow")
    known = tuple(kinds())
    refusals = _refusals()
    # One bit for each kind; extensions add some.
    whole = np.uint32 if len(known) <= 32 else np.uint64
    bits = np.zeros(len(rows), dtype=whole)
    first = np.full(len(rows), -1, dtype=np.int8)
    for finding in design.findings:
        mask = np.broadcast_to(np.asarray(finding.mask), (design.count or 1,))[rows]
        bits |= mask * whole(1 << known.index(finding.id))
        if finding.severity == "error":
            first[mask & (first < 0)] = refusals.index(finding.id)
    codes = pa.array(first, mask=first < 0)
    return {
        "accepted": np.asarray(design.accepted)[rows],
        "findings": bits,
        "refused_by": pa.DictionaryArray.from_arrays(codes, pa.array(refusals)),
    }


def _refusals() -> tuple[str, ...]:
    """Kinds of findings that refuse a design."""
    return tuple(filter(is_error, kinds()))


def summarise(columns: Mapping[str, Any], count: int) -> Summary:
    """Summary of a part: designs drawn, rows kept, accepted, and refused by kind of error."""
    codes = columns["refused_by"].indices.drop_null().to_numpy()
    refusals = _refusals()
    counts = np.bincount(codes, minlength=len(refusals))
    return {
        "designs": count,
        "rows": len(columns["index"]),
        "accepted": int(np.count_nonzero(columns["accepted"])),
        "refused_by": {k: int(c) for k, c in zip(refusals, counts, strict=True) if c},
    }


def total(done: Mapping[int, Summary]) -> Summary:
    """Sum of the summaries of parts."""
    refused: dict[str, int] = {}
    for one in done.values():
        for kind, count in one["refused_by"].items():
            refused[kind] = refused.get(kind, 0) + count
    whole = {key: sum(one[key] for one in done.values()) for key in ("designs", "rows", "accepted")}
    dropped = whole["designs"] - whole["rows"]
    return whole | {"dropped": dropped, "refused_by": refused}


def fill(parts: Parts, work: Work, engine: Engine, watch: Watch) -> int:
    """Compute and write the missing parts.

    Returns:
        Number of designs computed.
    """
    done = sum(one["designs"] for one in parts.done.values())
    before = done
    watch(done)
    for number, (content, summary) in engine.run(parts.missing(), work):
        parts.add(number, content, summary)
        done += summary["designs"]
        watch(done)
    return done - before


def check_size(job: Job, out: Path) -> None:
    """Check that the disk has space for the rows of a run.

    Raises:
        DraftError: it has not, or the run has more than `MAX_ROWS` rows.
    """
    size = job.n * (8 * (1 + len(job.axes) + len(job.metrics)) + 4)
    folder = out.absolute().parent
    while not folder.exists():
        folder = folder.parent
    free = shutil.disk_usage(folder).free
    # A condition drops an unknown number of rows.
    if job.n <= MAX_ROWS and (job.where or size <= free):
        return
    cause = f"{job.n:.3g} designs take up to {_bytes(size)} of disk; {_bytes(free)} are free"
    remedy = f"lower `n`{_grid(job)}, ask for fewer `metrics`, or drop rows with `where`"
    if job.n > MAX_ROWS:
        cause += f", and a run has at most {MAX_ROWS:.0e}"
    raise DraftError(cause, remedy)


def _grid(job: Job) -> str:
    return (
        " or vary less (a grid has two points along every range)" if job.sampler == "grid" else ""
    )


def _bytes(size: float) -> str:
    for unit in ("B", "kB", "MB", "GB", "TB"):
        if size < 1000:
            return f"{size:.3g} {unit}"
        size /= 1000
    return f"{size:.3g} PB"
