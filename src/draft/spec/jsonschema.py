"""JSON Schemas of the files, with which editors complete and check YAML."""

from __future__ import annotations

import json
from pathlib import Path

from draft.errors import DraftError
from draft.spec import schema
from draft.spec.field_types import Model
from draft.spec.primitives.root import RootFile

SCHEMAS = Path(__file__).resolve().parent / "schemas"
FILES: dict[str, type[Model]] = {
    "parameters": schema.ParametersFile,
    "tree": schema.TreeFile,
    "root": RootFile,
    "design": schema.DesignFile,
}


def schema_text(name: str) -> str:
    """JSON Schema of one file: "parameters", "tree", "root" or "design"."""
    model = schema.tree_file() if name == "tree" else FILES[name]
    document = {"$schema": "https://json-schema.org/draft/2020-12/schema"}
    document |= model.model_json_schema()
    return json.dumps(document, indent=1) + "\n"


def write_schemas(folder: Path) -> list[Path]:
    """Write all schemas as NAME.json and return their paths.

    Raises:
        DraftError: the folder cannot be written.
    """
    paths = []
    try:
        folder.mkdir(parents=True, exist_ok=True)
        for name in FILES:
            path = folder / f"{name}.json"
            path.write_text(schema_text(name), encoding="utf-8")
            paths.append(path)
    except OSError as error:
        raise DraftError(
            f"cannot write '{folder}': {error.strerror}", "choose another folder"
        ) from None
    return paths


if __name__ == "__main__":
    write_schemas(SCHEMAS)
