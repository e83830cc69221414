"""The machine, its processes, and the engines that step the worlds."""
