"""A process that does one `draft` command after the other, as a study asks for them.

Lines of JSON come on standard input, {"arguments": [...], "log": file}, and each is answered with
the exit code. Imports and kernels are paid for once. Where standard input ends, so does the
process, at once: whoever started it has gone.
"""

from __future__ import annotations

import json
import os
import queue
import shlex
import sys
import threading
from typing import IO

from draft.cli import main
from draft.cli.offscreen import choose_rendering


def work(requests: IO[str], answers: IO[str]) -> None:
    """Do what is asked for until nobody asks any more."""
    lines: queue.SimpleQueue[str] = queue.SimpleQueue()
    threading.Thread(target=_listen, args=(requests, lines), daemon=True).start()
    while True:
        request = json.loads(lines.get())
        answers.write(f"{_do(request['arguments'], request['log'])}\n")
        answers.flush()


def _listen(requests: IO[str], lines: queue.SimpleQueue[str]) -> None:
    for line in requests:
        lines.put(line)
    os._exit(1)


def _do(arguments: list[str], log: str) -> int:
    """One command; what it says goes to the end of a file."""
    choose_rendering(arguments)
    with open(log, "ab", buffering=0) as file:
        os.dup2(file.fileno(), 1)
        os.dup2(file.fileno(), 2)
    print(f"$ draft {shlex.join(arguments)}", flush=True)
    try:
        code = main(arguments)
    except SystemExit as ended:
        # tyro ends so on arguments that it cannot read.
        code = ended.code if isinstance(ended.code, int) else 1
    sys.stdout.flush()
    sys.stderr.flush()
    return code


def run() -> None:
    """Work with this process's own input and output, which commands do not get to see."""
    requests = os.fdopen(os.dup(0), encoding="utf-8")
    answers = os.fdopen(os.dup(1), "w", encoding="utf-8")
    nothing = os.open(os.devnull, os.O_RDWR)
    os.dup2(nothing, 0)
    os.dup2(nothing, 1)
    work(requests, answers)


if __name__ == "__main__":
    run()
