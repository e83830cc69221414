"""Designs for one policy: one, a family of one topology, or draws around one of them."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from draft.design.findings import first_error
from draft.design.references import open_designs
from draft.errors import DraftError, Problem
from draft.learn.bodies.legged import (
    LeggedRobot,
    check_family,
    legged_robot,
    with_one_template,
)
from draft.learn.bodies.legged_batch import legged_robots
from draft.learn.bodies.topology import check_topology
from draft.model.folder import design_text, design_texts
from draft.values import Array

if TYPE_CHECKING:
    from pathlib import Path

    from draft.design import Design
    from draft.spec import Spec
    from draft.variation.axes import Vary

_BLOCK = 1024  # Designs resolved at once.
_DRAWS_PER_BODY = 50  # Draws before giving up; at least one block.
_REPORTED = 5  # Refused designs that are reported one by one.


@dataclass(frozen=True)
class Bodies:
    """Designs that train one policy in one simulation.

    Attributes:
        spec: spec of the first design.
        members: the robots as learning uses them, in order; each name is unique.
        texts: text of the design file of each.
        note: number of draws that were refused, with the reasons; "" if none were.
    """

    spec: Spec
    members: tuple[LeggedRobot, ...]
    texts: tuple[str, ...]
    note: str = ""


def open_bodies(
    references: Sequence[Design | Spec | str | Path],
    vary: Vary = (),
    count: int | None = None,
    values: Mapping[str, float | str | None] | None = None,
    seed: int = 0,
) -> Bodies:
    """Open the designs of a policy, or draw them.

    Args:
        references: designs as `draft.design.references.open_designs` takes them; exactly one if
            `vary` is given.
        vary: ranges, see `draft.variation.axes.parse`; designs are drawn from them until `count`
            pass the filter and can be trained.
        count: number of designs to draw; only with `vary`.
        values: parameter values that override those of the designs.
        seed: seed of the draws.

    Raises:
        DraftError: a reference cannot be read, a design cannot be trained, or too few draws pass.
    """
    given = dict(values or {})
    if not references:
        raise DraftError("no design is named", "name one, such as cheetah")
    designs = open_designs(references)
    if given:
        designs = [one.spec.resolve(dict(one.values), given) for one in designs]
    if len(vary):
        return _drawn(designs, vary, count, given, seed)
    if count is not None:
        cause = "`bodies` draws designs, but nothing is varied"
        raise DraftError(cause, "add `vary` NAME=LOW:HIGH, or omit `bodies`")
    texts = tuple(design_text(design) for design in designs)
    return Bodies(designs[0].spec, family(designs), texts)


def _drawn(
    designs: list[Design],
    vary: Vary,
    count: int | None,
    values: Mapping[str, float | str | None],
    seed: int,
) -> Bodies:
    """Draw a family around one design."""
    from draft.variation import axes

    if len(designs) != 1:
        cause = f"`vary` varies one design, but {len(designs)} are named"
        raise DraftError(cause, "name one")
    if count is None:
        remedy = "give the number of designs to draw, such as `bodies=64`"
        raise DraftError("`bodies` is missing", remedy)
    from draft.variation import sampling

    parsed = axes.parse(designs[0].spec, vary, values)
    most = _most(count)

    def draw(start: int, size: int) -> Mapping[str, Array]:
        return sampling.draw(parsed, "sobol", most, seed, start, size)

    return draw_bodies(designs[0], draw, count)


def draw_bodies(
    base: Design,
    draw: Callable[[int, int], Mapping[str, Array]],
    count: int,
    sound: Callable[[Design], NDArray[np.bool_]] | None = None,
) -> Bodies:
    """Draw designs until enough of them pass the filter and can be trained.

    Args:
        base: one design, whose values are replaced by those drawn.
        draw: values by name, shape (size,), from the index of the first draw and their number.
        count: number of bodies.
        sound: which of N designs are wanted, shape (N,); None for all.

    Raises:
        DraftError: too few pass.
    """
    check_topology(base)
    draws = _Draws(base, draw, sound)
    draws.draw(count)
    note = (
        f"{'1 body' if count == 1 else f'{count} bodies'} of {draws.count} drawn; {draws.reasons()}"
        if draws.refused
        else ""
    )
    return Bodies(base.spec, joined(draws.members), tuple(draws.texts), note)


def _most(count: int) -> int:
    """Draws before giving up on a number of bodies."""
    return max(_DRAWS_PER_BODY * count, _BLOCK)


def family(designs: Sequence[Design]) -> tuple[LeggedRobot, ...]:
    """Return the quadrupeds of designs that can share one simulation.

    Args:
        designs: single designs, or Designs of many.

    Raises:
        DraftError: there is none; some are refused or are no quadrupeds, each with its reason; or
            they have different topologies.
    """
    singles = [one for design in designs for one in ([design] if design.count is None else design)]
    if len(singles) == 1:
        return (legged_robot(singles[0]),)
    members: list[LeggedRobot] = []
    problems: list[Problem] = []
    for number, design in enumerate(singles, start=1):
        try:
            members.append(legged_robot(design))
        except DraftError as error:
            reasons = "; ".join(problem.cause for problem in error.problems)
            cause = f"design {number} of the family, {design.name}:{design.label}: {reasons}"
            problems.append(Problem(cause, None, error.problems[0].remedy))
    if len(problems) > _REPORTED:
        more = Problem(f"and {len(problems) - _REPORTED} more of {len(singles)} designs")
        problems = [*problems[:_REPORTED], more]
    if problems:
        raise DraftError(problems)
    return joined(members)


def joined(members: Sequence[LeggedRobot]) -> tuple[LeggedRobot, ...]:
    """Return quadrupeds as one family: with unique names, and of one topology.

    Raises:
        DraftError: there is none, or they have different topologies.
    """
    if not members:
        raise DraftError("a family needs a design", "name one or several")
    check_family(members)
    count = Counter(member.name for member in members)
    taken, renamed = set(count), []
    last: Counter[str] = Counter()
    for member in members:
        name = member.name
        while count[member.name] > 1 and name in taken:
            last[member.name] += 1
            name = f"{member.name}-{last[member.name]}"
        taken.add(name)
        renamed.append(replace(member, name=name))
    return with_one_template(renamed)


class _Draws:
    """Designs drawn one after another, and the reasons why some were refused.

    Attributes:
        members: quadrupeds that pass the filter and can be trained.
        texts: text of the design file of each.
        count: number of designs drawn.
        refused: number of designs refused, by reason.
    """

    def __init__(
        self,
        base: Design,
        draw: Callable[[int, int], Mapping[str, Array]],
        sound: Callable[[Design], NDArray[np.bool_]] | None,
    ) -> None:
        self.base, self._draw, self._sound = base, draw, sound
        self.members: list[LeggedRobot] = []
        self.texts: list[str] = []
        self.count = 0
        self.refused: Counter[str] = Counter()

    def draw(self, count: int) -> None:
        """Draw until `count` designs are accepted.

        Raises:
            DraftError: too few pass.
        """
        fixed = dict(self.base.values)
        for start in range(0, _most(count), _BLOCK):
            drawn = dict(self._draw(start, _BLOCK))
            self._accept(self.base.spec.resolve(fixed, drawn), count)
            if len(self.members) == count:
                return
        cause = f"only {len(self.members)} of {self.count} drawn bodies pass, not {count}"
        remedy = f"{self.reasons()}; narrow the ranges of `vary`, or ask for fewer `bodies`"
        raise DraftError(cause, remedy)

    def _accept(self, block: Design, count: int) -> None:
        """Accept designs of a block, in order, until there are `count`."""
        accepted = np.broadcast_to(np.asarray(block.accepted), _BLOCK)
        sound = np.ones(_BLOCK, bool) if self._sound is None else self._sound(block)
        rows = np.flatnonzero(accepted & sound)
        found: dict[int, LeggedRobot | DraftError] = {}
        kept: list[int] = []
        for row in range(_BLOCK):
            if len(self.members) == count:
                break
            self.count += 1
            if not accepted[row]:
                self.refused[first_error(block.findings, row)] += 1
                continue
            if not sound[row]:
                self.refused["motors too weak to stand"] += 1
                continue
            if row not in found:
                # As many as may be missing: most of those that pass can be trained.
                found |= legged_robots(block, rows[rows >= row][: count - len(self.members)])
            one = found[row]
            if isinstance(one, DraftError):
                self.refused[one.problems[0].cause] += 1
            else:
                self.members.append(one)
                kept.append(row)
        self.texts += design_texts(block, np.array(kept, dtype=np.intp))

    def reasons(self) -> str:
        """Most frequent reasons of refusal, in words."""
        reasons = (f"{count} {reason}" for reason, count in self.refused.most_common(3))
        return f"{self.refused.total()} did not pass: {', '.join(reasons)}"
