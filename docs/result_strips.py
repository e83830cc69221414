"""Strips of pictures for docs/results.md: each skill of each shipped design.

python -m docs.result_strips RESULTS   # RESULTS/strips/DESIGN-SKILL.png
"""

from __future__ import annotations

import subprocess
import sys
import tempfile
from pathlib import Path

from draft.learn.policy.policy import STUDIED, designs
from draft.study.report.figures import shrink
from draft.study.report.sections import STRIPS

WIDTH = 960  # [pixels]
SECONDS = {"climb": "8", "push": "8"}  # Others take four.


def main(results: Path) -> None:
    """Write all strips."""
    folder = results / STRIPS
    folder.mkdir(parents=True, exist_ok=True)
    for design in designs():
        for skill in STUDIED:
            strip = folder / f"{design}-{skill}.png"
            with tempfile.TemporaryDirectory() as scratch:
                outputs = ("--out", f"{scratch}/play.mp4", "--strip", str(strip))
                words = ("--skill", skill, "--seconds", SECONDS.get(skill, "4"), *outputs)
                subprocess.run([sys.executable, "-m", "draft", "play", design, *words], check=True)
            shrink(strip, WIDTH)
            print(f"{strip}: {strip.stat().st_size / 1000:.0f} kB")


if __name__ == "__main__":
    main(Path(sys.argv[1]))
