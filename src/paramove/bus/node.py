"""The entry of every node: `main(run, SUBSCRIBES, PUBLISHES, Config)`.

The supervisor starts a node as `python -m nodes.<name> --config FILE`. The file is YAML:

    node: colour_tracker
    bus: {folder: /run/user/1000/paramove/default, clock: simulated, lockstep: true}
    parameters: {…}              # what the node's Config holds
    run_folder: runs/2026-11-21_10-00-00

Exit codes: 0 ended well or by SIGTERM or SIGINT; 2 wrong arguments; 66 a file or device is missing; 70 the node raised
an exception or ended after it had published that it failed; 75 a topic or the bus folder is held by another process; 78
the configuration, or a file that it names, is wrong.
"""

from __future__ import annotations

import argparse
import logging
import os
import sys
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from typing import Any, ClassVar, TypeVar

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from paramove.bus.bus import Bus
from paramove.bus.endpoint import BusFolderError, TopicTakenError
from paramove.bus.live_parameters import LiveParameters
from paramove.bus.log_format import log_to_stderr
from paramove.bus.settings import BusSettings
from paramove.bus.signals import handle_signals
from paramove.bus.topics import Topic
from paramove.documents import InputError, OldNames, exit_codes, findings, read_document

_log = logging.getLogger(__name__)

START_VARIABLE = "PARAMOVE_NODE_START"
"""In the environment of a node: how often the launcher has started it in this run, this time included."""
LAST_STATUS_TIMEOUT_S = 1.0
"""How long a node that has failed waits for a subscriber to receive the reason."""


class NodeConfig(OldNames):
    """Parameters of a node; each node derives its own. Unknown keys are rejected.

    `CHANGEABLE` names those that a person may change while the node runs: the node reads them from its configuration
    whenever it uses them.
    """

    model_config = ConfigDict(extra="forbid", frozen=True)

    CHANGEABLE: ClassVar[tuple[str, ...]] = ()


class NodeFile(BaseModel):
    """The file behind `--config`."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    node: str
    bus: BusSettings
    parameters: dict[str, Any] = Field(default_factory=dict)
    run_folder: Path = Path()


Config = TypeVar("Config", bound=NodeConfig)


class ConfigurationError(InputError):
    """The node's file is missing or wrong; the text is printed for the user."""


def is_first_start() -> bool:
    """Whether the launcher has started this process's node for the first time in its run.

    The launcher counts the starts itself, so that no deleted file makes a restarted node a new one. False where no
    launcher has started the process.
    """
    return os.environ.get(START_VARIABLE) == "1"


def read_node_file(path: Path, config_type: type[Config]) -> tuple[NodeFile, Config]:
    """Reads and checks the file behind `--config`; raises ConfigurationError that names the wrong keys."""
    try:
        file = NodeFile.model_validate(read_document(path, "configuration of a node", ConfigurationError).data)
    except ValidationError as error:
        raise ConfigurationError(f"{path}: {findings(error)}") from error
    try:
        return file, config_type.model_validate(file.parameters)
    except ValidationError as error:
        raise ConfigurationError(f"{path}: parameters: {findings(error)}") from error


def publish_each(bus: Bus, published: Sequence[Topic], messages: Sequence[Iterable[Any]]) -> None:
    """Publishes all messages of the first topic, then those of the second, and so on; see `Bus.publish`."""
    for topic, some in zip(published, messages, strict=True):
        for message in some:
            bus.publish(topic, message)


def main(
    run: Callable[[Bus, Config], None],
    subscribes: Sequence[Topic],
    publishes: Sequence[Topic],
    config_type: type[Config],
    visitor: bool = False,
    every_namespace: bool = False,
) -> None:
    """Runs a node and exits the process.

    Args:
        run: Loops over `bus.events` or `bus.latest` and returns when they end.
        subscribes: Topics that the node subscribes to.
        publishes: Topics that it publishes.
        config_type: Its parameters.
        visitor: Whether other nodes are ready without being connected with it; see `Bus.connect`.
        every_namespace: Whether it subscribes to and publishes, where it is in no namespace itself, these topics of all
            namespaces. Its loop then names no topics: `bus.events()`.
    """
    parser = argparse.ArgumentParser(description=sys.modules[run.__module__].__doc__)
    parser.add_argument("--config", type=Path, required=True, help="YAML file written by the supervisor")
    arguments = parser.parse_args()
    try:
        file, config = read_node_file(arguments.config, config_type)
    except ConfigurationError as error:
        sys.stderr.write(f"{error}\n")
        sys.exit(exit_codes.CONFIGURATION)
    log_to_stderr(file.node)
    try:
        live = LiveParameters(file.node, config, config.CHANGEABLE)
        if every_namespace:
            subscribes, publishes = map(file.bus.in_every_namespace, (subscribes, publishes))
        bus = Bus(file.node, file.bus, subscribes, publishes, file.run_folder)
    except (TopicTakenError, BusFolderError) as error:
        _log.error("%s", error)
        sys.exit(exit_codes.TEMPORARY)
    except ValueError as error:
        _log.error("%s", error)
        sys.exit(exit_codes.CONFIGURATION)
    with bus:
        if config.CHANGEABLE:
            bus.follow(live)
        code = _run(run, bus, config, visitor)
        if code != exit_codes.OK:
            bus.wait_for_subscriber(LAST_STATUS_TIMEOUT_S)
        sys.exit(code)


def _run(run: Callable[[Bus, Config], None], bus: Bus, config: Config, visitor: bool) -> int:
    """Calls `run` with the signals tied to the bus; returns the exit code."""
    handle_signals(bus.stop)
    try:
        bus.starting("starting")
        bus.connect(visitor=visitor)
        run(bus, config)
    except InputError as error:
        _log.error("%s", error)
        bus.failed(str(error))
        return error.exit_code
    except Exception as error:
        _log.exception("the node raised an exception")
        over = f" (over {bus.taken_up})" if bus.taken_up else ""
        bus.failed(f"{type(error).__name__}: {error}{over}")
        return exit_codes.NODE_FAILED
    if bus.has_failed:
        return exit_codes.NODE_FAILED
    if not bus.has_ended:
        bus.ended("stopped on request" if bus.stopped else "finished")
    return exit_codes.OK
