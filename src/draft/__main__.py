"""The `draft` command as a process of its own; `python -m draft` is the same."""

import os
import sys

from draft.cli import main


def run() -> int:
    """Run the command line."""
    # On import MuJoCo loads the libraries that it renders with, a fifth of the time of a build.
    if "view" not in sys.argv[1:2]:
        os.environ.setdefault("MUJOCO_GL", "disabled")
    return main()


if __name__ == "__main__":
    sys.exit(run())
