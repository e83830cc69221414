"""Change 40 places of the code, one at a time, and see whether their tests notice.

Each mutant replaces a text that occurs once in a file of `src/draft`, in a copy of the package that
only its own tests import. The tests are named by the end of their path, so that the same table fits
a tree in which they lie elsewhere: run it before and after a change of the tests, and compare.

    python scripts/mutants.py                 # all, in a few minutes
    python scripts/mutants.py metrics learn   # those of these packages
    python scripts/mutants.py --sound         # the same tests without a mutant: all must pass
    python scripts/mutants.py --list          # checks the table and runs nothing

Exit code: 0 if the tests notice all, 1 if a mutant survives, 2 if the table does not fit the code.
"""

from __future__ import annotations

import argparse
import os
import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import NamedTuple

ROOT = Path(__file__).resolve().parents[1]
CAUGHT, SURVIVED = 1, 0  # Exit codes of pytest.


class Mutant(NamedTuple):
    """A changed place.

    Attributes:
        file: file below `src/draft`.
        old: text that occurs once in it.
        new: text that replaces it.
        tests: files of the tests that should notice, by the ends of their paths.
        words: expression of `pytest -k` that chooses among them; all if empty.
    """

    file: str
    old: str
    new: str
    tests: tuple[str, ...]
    words: str = ""


