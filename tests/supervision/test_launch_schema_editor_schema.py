"""The schemas that editors use: as committed, and in agreement with what is accepted and refused."""

import re
from pathlib import Path

import pytest
from typer.testing import CliRunner

from paramove.cli.main import build
from paramove.documents.positions import DocumentError, read_mapping
from paramove.supervision.launch_file import load, validated
from paramove.supervision.launch_schema import FILES, editor_schema, schema_as_text
from paramove.workspace import Workspace

ROOT = Path(__file__).parents[2]
LAUNCH = ROOT / "launch"
OURS = [*sorted(LAUNCH.glob("*.yaml")), *sorted(LAUNCH.glob("overlays/**/*.yaml"))]
KINDS = {"object": dict, "array": list, "string": str, "boolean": bool, "null": type(None)}


def kind_of(path):
    return "overlay" if "overlays" in path.relative_to(LAUNCH).parts else "launch"


def conforms(value, schema, root):
    """Whether a value conforms to a JSON Schema, as far as ours use the language."""
    unknown = set(schema) - KEYWORDS
    assert not unknown, f"this check does not know {unknown}"
    if "$ref" in schema and not conforms(value, root["$defs"][schema["$ref"].removeprefix("#/$defs/")], root):
        return False
    if "anyOf" in schema and not any(conforms(value, choice, root) for choice in schema["anyOf"]):
        return False
    if "not" in schema and conforms(value, schema["not"], root):
        return False
    if "if" in schema and conforms(value, schema["if"], root) and not conforms(value, schema["then"], root):
        return False
    if "enum" in schema and value not in schema["enum"]:
        return False
    if "type" in schema and not is_type(value, schema["type"]):
        return False
    if isinstance(value, str):
        return re.search(schema.get("pattern", ""), value) is not None and len(value) <= schema.get("maxLength", 10**6)
    if isinstance(value, bool) or value is None:
        return True
    if isinstance(value, int | float):
        low, over, high = (schema.get(key) for key in ("minimum", "exclusiveMinimum", "maximum"))
        return (low is None or value >= low) and (over is None or value > over) and (high is None or value <= high)
    if isinstance(value, list):
        return all(conforms(item, schema.get("items", {}), root) for item in value)
    return mapping_conforms(value, schema, root)


def mapping_conforms(value, schema, root):
    if not set(schema.get("required", ())) <= set(value) or len(value) < schema.get("minProperties", 0):
        return False
    patterns = schema.get("patternProperties", {})
    for key, item in value.items():
        rules = [schema["properties"][key]] if key in schema.get("properties", {}) else []
        rules += [rule for pattern, rule in patterns.items() if re.search(pattern, key)]
        if not rules and schema.get("additionalProperties", True) is not True:
            other = schema["additionalProperties"]
            rules = [other] if isinstance(other, dict) else []
            if other is False:
                return False
        if not all(conforms(item, rule, root) for rule in rules):
            return False
    return True


def is_type(value, kind):
    if kind in ("integer", "number"):
        return isinstance(value, int if kind == "integer" else int | float) and not isinstance(value, bool)
    return isinstance(value, KINDS[kind])


KEYWORDS = {"$schema", "title", "description", "default", "$defs", "$ref", "anyOf", "enum", "type", "pattern"}
KEYWORDS |= {"maxLength", "minimum", "exclusiveMinimum", "maximum", "items", "required", "properties"}
KEYWORDS |= {"additionalProperties", "patternProperties", "propertyNames", "minProperties", "not", "if", "then"}


@pytest.mark.parametrize("kind", FILES)
def test_committed_schema_is_that_of_the_code(kind):
    """To renew it: `paramove launch --schema launch > launch/launch.schema.json`, and so for `overlay`."""
    assert (LAUNCH / FILES[kind]).read_text(encoding="utf-8") == schema_as_text(editor_schema(kind))


@pytest.mark.parametrize("kind", FILES)
def test_command_prints_the_schema(kind):
    answer = CliRunner().invoke(build("launch"), ["launch", "--schema", kind])
    assert answer.exit_code == 0
    assert answer.stdout == schema_as_text(editor_schema(kind))


def test_command_names_the_kinds_that_there_are():
    answer = CliRunner().invoke(build("launch"), ["launch", "--schema", "nodes"])
    assert answer.exit_code == 2
    assert "launch, overlay" in answer.stderr


@pytest.mark.parametrize("path", OURS, ids=lambda path: path.stem)
def test_file_names_its_schema_and_conforms(path):
    first = path.read_text(encoding="utf-8").splitlines()[0]
    found = re.fullmatch(r"# yaml-language-server: \$schema=(\S+)", first)
    assert found, f"{path} does not begin with its schema"
    assert (path.parent / found[1]).resolve() == LAUNCH / FILES[kind_of(path)]
    schema = editor_schema(kind_of(path))
    assert conforms(read_mapping(path.read_text(encoding="utf-8"), str(path)).data, schema, schema)


BAD = [
    "node: {}",
    "nodes: {}",
    "nodes: {a: {}}",
    "nodes: {a: {module: m, restart: on-failur}}",
    "nodes: {a: {module: m, required: yes}}",
    "nodes: {a: {module: m, backoff_s: -1}}",
    "nodes: {a: {module: m, budget: {restart: 3}}}",
    "nodes: {a: {module: m, budget: {restarts: 1.5}}}",
    "nodes: {a: {module: m, after: b}}",
    "nodes: {A b: {module: m}}",
    "nodes: {a: {module: ../m}}",
    "{nodes: {a: {module: m}}, time_limit_s: 0}",
    "{nodes: {a: {module: m}}, bus: simulated}",
]


@pytest.mark.parametrize("text", BAD)
def test_schema_refuses_what_the_launcher_refuses(text):
    document = read_mapping(text, "bad.yaml")
    with pytest.raises(DocumentError):
        validated(document)
    schema = editor_schema("launch")
    assert not conforms(document.data, schema, schema)


def test_a_node_that_may_lie_over_an_included_one_needs_no_module():
    schema = editor_schema("launch")
    nodes = {"left_reacher": {"parameters": {"tasks": []}}}
    assert conforms({"include": {"left": {"launch": "dynamixel_arm"}}, "nodes": nodes}, schema, schema)
    assert not conforms({"nodes": nodes}, schema, schema)


def test_an_overlay_may_leave_out_remove_and_lie_over_others_but_has_no_default_ones():
    schema = editor_schema("overlay")
    assert conforms({}, schema, schema)
    assert conforms({"nodes": {"a": None, "b": {"restart": None}}, "after_run": None}, schema, schema)
    assert conforms({"over": ["sim"]}, schema, schema)
    assert not conforms({"default_overlays": ["sim"]}, schema, schema)
    assert not conforms({"nodes": {"a": {"restrat": "never"}}}, schema, schema)


def test_every_key_is_explained():
    schema = editor_schema("launch")
    node = schema["$defs"]["NodeSettings"]["properties"]
    unexplained = [key for key, field in (*schema["properties"].items(), *node.items()) if "description" not in field]
    assert unexplained == []


def test_defaults_of_the_schema_are_those_of_the_code():
    launch = load(Workspace.at(LAUNCH.parent), "rule_learning", ["sim"]).file
    fresh = type(launch.nodes["camera"])(module="nodes.camera")
    for key, field in editor_schema("launch")["$defs"]["NodeSettings"]["properties"].items():
        if "default" in field and field["default"] is not None and key != "budget":
            assert getattr(fresh, key) == field["default"]
