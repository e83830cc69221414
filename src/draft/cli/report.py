"""`draft report`: write one page about a few designs."""

from __future__ import annotations

import json as json_
import time
from pathlib import Path
from typing import Annotated

import tyro

from draft.cli.interrupted import NOTHING, if_interrupted
from draft.cli.options import DesignArguments, JsonOutput, OwnPolicies
from draft.errors import DraftError, counted
from draft.offscreen import prefer_offscreen


def main(
    designs: DesignArguments,
    /,
    out: Annotated[Path, tyro.conf.arg(metavar="FILE", help="The page.")] = Path("report.html"),
    figures: Annotated[
        Path | None,
        tyro.conf.arg(
            metavar="DIR",
            help="Folder for the figures as PNG and PDF.",
            help_behavior_hint="(default: no files)",
        ),
    ] = None,
    walk: Annotated[
        bool,
        tyro.conf.arg(
            help="Let the robots of the page walk, with the shipped policies. A design that none "
            "of them drives stands, and the page says why."
        ),
    ] = False,
    policy: OwnPolicies = (),
    json: JsonOutput = False,
) -> int:
    """Write one HTML page about a few designs, which opens without a network."""
    start = time.perf_counter()
    prefer_offscreen()
    from draft.design.references import open_designs
    from draft.learn.policy.reduced import open_any
    from draft.reporting.report import write_report
    from draft.reporting.subjects import comparison, subjects, table

    if policy and not walk:
        raise DraftError("--policy is for robots that walk", "add --walk")
    with if_interrupted(NOTHING):
        found = subjects(open_designs(designs), walk, [open_any(file) for file in policy])
        paths = write_report(found, out, figures)
    if json:
        record = table(found, comparison(found)) | {"out": [str(path) for path in paths]}
        print(json_.dumps(record, indent=2))
    else:
        print("\n".join(map(str, paths)))
        print(f"{counted(len(found), 'design')} in {time.perf_counter() - start:.1f} s")
    return 0
