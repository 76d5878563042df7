"""Keys and values of a launch file, as pydantic models.

JSON Schemas of launch files and overlays, with which an editor completes and checks while you type.

A file names its schema in a comment: `# yaml-language-server: $schema=launch.schema.json`.
"""

from __future__ import annotations

import json
from typing import Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Field
from pydantic.json_schema import GenerateJsonSchema

from paramove.documents import Identifier

DIALECT = "https://json-schema.org/draft/2020-12/schema"
FILES = {"launch": "launch.schema.json", "overlay": "overlay.schema.json"}
"""Kind of file -> its schema in the folder of the launch files."""
Module = Annotated[str, Field(pattern=r"^[A-Za-z_]\w*(\.[A-Za-z_]\w*)*$", max_length=200)]
Seconds = Annotated[float, Field(ge=0.0, le=86_400.0)]


class _Checked(BaseModel):
    model_config = ConfigDict(extra="forbid", strict=True, frozen=True, allow_inf_nan=False)


class BusSettings(_Checked):
    """The bus of a run."""

    clock: Literal["simulated", "monotonic"] = Field(default="monotonic", description="the clock of the run")
    lockstep: bool = Field(
        default=False, description="simulated time advances only when all members have acknowledged a tick"
    )


class RestartBudget(_Checked):
    """So many restarts within so many seconds; one more and the node is given up."""

    restarts: int = Field(default=5, ge=0, le=1000, description="number of restarts")
    window_s: Seconds = Field(default=300.0, description="within this time")


class HostSettings(_Checked):
    """A computer of the run."""

    ssh: str | None = Field(default=None, description="its name for `ssh`; null: this computer")
    address: str | None = Field(
        default=None, description="of its relay, for the other hosts; null: as ssh finds it, or as they reach this one"
    )
    port: int = Field(default=47110, ge=1024, le=65534, description="TCP port of its relay; images take the next one")
    folder: str | None = Field(default=None, description="where paramove is started there; null: the home folder")
    command: str = Field(default="paramove", description="how paramove is started there")
    may_arm: bool | None = Field(
        default=None, description="whether a person may arm the robot from there; null: from the launcher's host only"
    )


class NodeSettings(_Checked):
    """One process of the run."""

    module: Module = Field(description="Python module that is started, such as nodes.camera")
    parameters: dict[str, Any] = Field(default_factory=dict, description="checked by the node's own Config")
    remaps: dict[str, str] = Field(default_factory=dict, description="topic name in the node: topic name on the bus")
    namespace: Identifier | Literal[""] = Field(
        default="", description="its topics, but those of all nodes, begin with this name; its files lie in that folder"
    )
    host: Identifier | None = Field(default=None, description="where it runs; null: on the host without `ssh`")
    restart: Literal["never", "on-failure", "always"] = Field(
        default="never", description="reaction to its end: none; a restart after a failure; a restart in any case"
    )
    backoff_s: Seconds = Field(default=0.5, description="wait before the first restart; doubles up to 30 s")
    budget: RestartBudget = Field(
        default=RestartBudget(), description="how often it is restarted before it is given up"
    )
    required: bool = Field(default=True, description="the run fails when this node ends before the run does")
    after: list[Identifier] = Field(default_factory=list, description="started when these nodes are ready")
    ready_timeout_s: Annotated[float, Field(gt=0.0, le=3600.0)] = Field(
        default=30.0, description="a node that is not ready within this time after its start has failed"
    )
    silent_timeout_s: Annotated[float, Field(gt=0.0, le=3600.0)] | None = Field(
        default=10.0,
        description="a node that was ready and publishes no status for this time is killed; null: never",
    )
    stopped_timeout_s: Annotated[float, Field(ge=0.0, le=3600.0)] | None = Field(
        default=1.0, description="a process that is stopped (SIGSTOP) for this time is killed; null: never"
    )
    restart_ends_run: bool = Field(
        default=False, description="once the node is back after a restart, the run ends with its ready message"
    )
    memory_limit_mb: Annotated[float, Field(gt=0.0)] | None = Field(
        default=None, description="a node that uses more is killed, and restarted according to `restart`"
    )
    priority: Literal["low", "normal", "high"] = Field(
        default="normal", description="priority on a busy processor; high only where the system allows it"
    )
    ends_run: bool = Field(default=False, description="the run succeeds when this node finishes with exit code 0")
    lockstep: bool = Field(default=True, description="if the bus runs in lockstep: whether time waits for this node")
    optional_topics: list[str] = Field(
        default_factory=list,
        description="subscribed topics that may lack a publisher, or patterns of them such as '*/key_points'; '*': all",
    )
    truth: bool = Field(
        default=False, description="gets the folder of ground truth; for the simulator and the judge only"
    )
    stop: Literal["first", "in-order", "last"] = Field(
        default="in-order", description="when it is stopped as the run ends"
    )


