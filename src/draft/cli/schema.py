"""`draft schema`: print or write the JSON Schemas of the files."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

import tyro

from draft.cli.options import check_folder
from draft.errors import DraftError
from draft.spec.jsonschema import schema_text, write_schemas


def main(
    file: Annotated[
        tyro.conf.Positional[Literal["parameters", "tree", "root", "design", "all"]],
        tyro.conf.arg(
            metavar="{parameters,tree,root,design,all}",
            help="File whose schema is printed; all needs --out.",
        ),
    ] = "all",
    /,
    out: Annotated[
        str | None,
        tyro.conf.arg(
            metavar="DIR",
            help="Write all schemas to this folder.",
            help_behavior_hint="(default: print one)",
        ),
    ] = None,
) -> int:
    """Print or write the JSON Schemas of the files."""
    check_folder(out)
    if out is not None:
        for path in write_schemas(Path(out)):
            print(path)
        return 0
    if file == "all":
        raise DraftError(
            "no schema is named",
            "'draft schema tree' prints one (parameters, tree, root, design); "
            "'draft schema --out DIR' writes all",
        )
    print(schema_text(file), end="")
    return 0
