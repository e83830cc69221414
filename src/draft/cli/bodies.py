"""Which bodies a command works on: the designs that it names, or drawn ones of one robot."""

from __future__ import annotations

import sys
from collections import Counter
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from draft.cli.options import parse_values
from draft.errors import DraftError, Problem

if TYPE_CHECKING:
    from draft.design import Design
    from draft.explore.vary import Axis
    from draft.learn.quadruped import Quadruped

MOST = 4096  # bodies of one family
_BLOCK = 256  # drawn at once
_PATIENCE = 50  # drawn for each body that is asked for, and this many blocks at least
_LEAST_BLOCKS = 4


def members(
    words: Sequence[str],
    vary: Sequence[str] = (),
    bodies: int | None = None,
    values: Sequence[str] = (),
    seed: int = 0,
) -> tuple[list[Design], tuple[Quadruped, ...]]:
    """Designs of a family, and what learning needs of them; what was refused is told on stderr.

    Args:
        words: designs as `draft.design.references` reads them; one where they are varied.
        vary: what is varied, such as `thigh_length=0.2:0.4`; then designs are drawn until there
            are enough that pass.
        bodies: how many to draw.
        values: NAME=VALUE words that win over the designs' own.
        seed: of the draws.

    Raises:
        DraftError: a word that cannot be read, a design that cannot be trained, too few that pass.
    """
    from draft.design.references import open_designs
    from draft.learn.family import family

    if not words:
        raise DraftError(Problem("no design is named", None, "such as cheetah"))
    designs = open_designs(words)
    if values:
        table = parse_values(values)
        designs = [one.spec.resolve(dict(one.values), table) for one in designs]
    if vary:
        return _varied(designs, vary, bodies, values, seed)
    if bodies is not None:
        cause = "--bodies draws bodies, and nothing is varied"
        raise DraftError(Problem(cause, None, "give --vary NAME=LOW:HIGH, or leave --bodies away"))
    return designs, family(designs)


def _varied(
    designs: list[Design],
    vary: Sequence[str],
    bodies: int | None,
    values: Sequence[str],
    seed: int,
) -> tuple[list[Design], tuple[Quadruped, ...]]:
    """A family that is drawn around one design."""
    from draft.explore import vary as varied
    from draft.learn.family import joined
    from draft.learn.quadruped import check_topology

    if len(designs) != 1:
        cause = f"--vary varies one design, and {len(designs)} are named"
        raise DraftError(Problem(cause, None, "name one"))
    if bodies is None or not 1 <= bodies <= MOST:
        given = "is missing" if bodies is None else f"{bodies} is not from 1 to {MOST}"
        raise DraftError(Problem(f"--bodies {given}", None, "say how many to draw: --bodies 64"))
    if not 0 <= seed < 1 << 63:
        raise DraftError(Problem(f"--seed {seed} is not from 0 to 2**63 - 1", None, "such as 0"))
    check_topology(designs[0])
    axes = varied.parse(designs[0].spec, vary, parse_values(values))
    drawn = _Draws(designs[0], axes, seed)
    drawn.take(bodies)
    if drawn.refused:
        print(f"{bodies} bodies of {drawn.count} drawn; {drawn.words()}", file=sys.stderr)
    return [one for one, _ in drawn.found], joined([member for _, member in drawn.found])


class _Draws:
    """Designs drawn one after another, and why some did not pass.

    Attributes:
        found: those that passed.
        count: how many were drawn.
        refused: how many did not pass, by reason.
    """

    def __init__(self, base: Design, axes: tuple[Axis, ...], seed: int) -> None:
        self.base, self.axes, self.seed = base, axes, seed
        self.found: list[tuple[Design, Quadruped]] = []
        self.count = 0
        self.refused: Counter[str] = Counter()

    def take(self, bodies: int) -> None:
        """Draw until there are so many.

        Raises:
            DraftError: too few pass.
        """
        from draft.explore import sample

        fixed: dict[str, Any] = dict(self.base.values)
        most = max(_PATIENCE * bodies, _LEAST_BLOCKS * _BLOCK)
        for start in range(0, most, _BLOCK):
            drawn = sample.draw(self.axes, "sobol", most, self.seed, start, _BLOCK)
            block = self.base.spec.resolve(fixed, drawn)
            accepted = np.broadcast_to(np.asarray(block.accepted), _BLOCK)
            for row in range(_BLOCK):
                if len(self.found) == bodies:
                    return
                self.count += 1
                if accepted[row]:
                    values = {name: float(column[row]) for name, column in drawn.items()}
                    self.try_one(self.base.spec.resolve(fixed, values))
                else:
                    self.refused[_finding(block, row)] += 1
        if len(self.found) < bodies:
            cause = f"only {len(self.found)} of {self.count} drawn bodies pass, not {bodies}"
            remedy = f"{self.words()}; narrow what --vary gives, or ask for fewer --bodies"
            raise DraftError(Problem(cause, None, remedy))

    def try_one(self, design: Design) -> None:
        """Keep a design if it can be trained."""
        from draft.learn.quadruped import quadruped

        try:
            self.found.append((design, quadruped(design)))
        except DraftError as error:
            self.refused[error.problems[0].cause] += 1

    def words(self) -> str:
        """Why some did not pass, the most frequent reasons first."""
        reasons = (f"{count} {reason}" for reason, count in self.refused.most_common(3))
        return f"{self.refused.total()} did not pass: {', '.join(reasons)}"


def _finding(design: Design, row: int) -> str:
    """The first error of the filter for one of many designs."""
    for finding in design.findings:
        if finding.severity == "error" and np.broadcast_to(finding.mask, design.count or 1)[row]:
            return finding.id
    return "refused"
