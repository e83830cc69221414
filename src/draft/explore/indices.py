"""Sobol indices: what numbers matter to metrics over whole ranges, alone and together.

The first-order index of a number is the share of a metric's variance that it explains alone, the
total one that which it has a part in; numbers are independent and uniform over their ranges. They
are estimated by SALib from Saltelli's samples (Saltelli et al. 2010, Comput. Phys. Commun. 181,
259), with intervals from resampling.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from draft.design import Design
from draft.errors import DraftError
from draft.explore.parquet_parts import about
from draft.explore.sensitivity import closed_metrics
from draft.extras import need
from draft.metrics import of_design
from draft.values import Array
from draft.variation.axes import Vary, parse

SAMPLES = 1024
_LEVEL = 0.9  # Of the intervals.
_INTERACT = 0.1  # Share of the variance that numbers explain together only, to be told.


@dataclass(frozen=True)
class Indices:
    """Sobol indices of P numbers and M metrics.

    Attributes:
        names: the numbers.
        ranges: their ranges, as words.
        metrics: the metrics.
        first, total: first-order and total indices, shape (P, M); NaN for a metric that is
            constant.
        first_width, total_width: half of their 90 % intervals, shape (P, M).
        mean, deviation: of each metric over the ranges, shape (M,).
        designs: designs that were computed.
    """

    names: tuple[str, ...]
    ranges: tuple[str, ...]
    metrics: tuple[str, ...]
    first: Array
    total: Array
    first_width: Array
    total_width: Array
    mean: Array
    deviation: Array
    designs: int

    @property
    def together(self) -> Array:
        """Share of each metric's variance that numbers explain only together, shape (M,)."""
        return np.clip(1.0 - self.first.sum(axis=0), 0.0, 1.0)

    def warnings(self) -> list[str]:
        """Metrics of which single effects mislead, as sentences."""
        return [
            f"{name}: {100 * share:.0f} % of its variance is of numbers together, so that effects "
            "of single ones mislead"
            for name, share in zip(self.metrics, self.together, strict=True)
            if share > _INTERACT
        ]

    def record(self) -> dict[str, Any]:
        """Plain data; None where there is no number."""

        def cell(i: int, k: int) -> dict[str, float | None]:
            fields = ("first", "first_width", "total", "total_width")
            values = {name: float(getattr(self, name)[i, k]) for name in fields}
            return {name: None if np.isnan(x) else x for name, x in values.items()}

        return {
            "designs": self.designs,
            "metrics": {
                name: {
                    "mean": float(self.mean[k]),
                    "deviation": float(self.deviation[k]),
                    "numbers": {own: cell(i, k) for i, own in enumerate(self.names)},
                }
                for k, name in enumerate(self.metrics)
            },
        }


def sobol_indices(
    design: Design,
    vary: Vary,
    of: Sequence[str] = (),
    *,
    n: int = SAMPLES,
    seed: int = 0,
) -> Indices:
    """Sobol indices of a design's closed-form metrics over ranges of its numbers.

    Args:
        design: one design, whose other numbers stay.
        vary: ranges of numbers, by name or as words; listed values count as even shares.
        of: metrics; empty for all that need no model.
        n: samples of Saltelli's scheme, a power of two: n (P + 2) designs.
        seed: seed of the samples.

    Raises:
        DraftError: the design is several, a name is unknown, a metric needs a model or is undefined
            somewhere in the ranges, `n` is no power of two, or the extra `explore` is missing.
    """
    if design.count is not None:
        raise DraftError("ranges are around one design", "select one, such as `design[0]`")
    if n < 2 or n & (n - 1):
        raise DraftError(f"`n` {n} is no power of two", "such as 1024")
    axes, metrics = parse(design.spec, vary), closed_metrics(design.spec, of)
    sample, analyse = need("SALib.sample.sobol"), need("SALib.analyze.sobol")
    names = [axis.name for axis in axes]
    problem = {"num_vars": len(axes), "names": names, "bounds": [[0.0, 1.0]] * len(axes)}
    shares = sample.sample(problem, n, calc_second_order=False, seed=seed)
    arrays = {axis.name: axis.at(shares[:, i]) for i, axis in enumerate(axes)}
    many = design.spec.resolve(design.values, arrays)
    found = of_design(many, metrics)
    rows = []
    for name in metrics:
        values = np.broadcast_to(np.asarray(found[name], float), len(shares))
        if not np.isfinite(values).all():
            cause = f"'{name}' has no number somewhere in these ranges"
            raise DraftError(cause, "narrow them, or name other metrics with `of`")
        rows.append(_of_metric(analyse, problem, values, seed))
    table = np.array(rows).transpose(1, 2, 0)  # (4, P, M)
    means = [np.mean(found[name]) for name in metrics]
    deviations = [np.std(found[name]) for name in metrics]
    return Indices(
        names=tuple(names),
        ranges=tuple(axis.record() for axis in axes),
        metrics=metrics,
        first=table[0],
        total=table[1],
        first_width=table[2],
        total_width=table[3],
        mean=np.array(means, float),
        deviation=np.array(deviations, float),
        designs=len(shares),
    )


def ranges_of_screen(file: Path) -> tuple[str, ...]:
    """Ranges of a screen, as words, from the metadata of its file.

    Raises:
        DraftError: it is no file of a screen.
    """
    ranges = about(file).get("manifest", {}).get("vary")
    if not ranges:
        raise DraftError(f"'{file}' is no file of `draft.screen`", "name one, or give `vary`")
    return tuple(f"{name}={text}" for name, text in ranges.items())


def _of_metric(analyse: Any, problem: dict[str, Any], values: Array, seed: int) -> Array:
    """First-order and total indices with half widths, shape (4, P); NaN for a constant."""
    if np.ptp(values) <= 1e-12 * abs(values).max():
        return np.full((4, problem["num_vars"]), np.nan)
    # SALib takes a seed of 0 as none.
    options = {"calc_second_order": False, "conf_level": _LEVEL, "seed": seed + 1}
    found = analyse.analyze(problem, values, **options)
    return np.array([found[key] for key in ("S1", "ST", "S1_conf", "ST_conf")], float)
