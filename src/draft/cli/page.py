"""`draft page`: write a web page in which robots walk under live physics."""

from __future__ import annotations

import time
from typing import Annotated, Literal

import tyro

from draft.cli.interrupted import NOTHING, if_interrupted
from draft.cli.options import DesignArguments, OwnPolicies
from draft.errors import counted


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
    from draft.browser.page import page

    with if_interrupted(NOTHING):
        first, *_ = page(designs, out, skill, single, policy, vary)
    print(first)
    print(f"{counted(len(designs), 'design')} in {time.perf_counter() - start:.1f} s")
    if not single:
        print(f"show it: python -m http.server --directory {first.parent}")
    return 0
