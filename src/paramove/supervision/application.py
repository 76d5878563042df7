"""From the name of a launch file to the outcome of its run."""

from __future__ import annotations

import contextlib
import datetime
import logging
import os
import socket
import subprocess
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

from paramove.documents import printable, raise_any
from paramove.supervision.agent import release_of
from paramove.supervision.distribution import distributed
from paramove.supervision.domain import held_domain
from paramove.supervision.environment import DEFAULT_DOMAIN, allow_open_files
from paramove.supervision.interfaces import Interface
from paramove.supervision.launch_file import Launch
from paramove.supervision.messages import Begin
from paramove.supervision.parameters import wrong_parameters
from paramove.supervision.remote_host import RemoteHost
from paramove.supervision.run_folder import RunFolder
from paramove.supervision.supervisor import Outcome, Supervisor, View
from paramove.supervision.wiring import clock_publisher, read_interfaces, topic_findings
from paramove.workspace import Workspace

_log = logging.getLogger(__name__)


def check(launch: Launch, workspace: Workspace) -> dict[str, Interface]:
    """Checks everything that can be checked before a process starts; returns the interfaces; raises DocumentError."""
    interfaces = read_interfaces(launch, workspace)
    raise_any([*topic_findings(launch, interfaces), *wrong_parameters(launch, interfaces, workspace)])
    return interfaces


def check_topics(launch: Launch, workspace: Workspace) -> dict[str, Interface]:
    """The interfaces as the sources of the nodes show them, whose topics fit together; imports none of the nodes.

    Raises DocumentError, also for topics that only an import would show.
    """
    interfaces = read_interfaces(launch, workspace, may_import=False)
    raise_any(list(topic_findings(launch, interfaces)))
    return interfaces


def run(
    launch: Launch, workspace: Workspace, make_view: Callable[[RunFolder], View], runs: Path | None = None
) -> tuple[Outcome, RunFolder]:
    """Checks the launch file, makes the run folder and runs to the end.

    Args:
        launch: From `launch_file.load`.
        workspace: Where nodes are found; its root is their working directory.
        make_view: Gets the run folder, to display it.
        runs: Where the run folder is made; default `runs` in the workspace's root.

    Raises DocumentError, LimitError, DomainError (another run holds the domain) or OSError (run folder).
    """
    interfaces = check(launch, workspace)
    clock = clock_publisher(interfaces)
    launch = distributed(launch, interfaces)
    allow_open_files()
    name = os.environ.get("PARAMOVE_DOMAIN") or DEFAULT_DOMAIN
    with _private_files(), held_domain(name, f"paramove launch {launch.name}") as domain:
        begun = datetime.datetime.now().astimezone()
        folder = RunFolder.create((runs or workspace.root / "runs").resolve(), begun)
        folder.write_effective(launch)
        folder.write_configs(launch, domain.folder, domain.truth_folder, clock)
        facts = _facts(launch, workspace, name, begun)
        if launch.file.bus.clock == "monotonic":
            facts["begun_ns"] = folder.begun_ns
        folder.write_run(facts)
        with contextlib.ExitStack() as connected:
            hosts = _remote_hosts(launch, workspace, folder, name, clock, connected)
            supervisor = Supervisor(launch, workspace, folder, domain.folder, make_view(folder), hosts)
            outcome = supervisor.run()
        ended = datetime.datetime.now().astimezone()
        facts["outcome"] = {
            "exit_code": outcome.code,
            "reason": outcome.reason,
            "ended": ended.isoformat(timespec="seconds"),
            "duration_s": round((ended - begun).total_seconds(), 1),
            "nodes": {
                node.name: {
                    "state": node.state.value,
                    "exit_code": node.exit_code,
                    "exit_reason": node.exit_reason or None,
                    "restarts": node.restarts,
                    "longest_silence_s": round(node.longest_silence_s, 1),
                }
                for node in supervisor.nodes.values()
            },
        }
        try:
            folder.write_run(facts)
        except OSError as error:  # a full disk does not change how the run ended
            _log.warning("the outcome could not be written to %s: %s", folder.path / "run.yaml", error.strerror)
    return outcome, folder


def _remote_hosts(
    launch: Launch,
    workspace: Workspace,
    folder: RunFolder,
    domain: str,
    clock: str | None,
    connected: contextlib.ExitStack,
) -> dict[str, RemoteHost]:
    """Connects to the other hosts; raises InputError for one that does not take part."""
    if not launch.file.hosts:
        return {}
    release = release_of(workspace)
    hosts = {}
    for name, settings in launch.file.hosts.items():
        if settings.ssh is not None:
            begin = Begin(
                launch=launch.file,
                name=printable(launch.name),
                domain=domain,
                clock=clock,
                launcher=printable(socket.gethostname()),
                release=release,
                host=name,
            )
            hosts[name] = RemoteHost(settings, begin, folder)
            connected.callback(hosts[name].close)
    return hosts


@contextlib.contextmanager
def _private_files() -> Iterator[None]:
    """Only the user may read files of the launcher, its nodes and the evaluation after the run: 0700 and 0600."""
    before = os.umask(0o077)
    try:
        yield
    finally:
        os.umask(before)


def _facts(launch: Launch, workspace: Workspace, domain: str, begun: datetime.datetime) -> dict[str, Any]:
    from paramove import __version__  # looked up in the installed package

    return {
        "launch": launch.name,
        "overlays": list(launch.overlays),
        "seed": launch.seed,
        "domain": domain,
        "begun": begun.isoformat(timespec="seconds"),
        "version": __version__,
        "commit": _commit(workspace.clone),
        "workspace": {"folders": [str(folder) for folder in workspace.layers], "sha256": workspace.digest},
    }


def _commit(clone: Path | None) -> str | None:
    """Commit of the clone, with `+` if files differ from it; None without a clone, git or its history."""
    if clone is None:
        return None
    try:
        answer = subprocess.run(
            ["git", "describe", "--always", "--abbrev=12", "--dirty=+", "--exclude=*"],
            cwd=clone,
            capture_output=True,
            text=True,
            timeout=10,
            check=False,
        )
    except (OSError, subprocess.TimeoutExpired):
        return None
    return answer.stdout.strip() or None
