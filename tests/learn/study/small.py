"""Small studies, and workers that write what the commands would, without learning anything."""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from draft.learn.study.execution import Execution
from draft.learn.study.file import Study
from draft.learn.study.jobs import Group, Job, graph
from draft.learn.study.store import Store
from draft.spec.reader import read_text
from tests.learn.small import member

TEXT = """\
designs: [cheetah, bear]
seeds: 2
stages: [base, push]
iterations: {base: 3, push: 2}
environments: 4
evaluate: {replicas: 2, levels: 2}
"""


def study(text: str = TEXT, toy: bool = False) -> Study:
    return Study(read_text(text, "small.yaml"), "small", text, toy)


def groups(*names: str) -> list[Group]:
    return [Group(name, name, (member(name),)) for name in names or ("cheetah", "bear")]


def jobs(text: str = TEXT, *names: str) -> dict[str, Job]:
    return graph(study(text), groups(*names))


def store(folder: Path, text: str = TEXT, *names: str) -> Store:
    chosen = groups(*names)
    return Store(folder, study(text), chosen, graph(study(text), chosen))


class Killed(BaseException):
    """The study's own process is killed."""


def write_output(arguments: Sequence[str], done: int | None = None) -> None:
    """Write what a command writes.

    Args:
        arguments: of `draft`.
        done: iterations of a training that are done; None for all.
    """
    if arguments[0] == "train":
        folder = Path(after(arguments, "--out"))
        count = int(after(arguments, "--iterations")) if done is None else done
        folder.mkdir(parents=True, exist_ok=True)
        (folder / "run.json").write_text("{}")
        (folder / f"model_{count}.pt").write_text("")
        (folder / "state.json").write_text(json.dumps({"iteration": count}))
    elif arguments[0] == "evaluate":
        arm = "perturbed" if "--perturbed" in arguments else "nominal"
        protocol = "published" if "--published" in arguments else "walking"
        folder = Path(arguments[1]) / "evaluation" / f"{arm}-{protocol}"
        assert not folder.exists()
        folder.mkdir(parents=True)
        (folder / "summary.json").write_text("{}")
    else:
        folder = Path(arguments[2]) / "report"
        folder.mkdir(exist_ok=True)
        (folder / "index.html").write_text("report")


def after(arguments: Sequence[str], option: str) -> str:
    return arguments[[*arguments].index(option) + 1]


class Fake:
    """A worker that does a job as soon as it begins.

    Attributes:
        began: logs' names, which are the jobs', in the order in which they were begun.
        commands: arguments of each.
    """

    device = "cpu"

    def __init__(self, act: Callable[[str, Sequence[str]], int | None] | None = None) -> None:
        """Note what it does.

        Args:
            act: called with a job's name and arguments; gives an exit code, or None to go on
                and write the output.
        """
        self._act = act or (lambda name, arguments: None)
        self.began: list[str] = []
        self.commands: dict[str, list[str]] = {}
        self._code: int | None = None

    def start(self, arguments: Sequence[str], log: Path, fresh: bool = False) -> None:
        self.began.append(log.stem)
        self.commands[log.stem] = [*arguments]
        log.parent.mkdir(parents=True, exist_ok=True)
        with log.open("a") as file:
            file.write(f"{log.stem} says this\n")
        self._code = self._act(log.stem, arguments)
        if self._code is None:
            write_output(arguments)
            self._code = 0

    def poll(self) -> int | None:
        return self._code

    def stop(self) -> None:
        self._code = None


def go(folder: Path, worker: Fake, text: str = TEXT, *names: str, **more: Any) -> Execution:
    """One call of the study."""
    opened = store(folder, text, *names)
    try:
        opened.open()
        execution = Execution(opened, [worker], **more)
        execution.run()
    finally:
        opened.close()
    return execution
