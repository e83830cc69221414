"""Entry point of the `draft` command and of `python -m draft`."""

import sys
from collections.abc import Sequence

from draft.cli import main
from draft.offscreen import disable_drawing, prefer_offscreen


def run() -> int:
    """Run the command line; return the exit code."""
    _choose_rendering(sys.argv[1:])
    return main()


def _choose_rendering(arguments: Sequence[str]) -> None:
    """Choose how MuJoCo renders for a command, before it is imported."""
    command = [*arguments[:1]]
    draws = command in (["twin"], ["import"], ["play"], ["mcp"])
    if command == ["report"]:
        draws = any(one.lstrip("-").startswith("figures") for one in arguments)
    if draws or [*arguments[:2]] == ["study", "report"]:
        prefer_offscreen()
    elif command not in (["view"], ["study"], ["doctor"]):
        # The workers of a study choose for themselves, and `doctor` reports the user's choice.
        disable_drawing()


if __name__ == "__main__":
    sys.exit(run())
