"""Screens: closed-form metrics and the verdict of the design filter for many designs, by arrays."""

from __future__ import annotations

import shutil
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from draft import metrics as m
from draft.design import Design
from draft.design.checks import is_error, kinds
from draft.errors import DraftError
from draft.explore.engines import Engine, LocalEngine
from draft.explore.job import MAX_ROWS, Job
from draft.explore.parquet_parts import Parts, Summary, about, check_same, encode
from draft.extras import need
from draft.values import Value

CHUNK = 20_000  # designs per part; the fastest, because the arrays fit the caches
FEW = 0.3  # share of the designs of a part below which it is quicker to resolve them again

Watch = Callable[[int], object]


@dataclass(frozen=True, slots=True)
class Screen:
    """Task of a screen: from the number of a part to its Parquet file and its summary."""

    job: Job

    def __call__(self, part: int) -> tuple[bytes, Summary]:
        """Draw, resolve and measure the designs of a part, and drop rows by the condition."""
        job = self.job
        start, count = job.span(part)
        drawn = job.draw(start, count)
        design = job.resolve(drawn)
        condition = job.condition()
        found = m.of_design(design, condition.metrics if condition else ())
        keep = condition.holds(design, found) if condition else np.ones(count, dtype=bool)
        rows = np.flatnonzero(keep)
        columns: dict[str, Any] = {"index": rows + start}
        columns |= {name: values[rows] for name, values in drawn.items()}
        columns |= self._measured(design, drawn, found, rows)
        columns |= verdict(design, rows)
        summary = summarise(columns, count)
        return encode(columns, summary), summary

    def _measured(
        self,
        design: Design,
        drawn: Mapping[str, NDArray[Any]],
        found: Mapping[str, Value],
        rows: NDArray[np.intp],
    ) -> dict[str, NDArray[Any]]:
        """Metrics of some of the designs, of which those in `found` are known for all.

        To resolve a few again and measure them takes less time than to measure all.
        """
        count, names = design.count or 1, self.job.metrics
        if len(rows) < FEW * count:
            some = rows if len(rows) else np.array([0])
            few = self.job.resolve({name: values[some] for name, values in drawn.items()})
            measured = m.of_design(few, names)
            return {name: column(measured[name], len(some))[: len(rows)] for name in names}
        measured = {**found, **m.of_design(design, [n for n in names if n not in found])}
        return {name: column(measured[name], count)[rows] for name in names}


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


def run_screen(
    job: Job, out: Path, engine: Engine | None = None, watch: Watch = lambda done: None
) -> Summary:
    """Screen designs into one Parquet file.

    Until the file is complete, its parts are in a folder beside it; a repeated run resumes.

    Args:
        job: job from `draft.explore.job.make`.
        out: file to write; its metadata contain the manifest.
        engine: engine that does the work; two processes by default.
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
        computed = fill(parts, Screen(job), engine or LocalEngine(), watch)
        summary = total(parts.done)
        parts.merge(out, {"summary": summary, "findings": list(kinds())})
    return summary | {"computed": computed, "seconds": time.perf_counter() - start}


def fill(
    parts: Parts, work: Callable[[int], tuple[bytes, Summary]], engine: Engine, watch: Watch
) -> int:
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
