"""Small studies, and workers that write what the commands would, without learning anything."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator, Sequence
from itertools import takewhile
from pathlib import Path
from typing import Any

from draft.cli.bodies import members
from draft.learn import evaluation
from draft.learn.battery import batteries, named, settle
from draft.learn.recipes import RECIPES
from draft.learn.run import Plan, create, is_run, open_run, versions
from draft.learn.study.execution import Execution
from draft.learn.study.file import Study
from draft.learn.study.graph import graph
from draft.learn.study.jobs import Group, Job, Physics
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
SMALL = TEXT.replace("seeds: 2", "seeds: 1")


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
        _train(arguments, done)
    elif arguments[0] == "evaluate":
        _evaluate(arguments)
    else:
        folder = Path(arguments[2]) / "report"
        folder.mkdir(exist_ok=True)
        (folder / "index.html").write_text("report")


def _train(arguments: Sequence[str], done: int | None) -> None:
    folder = Path(after(arguments, "--out"))
    count = int(after(arguments, "--iterations")) if done is None else done
    if not is_run(folder):
        designs = takewhile(lambda word: not word.startswith("--"), arguments[1:])
        recipe, ground = RECIPES[after(arguments, "--recipe")], after(arguments, "--ground")
        origin = after(arguments, "--from")
        base = origin is not None and is_run(Path(origin)) and open_run(Path(origin))
        plan = Plan(
            members=members([*designs])[1],
            stage=after(arguments, "--stage"),
            seed=int(after(arguments, "--seed")),
            environments=int(after(arguments, "--envs")),
            config=recipe.config.with_values(dict(word.split("=") for word in _values(arguments))),
            ground=ground,
            see_design="--see-design" in arguments,
            see_ground=ground == "uneven" or (base and base.plan.see_ground),
        )
        create(folder, plan, {})
    (folder / f"model_{count}.pt").write_text(f"{count} iterations")
    (folder / "state.json").write_text(json.dumps({"iteration": count}))


def _values(arguments: Sequence[str]) -> Iterator[str]:
    at = [*arguments].index("--set") + 1 if "--set" in arguments else len(arguments)
    return takewhile(lambda word: not word.startswith("--"), arguments[at:])


def _evaluate(arguments: Sequence[str]) -> None:
    """Write parts of a result; of the summary only what tells whose it is."""
    run = open_run(Path(arguments[1]))
    seconds = float(after(arguments, "--seconds", "12"))
    what = evaluation.asked(
        run,
        batteries(named(after(arguments, "--battery", "walk")), after(arguments, "--levels", None)),
        int(after(arguments, "--checkpoint", str(run.checkpoint()[0]))),
        "perturbed" if "--perturbed" in arguments else "nominal",
        "published" if "--published" in arguments else "walking",
        replicas=int(after(arguments, "--replicas", "256")),
        seconds=seconds,
        settle=settle(seconds),
        evaluation_seed=int(after(arguments, "--seed", "0")),
        errors=after(arguments, "--errors"),
    )
    folder = evaluation.place(run, what.arm, what.protocol)
    folder.mkdir(parents=True, exist_ok=True)
    for name in evaluation.PARTS:
        (folder / name).write_text("")
    told = {"format": evaluation.FORMAT, "asked": what.as_dict(), "versions": versions()}
    (folder / evaluation.SUMMARY).write_text(json.dumps(told))


def after(arguments: Sequence[str], option: str, default: Any = None) -> Any:
    words = [*arguments, option, default]
    return words[words.index(option) + 1]


class Fake:
    """A worker that does a job as soon as it begins.

    Attributes:
        began: logs' names, which are the jobs', in the order in which they were begun.
        commands: arguments of each.
    """

    device = "cpu"
    physics = Physics()

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


def states(folder: Path) -> dict[str, str]:
    return {n: job["state"] for n, job in told(folder)["jobs"].items()}


def told(folder: Path) -> dict:
    return json.loads((folder / "study.json").read_text())


def dying(name: str, how: Callable[[Sequence[str]], None]) -> Fake:
    """A worker during whose job the study is killed."""

    def act(job: str, arguments: Sequence[str]) -> None:
        if job == name:
            how(arguments)
            raise Killed

    return Fake(act)
