"""Keep what libraries say while they load out of a command's output; call it before mjlab comes."""

from __future__ import annotations

import os
import warnings


def quiet() -> None:
    """Silence Warp's report of every kernel, and warnings that no user of Draft can act upon."""
    os.environ.setdefault("MJLAB_WARP_QUIET", "1")
    # rsl-rl's exporter uses it on import.
    warnings.filterwarnings("ignore", message=".*torch.jit.script.*")
    try:
        import warp
    except ImportError:
        return
    warp.config.log_level = warp.LOG_ERROR
