"""Job: everything that determines the rows of a run over many designs.

It contains the files of the spec, so that all processes and machines use the same spec.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from pathlib import Path
from typing import Any

from draft import metrics as m
from draft.design import Design
from draft.design.checks import CHECKS
from draft.errors import DraftError
from draft.explore import sample, vary, where
from draft.explore.vary import Axis
from draft.explore.where import Condition
from draft.extensions import load
from draft.extras import own_version
from draft.laws import actuators, catalogue, structure
from draft.metrics.learned import digest
from draft.metrics.measure import needs_more
from draft.spec import Spec
from draft.spec.payload import with_payload
from draft.values import Array

FORMAT = 1
MAX_ROWS = 10**10  # of one run
_SEED_END = 1 << 63

Number = float | str | None


@dataclass(frozen=True)
class Job:
    """Definition of a run.

    Attributes:
        kind: name of the command.
        files: name and content of each relevant file of the spec.
        values: values that hold for all designs, by name.
        axes: numbers that are varied.
        sampler: "sobol", "grid" or "random".
        n: designs to draw.
        seed: seed of the sampler.
        where: condition on the rows to keep; "" keeps all.
        metrics: names of the metrics to compute.
        chunk: designs per part.
        policy: run or ONNX file of the policy of learned metrics; "" for the one that ships.
        digest: digest of that policy, which all parts have to find; "" for the one that ships.
        outside: whether learned metrics have values outside the policy's region of validity too.
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
    policy: str = ""
    digest: str = ""
    outside: bool = False

    @property
    def parts(self) -> int:
        """Number of parts."""
        return -(-self.n // self.chunk)

    def span(self, part: int) -> tuple[int, int]:
        """First row of a part, and its number of rows."""
        start = part * self.chunk
        return start, min(self.chunk, self.n - start)

    def draw(self, start: int, count: int) -> dict[str, Array]:
        """Draw the varied values of rows [start, start + count), by name, shape (count,)."""
        return sample.draw(self.axes, self.sampler, self.n, self.seed, start, count)

    def resolve(self, drawn: Mapping[str, Array]) -> Design:
        """Resolve the designs of drawn values in this process."""
        return opened(self).resolve(dict(self.values), drawn)

    def condition(self) -> Condition | None:
        """Condition on the rows to keep; None keeps all."""
        return where.condition(opened(self), self.where) if self.where else None

    def manifest(self, read: Sequence[str] = ()) -> dict[str, Any]:
        """Identity of the run as plain data: runs with equal manifests have equal rows.

        Args:
            read: names of metrics that are read besides those of the job.
        """
        read = [*self.metrics, *read]
        if self.where:
            read += where.condition(opened(self), self.where).metrics
        more: dict[str, Any] = {}
        if needs_policy(read):
            first = self.resolve(self.draw(0, 1))[0]
            more["policy"] = self.digest or digest(self.policy, first)
            if self.outside:
                more["outside"] = True
        if extensions := {one.package: one.version for one in load() if not one.problem}:
            more["extensions"] = extensions
        if CHECKS:
            more["checks"] = list(CHECKS)
        return more | {
            "format": FORMAT,
            "command": self.kind,
            "draft": own_version(),
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
    varied: vary.Vary,
    n: str | float,
    *,
    values: Mapping[str, Number] | None = None,
    sampler: sample.Kind = "sobol",
    seed: int = 0,
    condition: str | None = None,
    metrics: Sequence[str] | None = None,
    chunk: int,
    policy: str | Path | None = None,
    outside: bool = False,
) -> Job:
    """Check the arguments of a run and make its job; nothing is written.

    Args:
        spec: the robot.
        kind: name of the command.
        varied: ranges, as `draft.explore.vary.parse` reads them.
        n: designs to draw, such as 1e6.
        values: values that hold for all designs.
        sampler: sampler of the designs.
        seed: seed of the sampler.
        condition: condition on the rows to keep.
        metrics: names of the metrics to compute; None for all that the command can compute.
        chunk: designs per part.
        policy: policy of learned metrics; None for the one that ships.
        outside: whether they have values outside its region of validity too.

    Raises:
        DraftError: an argument is invalid.
    """
    fixed = dict(values or {})
    spec = with_payload(spec, [*fixed, *vary.names(varied)])
    axes = vary.parse(spec, varied, fixed)
    count = sample.rounded(axes, sampler, whole(n))
    if not 0 <= seed < _SEED_END:
        raise DraftError(f"`seed` {seed} is not from 0 to 2**63 - 1", "such as 0")
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
        str(Path(policy).absolute()) if policy else "",
        outside=outside,
    )
    # Resolve one design, so that errors in the values are reported before anything is written.
    if count <= MAX_ROWS:
        design = spec.resolve(fixed, job.draw(0, 1))
        if policy:
            job = replace(job, digest=digest(job.policy, design[0]))
    return job


def whole(n: str | float) -> int:
    """Parse a number of designs, such as 1e6.

    Raises:
        DraftError: it is not a whole number above zero.
    """
    try:
        number = float(n)
        count = int(number)
    except (ValueError, OverflowError):
        number, count = 0.5, 0
    if count != number or count < 1:
        remedy = "give a whole number above zero, such as 1e6"
        raise DraftError(f"`n` {n} is not a number of designs", remedy)
    return count


@lru_cache(maxsize=4)
def opened(job: Job) -> Spec:
    """Spec of a job, read once per process."""
    names = (*dict(job.values), *(axis.name for axis in job.axes))
    return with_payload(Spec.parse(dict(job.files)), names)


def needs_policy(names: Iterable[str]) -> bool:
    """Whether one of some metrics is measured with a policy."""
    return any(m.find(name).needs == "policy" for name in names)


def _metrics(kind: str, names: Sequence[str] | None, axes: Sequence[Axis]) -> tuple[str, ...]:
    known = [x.name for x in m.METRICS.values() if x.needs == "design" or kind == "sweep"]
    chosen = known if names is None else list(dict.fromkeys(names))
    for name in chosen:
        if m.find(name).needs != "design" and kind != "sweep":
            raise DraftError(needs_more(m.find(name)))
    clashes = {axis.name for axis in axes} & {*chosen, "index", where.ACCEPTED, "findings"}
    if clashes:
        cause = f"'{min(clashes)}' is the name of a varied parameter and of another column"
        raise DraftError(cause, "rename the parameter, or omit it from `metrics`")
    return tuple(chosen)


def _files(spec: Spec) -> tuple[tuple[str, bytes], ...]:
    """Name and content of the files that determine the designs of a spec.

    Named designs are not among them: a job contains their values.
    """
    try:
        return tuple((name, file.read_bytes()) for name, file in spec.files.items())
    except OSError as error:
        cause = f"cannot read {error.filename}: {(error.strerror or str(error)).lower()}"
        raise DraftError(cause) from None


def _digest(files: Sequence[tuple[str, bytes]]) -> str:
    table = [(name, hashlib.sha256(content).hexdigest()) for name, content in files]
    return hashlib.sha256(json.dumps(table).encode()).hexdigest()


@lru_cache(maxsize=1)
def _trends() -> str:
    """Digest of the shipped trends and the catalogue."""
    paths = (actuators.FILE, structure.FILE, catalogue.FILE)
    return _digest([(path.name, path.read_bytes()) for path in paths])
