"""Job: everything that determines the rows of a run over many designs.

It contains the files of the spec, so that all processes and machines use the same spec.
"""

from __future__ import annotations

import hashlib
import json
import warnings
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np

from draft import metrics as m
from draft.design import Design
from draft.design.checks import CHECKS
from draft.design.references import find_design
from draft.errors import DraftError, ModelError, RefusedError, counted
from draft.explore import where
from draft.explore.settings import Number, Sampled
from draft.explore.where import Condition
from draft.extensions import ExtensionWarning, load
from draft.extras import own_version
from draft.laws import actuators, catalogue, structure
from draft.learn.measuring.evaluation_options import LearnedMetrics
from draft.learn.measuring.policy_metrics import digest
from draft.metrics.measure import needs_more
from draft.metrics.registry import closed, misfit, of_spec
from draft.spec import Spec
from draft.spec.payload import with_payload
from draft.spec.relative import merged
from draft.values import Array
from draft.variation import sampling
from draft.variation.axes import Axis, parse

FORMAT = 1
MAX_ROWS = 10**10  # of one run

Robot = Spec | Design | str | Path


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
    sampler: sampling.Sampler
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
        return sampling.draw(self.axes, self.sampler, self.n, self.seed, start, count)

    def resolve(self, drawn: Mapping[str, Array]) -> Design:
        """Resolve the designs of drawn values in this process."""
        return opened(self).resolve(dict(self.values), drawn)

    def condition(self) -> Condition | None:
        """Condition on the rows to keep; None keeps all."""
        return where.condition(opened(self), self.where) if self.where else None

    @property
    def read(self) -> tuple[str, ...]:
        """Names of the metrics to compute, and of those in the condition."""
        condition = self.condition()
        return tuple(dict.fromkeys((*self.metrics, *(condition.metrics if condition else ()))))

    def manifest(self, read: Sequence[str] = ()) -> dict[str, Any]:
        """Identity of the run as plain data: runs with equal manifests have equal rows.

        Args:
            read: names of metrics that are read besides those of the job.
        """
        read = [*self.read, *read]
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
    robot: Robot, kind: str, settings: Sampled, chunk: int, learned: LearnedMetrics | None = None
) -> Job:
    """Check the settings of a run and make its job; nothing is written.

    Args:
        robot: a spec or a design, or its reference.
        kind: name of the command.
        settings: what is varied, and how designs are drawn and measured.
        chunk: designs per part.
        learned: settings of learned metrics; None for a run without them.

    Raises:
        DraftError: an argument is invalid.
    """
    spec, fixed = _base(robot, settings)
    learned = learned or LearnedMetrics()
    spec = with_payload(spec, [*fixed, *settings.vary])
    axes = parse(spec, settings.vary, fixed)
    count = sampling.rounded(axes, settings.sampler, settings.n)
    if settings.where is not None:
        where.parts(spec, settings.where)
    job = Job(
        kind,
        _files(spec),
        tuple(sorted(fixed.items())),
        axes,
        settings.sampler,
        count,
        settings.seed,
        (settings.where or "").strip(),
        _metrics(spec, kind, settings.metrics, axes),
        chunk,
        str(Path(learned.policy).absolute()) if learned.policy else "",
        outside=learned.outside,
    )
    # Resolve one design, so that errors in the values are reported before anything is written.
    if count <= MAX_ROWS:
        design = spec.resolve(fixed, job.draw(0, 1))
        job = _tried(job, design[0], named=settings.metrics is not None)
        if job.policy:
            job = replace(job, digest=digest(job.policy, design[0]))
    return job


def _tried(job: Job, design: Design, named: bool) -> Job:
    """Job without the metrics of extensions that fail for a design, with a warning for each.

    Raises:
        DraftError: one of them fails that is named.
    """
    failing: set[str] = set()
    for name in filter(m.METRICS.origin, job.read):
        try:
            if m.find(name).needs == "design":
                m.of_design(design, [name])
            else:
                m.of_model(design.build(), [name])
        except (RefusedError, ModelError):
            continue  # The design has no model; others may.
        except DraftError as error:
            if named or name not in job.metrics:
                raise
            warnings.warn(error.problems[0].cause, ExtensionWarning, stacklevel=2)
            failing.add(name)
    return replace(job, metrics=tuple(name for name in job.metrics if name not in failing))


def _base(robot: Robot, settings: Sampled) -> tuple[Spec, dict[str, Number]]:
    """Spec of a robot, and the values that hold for all designs; those of a design are some."""
    fixed: dict[str, Number] = {}
    if isinstance(robot, Design):
        spec, design = robot.spec, robot
    else:
        choice = find_design(robot)
        spec, design = choice.spec, None if choice.design is None else choice.resolve()
    if design is not None:
        if design.count is not None:
            remedy = "select one: design[0]"
            raise DraftError(f"this is {counted(design.count, 'design')}", remedy)
        for name, value in design.values.items():
            if name not in settings.vary and not isinstance(value, np.ndarray):
                fixed[name] = value
    return spec, dict(merged(fixed, settings.values or {}))


def checked_folder(out: str | Path) -> Path:
    """Return a folder to write.

    Raises:
        DraftError: its name is empty, which as a path would be the current folder.
    """
    if not str(out).strip():
        raise DraftError("`out` names no folder", "name one")
    return Path(out)


@lru_cache(maxsize=4)
def opened(job: Job) -> Spec:
    """Spec of a job, read once per process."""
    names = (*dict(job.values), *(axis.name for axis in job.axes))
    return with_payload(Spec.parse(dict(job.files)), names)


def needs_policy(names: Iterable[str]) -> bool:
    """Whether one of some metrics is measured with a policy."""
    return any(m.find(name).needs == "policy" for name in names)


def _metrics(
    spec: Spec, kind: str, names: Sequence[str] | None, axes: Sequence[Axis]
) -> tuple[str, ...]:
    known = of_spec(spec) if kind == "sweep" else closed(spec)
    chosen = known if names is None else list(dict.fromkeys(names))
    for name in chosen:
        if (problem := misfit(name, spec)) is not None:
            raise DraftError(problem)
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
