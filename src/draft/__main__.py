"""The `draft` command as a process of its own; `python -m draft` is the same."""

import sys
from collections.abc import Sequence

from draft.cli import main
from draft.offscreen import disable_drawing, prefer_offscreen


def run() -> int:
    """Run the command line."""
    _choose_rendering(sys.argv[1:])
    return main()


def _choose_rendering(arguments: Sequence[str]) -> None:
    """Say how MuJoCo draws for a command, if it does."""
    command = [*arguments[:1]]
    if command in (["twin"], ["import"], ["play"]) or [*arguments[:2]] == ["study", "report"]:
        prefer_offscreen()
    elif command not in (["view"], ["study"]):
        # What a study starts chooses for itself.
        disable_drawing()


if __name__ == "__main__":
    sys.exit(run())
