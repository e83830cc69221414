"""Options of every page that a command serves."""

from __future__ import annotations

from typing import Annotated

import tyro

HostOption = Annotated[str, tyro.conf.arg(help="Address of the page; a public one needs --token.")]
PortOption = Annotated[int, tyro.conf.arg(help="Port of the page; 0 for any free one.")]
TokenOption = Annotated[
    str | None,
    tyro.conf.arg(
        metavar="SECRET",
        help="Secret of 16 or more letters, digits, - and _, without which nothing is shown.",
        help_behavior_hint="(default: none, on this machine only)",
    ),
]
