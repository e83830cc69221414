"""A process that runs the jobs of a study, one after another.

Each line of standard input is a JSON object, {"request": ..., "log": file}. Each is answered by a
line with an exit code: 0 done, 2 for a `DraftError`, 70 for a fault of Draft. A job's own output
goes to its log. Libraries and kernels are loaded once for all jobs. The process exits as soon as
standard input closes, because then the process that started it has ended.
"""

from __future__ import annotations

import errno
import json
import os
import queue
import sys
import threading
import traceback
from collections.abc import Mapping
from pathlib import Path
from typing import IO

from draft.errors import DraftError, counted
from draft.offscreen import disable_drawing, prefer_offscreen
from draft.study.requests import (
    EvaluateRequest,
    ReportRequest,
    Request,
    TrainRequest,
    from_dict,
    title,
)

DONE, BAD_INPUT, FAULT = 0, 2, 70


def work(requests: IO[str], answers: IO[str]) -> None:
    """Run requested jobs until the requests end, which ends this process."""
    lines: queue.SimpleQueue[str] = queue.SimpleQueue()
    threading.Thread(target=_listen, args=(requests, lines), daemon=True).start()
    while True:
        asked = json.loads(lines.get())
        answers.write(f"{_answer(asked['request'], asked['log'])}\n")
        answers.flush()


def _listen(requests: IO[str], lines: queue.SimpleQueue[str]) -> None:
    for line in requests:
        lines.put(line)
    os._exit(1)


def _answer(request: Mapping[str, object], log: str) -> int:
    """Run one job with its output appended to a log; return the exit code."""
    with open(log, "ab", buffering=0) as file:
        os.dup2(file.fileno(), 1)
        os.dup2(file.fileno(), 2)
    try:
        return _exit_code(request)
    finally:
        sys.stdout.flush()
        sys.stderr.flush()


def _exit_code(request: Mapping[str, object]) -> int:
    try:
        do(from_dict(request))
    except DraftError as error:
        print(f"error: {error}", file=sys.stderr)
        return BAD_INPUT
    except OSError as error:
        if error.errno != errno.ENOSPC:
            traceback.print_exc()
            return FAULT
        print("error: there is no space left to write the output", file=sys.stderr)
        return BAD_INPUT
    except Exception:
        traceback.print_exc()
        return FAULT
    return DONE


def do(request: Request) -> None:
    """Run one job, and print its progress.

    Raises:
        DraftError: see `draft.learn.train`, `draft.learn.evaluate`, `draft.study.write_report`.
    """
    print(title(request), flush=True)
    if isinstance(request, ReportRequest):
        prefer_offscreen()
        from draft.study.report.writing import write

        print(f"report: {write(Path(request.study))}")
        return
    disable_drawing()
    if isinstance(request, TrainRequest):
        _train(request)
    else:
        _evaluate(request)


def _train(request: TrainRequest) -> None:
    from draft.learn.training.progress import LinePrinter
    from draft.learn.training.run import open_run
    from draft.learn.training.session import check_fits, finished, origin_line, setting_of, train_on

    run = open_run(Path(request.run))
    total = request.total(run.plan)
    if not finished(run, request):
        where = setting_of(run, request)
        check_fits(run.plan, where)
        if (base := origin_line(run.plan, run.folder.parent)) is not None:
            print(base)
        print(where.describe(run, total), flush=True)
        train_on(run, request, where, LinePrinter().report)
    print(f"{run.done()} of {counted(total, 'iteration')} are done")


def _evaluate(request: EvaluateRequest) -> None:
    from draft.learn.measuring.evaluation import evaluate
    from draft.learn.training.run import open_run

    options = request.model_dump(exclude={"run"})
    summary = evaluate(open_run(Path(request.run)), **options)
    print(f"evaluated in {summary.took_s} s on {summary.device} ({summary.engine})")


def run() -> None:
    """Serve standard input and output; jobs see neither."""
    requests = os.fdopen(os.dup(0), encoding="utf-8")
    answers = os.fdopen(os.dup(1), "w", encoding="utf-8")
    nothing = os.open(os.devnull, os.O_RDWR)
    os.dup2(nothing, 0)
    os.dup2(nothing, 1)
    work(requests, answers)


if __name__ == "__main__":
    run()
