"""Strips of pictures for docs/results.md: each design and skill, of the seed of median top speed.

python -m docs.result_strips STUDY RESULTS   # RESULTS/strips/DESIGN-SKILL.png
"""

from __future__ import annotations

import subprocess
import sys
import tempfile
from pathlib import Path

from draft.learn.report.records import Study
from draft.learn.report.spread import by_seed
from draft.learn.results import files
from draft.learn.results.choice import median_seed
from draft.learn.results.figures import shrink
from draft.learn.results.page import STRIPS, WORDS

WIDTH = 960  # [pixels]
SECONDS = 4.0


def commands(study: Study, design: str) -> dict[str, float | None]:
    """Commanded forward speed by stage [m/s]; None for the default of `draft play`."""
    seed = median_seed(study, design)
    peak = by_seed(study, design, "nominal", "peak_command").known
    return dict.fromkeys(WORDS) | {"velocity": peak.get(seed) if seed is not None else None}


def play(run: Path, forward: float | None, strip: Path) -> None:
    """Write a strip of a run's policy."""
    asked = ("--command", str(forward), "0", "0") if forward is not None else ()
    with tempfile.TemporaryDirectory() as folder:
        video, raw = Path(folder) / "play.mp4", Path(folder) / "strip.png"
        outputs = ("--out", str(video), "--strip", str(raw))
        words = ("draft", "play", str(run), "--seconds", str(SECONDS), *asked, *outputs)
        subprocess.run(words, check=True)
        shrink(raw, WIDTH)
        strip.parent.mkdir(parents=True, exist_ok=True)
        strip.write_bytes(raw.read_bytes())


def main(source: Path, results: Path) -> None:
    """Write all strips of a study whose runs are there."""
    study = files.read(results)
    for design, title in study.titles.items():
        seed, asked = median_seed(study, design), commands(study, design)
        for one in study.singles:
            run = source / "runs" / one.name
            if one.key[0] == design and one.seed == seed and run.is_dir():
                strip = results / STRIPS / f"{title}-{WORDS[one.stage]}.png"
                play(run, asked[one.stage], strip)
                print(f"{strip}: {strip.stat().st_size / 1000:.0f} kB")


if __name__ == "__main__":
    main(*(Path(word) for word in sys.argv[1:3]))
