"""Lockstep, the simulator's side: publishes the clock and waits for the members.

barrier = LockstepBarrier(bus)
if barrier.wait_for_members():
    while not bus.stopped:
        bus.publish(...)                            # the sensor data of this time
        for received in barrier.advance(now_ns): ...   # publishes the tick; messages of the members
        # step the world by one period
"""

from __future__ import annotations

import logging
import os
import time

import zmq
from google.protobuf.message import DecodeError  # type: ignore[import-untyped]

from paramove.bus import topics
from paramove.bus.bus import Bus
from paramove.bus.envelope import Reason, RejectedError, unpack
from paramove.bus.lockstep import answers_socket, from_marks, member_mark, to_marks
from paramove.bus.log_format import is_logged
from paramove.bus.monitor import can_read
from paramove.bus.schemas import schema_hash
from paramove.bus.subscriber import Received
from paramove.bus.ticks import TICK_PERIOD_NS
from paramove.msgs.clock_pb2 import Clock, TickDone

_log = logging.getLogger(__name__)

WARNING_PERIOD_S = 5.0
MAX_ANSWER_BYTES = 2**18


class LockstepBarrier:
    """The publisher of the clock.

    With `bus.settings.lockstep` a tick ends when every member has published DONE. A member whose process ends or that
    publishes LEAVE is no longer waited for and is listed in `lost`; once restarted it joins at the next tick.
    There is no timeout: a member that hangs is logged every 5 s, and the supervisor decides what to do about it.
    Without lockstep the clock is only published, and its caller paces it.

    Args:
        bus: A bus that publishes `clock`; in lockstep it waits for the nodes in `bus.settings.members`.

    Attributes:
        members: Nodes that time waits for at present.
        lost: Nodes that have left, in order.
        tick: Number of the latest tick. 0 is the handshake.
        rejected: How many answers were rejected because they did not come from a member.
    """

    def __init__(self, bus: Bus) -> None:
        self._bus = bus
        self._exchange = bus.exchange
        self._lockstep = bus.settings.lockstep
        self._marks: dict[str, dict[str, tuple[int, int]]] = {}  # by member
        self._pidfds: dict[str, int] = {}
        self._answered: set[str] = set()
        self._newcomers: dict[str, TickDone] = {}
        self._last_marks: dict[str, tuple[int, int]] = {}  # of members that have left since the latest tick
        self.lost: list[str] = []
        self.tick = 0
        self.rejected = 0
        if self._lockstep:
            bus.hold()
            self._socket, ownership, foreign = answers_socket(
                self._exchange.context, bus.settings.folder, bus.node, MAX_ANSWER_BYTES
            )
            self._exchange.add_socket(self._socket, ownership, foreign)

    @property
    def members(self) -> frozenset[str]:
        """Nodes that time waits for at present."""
        return frozenset(self._marks)

    def wait_for_members(self) -> bool:
        """Waits until all expected members have joined and are connected; False if the bus was stopped.

        Messages that the simulator publishes before are queued and sent afterwards, so that every member gets them.
        """
        if not self._lockstep:
            return not self._exchange.stopped
        expected = set(self._bus.settings.members)
        while not self._exchange.stopped and (missing := expected - self._newcomers.keys()):
            self._wait(missing, "join")
        self._publish_tick(self._bus.now_ns)
        self._bus.read_up_to(self._all_marks(), keep=True)
        self._bus.release()
        return not self._exchange.stopped

    def advance(self, now_ns: int) -> list[Received]:
        """Publishes the next tick and, in lockstep, waits until all members are done with it.

        Args:
            now_ns: Simulated time of the tick, not before the last one.

        Returns:
            What this bus received in the tick, in an order that is the same in every run.
        """
        self.tick += 1
        self._publish_tick(now_ns)
        return self._bus.read_up_to(self._all_marks())

    def _publish_tick(self, now_ns: int) -> None:
        self._admit()
        self._bus.keep_time(now_ns)
        self._answered.clear()
        clock = Clock(time_ns=now_ns, tick=self.tick, period_ns=TICK_PERIOD_NS, lockstep=self._lockstep)
        clock.published.extend(from_marks(self._all_marks()))
        self._bus.publish_at_once(topics.CLOCK, clock)
        self._last_marks.clear()
        while not self._exchange.stopped and (missing := self._marks.keys() - self._answered):
            self._wait(missing, f"be done with tick {self.tick}")

    def _all_marks(self) -> dict[str, tuple[int, int]]:
        marks = self._exchange.marks() | self._last_marks
        for published in self._marks.values():
            marks |= published
        return marks

    def _wait(self, missing: set[str], what: str) -> None:
        """Reads answers until there is one or a member ended; logs which members it waits for."""
        warning_due_s = time.monotonic() + WARNING_PERIOD_S
        ready: set[object] = set()
        while not self._exchange.stopped:
            if self._read_answers() or self._remove_ended(ready):
                return
            ready = self._exchange.wait(WARNING_PERIOD_S)
            if time.monotonic() > warning_due_s:
                warning_due_s += WARNING_PERIOD_S
                _log.warning("lockstep: time waits for %s to %s", ", ".join(sorted(missing)), what)

    def _read_answers(self) -> bool:
        changed = False
        while can_read(self._socket):
            frames = self._socket.recv_multipart(zmq.NOBLOCK)
            try:
                if len(frames) != 3:
                    raise RejectedError(Reason.FRAMES, f"{len(frames)} frames, expected 3: sender, header, answer")
                unpack(frames[1], frames[2], schema_hash(TickDone), MAX_ANSWER_BYTES)
                answer = TickDone.FromString(frames[2])
            except (RejectedError, DecodeError) as error:
                self._reject(str(error))
                continue
            changed |= self._take(answer)
        return changed

    def _reject(self, reason: str) -> None:
        self.rejected += 1
        if is_logged(self.rejected):
            _log.warning("lockstep: answer rejected (number %d): %s", self.rejected, reason)

    def _take(self, answer: TickDone) -> bool:
        node, marks = answer.node, to_marks(answer.published)
        if marks.get(member_mark(node), (0, 0))[0] != answer.pid:
            self._reject(f"it comes from {node!r:.60} without the mark of its process {answer.pid}")
            return False
        if answer.kind == TickDone.KIND_JOIN:
            if node in self._marks:
                self._remove(node, "was started again")
            if self._watch_process(node, answer.watched_pid or answer.pid):
                self._newcomers[node] = answer
            return True
        if node not in self._marks or self._marks[node][member_mark(node)][0] != answer.pid:
            return False  # of a process that is no longer a member
        self._marks[node] = marks
        if answer.kind == TickDone.KIND_LEAVE:
            self._last_marks |= {name: mark for name, mark in marks.items() if name != member_mark(node)}
            self._remove(node, "left")
        elif answer.tick == self.tick:
            self._answered.add(node)
        return True

    def _admit(self) -> None:
        """Takes newcomers in; done between ticks only, so that each tick has one set of members."""
        for node, greeting in sorted(self._newcomers.items()):
            self._marks[node] = to_marks(greeting.published)
            if self.tick > 0:
                _log.warning("lockstep: %s joins at tick %d", node, self.tick)
        self._newcomers.clear()

    def _watch_process(self, node: str, pid: int) -> bool:
        """Begins to watch for the end of a process; False if it has ended already."""
        self._unwatch(node)
        try:
            self._pidfds[node] = os.pidfd_open(pid)
        except (OSError, OverflowError) as error:  # OverflowError: no process has such a number
            self._reject(f"{node!r:.60} cannot join as process {pid}: {error}")
            return False
        self._exchange.watch_descriptor(self._pidfds[node])
        return True

    def _unwatch(self, node: str) -> None:
        descriptor = self._pidfds.pop(node, None)
        if descriptor is not None:
            self._exchange.watch_descriptor(descriptor, watched=False)
            os.close(descriptor)

    def _remove_ended(self, ready: set[object]) -> bool:
        """Removes members whose process descriptor is ready, which means ended; whether there was one."""
        names = [node for node, descriptor in self._pidfds.items() if descriptor in ready]
        for node in names:
            self._newcomers.pop(node, None)
            self._remove(node, "ended")
        return bool(names)

    def _remove(self, node: str, what: str) -> None:
        self._unwatch(node)
        self._answered.discard(node)
        if self._marks.pop(node, None) is not None:
            self.lost.append(node)
            _log.warning("lockstep: member %s %s at tick %d; time no longer waits for it", node, what, self.tick)

    def close(self) -> None:
        """Forgets the members; the sockets are the bus's."""
        for node in list(self._pidfds):
            self._unwatch(node)
