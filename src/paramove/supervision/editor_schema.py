"""JSON Schemas of launch files and overlays, with which an editor completes and checks while one types.

A file names its schema in a comment: `# yaml-language-server: $schema=launch.schema.json`.
"""

from __future__ import annotations

import copy
import json
from typing import Any

from paramove.supervision.launch_schema import LaunchFile

DIALECT = "https://json-schema.org/draft/2020-12/schema"
FILES = {"launch": "launch.schema.json", "overlay": "overlay.schema.json"}
"""Kind of file -> its schema in the folder of the launch files."""


def editor_schema(kind: str) -> dict[str, Any]:
    """JSON Schema of a `launch` file or an `overlay`; raises KeyError for another kind."""
    return {"launch": _launch, "overlay": _overlay}[kind]()


def as_text(schema: dict[str, Any]) -> str:
    """The schema as it lies in the repository."""
    return json.dumps(schema, indent=2, ensure_ascii=False) + "\n"


def _launch() -> dict[str, Any]:
    schema = LaunchFile.model_json_schema()
    _without_titles(schema)
    schema["properties"]["nodes"]["additionalProperties"] = False  # names that do not fit the pattern
    return {"$schema": DIALECT, "title": "paramove launch file", **schema}


def _overlay() -> dict[str, Any]:
    """Of a launch file everything may be left out, and null removes what the file below says."""
    schema = copy.deepcopy(_launch())
    schema["title"] = "paramove overlay"
    schema["description"] = "Laid over a launch file: mappings merge, all else is replaced, null removes a key."
    del schema["properties"]["default_overlays"]
    nodes = schema["properties"]["nodes"]
    nodes.pop("minProperties", None)
    nodes["patternProperties"] = {
        name: {"anyOf": [node, {"type": "null"}]} for name, node in nodes["patternProperties"].items()
    }
    for model in (schema, *schema["$defs"].values()):
        model.pop("required", None)
        model["properties"] = {name: _or_null(field) for name, field in model["properties"].items()}
    return schema


def _or_null(field: dict[str, Any]) -> dict[str, Any]:
    about: dict[str, Any] = {key: field.pop(key) for key in ("description", "default") if key in field}
    choices = field.get("anyOf", [field])
    about["anyOf"] = choices if {"type": "null"} in choices else [*choices, {"type": "null"}]
    return about


def _without_titles(schema: Any) -> None:
    """Removes the titles that pydantic makes of the names of fields; they say nothing more."""
    if isinstance(schema, dict):
        if isinstance(schema.get("title"), str):
            del schema["title"]
        for value in schema.values():
            _without_titles(value)
    elif isinstance(schema, list):
        for value in schema:
            _without_titles(value)
