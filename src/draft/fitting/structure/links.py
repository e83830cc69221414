"""Laws of the links of arms and hands, from the shipped tables of public data.

`python -m draft.fitting.structure.links` writes the file that Draft ships; a test checks that it is
reproduced. Fingers are fitted link by link; of arms only the span of the mass per metre is known.
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np

from draft.fitting import coefficients
from draft.fitting.limits import Points, fitted_law, power_law, table
from draft.laws.law import Law, Term, fold_of_sigma
from draft.laws.structure import LINKS

SOURCE, PAGE = "draft/fitting/data/{}.csv", "docs/structure-trends.md"
# Mean of the largest of n numbers drawn from the standard normal distribution.
_LARGEST = {3: 0.846, 8: 1.424}


def link_trends() -> dict[str, Any]:
    """Content of the file of coefficients."""
    laws = [_finger(), *(_arm(row) for row in table("arms"))]
    return coefficients.rounded({law.name: law.record() for law in laws})


def _finger() -> Law:
    """Mass of a passive finger link from its length; hands held out.

    Metal links with sensors, and masses that their descriptions only name, are left out.
    """
    used = [row for row in table("phalanges") if row["used"] == "yes"]
    length, mass = (np.array([float(row[key]) for row in used]) for key in ("length_m", "mass_kg"))
    points = Points(length, mass, [row["hand"] for row in used])
    held = ("maker", SOURCE.format("phalanges"))
    formula = "m = {:.3g} L^{:.2f}"
    law = fitted_law("finger", "kg", formula, ("length", "m"), points, power_law, held, PAGE)
    return replace(law, beyond="proportional")


def _arm(row: dict[str, str]) -> Law:
    """Mass per metre in the middle of its span over n arms.

    The spread is that of a normal distribution of which the extremes of n draws lie as far apart:
    of the logarithm, or where the lowest is zero of the mass per metre itself, whose share of the
    middle then stands for that of the logarithm.
    """
    low, high, n = float(row["low_kg_m"]), float(row["high_kg_m"]), int(row["machines"])
    middle = math.sqrt(low * high) if low else high / 2
    half = math.log(high / middle) if low else 1.0
    return Law(
        name=row["class"],
        unit="kg",
        formula=f"m = {middle:.3g} L",
        inputs=("length",),
        input_units=("m",),
        terms=(Term(middle, (1.0,)),),
        n=n,
        ranges={"length": (0.05, 0.8)},
        held_out={},
        source=f"{SOURCE.format('arms')}; {PAGE}",
        beyond="proportional",
        fold=fold_of_sigma(half / _LARGEST[n]),
    )


if __name__ == "__main__":
    coefficients.write(LINKS, link_trends())