MUTANTS = (
    # Core: vectors, numbers and laws.
    Mutant(
        "geometry.py",
        "(c + t * x * x, t * x * y - s * z, t * x * z + s * y)",
        "(c + t * x * x, t * x * y - s * z, t * x * z - s * y)",
        ("model/test_slides.py", "model/test_export.py", "model/test_symmetry.py"),
    ),
    Mutant(
        "values.py",
        "return minimum(maximum(x, low), high)",
        "return maximum(x, low)",
        ("laws/test_law.py", "metrics/test_leaping.py", "design/test_actuators.py"),
    ),
    Mutant("laws/law.py", "(at - half) / (ninety - half)", "at / ninety", ("laws/test_law.py",)),
    Mutant(
        "laws/law.py",
        "factor = 1 / fold if self.reciprocal else fold",
        "factor = fold",
        ("laws/test_law.py", "design/test_bands.py"),
    ),
    # Spec: what is read.
    Mutant(
        "spec/expressions.py",
        "if not fewest <= count <= most:",
        "if not fewest <= count:",
        ("spec/test_expressions.py", "test_bad_input.py"),
    ),
    Mutant(
        "spec/expressions.py",
        "where.column + columns)",
        "where.column)",
        ("spec/test_expressions.py", "test_bad_input.py"),
    ),
    Mutant(
        "spec/tree.py",
        "signs[1] * mirror[1], signs[2] * mirror[2])",
        "mirror[1], signs[2] * mirror[2])",
        ("spec/test_tree.py", "model/test_symmetry.py"),
    ),
    Mutant(
        "spec/operators.py",
        "result = _choose(result, holds, 0.0) if v.is_array(result) else holds",
        "result = holds",
        ("spec/test_expressions.py", "test_fuzz.py"),
    ),
    # Design: numbers and checks.
    Mutant(
        "design/legs.py",
        "lift=axis[0] * r[1] - axis[1] * r[0],",
        "lift=axis[0] * r[1] + axis[1] * r[0],",
        ("metrics/test_physics.py",),
    ),
    Mutant(
        "design/filter.py",
        "limit = 2 * trend(segment.length)",
        "limit = 3 * trend(segment.length)",
        ("design/test_filter.py",),
    ),
    Mutant(
        "design/filter.py",
        "torque > rated * ROUNDING",
        "torque > 2 * rated",
        ("metrics/test_heat.py",),
    ),
    Mutant(
        "design/solids.py",
        "across = maximum(1.0 - along * along, 0.0)",
        "across = maximum(1.0 - along, 0.0)",
        ("design/test_solids.py",),
    ),
    Mutant(
        "design/actuators.py",
        "line = self.stall_torque * maximum(1.0 - speed / self.no_load_speed, 0.0)",
        "line = self.peak_torque * maximum(1.0 - speed / self.no_load_speed, 0.0)",
        ("design/test_corner.py", "design/test_actuators.py"),
    ),
    # Model: what is written.
    Mutant(
        "model/mjcf.py",
        "        x, y, z = -x, -y, -z\n",
        "        x, y, z = x, y, -z\n",
        ("model/test_slides.py", "model/test_symmetry.py", "model/test_mjcf.py"),
    ),
    Mutant(
        "model/urdf.py",
        "return math.atan2(-rotation[1, 2], rotation[1, 1]), pitch, 0.0",
        "return math.atan2(rotation[1, 2], rotation[1, 1]), pitch, 0.0",
        ("model/test_export.py",),
    ),
    Mutant(
        "model/simulate.py",
        "        at_limit / steps,",
        "        at_limit,",
        ("model/test_simulate.py",),
    ),
    # Metrics.
    Mutant(
        "metrics/heat.py",
        "(1.0 - part) * swing * swing",
        "(1.0 + part) * swing * swing",
        ("metrics/test_heat.py",),
    ),
    Mutant(
        "metrics/leaping.py",
        "rise * rise / (2.0 * GRAVITY)",
        "rise * rise / GRAVITY",
        ("metrics/test_leaping.py",),
    ),
    Mutant(
        "metrics/impact.py",
        "rows[k, i] = jacobian[2]",
        "rows[k, i] = jacobian[1]",
        ("metrics/test_physics.py",),
    ),
    # Imports.
    Mutant(
        "imports/symmetry.py",
        "reverse.append(float(axis @ b.axis) < 0)",
        "reverse.append(False)",
        ("imports/test_sides.py", "imports/test_import.py"),
    ),
    Mutant(
        "imports/limbs.py",
        'population = "quadruped" if len(legs) > 2 else "humanoid"',
        'population = "quadruped" if len(legs) > 3 else "humanoid"',
        ("imports/test_limbs.py",),
    ),
    Mutant(
        "imports/mesh_masses.py",
        'volumes = volumes if method == "exact" else np.abs(volumes)',
        "volumes = np.abs(volumes)",
        ("imports/test_mesh_masses.py", "imports/test_volumes.py"),
    ),
    Mutant(
        "imports/drives.py",
        "return max(law.sigma, SIGMA_FLOOR) + 0.5 * beyond",
        "return max(law.sigma, SIGMA_FLOOR)",
        ("imports/test_drives.py", "imports/test_summary.py"),
    ),
    # Explore.
    Mutant(
        "explore/front.py",
        "np.all(values[kept] <= values[row], axis=1)",
        "np.any(values[kept] <= values[row], axis=1)",
        ("explore/test_optimise.py",),
    ),
    Mutant(
        "variation/sampling.py",
        "bits.advance(start * axes)",
        "bits.advance(start)",
        ("variation/test_axes.py",),
    ),
    Mutant(
        "variation/axes.py",
        "found = self.low * (self.high / self.low) ** share",
        "found = self.low + (self.high - self.low) * share",
        ("variation/test_axes.py",),
    ),
    # Learn: task, training, measuring.
    Mutant(
        "learn/task/mdp/rewards.py",
        "return counts * (_commanded_motion(env) > robot.scaled(gate))",
        "return counts",
        ("test_rewards.py",),
        "not added",
    ),
    Mutant(
        "learn/task/mdp/curriculums.py",
        "up = ~fell & walks & (distance",
        "up = walks & (distance",
        ("test_laptop.py",),
    ),
    Mutant(
        "learn/task/mdp/events.py",
        "self._span = high - self._low",
        "self._span = high",
        ("test_events.py",),
    ),
    Mutant(
        "learn/training/ppo/ppo.py",
        "transition.rewards += self.gamma * bootstrap",
        "transition.rewards += bootstrap",
        ("test_ppo.py",),
        "recorded or weights",
    ),
    Mutant(
        "learn/training/ppo/trainer.py",
        "        if self.iteration and self.iteration not in kept:\n            self.keep()\n",
        "",
        ("test_training.py",),
        "stops_early",
    ),
    Mutant(
        "learn/bodies/inertia.py",
        "shift[..., 1] *= links.side[member]",
        "shift[..., 1] *= 1.0",
        ("learn/test_inertia.py", "bodies/test_inertia.py", "test_inertia_errors.py"),
    ),
    Mutant(
        "learn/measuring/scalars.py",
        "share = (recovered[i - 1] - HALF) / (recovered[i - 1] - recovered[i])",
        "share = 0.5",
        ("test_scalars.py",),
    ),
    Mutant(
        "learn/policy/matching.py",
        "sign = np.where(cosines < 0, -1.0, 1.0)",
        "sign = np.where(cosines < 0, 1.0, 1.0)",
        ("test_matching.py",),
    ),
    # Study.
    Mutant(
        "study/store.py",
        'return record.get("iterations", 0) <= job.iterations and not other',
        "return not other",
        ("study/test_store.py", "study/test_execution.py"),
    ),
    Mutant(
        "study/graph.py",
        'determinants | {"iterations": iterations}',
        "determinants",
        ("study/test_jobs.py",),
    ),
    Mutant(
        "study/capacity.py",
        "at_once = max(1, min(most // processes, _MOST))",
        "at_once = max(1, min(most, _MOST))",
        ("study/test_capacity.py", "study/test_placement.py"),
    ),
    # Command line.
    Mutant(
        "cli/evaluate.py",
        "if errors is not None and not perturbed:",
        "if errors is not None and perturbed:",
        ("cli/test_evaluate.py",),
        "bad_input",
    ),
    Mutant(
        "cli/play_output.py",
        "        if parent.is_dir():\n            break\n",
        "        break\n",
        ("cli/test_play.py",),
        "place_that or bad_input",
    ),
    Mutant(
        "cli/metrics.py",
        'if name == "hold_time" and math.isinf(value):',
        'if name == "hold_time":',
        ("cli/test_metrics.py",),
    ),
)


