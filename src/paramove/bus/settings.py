"""Settings of a process for the bus that it joins."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Literal

from pydantic import BaseModel, ConfigDict, Field

from paramove.bus.topics import Topic, in_all, name_on_bus
from paramove.documents import InputError, checked_name


def default_folder(domain: str | None = None) -> Path:
    """Bus folder of a domain: `$XDG_RUNTIME_DIR/paramove/<domain>`, else `/tmp/paramove-<uid>/<domain>`.

    Args:
        domain: Default: $PARAMOVE_DOMAIN, else "default".

    Raises InputError for a domain that cannot be the name of a folder.
    """
    domain = checked_name(domain or os.environ.get("PARAMOVE_DOMAIN") or "default", "domain")
    runtime = os.environ.get("XDG_RUNTIME_DIR", "")
    if runtime.startswith("/") and os.access(runtime, os.W_OK | os.X_OK):
        return Path(runtime) / "paramove" / domain
    return Path(tempfile.gettempdir()) / f"paramove-{os.getuid()}" / domain


def running_folder(domain: str | None = None) -> Path:
    """Bus folder of a domain; raises InputError if there is none, since nothing runs there."""
    folder = default_folder(domain)
    if not folder.is_dir():
        message = f"no bus at {folder}: nothing is running in this domain; start it with `paramove launch`"
        raise InputError(message, missing=True)
    return folder


def nodes_in(folder: Path) -> list[str]:
    """Nodes that publish, or have published, a status in a bus folder."""
    return sorted(path.name.removeprefix("status.") for path in folder.glob("status.*") if path.suffix != ".lock")


def lock_of(folder: Path) -> Path:
    """Lock file that the launcher of a run holds for its bus folder."""
    return folder.with_name(f"{folder.name}.lock")


class BusSettings(BaseModel):
    """One process's view of the bus.

    Attributes:
        folder: Of the sockets.
        clock: `monotonic`: real time. `simulated`: the time of the topic `clock`.
        lockstep: The simulator waits for this process at every tick. Only with the simulated clock.
        truth_folder: Of the sockets of topics under `truth/`; given to the simulator and evaluators only.
        remaps: Topic name in the node -> topic name on the bus.
        namespace: That the node is in, of which its other topics are; "" for none.
        namespaces: All of the run.
        members: Names of all nodes that time waits for in lockstep. Read by the simulator only.
        begun_ns: When the run began, by its clock.
    """

    model_config = ConfigDict(extra="forbid", frozen=True)

    folder: Path
    clock: Literal["monotonic", "simulated"] = "monotonic"
    lockstep: bool = False
    truth_folder: Path | None = None
    remaps: dict[str, str] = Field(default_factory=dict)
    namespace: str = ""
    namespaces: tuple[str, ...] = ()
    members: tuple[str, ...] = ()
    begun_ns: int = 0

    def folder_of(self, topic: Topic) -> Path:
        """Folder of the topic's socket; raises ValueError for ground truth whose folder this process does not get."""
        if not topic.truth:
            return self.folder
        if self.truth_folder is None:
            raise ValueError(
                f"topic {topic.name} is ground truth: only the simulator and evaluators are given bus.truth_folder"
            )
        return self.truth_folder

    def name_of(self, topic: Topic) -> str:
        """Name of the topic on the bus."""
        return name_on_bus(topic.name, self.remaps, self.namespace)

    def in_every_namespace(self, rows: Sequence[Topic]) -> Sequence[Topic]:
        """The topics, and for a node outside of namespaces those of each namespace, too, each once."""
        return rows if self.namespace else in_all(self.namespaces, rows)

    def check_namespaces(self, names: Iterable[str]) -> None:
        """Raises InputError if the run does not have one of these namespaces."""
        if strange := sorted(set(names) - set(self.namespaces)):
            present = ", ".join(self.namespaces) or "none"
            raise InputError(f"this run has no namespace {', '.join(strange)}; it has {present}")
