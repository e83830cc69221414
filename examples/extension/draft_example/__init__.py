"""An extension of Draft: importing a module registers what its decorators name."""

from draft_example import bodies, falling, pad

__all__ = ["bodies", "falling", "pad"]
