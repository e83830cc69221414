"""Sweeps: compiled models and their metrics, in batches of designs, into a folder of parts."""

from __future__ import annotations

import time
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from draft import metrics as m
from draft.design import Design
from draft.design.findings import refusal
from draft.errors import DraftError
from draft.explore.engines import Engine, LocalEngine
from draft.explore.job import Job, opened
from draft.explore.parquet_parts import Parts, Summary, encode
from draft.explore.screen import Watch, check_size, column, fill, summarise, total, verdict
from draft.extras import need
from draft.values import Array

if TYPE_CHECKING:
    import mujoco

# Errors of one design that do not end the run.
_FAULTS = (DraftError, ArithmeticError, np.linalg.LinAlgError)


LEARNED_CHUNK = 64  # Designs per part with a policy: about half a minute.


def chunk(n: int) -> int:
    """Designs per part: many enough for array operations, few enough to lose little to a kill."""
    return max(20, min(1000, -(-n // 16)))


@dataclass(frozen=True, slots=True)
class Sweep:
    """Task of a sweep: from the number of a part to its Parquet file and its summary."""

    job: Job

    def __call__(self, part: int) -> tuple[bytes, Summary]:
        """Draw, resolve, filter, build and measure the designs of a part."""
        job = self.job
        start, count = job.span(part)
        drawn = job.draw(start, count)
        design = job.resolve(drawn)
        condition = job.condition()
        names = tuple(dict.fromkeys((*job.metrics, *(condition.metrics if condition else ()))))
        closed = [name for name in names if m.find(name).needs == "design"]
        found = {n: column(v, count) for n, v in m.of_design(design, closed).items()}
        rows = np.arange(count)
        if condition and not condition.needs_model:  # dropped designs are not built
            rows = np.flatnonzero(condition.holds(design, found))
        built, errors = self.build(design, drawn, rows, [n for n in names if n not in closed])
        found |= built
        if condition and condition.needs_model:
            rows = np.flatnonzero(condition.holds(design, found))
        columns: dict[str, Any] = {"index": rows + start}
        columns |= {name: values[rows] for name, values in drawn.items()}
        columns |= {name: found[name][rows] for name in job.metrics}
        columns |= verdict(design, rows)
        messages = [errors.get(int(row)) for row in rows]
        columns["accepted"] = np.asarray([text is None for text in messages], dtype=bool)
        columns["error"] = need("pyarrow").array(messages, type="string")
        summary = summarise(columns, count)
        return encode(columns, summary), summary

    def build(
        self,
        design: Design,
        drawn: Mapping[str, Array],
        rows: NDArray[np.intp],
        names: list[str],
    ) -> tuple[dict[str, Array], dict[int, str]]:
        """Build and measure some of N designs: in one batch where possible, the others singly.

        Args:
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
        built = self.together(design, rows[accepted], together, found)
        for row in map(int, rows[accepted]):
            rest = others if row in built else names
            if row not in built or rest:
                self.alone(drawn, row, rest, found, errors)
        sound = rows[[int(row) not in errors for row in rows]]
        if learned:
            job, more = self.job, {"outside": True} if self.job.outside else {}
            measured = m.of_policy(
                design, learned, job.policy or None, known=job.digest, rows=sound, **more
            )
            found |= {name: np.asarray(values) for name, values in measured.items()}
        return found, errors

    def together(
        self, design: Design, rows: NDArray[np.intp], names: list[str], found: dict[str, Array]
    ) -> set[int]:
        """Compile designs as one batch and measure their models.

        Returns:
            Rows that this went for; the others have to be built to know what is wrong with them.
        """
        from draft.model.batch import build_batch

        if not len(rows):
            return set()
        try:
            batch = build_batch(design, rows, _template(self.job))
            measured = m.of_batch(batch, names)
        except _FAULTS:
            return set()
        _template(self.job, batch.template)
        for name, values in measured.items():
            found[name][batch.rows] = values
        return set(batch.rows.tolist())

    def alone(
        self,
        drawn: Mapping[str, Array],
        row: int,
        names: list[str],
        found: dict[str, Array],
        errors: dict[int, str],
    ) -> None:
        """Build one design and measure its model."""
        spec, fixed = opened(self.job), dict(self.job.values)
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


def run_sweep(
    job: Job, out: Path, engine: Engine | None = None, watch: Watch = lambda done: None
) -> Summary:
    """Build designs and write a row for each into the parts of a folder.

    Designs that the filter refuses and models that MuJoCo rejects are rows with `accepted` false,
    the reason in `error`, and NaN for the metrics of a model.

    Args:
        job: job from `draft.explore.job.make`.
        out: folder to write; `_manifest.json` identifies its run.
        engine: engine that does the work; two processes by default.
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
        computed = fill(parts, Sweep(job), engine or LocalEngine(), watch)
        summary = total(parts.done)
    return summary | {"computed": computed, "seconds": time.perf_counter() - start}
