"""How long the trends take: fits and hold-outs, the survey, and loading what is shipped.

`python -m benchmarks.trends [SURVEY]` prints a table and writes `benchmarks/results/trends.json`.
SURVEY is a folder or manifest of robot descriptions; without one, parsing is not measured.
"""

from __future__ import annotations

import statistics
import subprocess
import sys
from pathlib import Path
from typing import Any

from benchmarks.rows import measured, publish, timed
from draft.fitting.actuators import catalogue_refit as actuators
from draft.fitting.structure import survey_refit as survey
from draft.fitting.structure.parse import parse


def main() -> None:
    """Measure everything, print a table and write it as JSON."""
    rows = [
        measured("actuator fits and hold-outs", timed(actuators.actuator_trends)[0], "s", 2.0),
        measured("structure fits and hold-outs", timed(survey.structure_trends)[0], "s", 5.0),
        loading(),
    ]
    for source in sys.argv[1:]:
        seconds, found = timed(lambda source=source: parse(Path(source)))
        rows.append(measured(f"survey of {len(found.parsed)} files parsed", seconds, "s", 20.0))
    publish("trends", rows)


def loading() -> dict[str, Any]:
    """What the shipped coefficients add to a process that has imported the laws."""
    code = (
        "import time\n"
        "from draft.laws import actuators, structure\n"
        "start = time.perf_counter()\n"
        "actuators.laws(), structure.population('humanoid'), structure.population('quadruped')\n"
        "print(time.perf_counter() - start)\n"
    )
    times = [
        float(subprocess.run([sys.executable, "-c", code], check=True, capture_output=True).stdout)
        for _ in range(7)
    ]
    return measured("loading the coefficients", statistics.median(times) * 1e3, "ms", 5.0)


if __name__ == "__main__":
    main()