def tests_of(mutant: Mutant) -> list[str]:
    """Files of a mutant's tests in this tree."""
    files = sorted(path.relative_to(ROOT) for path in (ROOT / "tests").rglob("test_*.py"))
    return [str(path) for path in files if str(path).endswith(tuple("/" + x for x in mutant.tests))]


def faults() -> list[str]:
    """What of the table does not fit the code."""
    found = []
    for mutant in MUTANTS:
        path = ROOT / "src/draft" / mutant.file
        text = path.read_text(encoding="utf-8") if path.is_file() else ""
        if text.count(mutant.old) != 1:
            found.append(f"{mutant.file} has {text.count(mutant.old)} times: {mutant.old.strip()}")
        if not tests_of(mutant):
            found.append(f"{mutant.file}: there are no tests {', '.join(mutant.tests)}")
    return found


def run(mutant: Mutant | None, source: Path, tests: list[str], words: str) -> int:
    """Exit code of pytest with a mutant, or with none, in a copy of the package.

    Args:
        mutant: the mutant; None for the code as it is.
        source: folder with the copy of `draft`.
        tests: files of tests.
        words: expression of `pytest -k`.
    """
    place = source / "draft" / mutant.file if mutant is not None else None
    text = place.read_text(encoding="utf-8") if place is not None else ""
    command = [sys.executable, "-m", "pytest", "-n", "0", "-x", "-q", "-p", "no:cacheprovider"]
    command += [*tests, *(("-k", words) if words else ())]
    environment = os.environ | {"PYTHONPATH": str(source)}
    try:
        if place is not None and mutant is not None:
            _write(place, text.replace(mutant.old, mutant.new))
        done = subprocess.run(
            command, cwd=ROOT, env=environment, capture_output=True, text=True, check=False
        )
    finally:
        if place is not None:
            _write(place, text)
    if done.returncode not in (CAUGHT, SURVIVED):
        print(done.stdout[-2000:], done.stderr[-2000:], file=sys.stderr)
    return done.returncode


def _write(place: Path, text: str) -> None:
    """Write a file without its bytecode, which has the time of a second only."""
    for compiled in (place.parent / "__pycache__").glob(f"{place.stem}.*.pyc"):
        compiled.unlink()
    place.write_text(text, encoding="utf-8")


def main() -> int:
    """Run the mutants of the packages that are named, or all."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("packages", nargs="*", help="such as metrics; all if none is named")
    parser.add_argument("--sound", action="store_true", help="run the tests without a mutant")
    parser.add_argument("--list", action="store_true", help="check the table and run nothing")
    asked = parser.parse_args()
    if wrong := faults():
        print(*wrong, sep="\n", file=sys.stderr)
        return 2
    if asked.list:
        print(f"{len(MUTANTS)} mutants fit the code")
        return 0
    survivors = 0
    chosen = [m for m in MUTANTS if not asked.packages or m.file.split("/")[0] in asked.packages]
    with tempfile.TemporaryDirectory() as folder:
        source = Path(folder)
        shutil.copytree(ROOT / "src/draft", source / "draft")
        for number, mutant in enumerate(chosen, 1):
            start = time.monotonic()
            made = None if asked.sound else mutant
            code = run(made, source, tests_of(mutant), mutant.words)
            if code not in (CAUGHT, SURVIVED) or (asked.sound and code == CAUGHT):
                print(f"the tests of the mutant of {mutant.file} fail", file=sys.stderr)
                return 2
            survivors += code == SURVIVED
            word = "caught" if code == CAUGHT else "passed" if asked.sound else "SURVIVED"
            took = time.monotonic() - start
            print(f"[{number}/{len(chosen)}] {word:8} {took:4.0f} s  {mutant.file}", flush=True)
    if asked.sound:
        return 0
    print(f"{len(chosen) - survivors} of {len(chosen)} mutants are caught")
    return 1 if survivors else 0


if __name__ == "__main__":
    sys.exit(main())
