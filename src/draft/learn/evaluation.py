"""Evaluation from Python: put a run's policy through batteries, and save what it can do."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from draft.errors import DraftError, Problem, suggest
from draft.extras import need
from draft.learn.battery import Battery, batteries, named, of_stage, settle
from draft.learn.inertia import SOURCES
from draft.learn.machine import Engine, choose, cores, devices
from draft.learn.results import Asked, answers, asked, place, read, save, summarise
from draft.learn.run import Run
from draft.learn.silence import quiet

PROTOCOLS = ("walking", "published")
Tell = Callable[[str, int, int], None]


@dataclass(frozen=True)
class Evaluation:
    """A question to a run's policy, as `ask` checked it.

    Attributes:
        run: the run.
        batteries: with their levels.
        asked: all that decides the result.
        folder: of the result.
    """

    run: Run
    batteries: tuple[Battery, ...]
    asked: Asked
    folder: Path

    def found(self) -> dict[str, Any] | None:
        """The summary of a result that answers it; None where there is none."""
        summary = read(self.folder)
        return summary if summary is not None and answers(summary, self.asked) else None

    def measure(
        self, device: str, engine: Engine, tell: Tell = lambda names, step, steps: None
    ) -> tuple[dict[str, Any], int]:
        """Roll out all levels and save the result, in the place of an older one.

        Args:
            device: "cpu" or "cuda:0" and the like.
            engine: as `setting` chose it.
            tell: called after every step with the batteries' names, steps done and steps in all.

        Returns:
            The summary, see `draft.learn.results.summarise`, and the number of roll-outs.

        Raises:
            DraftError: the checkpoint cannot be read or does not fit, there is too little memory,
                or the result cannot be written.
        """
        from draft.learn.lab.evaluate import evaluate, trained
        from draft.learn.lab.trial import trial

        begun = time.monotonic()
        policy = trained(self.run, self.asked.iteration, device)
        put_through = trial(self.run, self.batteries, self.asked)
        worlds, histograms = evaluate(put_through, policy, device, tell, engine.name, cores())
        summary = summarise(
            self.run,
            self.asked,
            self.batteries,
            worlds,
            histograms,
            device=_name(device),
            engine=engine.name,
            took_s=round(time.monotonic() - begun, 1),
        )
        save(self.folder, summary, worlds, histograms)
        return summary, len(worlds.fell)


def ask(
    run: Run,
    battery: Sequence[str] | None = None,
    levels: str | None = None,
    *,
    checkpoint: int | None = None,
    replicas: int = 256,
    seconds: float = 12.0,
    seed: int = 0,
    errors: str | None = None,
    protocol: str = "walking",
    out: Path | None = None,
) -> Evaluation:
    """Check what is asked of a run, and find where the result is kept; see `evaluate`."""
    check(replicas, seconds, seed)
    for what, word, known in (
        ("source of errors", errors, SOURCES),
        ("protocol", protocol, PROTOCOLS),
    ):
        if word is not None and word not in known:
            raise DraftError(Problem(f"there is no {what} '{word}'", None, suggest(word, known)))
    words = of_stage(run.plan.stage) if battery is None else named(",".join(battery))
    found = batteries(words, levels)
    arm = "nominal" if errors is None else "perturbed"
    what = asked(
        run,
        found,
        checkpoint,
        arm,
        protocol,
        replicas=replicas,
        seconds=seconds,
        settle=settle(seconds),
        evaluation_seed=seed,
        errors=errors,
    )
    return Evaluation(run, found, what, place(run, arm, protocol, out))


def evaluate(
    run: Run,
    battery: Sequence[str] | None = None,
    levels: str | None = None,
    *,
    checkpoint: int | None = None,
    replicas: int = 256,
    seconds: float = 12.0,
    seed: int = 0,
    errors: str | None = None,
    protocol: str = "walking",
    out: Path | None = None,
    again: bool = False,
    device: str = "auto",
    engine: str = "auto",
    tell: Tell = lambda names, step, steps: None,
) -> dict[str, Any]:
    """Measure what a run's policy can do, level by level, and save it.

        from pathlib import Path
        from draft.learn import evaluate, open_run

        summary = evaluate(open_run(Path("runs/cheetah-base-0")), ["walk"], levels="5")
        summary["scalars"]["walk_speed"]  # [m/s]

    Args:
        run: the run.
        battery: of "walk", "speed", "stairs" and "push"; None for those of its stage. Results of
            other stages' batteries are flagged.
        levels: so many of each battery, such as "5", or the levels themselves: "0.4,1.0"; None
            for all.
        checkpoint: its iterations; None for the last.
        replicas: roll-outs of each level, shared out among the designs.
        seconds: of a roll-out, of which the first sixth does not count [s].
        seed: of everything random.
        errors: whose inertia errors the robots get, of "twins", "survey" and "paper"; None for
            robots as they were trained.
        protocol: "walking", or "published", where one robot in ten only stands.
        out: the result is written to OUT/RUN/; None for evaluation/ in the run's folder.
        again: even if that result is there already.
        device: "auto", "cpu", "cuda" or "cuda:1".
        engine: "auto", "native" or "warp".
        tell: called after every step with the batteries' names, steps done and steps in all.

    Returns:
        What summary.json says: see `draft.learn.results.summarise`.

    Raises:
        DraftError: numbers out of range, an unknown word, no such checkpoint, no such device,
            too little memory, a library that is missing, or a result that cannot be written.
    """
    question = ask(
        run,
        battery,
        levels,
        checkpoint=checkpoint,
        replicas=replicas,
        seconds=seconds,
        seed=seed,
        errors=errors,
        protocol=protocol,
        out=out,
    )
    found = None if again else question.found()
    if found is None:
        found, _ = question.measure(*setting(device, engine), tell)
    return found


def setting(device: str = "auto", engine: str = "auto") -> tuple[str, Engine]:
    """Choose the device and the engine of an evaluation.

    Args:
        device: "auto", "cpu", "cuda" or "cuda:1".
        engine: "auto", "native" or "warp".

    Raises:
        DraftError: there is no such device, or there are several; the engine does not run on it;
            mjlab or pyarrow is missing.
    """
    quiet()
    need("mjlab", "learn")
    need("pyarrow", "learn")  # Before the work, not after it.
    chosen = devices(device)
    if len(chosen) > 1:
        cause = f"--device {device} names {len(chosen)} GPUs, and an evaluation takes one"
        raise DraftError(Problem(cause, None, "--device cuda:0, and others for other runs"))
    return chosen[0], choose(engine, chosen)


def check(replicas: int, seconds: float, seed: int) -> None:
    """Refuse numbers that make no sense.

    Raises:
        DraftError: roll-outs, their length [s] or the seed are out of range.
    """
    if not 0 < replicas <= 10**6:
        cause = f"--replicas {replicas} is not above 0 and at most {10**6}"
        raise DraftError(Problem(cause, None, "such as 256"))
    if not 0.5 <= seconds <= 3600:
        cause = f"--seconds {seconds:g} is not from 0.5 to 3600"
        raise DraftError(Problem(cause, None, "leave it away for 12"))
    if not 0 <= seed < 2**31:
        raise DraftError(Problem(f"--seed {seed} is not from 0 to 2**31 - 1", None, "such as 0"))


def _name(device: str) -> str:
    """A device's name for the record."""
    if device == "cpu":
        return "cpu"
    return need("torch", "learn").cuda.get_device_name(device)
