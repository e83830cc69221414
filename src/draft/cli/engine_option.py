"""The option that names the physics engine; apart from the others, which load MuJoCo."""

from __future__ import annotations

from typing import Annotated, Literal

import tyro

EngineOption = Annotated[
    Literal["auto", "native", "warp"],
    tyro.conf.arg(
        help="Physics: native MuJoCo on the CPU, or MuJoCo Warp; auto is native without a GPU."
    ),
]
