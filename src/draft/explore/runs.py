"""Screens, sweeps and searches of one robot, by its name and a few arguments."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, overload

import numpy as np

from draft.design import Design
from draft.design.references import find_design
from draft.errors import DraftError, counted
from draft.explore import front, goals, sample
from draft.explore import job as jobs
from draft.explore.engines import Engine, LocalEngine
from draft.explore.job import Job, Number
from draft.explore.optimise import SCREENED, Kind, Search, run_search
from draft.explore.parquet_parts import Summary
from draft.explore.screen import CHUNK, run_screen
from draft.explore.sweep import LEARNED_CHUNK, chunk, run_sweep
from draft.explore.vary import Vary, names
from draft.extras import check as need_installed
from draft.extras import need
from draft.plotting import save
from draft.spec import Spec
from draft.spec.relative import merged

if TYPE_CHECKING:
    import pyarrow

Robot = Spec | Design | str | Path
Progress = Callable[[int, int], object]
_MOST_WORKERS = 1024


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


@dataclass(frozen=True)
class Front(Sequence[front.Entry]):
    """The designs of a search that no other trial beats in every goal.

    It is a sequence: each entry has `design` (name of its file in `out/designs`), `trial`, `values`
    (what was varied) and `goals`, by name.

    Attributes:
        out: folder of the study and the front.
        trials: trials of the study, those of earlier calls included.
        best: the entries, in order of the first goal.
        failed: number of trials that fail a condition, by condition; `a goal is undefined` counts
            those without numbers.
    """

    out: Path
    trials: int
    best: tuple[front.Entry, ...]
    failed: Mapping[str, int]

    @overload
    def __getitem__(self, index: int) -> front.Entry: ...
    @overload
    def __getitem__(self, index: slice) -> tuple[front.Entry, ...]: ...
    def __getitem__(self, index: int | slice) -> front.Entry | tuple[front.Entry, ...]:
        return self.best[index]

    def __len__(self) -> int:
        return len(self.best)

    def __repr__(self) -> str:
        best = counted(len(self), "best design")
        return f"Front('{self.out}', {counted(self.trials, 'trial')}, {best})"


def screen(
    robot: Robot,
    vary: Vary,
    *,
    out: str | Path,
    n: float | str = 100_000,
    where: str | None = None,
    metrics: Iterable[str] | None = None,
    values: Mapping[str, Number] | None = None,
    sampler: sample.Kind = "sobol",
    seed: int = 0,
    workers: int = 1,
    progress: Progress | None = None,
) -> Rows:
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
        vary: ranges by parameter or `actuators.CLASS.QUANTITY`, in the unit of that number:
            (low, high), (low, high, "log") for an even spread of the logarithm, or a list of
            values; or words of the command, such as ["thigh_length=0.2:0.4"].
        out: file to write.
        n: designs to draw. A grid rounds it.
        where: condition on the rows to keep, such as "mass < 40 and accepted"; None keeps all.
        metrics: metrics to write, by name; None for every closed-form metric.
        values: values that hold for all designs, by name; they override those of `robot`.
        sampler: "sobol", "grid" or "random".
        seed: seed of the sampler.
        workers: processes. With more than one, a script needs `if __name__ == "__main__":`.
        progress: called with the designs computed so far and in all.

    Returns:
        Counts, and the table by `Rows.table`: `index`, the varied numbers, the metrics,
        `accepted`, `findings` (bit k for kind k of `draft.design.checks.kinds()`), `refused_by`.

    Raises:
        DraftError: an argument is invalid, the file belongs to another run, the disk is full, or
            the extra `explore` is not installed.
    """
    path = Path(out)
    if not path.name or path.is_dir():
        cause = f"`out` '{out}' is a folder"
        raise DraftError(cause, "name a file, such as screen.parquet")
    job = _job(robot, "screen", vary, n, values, sampler, seed, where, metrics, CHUNK)
    summary = run_screen(job, path, _local(job, workers), _watch(progress, job.n))
    return _rows(path, summary)


