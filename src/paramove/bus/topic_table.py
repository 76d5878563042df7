"""Topics of a workspace: the table `msgs/topics.yaml`.

    topics:
      lamp/state: {type: my_robot.Lamp, rate_hz: 10, profile: latched, frame: table}

They are topics as the library's are: checked at launch, recorded, forwarded to other hosts, shown.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Field

from paramove.bus.own_messages import library_messages, own_messages
from paramove.bus.topics import IMAGE_BYTES, NAME, OWN_TABLE, RESERVED_TYPES, Profile, Topic, constant_of
from paramove.documents import checked, nearest, raise_any, read_document
from paramove.workspace import Workspace

RESERVED = ("status/",)
"""Begins of names that the library gives itself."""


class TopicRow(BaseModel):
    """One topic of a workspace; see `Topic`."""

    model_config = ConfigDict(extra="forbid", strict=True, frozen=True, allow_inf_nan=False)

    type: str = Field(description="full name of the message, such as my_robot.Lamp or foxglove.PoseInFrame")
    rate_hz: Annotated[float, Field(gt=0.0, le=10_000.0)] | None = Field(
        default=None, description="nominal rate; null: messages come with events"
    )
    profile: Literal["latest", "queue", "latched"] = Field(
        default="queue",
        description="every message counts (queue), a late joiner gets the last one too (latched), or "
        "only the latest is of use",
    )
    frame: Annotated[str, Field(pattern=r"^[\w/]*$", max_length=100)] = Field(
        default="", description="coordinate frame of spatial content"
    )
    recorded: bool | None = Field(default=None, description="whether the recorder stores it; null: unless it is truth")
    max_bytes: int = Field(default=2**16, ge=1, le=IMAGE_BYTES, description="largest message")
    limit_hz: Annotated[float, Field(gt=0.0, le=10_000.0)] | None = Field(
        default=None, description="where messages come with events: more a second are dropped"
    )


class TopicTable(BaseModel):
    """The file."""

    model_config = ConfigDict(extra="forbid", strict=True, frozen=True)

    topics: dict[Annotated[str, Field(pattern=f"^{NAME}$", max_length=100)], TopicRow]


def own_topics(workspace: Workspace, library: Mapping[str, Topic]) -> tuple[Topic, ...]:
    """Topics of the workspace's own tables, in their order.

    Args:
        workspace: Its folders. library: Topics of the library, whose names are taken.

    Raises:
        DocumentError: With file, line and column of each fault, and what would have worked.
        InputError: A file cannot be read, or messages cannot be compiled.
    """
    found: dict[str, Topic] = {}
    for layer in workspace.layers:
        if (layer / OWN_TABLE).is_file():
            found = {topic.name: topic for topic in _topics_of(layer, library)} | found
    return tuple(found.values())


def _topics_of(layer: Path, library: Mapping[str, Topic]) -> list[Topic]:
    """Topics of the table in one folder."""
    document = read_document(layer / OWN_TABLE, "table of topics")
    table = checked(TopicTable, document, {"": "parts of lower-case letters, digits and '_', joined by '/'"})
    types = own_messages(layer)
    if any(row.type not in types for row in table.topics.values()):
        types = library_messages() | types
    found, faults = [], []
    taken = {constant_of(name): name for name in library}
    for name, row in table.topics.items():
        message = types.get(row.type)
        fault = _fault(name, row, library) or _same_constant(name, taken)
        if fault:
            faults.append(document.error(("topics", name), fault))
        if message is None:
            fault = f"there is no message '{row.type}'; {nearest(row.type, types)}"
            faults.append(document.error(("topics", name, "type"), fault))
        elif row.type in RESERVED_TYPES:
            fault = (
                f"{row.type} is for topics of the library alone: who may arm, stop and tell the time depends on them"
            )
            faults.append(document.error(("topics", name, "type"), fault))
        else:
            found.append(_topic(name, row, message))
    raise_any(faults)
    return found


def _fault(name: str, row: TopicRow, library: Mapping[str, Topic]) -> str:
    """Why a topic cannot be so; "" if it can."""
    is_truth = name.startswith("truth/")
    if name in library:
        return f"'{name}' is a topic of the library already; give yours another name"
    if name.startswith(RESERVED):
        return f"'{name}': names that begin with {RESERVED[0]} are given by the library"
    if is_truth and row.recorded:
        return f"'{name}' is ground truth, which only the simulation and evaluators know: it is not recorded"
    return ""


def _same_constant(name: str, taken: dict[str, str]) -> str:
    """Which other topic a node would call the same; "" if none, and then the name is taken from now on."""
    constant = constant_of(name)
    other = taken.setdefault(constant, name)
    if other == name:
        return ""
    return f"'{name}': nodes would call it topics.{constant}, as they call '{other}'; give it another name"


def _topic(name: str, row: TopicRow, message: type[Any]) -> Topic:
    is_recorded = not name.startswith("truth/") if row.recorded is None else row.recorded
    return Topic(
        name,
        message,
        row.rate_hz,
        Profile(row.profile),
        row.frame,
        is_recorded,
        row.max_bytes,
        row.limit_hz,
    )
