"""The tables of the launch file's reference, and the picture of one, are those of the code."""

import json

import pytest

from paramove.supervision import application
from paramove.supervision.graph import graph_of
from paramove.supervision.graph_svg import as_svg
from paramove.supervision.launch_file import load
from paramove.supervision.launch_schema import editor_schema
from paramove.workspace import Workspace
from tests.docs.markdown import ROOT, table

PAGE = ROOT / "docs" / "reference" / "launch_file.md"


def rows_of(schema, model):
    """Key, type, default, meaning of every key."""
    rows = []
    for key, field in model["properties"].items():
        default = json.dumps(field["default"]) if "default" in field else "–"
        if "$ref" in field:
            default = "see there"
        if key in model.get("required", ()):
            default = "required"
        elif default == "–":
            default = "{}" if "object" in type_of(field) or "mapping" in type_of(field) else "[]"
        rows.append([key, type_of(field), default, field["description"].replace("|", "or")])
    return rows


def type_of(field):
    if "anyOf" in field:
        return " or ".join(dict.fromkeys(type_of(choice) for choice in field["anyOf"]))
    if "enum" in field:
        return ", ".join(field["enum"])
    if "$ref" in field:
        return "mapping"
    kind = {"object": "mapping", "string": "text", "array": "list", "boolean": "true or false"}
    text = kind.get(field["type"], field["type"])
    bounds = {"minimum": "≥", "exclusiveMinimum": ">", "maximum": "≤"}
    limits = [f"{sign} {field[key]:g}" for key, sign in bounds.items() if key in field]
    return " ".join([text, ", ".join(limits)]).strip()


SCHEMA = editor_schema("launch")
OF_A_NODE = SCHEMA["then"]["properties"]["nodes"]["patternProperties"][""]
"""What a node needs in a file that includes no other."""
MODELS = {
    "launch file": SCHEMA,
    "node": SCHEMA["$defs"]["NodeSettings"] | OF_A_NODE,
    "included file": SCHEMA["$defs"]["IncludedFile"],
    "bus": SCHEMA["$defs"]["BusSettings"],
    "budget": SCHEMA["$defs"]["RestartBudget"],
    "host": SCHEMA["$defs"]["HostSettings"],
    "needed file": SCHEMA["$defs"]["NeededFile"],
}


def test_picture_is_that_of_the_launch_file():
    """To renew it: `paramove graph rule_learning --format svg --output docs/images/rule_learning.svg`."""
    launch = load(Workspace.at(ROOT), "rule_learning")
    picture = as_svg(graph_of(launch, application.check(launch, Workspace.at(ROOT))))
    assert (ROOT / "docs" / "images" / "rule_learning.svg").read_text(encoding="utf-8") == picture


@pytest.mark.parametrize("name", MODELS)
def test_table_is_that_of_the_code(name):
    assert table(PAGE, name) == [[cell.strip().strip("`") for cell in row] for row in rows_of(SCHEMA, MODELS[name])]
