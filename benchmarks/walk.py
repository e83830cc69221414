"""How soon robots walk, run, climb and take kicks on this machine's processor, by recipe `laptop`.

`python -m benchmarks.walk` trains every design and stage that the table needs, for each seed, looks
for the first checkpoint that passes, prints the table of docs/learning.md and writes
`benchmarks/results/walk.json`. It takes over an hour per seed on two cores; `--quick` measures the
speed and trains the cheetah's base stage alone. Runs are kept in `--out`, and the same command
resumes them. Minutes are those of training, from the first step on, and of a second stage those of
its base policy too. Nothing else should run on the machine; runs that were trained on a busy one,
such as those of a study (`--out STUDY/runs`), are counted by their steps, with `--rates`.
"""

from __future__ import annotations

import math
import os
import platform
import resource
import statistics
import subprocess
import sys
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import torch
import tyro

from benchmarks.rows import measured, publish, timed
from draft.design.references import open_designs
from draft.learn.bodies.legged import legged_robot
from draft.learn.engine.machine import NATIVE, WARP, cores
from draft.learn.measuring.evaluation_options import RollOuts
from draft.learn.measuring.levels import (
    ASCENT,
    DESCENT,
    PUSH,
    SKILL_TESTS,
    SPEED,
    WALKING,
    settle,
)
from draft.learn.measuring.levels import skill_tests as named
from draft.learn.measuring.rollout.evaluate import evaluate, trained
from draft.learn.measuring.rollout.review import Level, levels
from draft.learn.measuring.rollout.trial import Trial
from draft.learn.silence import quiet
from draft.learn.task.recipes import LAPTOP
from draft.learn.training.options import SliceOptions
from draft.learn.training.ppo.worlds import task_of
from draft.learn.training.progress import read
from draft.learn.training.run import (
    PROGRESS,
    Origin,
    Plan,
    Run,
    create,
    file_digest,
    is_run,
    open_run,
)
from draft.learn.training.session import finished, setting, train_on

ROBOTS = 64
WALKED = (0.6, 1.0)  # Commands that a walking robot tracks [m/s].
ERROR = 0.10  # Largest error of those [m/s].
RUN, HELD = 3.0, 0.95  # A command that a running robot holds [m/s], and the share that is held.
STAIR_SPEED = 0.8  # Commanded on stairs [m/s].
SECONDS = 8.0  # Of a roll-out: at that speed it leads off a patch of stairs, and not far beyond.


def main(
    quick: bool = False,
    seeds: tuple[int, ...] = (0, 1, 2),
    out: str = "runs/benchmark",
    tests: bool = True,
    rates: tuple[float, float] | None = None,
) -> None:
    """Measure everything, print a table and write it as JSON.

    Args:
        quick: speed and the cheetah's base stage alone.
        seeds: of the trainings; medians count.
        out: folder of the runs.
        tests: roll out all skill tests of one policy too.
        rates: steps per second with learning, on flat and on uneven ground, that minutes are
            counted by; those of each run where left away.
    """
    quiet()
    torch.set_num_threads(1)
    load = f"{os.getloadavg()[0]:.2f} at the start"
    rows = _engines()
    found = [_Seed(Path(out), seed) for seed in seeds]
    first = _First(rates)
    bases = [one.run("cheetah") for one in found]
    rows += first.rate("flat", bases, 8000.0)
    rows += [_minutes("cheetah walks", [first(run, _walks) for run in bases], 5.0)]
    rows += _agree(bases[0])
    if not quick:
        rows += _stages(found, first)
        rows += _tests(found[0].run("cheetah", "velocity")) if tests else []
    publish("walk", rows, cpu=platform.processor(), load=load, seeds=str(seeds))


