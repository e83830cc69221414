"""Sweeps: compiled models and their metrics, one design after another, into a folder of parts."""

from __future__ import annotations

import time
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from draft import metrics as m
from draft.design import Design
from draft.errors import DraftError, Problem
from draft.explore import where
from draft.explore.engines import Engine, LocalEngine
from draft.explore.job import Job, opened
from draft.explore.parquet_parts import Parts, Summary, encode
from draft.explore.screen import Watch, check_size, column, fill, summarise, total, verdict
from draft.extras import need
from draft.values import Array

# What one design can do wrong without ending the run.
_FAULTS = (DraftError, ArithmeticError, np.linalg.LinAlgError)


def chunk(n: int) -> int:
    """Designs of a part: enough to work by arrays where that goes, few enough to lose little."""
    return max(20, min(200, -(-n // 64)))


@dataclass(frozen=True, slots=True)
class Sweep:
    """Work on one part of a sweep: from its number to a Parquet file and what it says."""

    job: Job

    def __call__(self, part: int) -> tuple[bytes, Summary]:
        """Draw, resolve, filter, build, measure."""
        job = self.job
        start, count = job.span(part)
        drawn = job.draw(start, count)
        design = job.resolve(drawn)
        condition = where.condition(opened(job), job.where) if job.where else None
        names = tuple(dict.fromkeys((*job.metrics, *(condition.metrics if condition else ()))))
        closed = [name for name in names if m.METRICS[name].needs == "design"]
        found = {n: column(v, count) for n, v in m.of_design(design, closed).items()}
        rows = np.arange(count)
        if condition and not condition.needs_model:  # what is dropped need not be built
            rows = np.flatnonzero(condition.holds(design, found))
        built, errors = self.build(design, drawn, rows, [n for n in names if n not in closed])
        found |= built
        if condition and condition.needs_model:
            rows = np.flatnonzero(condition.holds(design, found))
        columns: dict[str, Any] = {"index": rows + start}
        columns |= {name: values[rows] for name, values in drawn.items()}
        columns |= {name: found[name][rows] for name in job.metrics}
        columns |= verdict(design, rows)
        said = [errors.get(int(row)) for row in rows]
        columns["accepted"] = np.asarray([words is None for words in said], dtype=bool)
        columns["error"] = need("pyarrow").array(said, type="string")
        summary = summarise(columns, count)
        return encode(columns, summary), summary

    def build(
        self,
        design: Design,
        drawn: Mapping[str, Array],
        rows: NDArray[np.intp],
        names: list[str],
    ) -> tuple[dict[str, Array], dict[int, str]]:
        """Build some of N designs.

        Returns:
            Metrics of models, shape (N,), NaN where there is none; what is wrong, by row.
        """
        spec, fixed = opened(self.job), dict(self.job.values)
        found = {name: np.full(design.count or 1, np.nan) for name in names}
        accepted = np.asarray(design.accepted)
        errors: dict[int, str] = {}
        for row in map(int, rows):
            if not accepted[row]:
                errors[row] = _refusal(design, row)
                continue
            try:
                model = spec.resolve(fixed, {n: float(v[row]) for n, v in drawn.items()}).build()
                for name, value in m.of_model(model, names).items():
                    found[name][row] = value
            except _FAULTS as error:
                errors[row] = " ".join(str(error).split())
        return found, errors


def _refusal(design: Design, row: int) -> str:
    """Errors of the filter for one of N designs."""
    wrong = [
        f"{finding.id}:{finding.where}"
        for finding in design.findings
        if finding.severity == "error" and np.asarray(finding.mask)[row]
    ]
    return f"refused: {', '.join(wrong)}"


def run_sweep(
    job: Job, out: Path, engine: Engine | None = None, watch: Watch = lambda done: None
) -> Summary:
    """Build designs and write a row of each into the parts of a folder.

    The filter's refusals and models that MuJoCo rejects are rows with `accepted` false, what is
    wrong in `error`, and NaN for what only a model has.

    Args:
        job: from `draft.explore.job.make`.
        out: the folder; `_manifest.json` says what it holds.
        engine: where to work; two processes by default.
        watch: called with the number of designs done so far.

    Returns:
        As of `draft.explore.screen.run_screen`.

    Raises:
        DraftError: too many designs, a folder of something else, a full disk.
    """
    need("pyarrow")
    if out.exists() and not out.is_dir():
        remedy = "choose another --out"
        raise DraftError(Problem(f"--out '{out}' exists and is not a folder", None, remedy))
    check_size(job, out)
    start = time.perf_counter()
    with Parts(out, job.manifest(), job.parts).held() as parts:
        computed = fill(parts, Sweep(job), engine or LocalEngine(), watch)
        summary = total(parts.done)
    return summary | {"computed": computed, "seconds": time.perf_counter() - start}
