"""Suppress what libraries print while they load."""

from __future__ import annotations

import os
import warnings


def quiet() -> None:
    """Suppress Warp's report of every kernel, and warnings that no user of Draft can act upon."""
    os.environ.setdefault("MJLAB_WARP_QUIET", "1")
    # rsl-rl's exporter uses it on import.
    warnings.filterwarnings("ignore", message=".*torch.jit.script.*")


def start_mjlab() -> None:
    """Import mjlab before any module of Draft that uses it.

    While it loads, it imports `draft.learn.training.register` by its entry point, which uses them:
    packages with such modules call this first.
    """
    _start_warp()
    import mjlab  # noqa: F401


def _start_warp() -> None:
    """Start Warp without its line about a missing CUDA driver, which is no error on a CPU.

    Warp prints it from C, to the process's standard error; errors still raise.
    """
    try:
        import warp
    except ImportError:
        return
    if os.environ.get("MJLAB_WARP_QUIET") != "1":
        return
    warp.config.log_level = warp.LOG_ERROR
    kept, nothing = os.dup(2), os.open(os.devnull, os.O_WRONLY)
    try:
        os.dup2(nothing, 2)
        warp.init()
    finally:
        os.dup2(kept, 2)
        os.close(kept)
        os.close(nothing)
