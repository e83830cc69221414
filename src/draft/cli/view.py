"""`draft view`: show a robot in a window or in the browser."""

# pyright: reportAttributeAccessIssue=false
# (MuJoCo's compiled modules carry no types.)
from __future__ import annotations

import contextlib
import warnings
from typing import Annotated

import mujoco
import tyro

import draft.mujoco_log  # noqa: F401 - before anything is simulated
from draft.cli.display.verdict import print_verdict
from draft.cli.options import DesignArgument, DesignName, PortOption, Values, open_design
from draft.errors import DraftError
from draft.extras import need
from draft.serving.addresses import address, check_port
from draft.serving.server import Server


def main(
    reference: DesignArgument,
    /,
    design: DesignName = None,
    values: Values = (),
    web: Annotated[bool, tyro.conf.arg(help="Show it in the browser, on this machine only.")] = (
        False
    ),
    port: PortOption = 8080,
) -> int:
    """Show a robot in MuJoCo's viewer, or in the browser with --web."""
    check_port(port)
    resolved, _ = open_design(reference, design, values)
    print_verdict(resolved)
    model = resolved.build().scene()
    data = mujoco.MjData(model)
    reset(model, data)
    if web:
        view_in_browser(model, data, port)
    else:
        view_in_window(model, data)
    return 0


def reset(model: mujoco.MjModel, data: mujoco.MjData) -> None:
    """Reset a robot to its home pose."""
    mujoco.mj_resetDataKeyframe(model, data, 0)
    mujoco.mj_forward(model, data)


def view_in_window(model: mujoco.MjModel, data: mujoco.MjData) -> None:
    """Open MuJoCo's own viewer and wait until it is closed.

    Raises:
        DraftError: there is no screen.
    """
    import glfw
    import mujoco.viewer

    # Without a screen MuJoCo's viewer ends the process, so check first.
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        ready = glfw.init()
    if not ready:
        raise DraftError("there is no screen for MuJoCo's viewer", "add --web to use a browser")
    mujoco.viewer.launch(model, data)


def view_in_browser(model: mujoco.MjModel, data: mujoco.MjData, port: int) -> None:
    """Serve a page on 127.0.0.1 until interrupted.

    Raises:
        DraftError: the extra is not installed, or the port is taken.
    """
    need("mjviser", "view")
    with contextlib.closing(Server("127.0.0.1", port)) as server:
        print(f"open {address('127.0.0.1', server.port)} in a browser; Ctrl-C ends it", flush=True)
        server.show(model, data, reset_fn=reset)
