"""Shipped policies in several engines side by side: speeds, falls, and who stands after a kick.

    python -m benchmarks.other_engine cheetah bear giraffe

The engines are those of `benchmarks.engines`; the robot of Drake is the SDFormat of `draft export`.
Numbers are written after each robot and engine, and what is there already is not measured again.
`python -m docs.real_robots` makes a table of them.
"""

from __future__ import annotations

import json
import statistics
import sys
import tempfile
from collections.abc import Callable
from importlib.metadata import version
from pathlib import Path
from typing import Annotated, Any

import mujoco
import tyro

from benchmarks.engines import STEP, Advance, Drake, Warp, substeps
from draft.design import Design
from draft.design.references import open_design
from draft.errors import DraftError, suggest
from draft.files import write
from draft.learn.policy.play_options import Course
from draft.learn.policy.playback import playback
from draft.learn.policy.policy import policy

RESULTS = Path(__file__).resolve().parents[1] / "examples/results/other_engine.json"
ENGINES: dict[str, Callable[[mujoco.MjModel, Path], Advance]] = {
    "MuJoCo": lambda model, file: mujoco.mj_step,
    "MuJoCo 1 ms": lambda model, file: substeps(STEP),
    "MuJoCo hard": lambda model, file: substeps(STEP, HARD),
    "MuJoCo Warp": lambda model, file: Warp(model),
    "Drake": lambda model, file: Drake(file),
    "Drake sap": lambda model, file: Drake(file, "sap"),
    "Drake lagged": lambda model, file: Drake(file, "lagged"),
}
HARD = 0.004  # Time constant of contacts [s]; the shipped policies learnt with 20 ms.
SPEEDS = (1.0, 3.0)  # Commands of a run besides the largest of the training [m/s].
KICKS = (3.0, 5.0)  # Largest velocities that a kick adds along x and y [m/s].
SECONDS = 6.0  # Of a roll-out at a command [s].
KICKED = 5.5  # Of one with a kick [s], which comes after 3 s (`playback.KICK_EVERY`).


def main(
    names: Annotated[tuple[str, ...], tyro.conf.Positional] = ("cheetah", "bear", "giraffe"),
    /,
    engines: tuple[str, ...] = tuple(ENGINES),
    starts: int = 4,
    kicks: int = 16,
    out: Path = RESULTS,
) -> None:
    """Measure what is not measured yet, and print it.

    Args:
        names: designs with policies of their own.
        engines: names of engines.
        starts: roll-outs at each command, from other joint angles.
        kicks: roll-outs with each size of a kick.
        out: JSON file of the numbers.
    """
    for engine in engines:
        if engine not in ENGINES:
            raise DraftError(f"there is no engine '{engine}'", suggest(engine, ENGINES, "engines"))
    known: dict[str, Any] = {"versions": {}, "rows": []}
    if out.is_file():
        known = json.loads(out.read_text(encoding="utf-8"))
    for name in names:
        design = open_design(name)
        for engine in engines:
            if any((row["robot"], row["engine"]) == (name, engine) for row in known["rows"]):
                continue
            for row in measured(design, engine, starts, kicks):
                known["rows"].append({"robot": name, "engine": engine, **row})
                print(json.dumps(known["rows"][-1]))
                sys.stdout.flush()
            known["versions"] |= {one: version(one) for one in _packages(engine)}
            write(out, json.dumps(known, indent=1) + "\n")


def measured(design: Design, engine: str, starts: int, kicks: int) -> list[dict[str, Any]]:
    """Speeds at commands, and the shares of robots that do not fall after a kick.

    Args:
        design: a design with policies of its own.
        engine: name of the engine.
        starts: roll-outs at each command.
        kicks: roll-outs with each size of a kick.

    Raises:
        DraftError: a policy is missing.
    """
    with tempfile.TemporaryDirectory() as folder:
        file = design.build().save(Path(folder) / "robot", ("sdf",)) / "robot.sdf"
        own: list[Advance] = []

        def play(skill: str, course: Course, seed: int, seconds: float) -> tuple[float, int]:
            robot, _ = playback(design, skill, course=course, seed=seed)
            if not own:
                own.append(ENGINES[engine](robot.model, file))
            robot.controller.advance = own[0]
            found = robot.play(seconds)
            return found.speed, found.falls

        rows: list[dict[str, Any]] = []
        fastest = {skill: policy(design.reference, skill).forward for skill in ("walk", "run")}
        asked = [("walk", fastest["walk"])]
        asked += [("run", one) for one in sorted({*SPEEDS, fastest["run"]})]
        for skill, command in asked:
            course = Course(command=(command, 0.0, 0.0))
            found = [play(skill, course, seed, SECONDS) for seed in range(starts)]
            speed = round(statistics.fmean(one for one, _ in found), 3)
            falls = sum(one for _, one in found)
            row = {"skill": skill, "command": command, "roll_outs": starts}
            rows.append(row | {"speed": speed, "falls": falls})
        for size in KICKS:
            course = Course(kick=size)
            falls = [play("push", course, seed, KICKED)[1] for seed in range(kicks)]
            stood = sum(one == 0 for one in falls) / kicks
            row = {"skill": "push", "kick": size, "roll_outs": kicks}
            rows.append(row | {"stood": round(stood, 3)})
        return rows


def _packages(engine: str) -> tuple[str, ...]:
    """Packages whose versions belong to the numbers."""
    warp = ("mujoco-warp", "warp-lang") if engine == "MuJoCo Warp" else ()
    return ("mujoco", *warp, *(("drake",) if engine.startswith("Drake") else ()))


if __name__ == "__main__":
    tyro.cli(main, description=__doc__)
