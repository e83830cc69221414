"""A run over many designs: all that decides its rows, and nothing else.

The spec travels as the content of its files, so that every process and machine works on the same.
"""

from __future__ import annotations

import hashlib
import json
import os
import tempfile
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from importlib.metadata import version
from pathlib import Path
from typing import Any

from draft import metrics as m
from draft.design import Design
from draft.design.plan import plan
from draft.errors import DraftError, Problem
from draft.explore import sample, vary, where
from draft.explore.vary import Axis
from draft.laws import actuators, catalogue, structure
from draft.spec import Spec, load
from draft.values import Array

FORMAT = 1
MOST = 10**10  # rows of one run
_FILES = ("parameters.yaml", "tree.yaml", "root.yaml")
_SEED_END = 1 << 63

Number = float | str | None


@dataclass(frozen=True)
class Job:
    """What a run computes.

    Attributes:
        kind: the command.
        files: name and content of each file of the spec that counts.
        values: values that hold for all designs.
        axes: what is varied.
        sampler: "sobol", "grid" or "random".
        n: designs.
        seed: of the sampler.
        where: condition on the rows that are kept; "" for all.
        metrics: columns besides what is varied.
        chunk: designs of a part.
    """

    kind: str
    files: tuple[tuple[str, bytes], ...]
    values: tuple[tuple[str, Number], ...]
    axes: tuple[Axis, ...]
    sampler: sample.Kind
    n: int
    seed: int
    where: str
    metrics: tuple[str, ...]
    chunk: int

    @property
    def parts(self) -> int:
        """How many parts its rows come in."""
        return -(-self.n // self.chunk)

    def span(self, part: int) -> tuple[int, int]:
        """First row of a part, and how many."""
        start = part * self.chunk
        return start, min(self.chunk, self.n - start)

    def draw(self, start: int, count: int) -> dict[str, Array]:
        """Values of what is varied in rows [start, start + count)."""
        return sample.draw(self.axes, self.sampler, self.n, self.seed, start, count)

    def resolve(self, drawn: Mapping[str, Array]) -> Design:
        """Designs of some rows, in this process."""
        return opened(self).resolve(dict(self.values), drawn)

    def manifest(self) -> dict[str, Any]:
        """All that decides the rows, as plain data: runs with equal manifests have equal rows."""
        return {
            "format": FORMAT,
            "command": self.kind,
            "draft": version("draft"),
            "spec": _digest(self.files),
            "trends": _trends(),
            "values": dict(self.values),
            "vary": {axis.name: axis.record() for axis in self.axes},
            "sampler": self.sampler,
            "n": self.n,
            "seed": self.seed,
            "where": self.where,
            "metrics": list(self.metrics),
            "chunk": self.chunk,
        }


def make(
    spec: Spec,
    kind: str,
    words: Sequence[str],
    n: str | float,
    *,
    values: Mapping[str, Number] | None = None,
    sampler: sample.Kind = "sobol",
    seed: int = 0,
    condition: str | None = None,
    metrics: Sequence[str] | None = None,
    chunk: int,
) -> Job:
    """Check what a command was asked for.

    Args:
        spec: the robot.
        kind: the command.
        words: what to vary, as `draft.explore.vary` reads it.
        n: how many designs, such as 1e6.
        values: values that hold for all.
        sampler: how the designs are drawn.
        seed: of the sampler.
        condition: which rows to keep.
        metrics: which to compute; None for all that the command can.
        chunk: designs of a part.

    Raises:
        DraftError: anything of it is wrong; nothing is written yet.
    """
    fixed = dict(values or {})
    axes = vary.parse(spec, words, fixed)
    count = sample.rounded(axes, sampler, whole(n))
    if not 0 <= seed < _SEED_END:
        raise DraftError(Problem(f"--seed {seed} is not from 0 to 2**63 - 1", None, "such as 0"))
    if condition:
        where.condition(spec, condition)
    names = _metrics(kind, metrics, axes)
    job = Job(
        kind,
        _files(spec),
        tuple(sorted(fixed.items())),
        axes,
        sampler,
        count,
        seed,
        (condition or "").strip(),
        names,
        chunk,
    )
    # What is wrong with the values shows before anything is written, at its place in the files.
    if count <= MOST:
        spec.resolve(fixed, job.draw(0, 1))
    return job


def whole(n: str | float) -> int:
    """Read a number of designs; it may be written 1e6.

    Raises:
        DraftError: not a whole number above zero.
    """
    try:
        number = float(n)
        count = int(number)
    except (ValueError, OverflowError):
        number, count = 0.5, 0
    if count != number or count < 1:
        remedy = "a whole number above zero, such as 1e6"
        raise DraftError(Problem(f"--n {n} is not a number of designs", None, remedy))
    return count


@lru_cache(maxsize=4)
def opened(job: Job) -> Spec:
    """The spec of a job, read once in a process."""
    with tempfile.TemporaryDirectory(prefix="draft-") as folder:
        for name, content in job.files:
            path = Path(folder) / name
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_bytes(content)
        spec = load(folder)
        plan(spec)  # reads the spec's own trends while they are there
    return spec


def _metrics(kind: str, names: Sequence[str] | None, axes: Sequence[Axis]) -> tuple[str, ...]:
    able = [x.name for x in m.METRICS.values() if x.needs == "design" or kind == "sweep"]
    chosen = able if names is None else list(dict.fromkeys(names))
    for name in chosen:
        if m.find(name).needs == "model" and kind != "sweep":
            remedy = "use 'draft sweep', which builds every design"
            raise DraftError(Problem(f"'{name}' needs a compiled model", None, remedy))
    twins = {axis.name for axis in axes} & {*chosen, "index", where.ACCEPTED, "findings"}
    if twins:
        cause = f"'{min(twins)}' is varied and the name of a column"
        raise DraftError(Problem(cause, None, "rename the parameter, or leave it out of --metrics"))
    return tuple(chosen)


def _files(spec: Spec) -> tuple[tuple[str, bytes], ...]:
    """The files that decide what a spec gives; named designs count by their values."""
    names = [*_FILES]
    for path in (spec.trends, spec.structure):
        if isinstance(path, Path):
            names.append(os.path.relpath(path, spec.folder))
    try:
        return tuple((name, (spec.folder / name).read_bytes()) for name in names)
    except OSError as error:
        cause = f"cannot read {error.filename}: {(error.strerror or str(error)).lower()}"
        raise DraftError(Problem(cause)) from None


def _digest(files: Sequence[tuple[str, bytes]]) -> str:
    table = [(name, hashlib.sha256(content).hexdigest()) for name, content in files]
    return hashlib.sha256(json.dumps(table).encode()).hexdigest()


@lru_cache(maxsize=1)
def _trends() -> str:
    """Hash of the shipped trends and of the catalogue."""
    paths = (actuators.FILE, structure.FILE, catalogue.FILE)
    return _digest([(path.name, path.read_bytes()) for path in paths])
