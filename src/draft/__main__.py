"""The `draft` command as a process of its own; `python -m draft` is the same."""

import sys

from draft.cli import main
from draft.cli.offscreen import choose_rendering


def run() -> int:
    """Run the command line."""
<<<<<<< HEAD
    # On import MuJoCo loads the libraries that it renders with, a fifth of the time of a build.
    command = sys.argv[1:2]
    if command in (["twin"], ["play"]):
        prefer_offscreen()
    elif command != ["view"]:
        os.environ.setdefault("MUJOCO_GL", "disabled")
=======
    choose_rendering(sys.argv[1:])
>>>>>>> study
    return main()


if __name__ == "__main__":
    sys.exit(run())
