"""New robots, as copies of shipped ones."""

from __future__ import annotations

import os
import re
import shutil
from pathlib import Path

from draft.errors import DraftError, SpecError, suggest
from draft.files import new_folder
from draft.spec.field_types import MAX_NAME, NAME_PATTERN
from draft.spec.jsonschema import write_schemas
from draft.spec.load import FOLDERS, load, shipped
from draft.spec.problems import NAME_RULE

SCHEMA_FOLDER = ".schema"
_MODELINE = re.compile(r"(\$schema=).*/([a-z]+\.json)")


def new_robot(folder: Path, like: str) -> Path:
    """Copy a shipped robot to a new folder, whose name becomes its name.

    Its named designs are left out. All laws are those of the robot, so that the copy weighs the
    same. The folder has the schemas, so that editors complete and check its files anywhere.

    Raises:
        SpecError: the name is invalid, or there is no such shipped robot.
        DraftError: the folder exists or cannot be written.
    """
    if like not in shipped():
        raise SpecError(f"there is no shipped robot '{like}'", suggest(like, shipped()))
    if not re.fullmatch(NAME_PATTERN, folder.name) or len(folder.name) > MAX_NAME:
        raise SpecError(f"'{folder.name}' is not a robot's name", NAME_RULE)
    if folder.name in shipped():
        raise SpecError(f"'{folder.name}' is a shipped robot", "choose another name")
    if os.path.lexists(folder):
        raise DraftError(f"'{folder}' exists; it is kept", "choose another name")
    with new_folder(folder, "choose another place", replace=False) as temporary:
        _fill(temporary, folder.name, like)
        load(temporary)
    return folder


def _fill(target: Path, name: str, like: str) -> None:
    source = FOLDERS[like]
    write_schemas(target / SCHEMA_FOLDER)
    for file in load(source).files:
        if not file.endswith(".yaml"):  # laws, a table, parts
            (target / file).parent.mkdir(parents=True, exist_ok=True)
            shutil.copyfile(source / file, target / file)
    for path in sorted(source.rglob("*.yaml")):
        relative = path.relative_to(source)
        if relative.parts[0] == "designs":
            continue  # named designs of another robot: the user's begin empty
        up = "../" * (len(relative.parts) - 1)
        text = path.read_text(encoding="utf-8")
        text = _MODELINE.sub(rf"\g<1>{up}{SCHEMA_FOLDER}/\2", text)
        if relative.name == "parameters.yaml":
            text = re.sub(rf"^name: {like}$", f"name: {name}", text, count=1, flags=re.MULTILINE)
        (target / relative).parent.mkdir(parents=True, exist_ok=True)
        (target / relative).write_text(text, encoding="utf-8")
