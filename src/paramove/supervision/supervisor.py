"""Starts the nodes of a launch file in order, keeps them running, and ends all of them."""

from __future__ import annotations

import contextlib
import os
import select
import signal
import sys
import time
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from types import FrameType
from typing import Any, Protocol, Self

from paramove.bus import BusSettings, Exchange, topics
from paramove.documents import exit_codes, printable
from paramove.msgs.node_status_pb2 import NodeStatus
from paramove.msgs.rule_pb2 import Speech
from paramove.supervision import by_hand
from paramove.supervision.control import ControlServer
from paramove.supervision.environment import node_environment
from paramove.supervision.events import EventLog, signal_name
from paramove.supervision.launch_file import Launch
from paramove.supervision.messages import Answer, Request
from paramove.supervision.processes import Guard, SupervisedProcess, last_lines, node_process
from paramove.supervision.queued_output import ignored_by_nohup
from paramove.supervision.remote_host import RemoteHost
from paramove.supervision.run_folder import RunFolder
from paramove.supervision.stopping import stop_in_waves
from paramove.supervision.supervised_node import ENDED, NodeProcess, State, SupervisedNode
from paramove.workspace import Workspace

_ENDS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
_SUSPENDS = (signal.SIGTSTP, signal.SIGTTIN, signal.SIGTTOU)
STORIES = (topics.SPEECH, topics.APPLICATION_STAGE)
POLL_PERIOD_S = 0.05
"""Longest wait between two reads of the bus; the end of a process is noticed at once."""


@dataclass(frozen=True)
class Outcome:
    """How a run ended: exit code of the launcher and the reason in words."""

    code: int
    reason: str


class View(Protocol):
    """Shows a run to a person. No call waits for a terminal."""

    @property
    def closed_by(self) -> signal.Signals | None:
        """SIGHUP or SIGPIPE once the terminal or pipe that shows the run is closed; None before."""

    def changed(self, node: SupervisedNode) -> None:
        """A node's state has changed."""

    def story(self, text: str) -> None:
        """The robot spoke, or the application reached a new stage."""

    def problem(self, text: str) -> None:
        """Something went wrong; may have several lines."""

    def refresh(self, nodes: Iterable[SupervisedNode]) -> None:
        """Called several times a second."""

    def close(self) -> None:
        """The nodes have ended."""


