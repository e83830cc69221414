"""Twins of real robots: figures for docs/twins.md, and the residuals that the package ships.

python -m docs.twins ROBOTS     # a folder with twins/ and survey/, such as the repo's data
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Sequence
from functools import partial
from pathlib import Path

from draft.offscreen import prefer_offscreen

prefer_offscreen()  # before MuJoCo is imported

from draft.laws.residuals import FILE  # noqa: E402
from draft.plotting import save  # noqa: E402
from draft.twins import every, figure  # noqa: E402
from draft.twins.compare import Comparison, compare_twin  # noqa: E402
from draft.twins.look import side_by_side  # noqa: E402
from draft.twins.record import residuals  # noqa: E402

IMAGES = Path(__file__).resolve().parent / "images"
TWINS = {
    "g1": "twins/g1/g1_29dof_rev_1_0.urdf",
    "h2": "twins/h2/H2.urdf",
    "go2": "twins/go2/go2_description.urdf",
    "b2": "twins/b2/b2_description.urdf",
}


def main(arguments: Sequence[str] | None = None) -> None:
    """Compare all robots; write the figures and the residuals."""
    parser = argparse.ArgumentParser(prog="python -m docs.twins", description="Compare twins.")
    parser.add_argument("robots", type=Path, help="folder with twins/ and survey/")
    robots = parser.parse_args(arguments).robots
    four = {name: compare_twin(robots / file) for name, file in TWINS.items()}
    rows = [row for row in every.run(every.tasks(robots / "survey")) if isinstance(row, every.Row)]
    fitted = sorted((row for row in rows if row.fitted), key=lambda row: row.robot)
    write(four, fitted)
    makers = {f"twin_{name}": partial(draw, found) for name, found in four.items()}
    for path in save(IMAGES, {**makers, "twins": partial(figure.survey, fitted)}, figure.DPI):
        if path.suffix == ".pdf":
            path.unlink()
        else:
            print(path)


def draw(found: Comparison):
    """The figure of one twin, with both robots rendered."""
    return figure.twin(found, side_by_side(found))


def write(four: dict[str, Comparison], rows: Sequence[every.Row]) -> None:
    """Write the residuals of the four twins and of every robot that the survey fits."""
    table = {
        name: {"population": found.population, "held_out": False, "groups": residuals(found)}
        for name, found in four.items()
    }
    for row in rows:
        table[f"survey/{row.robot}"] = {
            "population": row.population,
            "held_out": True,
            "groups": row.residuals,
        }
    FILE.write_text(json.dumps(table, indent=1) + "\n", encoding="utf-8")
    print(FILE)


if __name__ == "__main__":
    main()
