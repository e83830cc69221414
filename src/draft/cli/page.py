"""`draft page`: write a web page in which robots walk under live physics."""

from __future__ import annotations

import threading
import time
from typing import Annotated, Literal

import tyro

from draft.cli.interrupted import NOTHING, if_interrupted
from draft.cli.options import DesignArguments, OwnPolicies
from draft.errors import DraftError, counted
from draft.serving.addresses import address, check_free, check_port
from draft.serving.messages import HOST

_PORT = 8080


def main(
    designs: DesignArguments,
    /,
    *,
    vary: Annotated[
        tuple[str, ...],
        tyro.conf.arg(
            metavar="NAME=LOW:HIGH ...",
            help="Ranges of up to 5 numbers, which become sliders: thigh_length=0.2:0.3, or "
            "'thigh_length=*0.8:*1.2' for factors of each design's own number.",
            help_behavior_hint="(default: none)",
        ),
    ] = (),
    skill: Annotated[
        Literal["walk", "run", "push"], tyro.conf.arg(help="What the shipped policies are to show.")
    ] = "walk",
    policy: OwnPolicies = (),
    single: Annotated[
        bool,
        tyro.conf.arg(help="Write one file that opens from the disk, without a server or network."),
    ] = False,
    live: Annotated[
        bool,
        tyro.conf.arg(
            help="Serve the page on this machine: in it, every number and the files of the designs "
            "can be changed, with the filter's messages."
        ),
    ] = False,
    port: Annotated[
        int | None,
        tyro.conf.arg(
            metavar="N",
            help="Port of --live; 0 for any free one.",
            help_behavior_hint=f"(default: {_PORT})",
        ),
    ] = None,
    python: Annotated[
        bool,
        tyro.conf.arg(
            help="Let visitors change every number and file, without a server: a button in the "
            "page loads Python (11 MB) from a public host into their browser."
        ),
    ] = False,
    out: Annotated[
        str | None,
        tyro.conf.arg(
            metavar="DIR|FILE",
            help="Folder of the page; with --single the file.",
            help_behavior_hint="(default: page or page.html)",
        ),
    ] = None,
) -> int:
    """Write a web page in which designs walk side by side under live physics.

    Whoever opens it steers and pushes them, and sees masses, findings and the loads of their
    motors. With --vary, sliders change their bodies while they walk. A design that no policy
    drives stands, and the page says why.
    """
    start = time.perf_counter()
    if port is not None and not live:
        raise DraftError("--port needs --live: nothing is served", "add --live, or omit --port")
    check_port(place := _PORT if port is None else port)
    if live:
        check_free(HOST, place)
    from draft.browser.page import page

    with if_interrupted(NOTHING):
        written = page(designs, out, skill, single, policy, vary, live, python)
    first = written[0]
    print(first)
    print(f"{counted(len(designs), 'design')} in {time.perf_counter() - start:.1f} s")
    if live:
        from draft.browser.live import serve

        server = serve(written, skill, policy, place)
        print(f"open {address(HOST, server.port)} in a browser; Ctrl-C ends it", flush=True)
        try:
            threading.Event().wait()
        finally:
            server.close()
    if not single:
        print(f"show it: python -m http.server --directory {first.parent}")
    return 0
