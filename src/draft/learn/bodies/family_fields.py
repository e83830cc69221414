"""Compiled numbers of the designs of a family."""

from __future__ import annotations

from functools import lru_cache
from typing import TYPE_CHECKING

from draft.learn.bodies.payload import model_spec
from draft.model.batch_text import read_fields

if TYPE_CHECKING:
    import mujoco
    from numpy.typing import NDArray

    from draft.learn.bodies.legged import LeggedRobot


@lru_cache(maxsize=1)
def family_fields(
    members: tuple[LeggedRobot, ...],
) -> tuple[mujoco.MjModel, dict[str, NDArray]]:
    """Model of the first design, and fields in which one differs from it; see `read_fields`.

    The last family is kept, as several parts of a simulation need it.

    Raises:
        DraftError: a design differs from the first in more than numbers.
    """
    load = (lambda row: model_spec(members[row]).compile()) if members[0].block else None
    return read_fields([m.text for m in members], [m.name for m in members], load)
