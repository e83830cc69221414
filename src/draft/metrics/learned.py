"""Metrics of behaviour: what a design does with a trained policy that observes its design.

They are measured by roll-outs in simulation (`learned_metrics`), which take less than a second
for each design, and are NaN for designs outside the policy's region of validity. `LEARNED` lists
them; `METRICS` has those that need no policy.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from operator import attrgetter
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from draft.design import Design
from draft.errors import DraftError
from draft.metrics.capabilities import MEASURED
from draft.metrics.registry import LEARNED, Better, Metric, find
from draft.values import Array, Value

if TYPE_CHECKING:
    from draft.learn.measuring.learned_metrics import Learned

PREFIX = "learned."
REPLICAS, SECONDS = 3, 6.0
_SOURCE = "roll-outs of a policy; definitions of arXiv 2609.38405 (docs/learning.md)"


def _learned(name: str, unit: str, doc: str, formula: str, better: Better) -> None:
    def inside_only(found: Learned) -> Array:
        return np.where(found.inside, getattr(found, name), np.nan)

    function = attrgetter(name) if unit == "bool" else inside_only
    metric = Metric(
        PREFIX + name, unit, doc, formula, _SOURCE, better, "policy", function, batch=True
    )
    LEARNED[metric.name] = metric


for _name, _one in MEASURED.items():
    _learned(_name, _one.unit, _one.text, _one.formula, _one.better)
_learned(
    "top_speed_error",
    "m/s",
    "Half of the 90 % interval of the mean speed of the roll-outs at the top speed.",
    "t(0.95, n - 1) std(v) / sqrt(n) at the command of the top speed",
    "less",
)
_learned(
    "inside",
    "bool",
    "In the policy's region of validity; no for designs that are refused or cannot walk.",
    "each feature within the range of those that the policy was trained with",
    "more",
)


def of_policy(
    design: Design,
    names: Iterable[str] | None = None,
    policy: str | Path | None = None,
    *,
    known: str = "",
    rows: NDArray[np.intp] | None = None,
    replicas: int = REPLICAS,
    seconds: float = SECONDS,
    seed: int = 0,
    outside: bool = False,
) -> dict[str, Value]:
    """Metrics of behaviour of one design or of N, by name.

        >>> design = draft.load("quadruped").resolve("cheetah")
        >>> draft.metrics.of_policy(design, ["learned.top_speed"])  # doctest: +SKIP
        {'learned.top_speed': 5.131}

    Args:
        design: one design, or N.
        names: names of metrics in `LEARNED`; None for all.
        policy: folder of a run or ONNX file; None for the policy of quadrupeds that ships.
        known: digest that the policy has to have, see `digest`; "" for any.
        rows: which of N designs, increasing; None for all that the filter accepts.
        replicas: roll-outs of each design at each speed and kick.
        seconds: duration of a roll-out [s].
        seed: seed of everything random.
        outside: whether designs outside the policy's region of validity have values too.

    Returns:
        A float per metric, or an array of shape (N,) for N designs; NaN outside the policy's region
        of validity, unless `outside`, and for designs that are refused, not in `rows`, or that
        cannot walk. There `learned.inside` is 0.0; it is 1.0 and another is NaN where the roll-outs
        give none, as of a robot that falls.

    Raises:
        DraftError: an unknown metric, the policy cannot be read or does not drive the robot, or the
            extra `learn` is not installed.
    """
    from draft.learn.measuring import learned_metrics as learned
    from draft.learn.measuring.policies import open_source

    chosen = [find(name) for name in (LEARNED if names is None else names)]
    for metric in chosen:
        if metric.needs != "policy":
            cause = f"'{metric.name}' needs no policy"
            raise DraftError(cause, "use draft.metrics.of_model")
    source = open_source(policy)
    if known and source.digest != known:
        cause = f"the policy of {source.name} has changed since this began"
        remedy = "give a file, which 'draft play' writes of a run: `policy=FILE`"
        raise DraftError(cause, remedy)
    found, _ = learned.of_designs(
        source, design, rows, replicas=replicas, seconds=seconds, seed=seed
    )
    shown = replace(found, inside=np.ones_like(found.inside)) if outside else found
    values: dict[str, Array] = {
        one.name: np.asarray(one.function(found if one.unit == "bool" else shown), np.float64)
        for one in chosen
    }
    if design.count is None:
        return {name: float(value[0]) for name, value in values.items()}
    return dict(values)


def digest(policy: str, design: Design) -> str:
    """Digest of a policy: equal digests give equal metrics.

    Args:
        policy: folder of a run or ONNX file; "" for the policy that ships.
        design: a design that it is to drive; the filter may have refused it.

    Raises:
        DraftError: it cannot be read, does not observe its design or does not drive this one.
    """
    from draft.learn.bodies.legged import legged_robot
    from draft.learn.measuring.policies import open_source
    from draft.model.model import preview

    source = open_source(policy or None)
    source.match(legged_robot(design, preview(design)))
    return source.digest
