"""`draft studio`: design a robot in the browser, with a slider for every number."""

from __future__ import annotations

import threading
import webbrowser
from pathlib import Path
from typing import Annotated

import tyro

from draft.cli.options import (
    DESIGN_FORMS,
    DesignName,
    HostOption,
    OwnPolicies,
    PortOption,
    TokenOption,
    Values,
    check_folder,
    parse_values,
)
from draft.design.references import find_design
from draft.errors import DraftError, suggest
from draft.extras import need
from draft.serving.addresses import address, check_port


def main(
    reference: Annotated[
        tyro.conf.Positional[str],
        tyro.conf.arg(metavar="[DESIGN]", help=f"The robot: {DESIGN_FORMS}."),
    ] = "quadruped",
    /,
    design: DesignName = None,
    values: Values = (),
    walk: Annotated[
        bool, tyro.conf.arg(help="Let the robot walk at once, with the policy that fits it best.")
    ] = False,
    policy: OwnPolicies = (),
    host: HostOption = "127.0.0.1",
    port: PortOption = 8080,
    token: TokenOption = None,
    designs: Annotated[
        str | None,
        tyro.conf.arg(
            metavar="DIR",
            help="Folder for saved designs.",
            help_behavior_hint="(default: designs of the robot's folder; ROBOT_designs if shipped)",
        ),
    ] = None,
    out: Annotated[str, tyro.conf.arg(metavar="DIR", help="Folder for exported models.")] = "out",
    no_browser: Annotated[bool, tyro.conf.arg(help="Do not open a browser.")] = False,
) -> int:
    """Design a robot in the browser: sliders, with masses, trends and findings at once."""
    check_port(port)
    check_folder(out)
    check_folder(designs, "designs")
    need("viser", "view")
    from draft.learn.policy.reduced import open_any
    from draft.learn.policy.validity import check_drives
    from draft.model.model import preview
    from draft.serving.guard import check_address
    from draft.spec.payload import with_payload
    from draft.studio import fields
    from draft.studio.library import Library
    from draft.studio.server import Studio

    check_address(host, token)
    choice = find_design(reference, design)
    changes = parse_values(values)
    spec = with_payload(choice.spec, changes)  # Its sliders appear if a payload is asked for.
    library = Library(spec, Path(designs) if designs else None)
    if isinstance(choice.design, Path):
        cause = f"'{choice.design}' is a file, and the studio starts from named designs"
        remedy = f"copy it to {library.folder}, and pass its name without .yaml"
        raise DraftError(cause, remedy)
    known = fields.names(spec)
    for name in changes:
        if name not in known:
            cause = f"--set {name}: there is no such parameter or number of an actuator class"
            raise DraftError(cause, suggest(name, known, "fields"))
    policies = [open_any(file) for file in policy]
    if policies:
        check_drives(policies, preview(spec.resolve()))
    name = choice.design or ""
    studio = Studio(library, name, host, port, token, Path(out), changes, walk, policies)
    page = address(host, studio.port, token)
    print(f"open {page} in a browser; Ctrl-C ends it", flush=True)
    if not no_browser:
        webbrowser.open(page)
    try:
        threading.Event().wait()
    finally:
        studio.close()
    return 0
