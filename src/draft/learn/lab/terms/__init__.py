"""Terms of the tasks for mjlab's managers: rewards, observations, commands, events, endings."""
