"""Choice of a stage: the stages of Draft and of installed extensions."""

from __future__ import annotations

from typing import TYPE_CHECKING, Literal

from draft.learn.task.stages import STAGES

if TYPE_CHECKING:
    StageChoice = str
else:
    StageChoice = Literal[tuple(STAGES)]  # tyro reads the names from the type.
