"""How long does a step of a deployed controller take, beside Draft's own evaluation with NumPy?

    python -m benchmarks.deploy

It writes the controllers of a quadruped and of the humanoid, compiles `deploy_step.cpp` with each,
as their README says, and measures medians in rounds of both languages in turn.
"""

from __future__ import annotations

import shutil
import statistics
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np

from benchmarks.rows import measured, publish, timed
from draft.deployment.deploy import Deployed, deploy

BAR = 50.0  # Of a step with twelve joints [us].
ROUNDS, STEPS = 5, 200


def main() -> None:
    """Measure, print and write the results."""
    compiler = shutil.which("g++") or shutil.which("clang++")
    if compiler is None:
        sys.exit("there is no compiler: install g++ or clang++")
    version = subprocess.run([compiler, "--version"], capture_output=True, text=True, check=True)
    rows = []
    with tempfile.TemporaryDirectory() as place:
        for design, skill, bar in (("cheetah", "run", BAR), ("humanoid", "walk", None)):
            found = deploy(design, Path(place) / design, skill)
            program = Path(place) / f"{design}-step"
            source = Path(__file__).with_name("deploy_step.cpp")
            words = ["-std=c++17", "-O3", f"-I{found.folder}", "-o", str(program), str(source)]
            subprocess.run([compiler, *words], check=True)
            steps, networks, own = zip(
                *(_round(program, found) for _ in range(ROUNDS)), strict=True
            )
            step = statistics.median(steps)
            joints = f"{len(found.policy.joints)} joints"
            rows += [
                measured(f"step in C++, {joints}", step, "us", bar),
                measured(
                    f"share of the control period, {joints}",
                    100e-6 * step / found.policy.control_period,
                    "%",
                ),
                measured(
                    f"network in C++ / Draft's with NumPy, {joints}",
                    statistics.median(np.divide(networks, own)),
                    "",
                ),
            ]
    publish("deploy", rows, compiler=version.stdout.splitlines()[0])


def _round(program: Path, found: Deployed) -> tuple[float, float, float]:
    """Medians of a step and of the network in C++, and of Draft's own evaluation [us]."""
    done = subprocess.run([str(program)], capture_output=True, text=True, check=True)
    step, network = map(float, done.stdout.split())
    seen = np.zeros(found.policy.network.size, np.float32)
    own = statistics.median(timed(lambda: found.policy(seen))[0] for _ in range(STEPS))
    return step, network, 1e6 * own


if __name__ == "__main__":
    main()