class IncludedFile(_Checked):
    """Another launch file, whose nodes get a namespace and names that begin with it."""

    launch: str = Field(description="name of the launch file")
    overlays: list[str] | None = Field(default=None, description="overlays applied to it; null: its default overlays")
    robot: str | None = Field(default=None, description="as `--robot`: folder of the robot's description")
    without: list[Identifier] = Field(default_factory=list, description="nodes of it that are left out")


class NeededFile(_Checked):
    """A file that a person makes before the first run. `{node.parameter}` stands for the value of a parameter."""

    file: str = Field(description="path of the file")
    about: str = Field(description="what is in it, for people")
    made_by: str = Field(description="command of paramove that makes it, with the person's help")


class LaunchFile(_Checked):
    """One application: its nodes and how they are restarted."""

    description: str = Field(default="", description="what the application does, for people")
    bus: BusSettings = Field(default=BusSettings(), description="clock and lockstep")
    hosts: dict[Identifier, HostSettings] = Field(
        default_factory=dict, description="computers of the run by their names, one of them without `ssh`"
    )
    include: dict[Identifier, IncludedFile] = Field(
        default_factory=dict, description="namespace: a launch file of which all nodes run in it"
    )
    nodes: dict[Identifier, NodeSettings] = Field(min_length=1, description="name of the node: how it runs")
    default_overlays: list[str] = Field(default_factory=list, description="overlays applied without --with")
    seed_parameters: list[str] = Field(default_factory=list, description="node.parameter that --seed sets")
    connections: list[str] = Field(
        default_factory=list,
        description="node.parameter that selects the hardware: --set accepts it only with an overlay, named by "
        "--with, that sets it",
    )
    needs: dict[Identifier, NeededFile] = Field(
        default_factory=dict, description="files that must be there; a terminal offers to make missing ones, in order"
    )
    headless: dict[str, Any] = Field(default_factory=dict, description="node.parameter: value that --headless sets")
    external: list[str] = Field(
        default_factory=list, description="topics that programs outside of the run publish, such as relocation/goal"
    )
    after_run: Module | None = Field(
        default=None, description="module called with the run folder when all nodes have ended"
    )
    after_run_of: dict[Identifier, Module] = Field(
        default_factory=dict, description="namespace: module called with the folder of its nodes after the run"
    )
    time_limit_s: Annotated[float, Field(gt=0.0)] | None = Field(
        default=None, description="wall-clock limit of the run"
    )

    @property
    def namespaces(self) -> tuple[str, ...]:
        """Those that nodes are in, in the order of the file."""
        return tuple(dict.fromkeys(node.namespace for node in self.nodes.values() if node.namespace))


def editor_schema(kind: str) -> dict[str, Any]:
    """JSON Schema of a `launch` file or an `overlay`; raises KeyError for another kind."""
    return {"launch": _launch, "overlay": _overlay}[kind]()


def schema_as_text(schema: dict[str, Any]) -> str:
    """The schema as stored in the repository."""
    return json.dumps(schema, indent=2, ensure_ascii=False) + "\n"


class _Untitled(GenerateJsonSchema):
    """Fields without the titles that pydantic makes of their names; they add nothing."""

    def field_title_should_be_set(self, schema: Any) -> bool:
        return False


def _launch() -> dict[str, Any]:
    schema = LaunchFile.model_json_schema(schema_generator=_Untitled)
    for model in (schema, *schema["$defs"].values()):
        del model["title"]  # the name of its class
    schema["properties"]["nodes"]["additionalProperties"] = False  # names that do not fit the pattern
    # What a file that includes others sets of a node may be laid over one of theirs, which has a module.
    needed = schema["$defs"]["NodeSettings"].pop("required")
    schema["if"] = {"not": {"required": ["include"]}}
    schema["then"] = {"properties": {"nodes": {"patternProperties": {"": {"required": needed}}}}}
    return {"$schema": DIALECT, "title": "paramove launch file", **schema}


def _overlay() -> dict[str, Any]:
    """The launch file's schema with every key optional; null removes a key of the file below."""
    schema = _launch()
    schema["title"] = "paramove overlay"
    del schema["if"], schema["then"]
    schema["description"] = "Laid over a launch file: mappings merge, all else is replaced, null removes a key."
    schema["properties"]["over"] = schema["properties"].pop("default_overlays")
    schema["properties"]["over"]["description"] = "overlays that are laid below this one, if they are not yet"
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
