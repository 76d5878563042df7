"""The folder of one run: effective launch file, node configurations, logs, outcome. Only its owner may read it."""

from __future__ import annotations

import datetime
import os
import time
from collections import Counter
from pathlib import Path
from typing import Any

from ruamel.yaml import YAML

from paramove.documents import checked_name, replacing
from paramove.supervision.launch_file import Launch
from paramove.supervision.launch_schema import NodeSettings


class RunFolder:
    """Layout of `runs/<YYYY-MM-DD_HH-MM-SS[-n]>/`.

    Attributes:
        path: The folder.
        begun_ns: When the run began, by the monotonic clock.
        starts: How often each node was started, by its name; in the memory of who starts them.
    """

    def __init__(self, path: Path) -> None:
        self.path, self.begun_ns = path, time.monotonic_ns()
        self.logs = path / "logs"
        self.starts = Counter[str]()

    @classmethod
    def create(cls, runs: Path, now: datetime.datetime) -> RunFolder:
        """Makes a new folder below `runs`, named by local time, and points the link `latest` to it.

        Raises OSError if `runs` cannot be written.
        """
        stamp = now.strftime("%Y-%m-%d_%H-%M-%S")
        runs.mkdir(parents=True, exist_ok=True)
        for number in range(1, 1000):
            path = runs / (stamp if number == 1 else f"{stamp}-{number}")
            try:
                path.mkdir()
            except FileExistsError:
                continue
            folder = cls(path)
            folder.logs.mkdir()
            _point_latest(runs, path)
            return folder
        raise FileExistsError(f"{runs / stamp} and 998 more exist already")

    def log(self, node: str) -> Path:
        """File with the node's standard output and standard error."""
        return self.logs / f"{checked_name(node, 'node')}.log"

    def of_namespace(self, namespace: str) -> Path:
        """Folder of the files of the nodes in a namespace: as that of a run that they would have for themselves."""
        return self.path / checked_name(namespace, "namespace") if namespace else self.path

    def config(self, node: str, namespace: str = "") -> Path:
        """File that the node gets as `--config`; in the folder of its namespace it has its name there."""
        name = node.removeprefix(f"{namespace}_") if namespace else node
        return self.of_namespace(namespace) / "nodes" / f"{checked_name(name, 'node')}.yaml"

    @property
    def events(self) -> Path:
        """File of the events of the nodes, a line of JSON each (see `EventLog`)."""
        return self.path / "events.jsonl"

    def write_effective(self, launch: Launch) -> None:
        """Writes `launch.yaml`: the launch file after overlays, settings and defaults."""
        _write(self.path / "launch.yaml", launch.file.model_dump(mode="json"))

    def write_configs(
        self, launch: Launch, bus_folder: Path, truth_folder: Path, clock: str | None = None, host: str | None = None
    ) -> None:
        """Writes the configuration of every node of one host.

        Args:
            launch: Names nodes and parameters.
            bus_folder: Of the sockets.
            truth_folder: Of the sockets of the ground truth; only nodes with `truth: true` get it.
            clock: Node that publishes the clock; in lockstep it gets the list of members.
            host: Name of the host; None for the nodes without one.
        """
        lockstep = launch.file.bus.lockstep
        for name, node in launch.file.nodes.items():
            if node.host != host:
                continue
            bus: dict[str, Any] = {
                "folder": str(bus_folder),
                "clock": launch.file.bus.clock,
                "lockstep": lockstep and (node.lockstep or name == clock),
            }
            if launch.file.bus.clock == "monotonic":
                bus["begun_ns"] = self.begun_ns
            if name == clock and lockstep:
                bus["members"] = [other for other, its in launch.file.nodes.items() if its.lockstep and other != clock]
            if node.truth:
                bus["truth_folder"] = str(truth_folder)
            if launch.file.namespaces:
                bus["namespaces"] = list(launch.file.namespaces)
            file = self.config(name, node.namespace)
            file.parent.mkdir(parents=True, exist_ok=True)
            write_node_file(file, name, node, bus, self.of_namespace(node.namespace))

    def write_run(self, facts: dict[str, Any]) -> None:
        """Writes `run.yaml`: facts of the run and, once it has ended, its outcome."""
        _write(self.path / "run.yaml", facts)


def _point_latest(runs: Path, path: Path) -> None:
    temporary = runs / f".latest-{os.getpid()}"
    temporary.unlink(missing_ok=True)
    temporary.symlink_to(path.name)
    temporary.replace(runs / "latest")


def write_node_file(path: Path, name: str, node: NodeSettings, bus: dict[str, Any], run_folder: Path) -> None:
    """Writes what a node gets as `--config`; see `paramove.bus.node`.

    Args:
        path: Of the file.
        name: Of the node.
        node: Its settings in the launch file.
        bus: Its view of the bus, without its remaps and its namespace.
        run_folder: Where it may write files.
    """
    if node.remaps:
        bus = bus | {"remaps": dict(node.remaps)}
    if node.namespace:
        bus = bus | {"namespace": node.namespace}
    _write(path, {"node": name, "bus": bus, "parameters": node.parameters, "run_folder": str(run_folder)})


def _write(path: Path, content: Any) -> None:
    yaml = YAML(typ="safe", pure=True)
    yaml.default_flow_style = False
    yaml.representer.ignore_aliases = lambda _: True  # readers reject them
    yaml.sort_base_mapping_type_on_output = False  # type: ignore[assignment]
    with replacing(path, 0o600) as unfinished, unfinished.open("w", encoding="utf-8") as file:
        yaml.dump(content, file)
