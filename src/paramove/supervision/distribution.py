"""Nodes on several hosts: what crosses between them, and the relays that forward it."""

from __future__ import annotations

import contextlib
import os
import shlex
import socket
import subprocess
from collections import defaultdict
from collections.abc import Iterator, Mapping
from dataclasses import replace

from paramove.bus import CLOCK, Topic, topics
from paramove.documents import DocumentError, InputError, nearest
from paramove.hosts import HostKeys, Peer, RelaySettings
from paramove.supervision.interfaces import Interface
from paramove.supervision.launch_file import Launch
from paramove.supervision.launch_schema import HostSettings, LaunchFile, NodeSettings

SSH = ("ssh", "-o", "BatchMode=yes", "-o", "ConnectTimeout=10", "-o", "ServerAliveInterval=1")
"""The person's own ssh, with keys and configuration; never asks for a password, as no terminal waits for it."""
STAYS = ("wire/", "truth/")
"""Topics that connect a robot, or the truth about it, with the process that drives or judges it: on one host."""

LINK_TIMEOUT_S = 0.08
"""Without a reply from a host for so long, its commands count as lost: stopping has begun within 0.1 s."""

Crossing = dict[tuple[str, str], dict[str, str]]
"""(from, to) -> name on the bus -> row of the table of topics."""


def ssh_command(host: HostSettings, *words: str) -> list[str]:
    """What runs a command of paramove on a host. The variable PARAMOVE_SSH takes the place of ssh and its options."""
    program = os.environ.get("PARAMOVE_SSH")
    there = f"{host.command} {shlex.join(words)}"
    if host.folder is not None:
        there = f"cd {shlex.quote(host.folder)} && {there}"
    assert host.ssh is not None
    try:
        return [*(shlex.split(program) if program else SSH), host.ssh, there]
    except ValueError as error:
        raise InputError(f"PARAMOVE_SSH is {program!r}, which is no command: {error}") from error


def on_bus(launch: Launch, node: str, topic: Topic) -> str:
    """Name on the bus of a topic of a node, after its remaps and in its namespace."""
    settings = launch.file.nodes[node]
    return topics.name_on_bus(topic.name, settings.remaps, settings.namespace)


def _publishers(launch: Launch, interfaces: Mapping[str, Interface]) -> dict[str, str]:
    """Name on the bus -> node that publishes it, without statuses."""
    return {on_bus(launch, name, topic): name for name, its in interfaces.items() for topic in its.publishes}


def own_host(file: LaunchFile) -> str | None:
    """Name of the host that the launcher runs on; None where the file has no hosts."""
    return next((name for name, host in file.hosts.items() if host.ssh is None), None)


def crossing(launch: Launch, interfaces: Mapping[str, Interface]) -> Crossing:
    """Which topics cross from which host to which.

    The status of each node, and what nobody on the bus publishes but a person's terminal, cross to and from the
    launcher's host; changes of parameters cross from there to all others. A person's stop crosses from every host to
    the arm's driver, an arming request from those that may arm, and the answer to all of them.
    """
    own = own_host(launch.file) or ""
    host = {name: node.host or own for name, node in launch.file.nodes.items()}
    arming = {name for name, its in launch.file.hosts.items() if (name == own if its.may_arm is None else its.may_arm)}
    publisher = {topic: host[name] for topic, name in _publishers(launch, interfaces).items()}
    found: Crossing = defaultdict(dict)
    for name, interface in interfaces.items():
        for topic in interface.subscribes:
            subscribed = on_bus(launch, name, topic)
            sources = {publisher.get(subscribed, own)}
            if topic in topics.BY_RELAYS:
                sources = set()
            elif topic.name in topics.AWAY and subscribed not in publisher and topics.ARM_SAFETY in interface.publishes:
                sources = arming if topic == topics.OPERATOR_ARM else {*launch.file.hosts}
            for here in sources - {host[name]}:
                found[here, host[name]][subscribed] = topic.name
        if topics.ARM_SAFETY in interface.publishes:
            safety = on_bus(launch, name, topics.ARM_SAFETY)
            for other in {*launch.file.hosts} - {host[name]}:
                found[host[name], other][safety] = topics.ARM_SAFETY.name
        if CLOCK in interface.publishes:
            for other in {*host.values()} - {host[name]}:
                found[host[name], other][CLOCK.name] = CLOCK.name
        if host[name] != own:
            status = topics.status(name).name
            found[host[name], own][status] = status
            found[own, host[name]][topics.PARAMETERS_SET.name] = topics.PARAMETERS_SET.name
    return dict(found)


def wrong_hosts(launch: Launch, interfaces: Mapping[str, Interface]) -> Iterator[DocumentError]:
    """Errors of hosts, and of topics that must not cross."""
    file = launch.file
    for name, node in file.nodes.items():
        if node.host is not None and node.host not in file.hosts:
            known = f"; {nearest(node.host, file.hosts)}" if file.hosts else ": the launch file has no hosts"
            yield launch.error(("nodes", name, "host"), f"there is no host '{node.host}'{known}")
            return
    if not file.hosts:
        return
    own = [name for name, host in file.hosts.items() if host.ssh is None]
    if len(own) != 1:
        found = ", ".join(own) or "none"
        yield launch.error(("hosts",), f"one host without `ssh` expected, that of the launcher; found {found}")
        return
    if file.bus.clock == "simulated" and not file.bus.lockstep:
        message = (
            "hosts need 'clock: monotonic', or 'lockstep: true': simulated time that waits for nobody does not cross"
        )
        yield launch.error(("hosts",), message)
    for (here, there), names in crossing(launch, interfaces).items():
        for name in names:
            if name.startswith(STAYS):
                yield launch.error(("hosts",), f"{name} would cross from {here} to {there}: its nodes need one host")


