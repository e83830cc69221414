"""The task of a training: its numbers, recipes, terms and environments."""
