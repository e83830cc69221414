"""Row of the progress of a training, and its columns that worlds of several bodies fill."""

from __future__ import annotations

Row = dict[str, float]
# Relative tracking error of a family's bodies: the mean, and that of the worst cell of them.
BODIES_ERROR, BODIES_WORST = "bodies/error", "bodies/worst"