def sweep(
    robot: Robot,
    vary: Vary,
    *,
    out: str | Path,
    n: float | str = 1000,
    where: str | None = None,
    metrics: Iterable[str] | None = None,
    values: Mapping[str, Number] | None = None,
    sampler: sample.Kind = "sobol",
    seed: int = 0,
    policy: str | Path | None = None,
    outside: bool = False,
    workers: int = 1,
    engine: Engine | None = None,
    progress: Progress | None = None,
) -> Rows:
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
        vary: ranges or lists of values by name, as `screen` takes them.
        out: folder to write.
        n: designs to draw. A grid rounds it.
        where: condition on the rows to keep; None keeps all.
        metrics: metrics to write, by name; None for all that need no policy.
        values: values that hold for all designs, by name; they override those of `robot`.
        sampler: "sobol", "grid" or "random".
        seed: seed of the sampler.
        policy: policy of metrics such as "learned.top_speed": a run or an ONNX file; None for the
            one of quadrupeds that ships. They use all cores in one process.
        outside: whether these metrics have values outside the policy's region of validity too,
            where it may fail; "learned.inside" tells them apart.
        workers: processes. With more than one, a script needs `if __name__ == "__main__":`.
        engine: where to compute instead, such as `draft.explore.engines.RayEngine()`.
        progress: called with the designs computed so far and in all.

    Returns:
        Counts, and the table by `Rows.table`: the columns of `screen`, and `error`, the reason why
        a design has no model; its metrics of the model are NaN and `accepted` is false.

    Raises:
        DraftError: an argument is invalid, the folder belongs to another run, the disk is full, or
            the extra `explore` is not installed.
    """
    path = _folder(out)
    size = chunk(jobs.whole(n))
    job = _job(
        robot, "sweep", vary, n, values, sampler, seed, where, metrics, size, policy, outside
    )
    condition = job.condition()
    if jobs.needs_policy([*job.metrics, *(condition.metrics if condition else ())]):
        job, workers = replace(job, chunk=min(size, LEARNED_CHUNK)), 1
    chosen = engine or _local(job, workers)
    return _rows(path, run_sweep(job, path, chosen, _watch(progress, job.n)))


def optimise(
    robot: Robot,
    vary: Vary,
    *,
    out: str | Path,
    minimise: Iterable[str] = (),
    maximise: Iterable[str] = (),
    subject_to: Iterable[str] = (),
    trials: int = 2000,
    values: Mapping[str, Number] | None = None,
    sampler: Kind = "nsga2",
    policy: str | Path | None = None,
    outside: bool = False,
    storage: str | None = None,
    seed: int = 0,
    figure: bool = False,
    progress: Progress | None = None,
) -> Front:
    """Search for designs that no other beats in every goal, and save them as named designs.

    A call that was interrupted resumes when it is repeated, and ends with the trials of one that
    was not; more `trials` continue the study. With `storage` the order of trials is by chance.

        >>> front = draft.optimise(
        ...     "quadruped",
        ...     vary={"thigh_length": (0.15, 0.6), "actuators.leg.peak_torque": (40, 150)},
        ...     minimise=["mass"],
        ...     maximise=["jump_height"],
        ...     subject_to=["accepted"],
        ...     trials=20,
        ...     out="search",
        ... )
        >>> front.trials, sorted(front[0]["goals"])
        (20, ['jump_height', 'mass'])
        >>> draft.load("quadruped").resolve("search/designs/front_001.yaml").accepted
        True

    Args:
        robot: a spec or a design, or its reference, as `screen` takes it.
        vary: ranges or lists of values by name, as `screen` takes them.
        out: folder of the study, `front.csv`, `front.json` and `designs/`.
        minimise: metrics or expressions to minimise.
        maximise: metrics or expressions to maximise.
        subject_to: conditions that designs must meet, such as "accepted" or "payload_rated > 20".
        trials: designs to try in all, those of earlier calls included.
        values: values that hold for all designs, by name; they override those of `robot`.
        sampler: sampler of Optuna: "nsga2" or "tpe".
        policy: policy of metrics such as "learned.top_speed", as `sweep` takes it.
        outside: whether these have values outside the policy's region too, as `sweep` takes it.
        storage: URL of a database that several processes share; None for `out/study.db`.
        seed: seed of the sampler.
        figure: draw the front over all trials as `front.png` and `front.pdf`.
        progress: called with the trials so far and in all.

    Returns:
        The best designs; empty where no trial meets all conditions.

    Raises:
        DraftError: an argument is invalid, the study is of another search, a file cannot be
            written, or the extra `explore` (with `figure`, `figures`) is not installed.
    """
    path = _folder(out)
    if figure:
        need_installed("matplotlib", "figures")
    job = _job(
        robot,
        "optimise",
        vary,
        SCREENED,
        values,
        "sobol",
        seed,
        None,
        (),
        SCREENED,
        policy,
        outside,
    )
    spec = jobs.opened(job)
    wanted = goals.goals(spec, _listed(minimise), _listed(maximise))
    search = Search(job, wanted, goals.constraints(spec, _listed(subject_to)), trials, sampler)
    done = run_search(search, path, storage, _watch(progress, trials))
    best = front.front(search, done)
    front.save(search, best, path)
    if figure:
        from draft.explore import front_figure

        save(path, {"front": partial(front_figure.draw, search, done, best)})
    return Front(path, len(done), tuple(best), front.failed(search, done))


def _job(
    robot: Robot,
    kind: str,
    vary: Vary,
    n: float | str,
    values: Mapping[str, Number] | None,
    sampler: sample.Kind,
    seed: int,
    where: str | None,
    metrics: Iterable[str] | None,
    size: int,
    policy: str | Path | None = None,
    outside: bool = False,
) -> Job:
    """Check the arguments that all runs share; nothing is written yet."""
    vary = vary if isinstance(vary, Mapping) else _listed(vary)
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
        varied = names(vary)
        for name, value in design.values.items():
            if name not in varied and not isinstance(value, np.ndarray):
                fixed[name] = value
    return jobs.make(
        spec,
        kind,
        vary,
        n,
        values=merged(fixed, values or {}),
        sampler=sampler,
        seed=seed,
        condition=where,
        metrics=None if metrics is None else _listed(metrics),
        chunk=size,
        policy=policy,
        outside=outside,
    )


def _local(job: Job, workers: int) -> LocalEngine:
    if not 1 <= workers <= _MOST_WORKERS:
        cause = f"`workers` {workers} is not from 1 to {_MOST_WORKERS}"
        raise DraftError(cause, "such as 2")
    return LocalEngine(min(workers, job.parts))


def _watch(progress: Progress | None, total: int) -> Callable[[int], object]:
    return lambda done: progress(done, total) if progress else None


def _rows(out: Path, summary: Summary) -> Rows:
    return Rows(out, **summary)


def _folder(out: str | Path) -> Path:
    """Refuse an empty name, which as a path would be the current folder."""
    if not str(out).strip():
        raise DraftError("`out` names no folder", "name one")
    return Path(out)


def _listed(names: Iterable[str]) -> list[str]:
    """Names as a list; a single string is one name."""
    return [names] if isinstance(names, str) else list(names)
