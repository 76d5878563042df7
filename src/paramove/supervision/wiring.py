"""Checks, before anything starts, that the nodes of a launch file fit together."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from paramove.bus.topics import CLOCK
from paramove.supervision.interfaces import Interface, InterfaceError, read_interface, source_of
from paramove.supervision.launch_file import Launch, nearest


def read_interfaces(launch: Launch, workspace: Path) -> dict[str, Interface]:
    """Interface of every node; raises LaunchFileError at the first `module` or `after_run` that does not exist."""
    interfaces = {}
    for name, node in launch.file.nodes.items():
        try:
            interfaces[name] = read_interface(node.module, workspace)
        except InterfaceError as error:
            raise launch.error(("nodes", name, "module"), str(error)) from error
    if launch.file.after_run is not None:
        try:
            source_of(launch.file.after_run, workspace)
        except InterfaceError as error:
            raise launch.error(("after_run",), str(error)) from error
    return interfaces


def check_wiring(launch: Launch, interfaces: Mapping[str, Interface]) -> None:
    """Checks topics, parameters and access to ground truth.

    Every topic that is heard has a speaker, no topic has two, only nodes with `truth: true` know a truth topic, and
    every parameter is one that its node takes.

    Raises LaunchFileError at the place in the launch file.
    """
    _check_parameters(launch, interfaces)
    bus = launch.file.bus
    if bus.clock == "simulated" and clock_speaker(interfaces) is None:
        raise launch.error(("bus", "clock"), "the clock is simulated, but no node of this launch file says it")
    if bus.lockstep and bus.clock != "simulated":
        raise launch.error(("bus", "lockstep"), "lockstep needs 'clock: simulated'")
    speakers: dict[str, str] = {}
    for name, interface in interfaces.items():
        for topic in interface.says:
            said = _on_bus(launch, name, topic.name)
            if said in speakers:
                raise launch.error(
                    ("nodes", name),
                    f"'{name}' and '{speakers[said]}' both say {said}; a topic has one speaker (remap one of them)",
                )
            speakers[said] = name
    for name, interface in interfaces.items():
        for topic in (*interface.hears, *interface.says):
            if topic.truth and not launch.file.nodes[name].truth:
                raise launch.error(("nodes", name), f"'{name}' uses {topic.name} but has no 'truth: true'")
        for topic in interface.hears:
            heard = _on_bus(launch, name, topic.name)
            optional = launch.file.nodes[name].optional_topics
            if heard in speakers or heard.startswith("status/") or topic.name in optional or "*" in optional:
                continue
            raise launch.error(
                ("nodes", name),
                f"'{name}' hears {heard}, which no node of this launch file says; "
                "add its speaker, or name it in 'optional_topics' of the node",
            )


def clock_speaker(interfaces: Mapping[str, Interface]) -> str | None:
    """Node that says the clock; None where there is none."""
    return next((name for name, interface in interfaces.items() if CLOCK in interface.says), None)


def _on_bus(launch: Launch, node: str, topic: str) -> str:
    return launch.file.nodes[node].remaps.get(topic, topic)


def _check_parameters(launch: Launch, interfaces: Mapping[str, Interface]) -> None:
    for name, interface in interfaces.items():
        node = launch.file.nodes[name]
        if interface.parameters is not None:
            for parameter in node.parameters:
                if parameter not in interface.parameters:
                    raise launch.error(
                        ("nodes", name, "parameters", parameter),
                        f"'{name}' has no parameter '{parameter}'; {nearest(parameter, interface.parameters)}",
                    )
        known = {topic.name for topic in (*interface.hears, *interface.says)}
        for topic in node.remaps:
            if topic not in known:
                raise launch.error(
                    ("nodes", name, "remaps", topic), f"'{name}' does not use {topic}; {nearest(topic, known)}"
                )
