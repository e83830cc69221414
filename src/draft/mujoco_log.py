"""MuJoCo's warnings go to the console alone, not to a file in the user's folder.

MuJoCo appends every warning, such as that of an unstable simulation, to MUJOCO_LOG.TXT in the
working directory. Importing this module turns that off for the process, on all of MuJoCo's
threads and for every library that shares it; a log file that someone has named is kept.
"""

from __future__ import annotations

import mujoco

DEFAULT_FILE = "MUJOCO_LOG.TXT"


def keep_off_disk() -> None:
    """Stop MuJoCo from writing its default log file."""
    config = mujoco.MjLogConfig.get()
    if config.logfile == DEFAULT_FILE:
        config.logto_file = False
        config.set()


keep_off_disk()
