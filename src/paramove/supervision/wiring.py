"""Checks, before anything starts, that the nodes of a launch file fit together."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace
from fnmatch import fnmatchcase

from paramove.bus import CLOCK, Topic, topics
from paramove.documents import DocumentError, nearest, raise_any
from paramove.supervision.distribution import on_bus, wrong_hosts
from paramove.supervision.included_files import NO_NAMESPACES
from paramove.supervision.interfaces import Interface, InterfaceError, read_interface, source_of
from paramove.supervision.launch_file import Launch
from paramove.supervision.launch_schema import NodeSettings
from paramove.supervision.parameters import wrong_parameters
from paramove.workspace import Workspace


def read_interfaces(launch: Launch, workspace: Workspace, *, may_import: bool = True) -> dict[str, Interface]:
    """Interface of every node; with the topics of each namespace where the node is for all.

    Args:
        launch: Its nodes. workspace: Where their modules are.
        may_import: Whether modules may be imported, where their sources do not suffice.

    Raises DocumentError with every `module` and `after_run` that does not exist, and with the wrong parameters of
    the nodes that do.
    """
    interfaces: dict[str, Interface] = {}
    findings = []
    for name, node in launch.file.nodes.items():
        try:
            interface = read_interface(node.module, workspace, may_import=may_import)
            interfaces[name] = _in_namespaces(launch, node, interface)
        except InterfaceError as error:
            findings.append(launch.error(("nodes", name, "module"), str(error)))
    if launch.file.after_run is not None:
        try:
            source_of(launch.file.after_run, workspace)
        except InterfaceError as error:
            findings.append(launch.error(("after_run",), str(error)))
    if findings and may_import:
        findings += wrong_parameters(launch, interfaces, workspace)
    raise_any(findings)
    return interfaces


def _in_namespaces(launch: Launch, node: NodeSettings, interface: Interface) -> Interface:
    """The interface with the topics that the node has in this launch file."""
    if not interface.every_namespace or node.namespace:
        return interface
    rows = (interface.subscribes, interface.publishes)
    subscribes, publishes = (topics.in_all(launch.file.namespaces, some) for some in rows)
    return replace(interface, subscribes=subscribes, publishes=publishes)


def topic_findings(launch: Launch, interfaces: Mapping[str, Interface]) -> Iterator[DocumentError]:
    """Errors of the clock, the topics and the hosts.

    Every topic with a subscriber has a publisher, no topic has two, only nodes with `truth: true` know a truth topic,
    and topics that the file names exist.
    """
    yield from _namespaces(launch)
    yield from _clock(launch, interfaces)
    yield from _publishers(launch, interfaces)
    yield from _subscribers(launch, interfaces)
    yield from wrong_hosts(launch, interfaces)
    yield from _named_topics(launch, interfaces)
    yield from _external_topics(launch, interfaces)


def _namespaces(launch: Launch) -> Iterator[DocumentError]:
    for name, node in launch.file.nodes.items():
        if node.namespace in NO_NAMESPACES:
            yield launch.error(("nodes", name, "namespace"), f"{node.namespace!r} is no namespace")


def clock_publisher(interfaces: Mapping[str, Interface]) -> str | None:
    """Node that publishes the clock; None where there is none."""
    return next((name for name, interface in interfaces.items() if CLOCK in interface.publishes), None)


def _clock(launch: Launch, interfaces: Mapping[str, Interface]) -> Iterator[DocumentError]:
    bus = launch.file.bus
    if bus.clock == "simulated" and clock_publisher(interfaces) is None:
        yield launch.error(("bus", "clock"), "the clock is simulated, but no node of this launch file publishes it")
    if bus.lockstep and bus.clock != "simulated":
        yield launch.error(("bus", "lockstep"), "lockstep needs 'clock: simulated'")


def _publishers(launch: Launch, interfaces: Mapping[str, Interface]) -> Iterator[DocumentError]:
    publishers: dict[str, str] = {}
    for name, interface in interfaces.items():
        for topic in interface.publishes:
            published = on_bus(launch, name, topic)
            other = publishers.setdefault(published, name)
            if other != name:
                yield launch.error(
                    ("nodes", name),
                    f"'{name}' and '{other}' both publish {published}; a topic has one publisher (remap one of them)",
                )


def _subscribers(launch: Launch, interfaces: Mapping[str, Interface]) -> Iterator[DocumentError]:
    published = {on_bus(launch, name, topic) for name, interface in interfaces.items() for topic in interface.publishes}
    for name, interface in interfaces.items():
        node = launch.file.nodes[name]
        for topic in (*interface.subscribes, *interface.publishes):
            if topic.truth and not node.truth:
                yield launch.error(("nodes", name), f"'{name}' uses {topic.name} but has no 'truth: true'")
        for topic in interface.subscribes:
            subscribed = on_bus(launch, name, topic)
            by_others = (
                subscribed.startswith("status/") or topic in topics.BY_RELAYS or subscribed in launch.file.external
            )  # by every node, on several hosts, or outside of the run
            is_optional = any(fnmatchcase(topic.name, one) for one in node.optional_topics)
            if not (subscribed in published or by_others or is_optional):
                yield launch.error(
                    ("nodes", name),
                    f"'{name}' subscribes to {subscribed}, which no node of this launch file publishes; "
                    "add its publisher, or name it in 'optional_topics' of the node",
                )


def _named_topics(launch: Launch, interfaces: Mapping[str, Interface]) -> Iterator[DocumentError]:
    """Topics that `remaps` and `optional_topics` name and that do not exist, or are of another type."""
    for name, interface in interfaces.items():
        node = launch.file.nodes[name]
        subscribes = {topic.name for topic in interface.subscribes}
        for index, optional in enumerate(node.optional_topics):
            if optional != "*" and not any(fnmatchcase(topic, optional) for topic in subscribes):
                path = ("nodes", name, "optional_topics", str(index))
                yield launch.error(
                    path, f"'{name}' does not subscribe to {optional!r}; {nearest(optional, subscribes)}"
                )
        used = {topic.name: topic for topic in (*interface.subscribes, *interface.publishes)}
        for topic, target in node.remaps.items():
            path = ("nodes", name, "remaps", topic)
            if topic not in used:
                yield launch.error(path, f"'{name}' does not use {topic!r}; {nearest(topic, used)}")
                continue
            problem = _target_problem(used[topic], target)
            if problem:
                yield launch.error(path, problem)


def _external_topics(launch: Launch, interfaces: Mapping[str, Interface]) -> Iterator[DocumentError]:
    """Topics in `external` that no program may publish, that a node publishes, or that nobody subscribes to."""
    publishers = {on_bus(launch, name, topic): name for name, one in interfaces.items() for topic in one.publishes}
    used = {on_bus(launch, name, topic): topic for name, one in interfaces.items() for topic in one.subscribes}
    for index, name in enumerate(launch.file.external):
        path = ("external", str(index))
        if name in publishers:
            yield launch.error(path, f"'{publishers[name]}' publishes {name}; a topic has one publisher")
        elif name not in used:
            yield launch.error(path, f"no node of this launch file subscribes to {name!r}; {nearest(name, used)}")
        elif used[name].reserved_for:
            yield launch.error(path, f"{name} is for nodes and persons, not for programs outside of the run")


def _target_problem(topic: Topic, target: str) -> str:
    """Why a topic cannot be remapped to `target`; "" if it can."""
    if not topics.is_name(target):
        return f"{target!r} is not a name of a topic: parts of lower-case letters, digits and '_', joined by '/'"
    if topic.truth or target.startswith(("truth/", "status/")):
        return f"{topic.name} cannot become {target}: truth and status topics are not remapped"
    known = topics.known_by(target) or topic
    if known.type is not topic.type:
        return f"{topic.name} cannot become {target}: it carries {topic.type_name}, {target} {known.type_name}"
    return ""
