"""`draft studio`: a robot in the browser, with every number under a slider."""

from __future__ import annotations

import threading
import webbrowser
from pathlib import Path
from typing import Annotated

import tyro

from draft.cli.options import DesignName, check_folder
from draft.cli.page_options import HostOption, PortOption, TokenOption
from draft.extras import need
from draft.serving.addresses import address, check_port
from draft.spec import load


def main(
    spec: Annotated[
        tyro.conf.Positional[str],
        tyro.conf.arg(metavar="SPEC", help="A shipped robot's name, or a robot's folder."),
    ] = "quadruped",
    /,
    design: DesignName = None,
    host: HostOption = "127.0.0.1",
    port: PortOption = 8080,
    token: TokenOption = None,
    designs: Annotated[
        str | None,
        tyro.conf.arg(
            metavar="DIR",
            help="Folder for designs that are saved.",
            help_behavior_hint="(default: designs of the robot's folder; SPEC_designs if shipped)",
        ),
    ] = None,
    out: Annotated[str, tyro.conf.arg(help="Folder for models that are exported.")] = "out",
    no_browser: Annotated[bool, tyro.conf.arg(help="Do not open a browser.")] = False,
) -> int:
    """Design a robot in the browser: sliders, masses, trends, findings, at once."""
    check_port(port)
    check_folder(out)
    check_folder(designs)
    need("viser", "view")
    from draft.serving.guard import check_address
    from draft.studio.library import Library
    from draft.studio.server import Studio

    check_address(host, token)
    library = Library(load(spec), Path(designs) if designs else None)
    studio = Studio(library, design or "", host, port, token, Path(out))
    page = address(host, studio.port, token)
    print(f"open {page} in a browser; Ctrl-C ends it", flush=True)
    if not no_browser:
        webbrowser.open(page)
    try:
        threading.Event().wait()
    finally:
        studio.close()
    return 0
