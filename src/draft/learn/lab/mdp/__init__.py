"""Terms of the tasks for mjlab's managers, in mjlab's layout: a file for each manager."""
