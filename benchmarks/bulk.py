"""What compiled models in bulk give: each bar, before and now, in one run.

`python -m benchmarks.bulk` prints a table and writes `benchmarks/results/bulk.json`. Every row is
measured in processes of its own, in turns by the code of this checkout and by that of a revision
before (`--before`, in a git worktree that is removed at the end); medians count. The bars hold for
two cores on which nothing else runs. It takes about eight minutes.
"""

from __future__ import annotations

import os
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import tyro

from benchmarks.explore import BODIES, BUILT, SCREENED, SWEPT, TRIALS, VARY
from benchmarks.rows import measured, publish

HERE = Path(__file__).parents[1]
BEFORE = "d0929d9~1"  # the last without models in bulk
SWEPT_BEFORE = 2000  # a sweep of 20 000 took two minutes
# Edit to checked model over MuJoCo's load of the same text, in CPU time and in turns.
_EDIT = """
import statistics, time, draft, mujoco
spec, ours, theirs = draft.load({robot!r}), [], []
for step in range(150):
    start = time.process_time()
    model = spec.resolve({{"thigh_length": {length} * (1 + 1e-4 * step)}}).build()
    ours.append(time.process_time() - start)
    text, start = model.xml, time.process_time()
    mujoco.MjModel.from_xml_string(text)
    theirs.append(time.process_time() - start)
print(statistics.median(ours[20:]) / statistics.median(theirs[20:]))
"""
_BUILT = """
import time, draft
spec = draft.load("quadruped")
designs = [spec.resolve({"thigh_length": 0.2 + 1e-4 * step}) for step in range(300)]
start = time.process_time()
for design in designs:
    design.build()
print(300 / (time.process_time() - start))
"""


@dataclass(frozen=True)
class Row:
    """One bar: what is measured by a tree of code, and whether the code before can be."""

    what: str
    measure: Callable[[Path], float]
    unit: str
    bar: float
    at_least: bool = False
    before: Callable[[Path], float] | None = None


def main(before: str = BEFORE, rounds: int = 3) -> None:
    """Measure every bar in turns, print a table and write it as JSON.

    Args:
        before: revision to compare with.
        rounds: measurements of each row.
    """
    with tempfile.TemporaryDirectory() as folder:
        old = Path(folder) / "before"
        _git("worktree", "add", "--detach", str(old), before)
        # The distribution was called `draft`, and asks for its version.
        named = old / "src" / "draft-0.1.0.dist-info" / "METADATA"
        named.parent.mkdir()
        named.write_text("Metadata-Version: 2.1\nName: draft\nVersion: 0.1.0\n")
        try:
            rows = [one for row in _rows() for one in _measured(row, old, rounds)]
        finally:
            _git("worktree", "remove", "--force", str(old))
    publish("bulk", rows, before=before, load=f"{os.getloadavg()[0]:.2f} at the end")


def _rows() -> list[Row]:
    where = ["--where", "mass < 40 and accepted"]
    goals = ["--minimise", "mass", "cost_of_standing", "--maximise", "jump_height"]
    screen = ["screen", "quadruped", "--vary", *VARY, "--n", str(SCREENED), *where]
    search = ["optimise", "quadruped", "--vary", *VARY, *goals, "--subject-to", "accepted"]
    search += ["--trials", str(TRIALS)]
    return [
        Row("models as fields, designs/s of CPU", _fields(0), "", 20_000, True, _code(_BUILT)),
        Row("models as fields, memory", _fields(3), "B/design", 20_000),
        Row("sweep with M(q), two processes, designs/s", _rate(2, SWEPT), "", 5000, True, _rate(2)),
        Row(f"sweep of {SWEPT:,}, two processes / one", _gain, "x", 1.8, True),
        Row(f"optimise, {TRIALS:,} trials", _command(search), "s", 8.0, before=_command(search)),
        Row(f"screen of {SCREENED:,}", _command(screen), "s", 5.0, before=_command(screen)),
        Row(f"family of {BODIES:,} ready to train, CPU", _family, "s", 5.0),
        *(
            Row(f"{robot}: edit / MuJoCo's load, CPU", edit, "x", 1.8, before=edit)
            for robot, length in (("quadruped", 0.25), ("humanoid", 0.2))
            for edit in [_code(_EDIT.format(robot=robot, length=length))]
        ),
    ]


def _measured(row: Row, old: Path, rounds: int) -> list[dict[str, Any]]:
    then, now = [], []
    for _ in range(rounds):
        if row.before:
            then.append(row.before(old))
        now.append(row.measure(HERE))
    found = [measured(f"{row.what}, before", statistics.median(then), row.unit)] if then else []
    now_row = measured(row.what, statistics.median(now), row.unit, row.bar, row.at_least)
    print(row.what, then, now, flush=True)
    return [*found, now_row]


def _command(words: list[str]) -> Callable[[Path], float]:
    """Seconds that a command takes, start and end of the process counted."""

    def seconds(tree: Path) -> float:
        with tempfile.TemporaryDirectory() as folder:
            start = time.perf_counter()
            _python(tree, "-m", "draft", *words, "--out", f"{folder}/out.parquet")
            return time.perf_counter() - start

    return seconds


def _rate(workers: int, count: int = SWEPT_BEFORE) -> Callable[[Path], float]:
    """Designs a second of a sweep, start and end of the process counted."""
    words = ["sweep", "quadruped", "--vary", *BUILT, "--n", str(count), "--workers", str(workers)]
    return lambda tree: count / _command(words)(tree)


def _gain(tree: Path) -> float:
    one = _rate(1, SWEPT)(tree)
    return _rate(2, SWEPT)(tree) / one


def _code(code: str) -> Callable[[Path], float]:
    """The number that some code prints."""
    return lambda tree: float(_python(tree, "-c", code).split()[-1])


def _fields(row: int) -> Callable[[Path], float]:
    """A row of `benchmarks.explore.compiles`, measured in a process of its own."""
    return _code(f"from benchmarks.explore import compiles\nprint(compiles()[{row}]['value'])")


def _family(tree: Path) -> float:
    return _code("from benchmarks.explore import families\nprint(families()[0]['value'])")(tree)


def _python(tree: Path, *words: str) -> str:
    """What Python prints with the code of a tree."""
    paths = {"PYTHONPATH": os.pathsep.join([str(tree / "src"), str(tree)])}
    settings = {**os.environ, **paths, "PYTHONWARNINGS": "ignore"}
    done = subprocess.run(
        [sys.executable, *words], cwd=tree, env=settings, check=True, stdout=subprocess.PIPE
    )
    return done.stdout.decode()


def _git(*words: str) -> None:
    subprocess.run(["git", *words], cwd=HERE, check=True, stdout=subprocess.DEVNULL)


if __name__ == "__main__":
    tyro.cli(main)
