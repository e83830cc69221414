"""Terms of the tasks for mjlab's managers, in mjlab's layout: one file per manager."""
