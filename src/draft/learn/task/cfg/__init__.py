"""Environments of the four stages, for one quadruped or for several of one topology.

Stage `base` walks on gently uneven ground at a commanded velocity, with pushes. The other stages
start from its policy, and each raises one thing: the commanded speed, the height of the ground, or
the size of the pushes. Numbers and their sources are in `draft.learn.task.config`.
"""

from draft.learn.engine.silence import start_mjlab

start_mjlab()

from draft.learn.task.cfg.environment import environment  # noqa: E402
from draft.learn.task.cfg.task import GroundKind, Task  # noqa: E402

__all__ = ["GroundKind", "Task", "environment"]
