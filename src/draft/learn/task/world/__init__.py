"""World of a task: its robots and ground in mjlab, and their mirror image."""

from draft.learn.silence import start_mjlab

start_mjlab()
