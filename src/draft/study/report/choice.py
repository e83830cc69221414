"""Choice of the policies that represent a design: the seed of median top speed, not the best."""

from __future__ import annotations

from draft.study.report.records import Study
from draft.study.report.spread import by_seed


def median_seed(study: Study, design: str, scalar: str = "top_speed") -> int | None:
    """Return the seed with the median of a scalar, nominal arm.

    It is the lower of the two middle seeds of an even number, and the first of seeds with the same
    value.

    Args:
        study: the results.
        design: name of the design.
        scalar: name of the scalar.

    Returns:
        The seed; None if the scalar is unknown for all.
    """
    known = by_seed(study, design, "nominal", scalar).known
    ranked = sorted(known, key=lambda seed: (known[seed], seed))
    if not ranked:
        return None
    middle = known[ranked[(len(ranked) - 1) // 2]]
    return next(seed for seed in ranked if known[seed] == middle)
