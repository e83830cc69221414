"""The `draft` command as a process of its own; `python -m draft` is the same."""

import sys

from draft.cli import main
from draft.cli.offscreen import choose_rendering


def run() -> int:
    """Run the command line."""
    choose_rendering(sys.argv[1:])
    return main()


if __name__ == "__main__":
    sys.exit(run())