class Supervisor:
    """Runs a launch file to its end.

    Order of the start: a node starts when all that it comes `after` are ready. Order of the end: nodes with
    `stop: first`, then the others against the order of their start, then nodes with `stop: last`; each wave gets
    SIGTERM and after 5 s SIGKILL, all together have 10 s.

    Args:
        launch: What to run.
        workspace: Where nodes are found; its root is their working directory.
        run_folder: Of this run; configurations of the nodes are written there before.
        bus_folder: Of the sockets.
        view: Shows what happens.
        hosts: The other hosts of the run, by name.
    """

    def __init__(
        self,
        launch: Launch,
        workspace: Workspace,
        run_folder: RunFolder,
        bus_folder: Path,
        view: View,
        hosts: Mapping[str, RemoteHost],
    ) -> None:
        self._file = launch.file
        self._headless = launch.headless
        self._workspace = workspace
        self._folder = run_folder
        self._view = view
        self._hosts = hosts
        self._interrupts = Interrupts()
        self.nodes = {
            name: SupervisedNode(name, node, self._spawn_node, self._changed) for name, node in self._file.nodes.items()
        }
        self._bus_folder = bus_folder
        self._stages: dict[str, int] = {}
        self._ending = False
        self._stop_s = 0.0

    def run(self) -> Outcome:
        """Starts, supervises and ends the nodes, then calls `after_run_of` and `after_run`.

        An interrupted run is not judged: they are left out.
        """
        self._bus = Exchange("supervisor", BusSettings(folder=self._bus_folder))
        for topic in (*topics.in_all(self._file.namespaces, STORIES), *map(topics.status, self.nodes)):
            self._bus.subscribe(topic)
        control = ControlServer(self._bus_folder, self._by_hand)
        with (
            EventLog(self._folder.events) as self._events,
            Guard() as self._guard,
            self._interrupts,
            control as self._control,
        ):
            self._events.write("run_begins", pid=os.getpid())
            try:
                outcome = self._supervise()
                self._events.write("run_stops", sentence=outcome.reason, exit_code=outcome.code)
                self._stop_all()
            finally:
                self._kill_all()
                self._bus.close()
                self._view.close()
            for module, folder in self._judges():
                if self._interrupts.first is None and outcome.code not in exit_codes.INTERRUPTED:
                    outcome = self._judge(module, folder, outcome)
            self._events.write("run_ends", sentence=outcome.reason, exit_code=outcome.code)
        return outcome

    def _judges(self) -> Iterator[tuple[str, Path]]:
        """Each module that is called after the run, and with which folder."""
        for namespace, module in self._file.after_run_of.items():
            yield module, self._folder.of_namespace(namespace)
        if self._file.after_run:
            yield self._file.after_run, self._folder.path

    def _by_hand(self, request: Request) -> Answer:
        return by_hand.answer(self.nodes, request, self._ending)

    def _changed(self, node: SupervisedNode) -> None:
        """Writes the log first, from which reaction times are measured, then updates the view."""
        code = node.exit_code if node.event == "ended" else None
        self._events.write(
            node.event,
            node=node.name,
            state=node.state.value,
            sentence=node.detail,
            pid=node.pid or None,
            exit_code=code,
            signal=signal_name(code),
        )
        self._view.changed(node)

    def _supervise(self) -> Outcome:
        """Runs until something ends the run; the reason is the outcome."""
        limit_s = time.monotonic() + (self._file.time_limit_s or float("inf"))
        while True:
            self._start_due()
            for node, code in self._poll():
                node.conclude(code, time.monotonic())
                if node.state is State.GIVEN_UP and node.event == "ended":
                    self._show_log(node)
            outcome = self._outcome(limit_s)
            if outcome is not None:
                return outcome

    def _start_due(self) -> None:
        for node in self.nodes.values():
            if node.state is State.WAITING and all(self.nodes[other].is_up for other in node.settings.after):
                node.start(time.monotonic())

    def _poll(self) -> list[tuple[SupervisedNode, int]]:
        """Waits up to `POLL_PERIOD_S` for an end, a stop (SIGSTOP) or a signal, and reads the bus.

        Returns the nodes that have just ended, with exit codes.
        """
        poll = select.poll()
        remote = (host.descriptor for host in self._hosts.values() if not host.lost)
        for descriptor in (self._interrupts.wake_fd, *self._control.descriptors, *remote):
            poll.register(descriptor, select.POLLIN)
        for node in self.nodes.values():
            if node.process is not None:
                poll.register(node.process.descriptor, select.POLLIN)
        poll.poll(POLL_PERIOD_S * 1e3)
        if not self._interrupts.urgent:
            with contextlib.suppress(BlockingIOError):
                os.eventfd_read(self._interrupts.wake_fd)
        self._ignore_suspension()
        self._control.serve()
        self._serve_hosts()
        self._read_bus()
        now_s = time.monotonic()
        checked = [(node, node.check(now_s)) for node in self.nodes.values()]
        self._view.refresh(self.nodes.values())
        return [(node, code) for node, code in checked if code is not None]

    def _serve_hosts(self) -> None:
        for name, host in self._hosts.items():
            connected = not host.lost
            host.serve()
            while host.problems:
                self._view.problem(host.problems.pop(0))
            if host.lost and connected:
                self._view.problem(f"the connection to {name} is lost: {host.lost}. Its nodes end by themselves there")

    def _outcome(self, limit_s: float) -> Outcome | None:
        """The outcome if the run has come to its end."""
        number = self._interrupts.first or self._view.closed_by
        if number is not None:
            return Outcome(exit_codes.by_signal(number), exit_codes.interrupted(number))
        for name, host in self._hosts.items():
            if host.lost:
                return Outcome(exit_codes.FAILURE, f"the connection to {name} is lost: {host.lost}")
        for node in self.nodes.values():
            is_done = node.state is State.FINISHED and node.settings.ends_run
            if is_done and self._are_done_elsewhere(node):
                return Outcome(exit_codes.OK, f"{node.name} has finished")
            if node.state in (State.GIVEN_UP, State.FINISHED) and node.settings.required and not is_done:
                reason = f"{node.name} {node.detail}; the run cannot continue without it"
                return Outcome(exit_codes.FAILURE, reason)
            if node.came_back and node.settings.restart_ends_run:
                return Outcome(exit_codes.FAILURE, f"{node.name} {node.came_back}; the run has ended")
        if all(node.state in ENDED for node in self.nodes.values()):
            failed = [node.name for node in self.nodes.values() if node.state is State.GIVEN_UP]
            reason = f"given up: {', '.join(failed)}" if failed else "all nodes have finished"
            return Outcome(exit_codes.FAILURE if failed else exit_codes.OK, reason)
        if stuck := self._stuck():
            return Outcome(exit_codes.FAILURE, f"never started: {', '.join(stuck)}")
        if time.monotonic() > limit_s:
            return Outcome(exit_codes.TIME_LIMIT, f"not finished within {self._file.time_limit_s:g} s")
        return None

    def _are_done_elsewhere(self, done: SupervisedNode) -> bool:
        """Whether in each other namespace that has nodes that end the run one of them has finished, too."""
        finished: dict[str, list[bool]] = {}
        for node in self.nodes.values():
            if node.settings.ends_run and node.settings.namespace != done.settings.namespace:
                finished.setdefault(node.settings.namespace, []).append(node.state is State.FINISHED)
        return all(map(any, finished.values()))

    def _ignore_suspension(self) -> None:
        if self._interrupts.suspended:
            self._interrupts.suspended = False
            self._view.problem(
                "Ctrl-Z does nothing, as the nodes would run on without supervision; Ctrl-C ends the run"
            )

    def _stuck(self) -> list[str]:
        """Nodes that wait for one that was given up."""
        given_up = {node.name for node in self.nodes.values() if node.state is State.GIVEN_UP}
        waiting = [node for node in self.nodes.values() if node.state is State.WAITING]
        return [node.name for node in waiting if given_up.intersection(node.settings.after)]

    def _stop_all(self) -> None:
        self._ending = True
        for node in self.nodes.values():
            if not node.is_running:
                node.stop()  # it is not started any more
        stop_in_waves(
            self._file,
            is_running=lambda name: self.nodes[name].is_running,
            stop=self._stop,
            kill=lambda name: self.nodes[name].kill(),
            wait=self._wait_for_ends,
        )

    def _stop(self, name: str) -> None:
        self._stop_s = time.monotonic()
        self.nodes[name].stop()

    def _wait_for_ends(self) -> None:
        if self._interrupts.urgent:
            self._kill_all()
        for node, code in self._poll():
            if node.state is not State.STOPPING:  # ended by itself while others were being stopped
                self._view.problem(f"{node.name} {exit_codes.describe(code)} before it was requested to end")
            node.stopped(code, time.monotonic() - self._stop_s)

    def _kill_all(self) -> None:
        for node in self.nodes.values():
            node.kill()

    def _judge(self, module: str, folder: Path, outcome: Outcome) -> Outcome:
        """Calls a module with a folder; its exit code decides whether a run without failure succeeds."""
        options = ["--no-video"] if self._headless else []
        judge = SupervisedProcess(
            [sys.executable, "-P", "-m", module, str(folder), *options],
            folder=self._workspace.root,
            environment=node_environment(os.environ, self._workspace),
            guard=self._guard,
        )
        code = judge.ended()
        while code is None:
            if self._interrupts.urgent:
                judge.kill()
            elif self._interrupts.first is not None:
                judge.terminate()
            self._ignore_suspension()
            select.select([judge.descriptor], [], [], POLL_PERIOD_S)
            code = judge.ended()
        if self._interrupts.first is not None:
            return Outcome(
                exit_codes.by_signal(self._interrupts.first),
                f"{exit_codes.interrupted(self._interrupts.first)} during {module}",
            )
        if outcome.code == exit_codes.OK and code != exit_codes.OK:
            return Outcome(code if code > 0 else exit_codes.FAILURE, f"{outcome.reason}; {module}: exit code {code}")
        return outcome

    def _spawn_node(self, name: str) -> NodeProcess:
        node = self._file.nodes[name]
        if node.host is not None:
            return self._hosts[node.host].start(name)
        return node_process(name, node, self._folder, self._workspace, self._guard)

    def _read_bus(self) -> None:
        """Handles what has come in: statuses of nodes, the robot's speech, stages of the application."""
        self._bus.wait(0.0)
        for received in self._bus.take(self._bus.subscribers):
            message = received.message
            if received.topic.type is NodeStatus:
                if message.node in self.nodes:
                    self.nodes[message.node].handle(message)
                continue
            namespace, _ = topics.split_name(received.topic.name)
            who = f"{namespace} " if namespace else ""
            if received.topic.type is Speech:
                self._view.story(f'{who}robot: "{printable(message.text)}"')
            elif message.stage != self._stages.get(namespace):
                self._stages[namespace] = message.stage
                self._view.story(f"{who}stage: {message.Stage.Name(message.stage).removeprefix('STAGE_').lower()}")

    def _show_log(self, node: SupervisedNode) -> None:
        path = self._folder.log(node.name)
        lines = "\n".join(f"    {line}" for line in last_lines(path, 20))
        self._view.problem(f"{node.name} {node.detail}. Last lines of {path}:\n{lines or '    (empty)'}")


