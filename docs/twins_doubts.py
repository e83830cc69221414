"""Twins under doubt, for docs/twins.md: torques removed, or trends of the other population.

python -m docs.twins_doubts declared ROBOTS  # the survey as it is, each robot held out
python -m docs.twins_doubts removed ROBOTS   # without the makers' torques
python -m docs.twins_doubts swapped ROBOTS   # by the trends of the other population
python -m docs.twins_doubts declared FILE ...  # a row for each description
python -m docs.twins_doubts removed FILE ...
"""

from __future__ import annotations

import contextlib
import math
import sys
from collections import Counter
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from unittest.mock import patch

from draft.offscreen import prefer_offscreen

prefer_offscreen()  # before MuJoCo is imported

from draft.errors import DraftError  # noqa: E402
from draft.imports import drives, names  # noqa: E402
from draft.imports.expected import expected_mass  # noqa: E402
from draft.imports.importer import POPULATIONS, spec_of, translate  # noqa: E402
from draft.imports.sources import find_source  # noqa: E402
from draft.laws.structure import CALIBRATED, PAPER  # noqa: E402
from draft.laws.survey import read  # noqa: E402
from draft.twins import every  # noqa: E402
from draft.twins.compare import Comparison, compare_twin  # noqa: E402
from draft.values import scalar  # noqa: E402

POSES = 2  # Of which only masses are read here.


def survey(robots: Path, doubt: str) -> None:
    """Print, by population, errors of mass and how many robots their bands hold, each held out."""
    populations = {row.robot: row.population for row in read()}
    found: dict[str, list[Comparison]] = {}
    for key, file, fitted, _, held in every.tasks(robots / "survey"):
        if not fitted:
            continue
        people = populations[key]
        other = next(one for one in POPULATIONS if one != people)
        twin = compare_twin(
            file,
            without=held,
            poses=POSES,
            key=key,
            population=other if doubt == "swapped" else None,
        )
        found.setdefault(people, []).append(twin)
    for people, twins in found.items():
        errors = [abs(math.log(one.mass_ratio)) for one in twins]
        own = sum(_within(one, *map(scalar, one.design.mass_band(0.9))) for one in twins)
        wide = sum(_within(one, one.expected.low, one.expected.high) for one in twins)
        mean, worst = math.exp(sum(errors) / len(errors)), math.exp(max(errors))
        print(
            f"{people}s, {doubt}: factor {mean:.2f}, largest {worst:.2f}, in the trends' band "
            f"{own} of {len(twins)}, in the import's {wide}"
        )


def _within(one: Comparison, low: float, high: float) -> bool:
    return low <= one.vendor_mass <= high


def files(paths: Sequence[Path]) -> None:
    """Print legs, population, torques, and mass over the maker's by both laws, of each file."""
    for path in paths:
        try:
            source = find_source(path)
            found = translate(source, names.valid(source.name, "robot"))
        except DraftError as error:
            print(f"{path}: {error}")
            continue
        maker, spec = found.reduced.description.mass, spec_of(found)
        cells = []
        for law in (PAPER, CALIBRATED):
            design = replace(spec, structure=law).resolve()
            band = expected_mass(design, found)
            inside = "in the band" if band.low <= maker <= band.high else "outside"
            cells.append(f"{law} {scalar(design.mass) / maker:.2f} {inside}")
        torques = Counter(one.torque_from for one in found.drives.values())
        words = ", ".join(f"{count} {what}" for what, count in torques.items())
        print(f"{path}: {found.limbs.legs} legs, {found.population}; {words}; {'; '.join(cells)}")


if __name__ == "__main__":
    doubt, *rest = sys.argv[1:] or [""]
    paths = [Path(one) for one in rest]
    folder = len(paths) == 1 and paths[0].is_dir()
    if not paths or doubt not in ("declared", "removed", "swapped"):
        sys.exit(__doc__)
    removed = patch.object(drives, "declared", lambda _: None)
    with removed if doubt == "removed" else contextlib.nullcontext():
        if folder:
            survey(paths[0], doubt)
        elif doubt != "swapped":
            files(paths)
        else:
            sys.exit(__doc__)