class _Seed:
    """Runs of one seed, trained when they are asked for."""

    def __init__(self, folder: Path, seed: int) -> None:
        self._folder, self._seed = folder, seed

    def run(self, design: str, stage: str = "base") -> Run:
        folder = self._folder / f"{design}-{stage}-{self._seed}"
        if not is_run(folder):
            config, origin = LAPTOP.config, None
            ground = LAPTOP.ground(stage)
            if stage != "base":
                base = self.run(design)
                at, file = base.checkpoint()
                origin = Origin(str(base.folder), at, file_digest(file))
            member = legged_robot(open_designs([design])[0])
            plan = Plan(
                members=(member,),
                stage=stage,
                seed=self._seed,
                environments=config.learning.environments,
                config=config,
                ground=ground,
                see_ground=ground == "uneven",
                origin=origin,
            )
            create(folder, plan, {member.name: "values: {}\n"})
        found = open_run(folder)
        if not finished(found, SliceOptions()):
            print(f"training {folder}", flush=True)
            options = SliceOptions(device="cpu", engine="native", replicas=cores())
            train_on(found, options, setting(found.plan, options), _quiet)
        return found


def _quiet(progress: Any) -> None:
    """Print nothing."""


class _First:
    """Minutes of training until a policy first passes, its base included."""

    def __init__(self, rates: tuple[float, float] | None) -> None:
        self._rates: dict[str, float] = {}
        if rates is not None:
            self._rates = {"flat": rates[0], "uneven": rates[1]}

    def __call__(self, run: Run, passes: Callable[[Run, int], bool]) -> float:
        before = 0.0
        if run.plan.origin is not None:
            base = open_run(run.folder.with_name(run.folder.name.replace(run.plan.stage, "base")))
            before = self._minutes(base, run.plan.origin.iteration)
        for iteration, _ in run.checkpoints():
            if passes(run, iteration):
                minutes = before + self._minutes(run, iteration)
                print(f"{run.folder}: passes after {iteration} its, {minutes:.1f} min", flush=True)
                return minutes
        print(f"{run.folder}: never passes", flush=True)
        return math.inf

    def rate(self, ground: str, runs: Sequence[Run], bar: float) -> list[dict[str, Any]]:
        """Median over iterations of the steps per second, median over runs; unless given."""
        found = self._rates[ground] if self._rates else statistics.median(map(_rate, runs))
        return [measured(f"environment steps/s with learning, {ground}", found, "", bar, True)]

    def _minutes(self, run: Run, iteration: int) -> float:
        rows = {row["iteration"]: row["seconds"] for row in read(run.folder / PROGRESS)}
        if not self._rates:
            return rows[iteration] / 60
        steps = iteration * run.plan.environments * run.plan.config.learning.steps
        return steps / self._rates[run.plan.ground] / 60


def _rate(run: Run) -> float:
    return statistics.median(row["steps_per_s"] for row in read(run.folder / PROGRESS))


def _stages(found: Sequence[_Seed], first: _First) -> list[dict[str, Any]]:
    climbing = [one.run("cheetah", "terrain") for one in found]
    running = [one.run("cheetah", "velocity") for one in found]
    pushed = [one.run("cheetah", "push") for one in found]
    others = [[one.run(design) for one in found] for design in ("bear", "giraffe")]
    return [
        *first.rate("uneven", climbing, 5000.0),
        _minutes("cheetah runs at 3 m/s", [first(run, _runs) for run in running], 10.0),
        _minutes("bear walks", [first(run, _walks) for run in others[0]], 8.0),
        _minutes("giraffe walks", [first(run, _walks) for run in others[1]], 8.0),
        _minutes("cheetah climbs", [first(run, _climbs) for run in climbing], 25.0),
        _minutes("cheetah takes kicks of 5 m/s", [first(run, _endures) for run in pushed], 10.0),
    ]


def _asked(run: Run, iteration: int, name: str, *levels_: float, speed: float = 0.0) -> list[Level]:
    """What a checkpoint does at levels of a test, 64 robots each."""
    test = replace(SKILL_TESTS[name], levels=levels_, walking=speed or WALKING)
    trial = Trial(task_of(run.plan), (test,), ROBOTS, seconds=SECONDS, settle=SECONDS / 6)
    return levels(trained(run, iteration, "cpu"), trial, "cpu", NATIVE)


def _walks(run: Run, iteration: int) -> bool:
    found = _asked(run, iteration, SPEED, *WALKED)
    return all(one.error <= ERROR and one.up == one.robots for one in found)


def _runs(run: Run, iteration: int) -> bool:
    (found,) = _asked(run, iteration, SPEED, RUN)
    return found.speed >= HELD * RUN and found.up >= 0.95 * found.robots