class Interrupts:
    """While the block lasts, the signals that end a run are counted instead of ending the process.

    Those by which a terminal suspends a process are ignored: the nodes would run on without supervision. SIGHUP stays
    ignored where `nohup` ignores it.

    Attributes:
        first: The first of these signals, None before.
        urgent: Whether SIGINT or SIGTERM came once more: end everything at once. A closed terminal may send several
            SIGHUP, so these do not count.
        suspended: Whether somebody has pressed Ctrl-Z; reset by the caller that reports it.
        wake_fd: Readable after a signal, and when a child process has ended, was stopped (SIGSTOP) or continued.
    """

    def __init__(self) -> None:
        self.first: signal.Signals | None = None
        self.urgent = False
        self.suspended = False
        self.wake_fd = os.eventfd(0, os.EFD_NONBLOCK | os.EFD_CLOEXEC)
        self._before: dict[signal.Signals, Any] = {}

    def __enter__(self) -> Self:
        ends = [number for number in _ENDS if not ignored_by_nohup(number)]
        handlers = dict.fromkeys(ends, self._handle) | dict.fromkeys(_SUSPENDS, self._suspend)
        for number, handler in {**handlers, signal.SIGCHLD: self._wake}.items():
            self._before[number] = signal.signal(number, handler)
        return self

    def __exit__(self, *_: object) -> None:
        for number, handler in self._before.items():
            signal.signal(number, handler)
        os.close(self.wake_fd)

    def _handle(self, number: int, frame: FrameType | None) -> None:
        if self.first is None:
            self.first = signal.Signals(number)
        elif number != signal.SIGHUP:
            self.urgent = True
        self._wake(number, frame)

    def _suspend(self, number: int, frame: FrameType | None) -> None:
        self.suspended = True
        self._wake(number, frame)

    def _wake(self, number: int, frame: FrameType | None) -> None:
        os.eventfd_write(self.wake_fd, 1)
