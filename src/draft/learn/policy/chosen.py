"""Policy of a design: its own that ships, or the one that ships for its legs."""

from __future__ import annotations

from typing import TYPE_CHECKING

from draft.learn.policy import policy as shipped

if TYPE_CHECKING:
    from draft.design import Design
    from draft.learn.policy.policy import Policy


def policy(design: str | Design, skill: str = "walk") -> Policy:
    """Load the policy that ships for a design, with the joints and motors of the design.

        >>> walk = draft.policy("cheetah")
        >>> walk
        Policy('quadruped:cheetah', stage base, 48 observations, 12 actions)
        >>> walk(np.zeros(48)).shape
        (12,)
        >>> draft.policy("humanoid")
        Policy('humanoid', stage any, 99 observations, 29 actions)

    Args:
        design: the design or its name; a robot of your own by its folder.
        skill: "walk", "run", "climb", "push", or "machine": it walks, runs and survives kicks with
            what sensors give.

    Raises:
        DraftError: there is no such design or skill, or no policy that ships drives its joints.
    """
    shipped.check_skill(skill)
    if isinstance(design, str):
        if shipped.has(design, skill):
            return shipped.policy(design, skill)
        from draft.design.references import open_design

        design = open_design(design)
    from draft.learn.policy.validity import fit
    from draft.model.model import preview

    return fit(preview(design), skill).policy
