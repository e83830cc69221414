"""A process that does one job after the other, as a study asks for them.

Lines of JSON come on standard input, {"request": ..., "log": file}, and each is answered with an
exit code: 0 done, 2 for a `DraftError`, 70 for a fault of Draft. What a job says goes to its log.
Imports and kernels are paid for once. Where standard input ends, so does the process, at once:
whoever started it has gone.
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
from typing import IO, Any

from draft.errors import DraftError
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
    """Do what is asked for until nobody asks any more."""
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


def _answer(request: Mapping[str, Any], log: str) -> int:
    """Do one job; what it says goes to the end of a file."""
    with open(log, "ab", buffering=0) as file:
        os.dup2(file.fileno(), 1)
        os.dup2(file.fileno(), 2)
    try:
        return _code(request)
    finally:
        sys.stdout.flush()
        sys.stderr.flush()


def _code(request: Mapping[str, Any]) -> int:
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
    """Do one job, and print how far it is.

    Raises:
        DraftError: see `draft.learn.train`, `draft.learn.evaluate`, `draft.study.write_report`.
    """
    print(title(request), flush=True)
    if isinstance(request, ReportRequest):
        prefer_offscreen()
        from draft.study.report import write

        print(f"report: {write(Path(request.study))}")
        return
    disable_drawing()
    if isinstance(request, TrainRequest):
        _train(request)
    else:
        _evaluate(request)


def _train(request: TrainRequest) -> None:
    from draft.learn.lines import Lines
    from draft.learn.run import open_run
    from draft.learn.training import check_fits, finished, setting_of, train_on

    run, total = open_run(Path(request.run)), request.iterations
    if not finished(run, total):
        where = setting_of(run, request.device, request.engine, request.replicas)
        check_fits(run.plan, where)
        print(where.words(run, total), flush=True)
        train_on(run, total, where, request.minutes, Lines().tell)
    print(f"{run.done()} of {total} iterations are done")


def _evaluate(request: EvaluateRequest) -> None:
    from draft.learn.evaluating import evaluate
    from draft.learn.run import open_run

    summary = evaluate(
        open_run(Path(request.run)),
        [request.battery],
        None if request.levels is None else str(request.levels),
        checkpoint=request.checkpoint,
        replicas=request.replicas,
        seconds=request.seconds,
        seed=request.seed,
        errors=request.errors,
        protocol=request.protocol,
        device=request.device,
        engine=request.engine,
    )
    print(f"evaluated in {summary['took_s']} s on {summary['device']} ({summary['engine']})")


def run() -> None:
    """Work with this process's own input and output, which jobs do not get to see."""
    requests = os.fdopen(os.dup(0), encoding="utf-8")
    answers = os.fdopen(os.dup(1), "w", encoding="utf-8")
    nothing = os.open(os.devnull, os.O_RDWR)
    os.dup2(nothing, 0)
    os.dup2(nothing, 1)
    work(requests, answers)


if __name__ == "__main__":
    run()
