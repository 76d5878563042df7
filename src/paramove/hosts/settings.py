"""What one host's relay forwards, and to whom."""

from __future__ import annotations

from pathlib import Path

from pydantic import BaseModel, ConfigDict, Field


class Peer(BaseModel):
    """Another host of the run.

    Attributes:
        address: Of its relay, an IP address or a name.
        port: Of its relay; images take the next one.
        key: Its public key.
        wants: Topics that it gets from here: name on the bus -> row of the table.
        gives: Topics that come from there, likewise.
        outside: Those of them that no node publishes, but a person or program there: nodes here have to be connected
            before the first message.
        members: Nodes there that lockstep waits for.
        commands: Whether the arm's commands come from there, so that the arm stops when the link is lost.
    """

    model_config = ConfigDict(extra="forbid", frozen=True)

    address: str
    port: int
    key: str
    wants: dict[str, str] = Field(default_factory=dict)
    gives: dict[str, str] = Field(default_factory=dict)
    outside: tuple[str, ...] = ()
    members: tuple[str, ...] = ()
    commands: bool = False


class RelaySettings(BaseModel):
    """Parameters of a relay.

    Attributes:
        address, port: Where it listens.
        peers: The other hosts, by their names in the launch file.
        keys: Folder of keys; default: the user's.
        members: Nodes of this host that lockstep waits for.
        clock_from: In lockstep, the host of the clock if it is another one: answers to ticks go there.
    """

    model_config = ConfigDict(extra="forbid", frozen=True)

    address: str
    port: int
    peers: dict[str, Peer] = Field(min_length=1)
    keys: Path | None = None
    members: tuple[str, ...] = ()
    clock_from: str | None = None
