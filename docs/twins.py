"""Twins of real robots: figures and scores for docs/twins.md, and the residuals that Draft ships.

python -m docs.twins ROBOTS              # a folder with twins/ and survey/, such as the repo's data
python -m docs.twins ROBOTS --residuals  # write the residuals instead

The residuals are those of twins by the published sum of structure: studies perturb the published
designs by them, which weigh by it, and results that exist were measured with these numbers.
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from statistics import median

from draft.offscreen import prefer_offscreen

prefer_offscreen()  # before MuJoCo is imported

from docs.pictures import shrink  # noqa: E402
from draft.imports import names  # noqa: E402
from draft.imports.importer import DEFAULTS, spec_of, translate  # noqa: E402
from draft.imports.sources import find_source  # noqa: E402
from draft.laws.residuals import FILE  # noqa: E402
from draft.laws.structure import PAPER  # noqa: E402
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
    """Compare all robots; draw the figures and print the scores, or write the residuals."""
    parser = argparse.ArgumentParser(prog="python -m docs.twins", description="Compare twins.")
    parser.add_argument("robots", type=Path, help="folder with twins/ and survey/")
    parser.add_argument("--residuals", action="store_true", help="write the residuals instead")
    given = parser.parse_args(arguments)
    if given.residuals:
        write(given.robots)
        return
    four = {name: compare_twin(given.robots / file) for name, file in TWINS.items()}
    for name, found in four.items():
        print(name, *_numbers(found))
    for name in ("go2", "b2"):
        out = compare_twin(given.robots / TWINS[name], without=(f"unitree_{name}",))
        print(name, "held out", *_numbers(out))
    rows = list(every.run(every.tasks(given.robots / "survey")))
    fitted = sorted((x for x in rows if isinstance(x, every.Row) and x.fitted), key=_key)
    for population in ("humanoid", "quadruped"):
        own = [row for row in fitted if row.population == population]
        score = every.score(own)
        inertia, gravity = (
            median(getattr(x, what) for x in own) for what in ("inertia", "gravity")
        )
        print(population, score, f"M(q) {inertia:.1f} %, g(q) {gravity:.1f} %")
    makers = {f"twin_{name}": partial(draw, found) for name, found in four.items()}
    for path in save(IMAGES, {**makers, "twins": partial(figure.survey, fitted)}, figure.DPI):
        if path.suffix == ".pdf":
            path.unlink()
        else:
            shrink(path)


def draw(found: Comparison):
    """The figure of one twin, with both robots rendered."""
    return figure.twin(found, side_by_side(found))


def by_published_sum(file: Path, key: str = "", without: Sequence[str] = ()) -> Comparison:
    """Compare a robot with its twin by the published sum of structure.

    Args:
        file: description of the robot.
        key: its key in the survey; "" for none.
        without: keys of surveyed robots to hold out.
    """
    source, options = find_source(file), replace(DEFAULTS, without=frozenset(without))
    files = translate(source, names.valid(source.name, "robot"), options=options, key=key)
    spec = replace(spec_of(files), structure=PAPER)
    return compare_twin(file, spec, options=options, key=key)


def write(robots: Path) -> None:
    """Write the residuals of the four twins and of every robot that the survey fits."""
    found = {name: (by_published_sum(robots / file), False) for name, file in TWINS.items()}
    for key, file, fitted, _, held in sorted(every.tasks(robots / "survey")):
        if fitted:
            found[f"survey/{key}"] = (by_published_sum(Path(file), key, held), True)
    table = {
        name: {"population": one.population, "held_out": out, "groups": residuals(one)}
        for name, (one, out) in found.items()
    }
    FILE.write_text(json.dumps(table, indent=1) + "\n", encoding="utf-8")
    print(FILE)


def _key(row: every.Row) -> str:
    return row.robot


def _numbers(found: Comparison) -> tuple[str, ...]:
    """Mass, ratio, medians and variances of M(q) and g(q), as the page has them."""
    errors = (f"{x.median:.2f} %, {x.variance:.2f}" for x in (found.inertia, found.gravity))
    return f"{found.design.mass:.2f} kg", f"{found.mass_ratio:.3f}", *errors


if __name__ == "__main__":
    main()
