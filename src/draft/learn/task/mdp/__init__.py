"""Terms of the tasks for mjlab's managers, in mjlab's layout: one file per manager."""

from draft.learn.silence import start_mjlab

start_mjlab()
