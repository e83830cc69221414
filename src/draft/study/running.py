"""Running a study from Python: open its folder, run its jobs, and say what was done."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import ParamSpec, Protocol

from draft.errors import DraftError
from draft.settings import by_keyword
from draft.study.designs import read_groups
from draft.study.execution import Execution, Watch
from draft.study.file import Study, read
from draft.study.graph import graph
from draft.study.jobs import REPORT
from draft.study.options import RunOptions
from draft.study.placement import make_workers
from draft.study.store import Store

P = ParamSpec("P")


@dataclass(frozen=True)
class Outcome:
    """Result of one call of `run_study`.

    Attributes:
        folder: the study's, absolute.
        done: whether all jobs are done.
        jobs: state of each job, by name: "waiting", "begun", "done", "failed" or "skipped".
        failures: reason of each failure with the end of the job's log, by the job's name.
        minutes_needed: time limit with which something could be done [min]; None if the limit was
            long enough.
        report: page of the report; None if nothing was reported on yet.
    """

    folder: Path
    done: bool
    jobs: Mapping[str, str]
    failures: Mapping[str, str]
    minutes_needed: int | None
    report: Path | None


def open_study(
    study: str | Path | Study, out: str | Path | None = None, toy: bool = False
) -> Store:
    """Read a study, its designs and the state of its folder; nothing is written.

    Args:
        study: a study's file, or a study that `draft.study.read_study` read.
        out: folder of the study; None for `studies/NAME`, or `studies/NAME-toy` of a toy.
        toy: whether to replace numbers of the file by those under `toy`.

    Raises:
        DraftError: the file is no study, a design cannot be read or trained, or the folder holds
            something else.
    """
    if not isinstance(study, Study):
        study = read(Path(study), toy)
    elif toy and not study.toy:
        remedy = "read it with draft.study.read_study(FILE, toy=True)"
        raise DraftError(f"study '{study.name}' was read without its toy", remedy)
    folder = Path(out) if out else Path("studies") / (study.name + "-toy" * study.toy)
    groups = read_groups(study)
    return Store(folder, study, groups, graph(study, groups))


class _RunStudy(Protocol[P]):
    """Type of `run_study`, with the options of the record as keyword arguments."""

    def __call__(
        self,
        study: str | Path | Study,
        out: str | Path | None = None,
        toy: bool = False,
        watch: Watch | None = None,
        *args: P.args,
        **options: P.kwargs,
    ) -> Outcome: ...


def _with_options(
    record: Callable[P, RunOptions],
) -> Callable[[Callable[..., Outcome]], _RunStudy[P]]:
    return by_keyword(record)


@_with_options(RunOptions)
def run_study(
    study: str | Path | Study,
    out: str | Path | None = None,
    *,
    toy: bool = False,
    watch: Watch | None = None,
    options: RunOptions,
) -> Outcome:
    """Train and evaluate all designs of a study with all seeds, and write its report.

    Call it again to resume: jobs that are done are kept, and only jobs whose designs or numbers
    changed are repeated.

        from draft.study import run_study

        outcome = run_study("examples/three_quadrupeds.yaml", toy=True)
        outcome.done, outcome.report

    Args:
        study: a study's file, or a study that `draft.study.read_study` read.
        out: folder of the study; None for `studies/NAME`, or `studies/NAME-toy` of a toy.
        toy: whether to replace numbers of the file by those under `toy`: everything, but tiny.
        watch: observer of the progress.
        options: fields of `RunOptions`, by keyword.

    Raises:
        DraftError: the study cannot be read, an option does not fit this machine, another process
            has the folder, or it cannot be written.
    """
    start, watch = time.monotonic(), watch or Watch()
    store = open_study(study, out, toy)
    # A study that is finished needs no worker, and so no PyTorch.
    team = [] if store.finished() else make_workers(store.study, options)
    until = math.inf if options.minutes is None else start + 60.0 * options.minutes
    try:
        store.open()
        watch.opened(store)
        execution = Execution(store, team, until, watch)
        done = execution.run()
    finally:
        store.close()
    short = execution.missing_seconds()
    page = store.folder / REPORT / "index.html"
    return Outcome(
        folder=store.folder,
        done=done,
        jobs=store.states,
        failures=execution.failures,
        minutes_needed=math.ceil((options.minutes or 0.0) + short / 60.0) if short else None,
        report=page if page.is_file() else None,
    )
