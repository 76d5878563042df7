"""Messages of supervision: at the control socket, and between the launcher and the agents of other hosts.

Each is a line of JSON. See `paramove.documents.messages` for what all of them have in common.
"""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import Field

from paramove.documents import Identifier as Name
from paramove.documents import Lines, Message, MessageReader, Pid, Text
from paramove.hosts import PublicKey
from paramove.supervision.launch_schema import LaunchFile

# -- the control socket -----------------------------------------------------------------------------------------------


class Request(Message):
    """What a person requests of the launcher; `node` is left out for `list` only."""

    do: Literal["list", "stop", "start", "restart"]
    node: Name | None = None


class NodeRow(Message):
    """One node as its supervisor sees it."""

    node: Name
    state: Text
    sentence: Text
    pid: Pid | None
    restarts: int
    exit_reason: Text


class Answer(Message):
    """The launcher's answer: whether it does what was requested, or why not."""

    ok: bool
    sentence: Text
    nodes: list[NodeRow] = Field(default_factory=list)


# -- from the launcher to an agent ------------------------------------------------------------------------------------


class Begin(Message):
    """The run. Sent once, as the first message.

    Attributes:
        launch: The launch file, after overlays and settings.
        name: Of the launch file, for people.
        domain: Of the bus.
        clock: Node that publishes the clock.
        launcher: Name of the launcher's computer, for people.
        release: What has to be the same on all hosts.
        host: Name of the agent's host in the launch file.
        age_ns: How long ago the run began.
    """

    kind: Literal["begin"] = "begin"
    launch: LaunchFile
    name: Text
    domain: Text
    clock: Name | None
    launcher: Text
    release: Text
    host: Name
    age_ns: Annotated[int, Field(ge=0, le=2**62)] = 0


class Start(Message):
    """Start a node; the answer is `Started` or `Failed`."""

    kind: Literal["start"] = "start"
    node: Name


class End(Message):
    """SIGTERM to a node."""

    kind: Literal["end"] = "end"
    node: Name


class Kill(Message):
    """SIGKILL to a node."""

    kind: Literal["kill"] = "kill"
    node: Name


class Alive(Message):
    """The sender is alive; both sides send it twice a second."""

    kind: Literal["alive"] = "alive"


# -- from an agent to the launcher ------------------------------------------------------------------------------------


class Rejected(Message):
    """The agent does not take part, and ends: another release, a taken domain …"""

    kind: Literal["rejected"] = "rejected"
    reason: Text


class Ready(Message):
    """The agent waits for nodes to start; the folder of this part of the run."""

    kind: Literal["ready"] = "ready"
    folder: Text


class Started(Message):
    """A node's process runs."""

    kind: Literal["started"] = "started"
    node: Name
    pid: Pid


class Failed(Message):
    """A node's process could not be started."""

    kind: Literal["failed"] = "failed"
    node: Name
    reason: Text


class Ended(Message):
    """A node's process has ended; a negative code is the number of a signal."""

    kind: Literal["ended"] = "ended"
    node: Name
    code: Annotated[int, Field(ge=-64, le=255)]


class Halted(Message):
    """A node's process was stopped (SIGSTOP), or continued."""

    kind: Literal["halted"] = "halted"
    node: Name
    is_halted: bool


class Log(Message):
    """Further output of a node."""

    kind: Literal["log"] = "log"
    node: Name
    text: Lines


class About(Message):
    """What `paramove host` needs to know of another host."""

    kind: Literal["about"] = "about"
    release: Text
    key: PublicKey


MAX_LINE = 4_000_000
"""Of `Begin` and of `Answer`, which hold a whole run."""
MAX_LOG_LINE = 1_000_000
REQUESTS = MessageReader(Request, max_bytes=4096)
ANSWERS = MessageReader(Answer, max_bytes=MAX_LINE)
TO_AGENT: MessageReader[Any] = MessageReader(Begin, Start, End, Kill, Alive, max_bytes=MAX_LINE)
FROM_AGENT: MessageReader[Any] = MessageReader(
    Rejected, Ready, Started, Failed, Ended, Halted, Log, Alive, max_bytes=MAX_LOG_LINE
)
ABOUTS = MessageReader(About, max_bytes=4096)
