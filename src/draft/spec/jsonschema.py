"""JSON Schemas of the files, for editors that complete and check YAML."""

from __future__ import annotations

import json
from pathlib import Path

from draft.errors import DraftError, Problem
from draft.spec import schema
from draft.spec.primitives.root import RootFile
from draft.spec.words import Model

SCHEMAS = Path(__file__).resolve().parent / "schemas"
FILES: dict[str, type[Model]] = {
    "parameters": schema.ParametersFile,
    "tree": schema.TreeFile,
    "root": RootFile,
    "design": schema.DesignFile,
}


def schema_text(name: str) -> str:
    """JSON Schema of one file: "parameters", "tree", "root" or "design"."""
    made = FILES[name].model_json_schema()
    document = {"$schema": "https://json-schema.org/draft/2020-12/schema", **made}
    return json.dumps(document, indent=1) + "\n"


def write_schemas(folder: Path) -> list[Path]:
    """Write all schemas as NAME.json; return their paths.

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
            Problem(f"cannot write '{folder}': {error.strerror}", None, "choose another folder")
        ) from None
    return paths


if __name__ == "__main__":
    write_schemas(SCHEMAS)