def _climbs(run: Run, iteration: int) -> bool:
    for name in (ASCENT, DESCENT):
        low, high = _asked(run, iteration, name, 0.10, 0.125, speed=STAIR_SPEED)
        if low.crossed < 0.8 * low.robots or high.crossed < 0.5 * high.robots:
            return False
    return _walks(run, iteration)


def _endures(run: Run, iteration: int) -> bool:
    (found,) = _asked(run, iteration, PUSH, 5.0)
    return found.up >= 0.5 * found.robots


def _agree(run: Run) -> list[dict[str, Any]]:
    """One policy on both engines: difference of its mean speeds, and half of the 95 % interval."""
    test = replace(SKILL_TESTS[SPEED], levels=WALKED)
    trial = Trial(task_of(run.plan), (test,), ROBOTS, seconds=SECONDS, settle=SECONDS / 6)
    policy = trained(run, run.checkpoint()[0], "cpu")
    worlds = {
        engine: evaluate(trial, policy, "cpu", engine=engine, threads=threads)[0]
        for engine, threads in ((NATIVE, cores()), (WARP, 1))
    }
    rows = []
    for level in WALKED:
        native, warp = (found.speed[found.level == level] for found in worlds.values())
        apart = abs(float(native.mean() - warp.mean()))
        spread = 1.96 * math.sqrt(native.var(ddof=1) / len(native) + warp.var(ddof=1) / len(warp))
        what = (
            f"same policy, native and Warp: mean speeds apart at {level:g} m/s; bar: 95 % interval"
        )
        rows.append(measured(what, apart, "m/s", spread))
    return rows


def _tests(run: Run) -> list[dict[str, Any]]:
    """All skill tests, 256 replicas, of a policy that sees no ground; stairs by the climber."""
    rows, total = [], 0.0
    climber = open_run(run.folder.with_name(run.folder.name.replace("velocity", "terrain")))
    for words, who in ((("walk", "speed", "push"), run), (("stairs",), climber)):
        usual, tests = RollOuts(), named(words)
        numbers = usual.replicas, usual.seconds, settle(usual.seconds, tests)
        trial = Trial(task_of(who.plan), tests, *numbers)
        policy = trained(who, who.checkpoint()[0], "cpu")
        taken, _ = timed(lambda: evaluate(trial, policy, "cpu", engine=NATIVE, threads=cores()))  # noqa: B023
        total += taken
        rows.append(measured(f"tests: {', '.join(words)}", taken / 60, "min"))
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e6
    return [
        *rows,
        measured("all tests, 256 replicas", total / 60, "min", 40.0),
        measured("peak memory of the tests", peak, "GB"),
    ]


def _engines() -> list[dict[str, Any]]:
    """Steps of the environment alone: native in one process per core, Warp as it is on a CPU."""
    rates = {
        (engine, ground): _alone(engine, ground)
        for engine, ground in ((NATIVE, "flat"), (WARP, "flat"), (NATIVE, "uneven"))
    }
    return [
        measured(f"{engine}, {ground}: environment steps/s", rate, "", at_least=True)
        for (engine, ground), rate in rates.items()
    ] + [
        measured(
            "native / Warp, flat", rates[NATIVE, "flat"] / rates[WARP, "flat"], "x", 15.0, True
        ),
        measured("native on uneven ground, steps/s", rates[NATIVE, "uneven"], "", 6500.0, True),
    ]


def _alone(engine: str, ground: str) -> float:
    """Steps per second of all processes together: one per core, as trainings run; Warp in one."""
    count = cores() if engine == NATIVE else 1
    worlds = LAPTOP.config.learning.environments // count if engine == NATIVE else 64
    words = [sys.executable, "-m", "benchmarks.walk_alone", engine, ground, str(worlds)]
    started = [subprocess.Popen(words, stdout=subprocess.PIPE, text=True) for _ in range(count)]
    return sum(float(one.communicate()[0].split()[-1]) for one in started)


def _minutes(what: str, found: Sequence[float], bar: float) -> dict[str, Any]:
    told = ", ".join(f"{value:.1f}" for value in found)
    return measured(f"{what} (seeds: {told})", statistics.median(found), "min", bar)


if __name__ == "__main__":
    tyro.cli(main)