def distributed(launch: Launch, interfaces: Mapping[str, Interface], keys: HostKeys | None = None) -> Launch:
    """The launch file with a relay for each host, and nodes of the launcher's host without a host.

    Raises InputError for a host that is not trusted or not found.
    """
    file, own = launch.file, own_host(launch.file)
    if own is None:
        return launch
    keys = keys or HostKeys()
    trusted = keys.trusted()
    peers, crosses = {}, crossing(launch, interfaces)
    for (here, there), names in crosses.items():
        if there == own:  # a relay reports its status as every node there
            status = topics.status(_relay(here)).name
            names[status] = status
    for name, host in file.hosts.items():
        if host.ssh is not None and host.ssh not in trusted:
            raise InputError(f"{host.ssh} is not trusted yet: paramove host trust {host.ssh}")
        key = keys.own().public if host.ssh is None else trusted[host.ssh]
        members = tuple(_members(file, name, own))
        address = host.address or _address(name, file.hosts)
        peers[name] = Peer(address=address, port=host.port, key=key, members=members)
    nodes = {
        name: node.model_copy(update={"host": None if node.host == own else node.host})
        for name, node in file.nodes.items()
    }
    statuses = {topics.status(name).name for name in (*nodes, *map(_relay, file.hosts))}
    by_nodes = statuses.union(_publishers(launch, interfaces))
    clock = next((nodes[name].host or own for name, its in interfaces.items() if CLOCK in its.publishes), own)
    for name, host in file.hosts.items():
        others = {}
        for other, peer in peers.items():
            wants, gives = crosses.get((name, other), {}), crosses.get((other, name), {})
            commands = not file.bus.lockstep and not _COMMANDS.isdisjoint(gives.values())
            outside = tuple(sorted(gives.keys() - by_nodes))
            if wants or gives:
                crossed = {"wants": wants, "gives": gives, "outside": outside, "commands": commands}
                others[other] = peer.model_copy(update=crossed)
        if not others:
            continue
        clock_from = clock if file.bus.lockstep and name != clock else None
        settings = RelaySettings(
            address=peers[name].address,
            port=host.port,
            peers=others,
            members=peers[name].members,
            clock_from=clock_from,
        )
        for node, its in interfaces.items() if any(peer.commands for peer in others.values()) else ():
            if (file.nodes[node].host or own) == name and topics.HOSTS_LINK in its.subscribes:
                limit = {"link_timeout_s": LINK_TIMEOUT_S, **file.nodes[node].parameters}
                nodes[node] = nodes[node].model_copy(update={"parameters": limit})
        nodes[_relay(name)] = NodeSettings(
            module="nodes.relay",
            parameters=settings.model_dump(mode="json", exclude_none=True),
            host=None if name == own else name,
            lockstep=False,
            # Lockstep does not wait for members whose relay has ended, so the run could not go on.
            restart="never" if file.bus.lockstep else "on-failure",
            priority="high",
            stop="last",
        )
    return replace(launch, file=file.model_copy(update={"nodes": nodes}))


_COMMANDS = frozenset(topic.name for topic in (topics.ARM_TRAJECTORY, *topics.ARMINGS))


def _members(file: LaunchFile, host: str, own: str) -> Iterator[str]:
    """Nodes of a host that lockstep waits for."""
    for name, node in file.nodes.items():
        if file.bus.lockstep and node.lockstep and (node.host or own) == host:
            yield name


def _relay(host: str) -> str:
    return f"relay_{host}"


def _address(name: str, hosts: Mapping[str, HostSettings]) -> str:
    """Of a host as others reach it: as ssh resolves its name; of this one, as it reaches the others."""
    host = hosts[name]
    if host.ssh is not None:
        return _resolved(host.ssh)
    other = next((one.address or _resolved(one.ssh) for one in hosts.values() if one.ssh is not None), "127.0.0.1")
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        try:
            probe.connect((other, 9))
        except OSError as error:
            raise InputError(f"{other} cannot be reached: {error.strerror}; give hosts.{name}.address") from error
        return str(probe.getsockname()[0])


def _resolved(ssh: str) -> str:
    lines: list[str] = []
    with contextlib.suppress(OSError, subprocess.TimeoutExpired):
        answer = subprocess.run(["ssh", "-G", ssh], capture_output=True, text=True, timeout=10, check=False)
        lines = answer.stdout.splitlines()
    name = next((line.split()[1] for line in lines if line.startswith("hostname ")), ssh)
    try:
        return socket.gethostbyname(name)
    except OSError as error:
        raise InputError(f"{name} is not found ({error}); correct ~/.ssh/config, or give the host's address") from error
