"""Records what a node receives, also while the disk is slow or full.

A thread writes, so that neither a slow disk nor a full one blocks the node: messages are queued in memory. Every
`FLUSH_S` they are handed to the operating system, and every `SYNC_S` a further thread syncs the file to the disk. When
the disk is full, the recorder waits for space and continues in a further part; beyond `WAITING_BYTES` the oldest
messages are dropped and counted.
"""

from __future__ import annotations

import logging
import shutil
import threading
import time
from collections import deque
from concurrent.futures import Future, ThreadPoolExecutor, wait
from pathlib import Path
from types import TracebackType
from typing import Any, Self

from paramove.bus import Bus, Received
from paramove.documents import FULL_DISK
from paramove.recording.parts import next_part
from paramove.recording.writer import RecordingWriter

_log = logging.getLogger(__name__)

FLUSH_S = 0.2
SYNC_S = 1.0
WAITING_BYTES = 64 * 2**20
LOW_BYTES = 10**9
"""Free on the disk; with less the node is degraded."""
REQUEST_AGE_NS = 10**9
"""A request that seems to be older than that, or of the future, has the time of another clock."""
ROOM_BYTES = 16 * 2**20
"""Free on a disk that was full before it is written to again."""


class Recorder:
    """The recording of a node, in parts; finished by `close` or at the end of a `with` block.

    Args:
        bus: Of the node. In lockstep time waits for the disk, but not for one that is full.
        path: Of the first part; see `paramove.recording.parts`.
        library: Name of the recording program, for the file's header.

    Attributes:
        part_name: Name of the file that was begun last; empty if the disk was full from the beginning.

    Raises OSError if it cannot be written for another reason than a full disk.
    """

    def __init__(self, bus: Bus, path: Path, library: str) -> None:
        self._bus, self._path, self._library = bus, path, library
        self._changed = threading.Condition()
        self._waiting: deque[tuple[int, tuple[str, Any, int, int, int]]] = deque()
        self._bytes = 0
        self._lost = 0
        self._last_ns: int | None = None  # of the last message written
        self._ends = False
        self._is_low = False
        self._fault = ""
        self._part: RecordingWriter | None = None
        self.part_name = ""
        self._syncing: Future[None] | None = None
        self._is_synced = True
        self._sync_due_s = 0.0
        self._free_bytes()
        try:
            self._begin_part()
        except OSError as error:
            if error.errno not in FULL_DISK:
                raise
            self._handle_fault(error)
        self._threads = ThreadPoolExecutor(2, "recorder")
        self._running = self._threads.submit(self._run)
        self._running.add_done_callback(lambda _: self._wake())

    def keep(self, received: Received, message: Any = None) -> None:
        """Records a message. Never waits for a disk, but in lockstep.

        A request to arm or stop counts whatever clock its sender has; with another than that of the run it is recorded
        at the time of its arrival.

        Args:
            received: The message.
            message: Written instead, if given.
        """
        to_write = received.message if message is None else message
        size = to_write.ByteSize()
        captured_ns, published_ns = received.captured_ns, received.published_ns
        if received.topic.is_request and self._is_of_another_clock(received):
            captured_ns = published_ns = self._bus.now_ns
        with self._changed:
            if self._bus.settings.lockstep:
                self._changed.wait_for(
                    lambda: (
                        not self._waiting or self._bytes + size <= WAITING_BYTES or self._fault or self._running.done()
                    )
                )
            if self._running.done():
                self._running.result()  # raises the exception that ended the thread
            self._waiting.append((size, (received.topic.name, to_write, captured_ns, published_ns, received.sequence)))
            self._bytes += size
            while self._bytes > WAITING_BYTES and len(self._waiting) > 1:
                self._bytes -= self._waiting.popleft()[0]
                self._lost += 1
            if self._bytes > WAITING_BYTES // 4:
                self._changed.notify_all()

    def tell(self, message: str) -> None:
        """Publishes `message` as the node's state, or a fault of the disk. To be called in every iteration."""
        if self._fault:
            self._bus.degraded(f"{self._fault}; waits for space in {self._path.parent} and continues in a further file")
        elif self._is_low:
            self._bus.degraded(
                f"less than 1 GB is free in {self._path.parent}: make room there, or recording will stop"
            )
        else:
            self._bus.ready(message)

    def close(self) -> None:
        """Writes the queued messages and finishes the part. What a full disk does not take is lost, and logged."""
        self._ends = True
        self._wake()
        try:
            self._running.result()
        finally:
            self._threads.shutdown()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def _is_of_another_clock(self, received: Received) -> bool:
        age_ns = self._bus.now_ns - received.published_ns
        return age_ns < -REQUEST_AGE_NS or (age_ns > REQUEST_AGE_NS and not received.resent)

    def _run(self) -> None:
        try:
            ends = False
            while not ends:
                with self._changed:
                    self._changed.wait_for(self._is_due, SYNC_S if self._fault else FLUSH_S)
                    ends = self._ends
                try:
                    self._write_queued(ends)
                except OSError as error:
                    self._handle_fault(error)
        finally:
            self._lost += len(self._waiting)
            if self._part is not None:
                self._lost += self._part.unwritten
                self._part.abandon()
        if self._fault:
            self._log_loss(self._path.name, self._fault, "the end")

    def _wake(self) -> None:
        with self._changed:
            self._changed.notify_all()

    def _is_due(self) -> bool:
        return self._ends or (self._bytes > WAITING_BYTES // 4 and not self._fault)

    def _write_queued(self, ends: bool) -> None:
        """Writes the queued messages; after a fault, once the disk has room again."""
        if self._free_bytes() < ROOM_BYTES and self._fault and not ends:
            return
        if self._part is None or self._fault:
            self._begin_part()
        assert self._part is not None
        for _ in range(len(self._waiting)):
            with self._changed:
                size, message = self._waiting.popleft()
                self._bytes -= size
                self._changed.notify_all()
            self._last_ns = message[3]
            self._part.write(*message)
        self._is_synced &= self._part.unwritten == 0
        self._part.flush()
        if ends:
            self._finish_part(self._part)
            self._part = None
        is_due = ends or time.monotonic() >= self._sync_due_s
        if is_due and self._lost:
            self._log_loss(self.part_name, "the disk does not keep up", "now")
        if self._syncing is not None and self._syncing.done():
            done, self._syncing = self._syncing, None
            done.result()
        if is_due and not self._is_synced and self._syncing is None and self._part is not None:
            self._is_synced, self._sync_due_s = True, time.monotonic() + SYNC_S
            self._syncing = self._threads.submit(self._part.sync)

    def _free_bytes(self) -> int:
        """Free bytes of the disk; a low one counts as low until 20 % more than the limit are free."""
        free = shutil.disk_usage(self._path.parent).free
        self._is_low = free < (1.2 if self._is_low else 1.0) * LOW_BYTES
        return free

    def _begin_part(self) -> None:
        """Begins the first part, or a further one after a fault; logs what was lost in between."""
        if self._part is not None:
            self._finish_part(self._part)
            self._part = None
        self._part = RecordingWriter(next_part(self._path), self._library)
        self.part_name = self._part.path.name
        if self._fault:
            until = f"{self._waiting[0][1][3] * 1e-9:.3f} s" if self._waiting else "now"
            self._log_loss(f"continues in {self.part_name}", self._fault, until)
        self._fault = ""

    def _finish_part(self, part: RecordingWriter) -> None:
        """Finishes a part; one that cannot be written stays unfinished."""
        if self._syncing is not None:
            wait([self._syncing])
            self._syncing = None
        try:
            part.close()
        except OSError as error:
            if error.errno in FULL_DISK:
                raise
            part.abandon()
            with self._changed:
                self._lost += part.unwritten
            _log.error("%s is unfinished, rebuild it with `paramove recover`: %s", part.path, error.strerror)

    def _handle_fault(self, error: OSError) -> None:
        if not self._fault:
            _log.error("%s cannot be written: %s", self.part_name or self._path.name, error.strerror)
        self._fault = error.strerror or str(error)
        self._wake()

    def _log_loss(self, where: str, reason: str, until: str) -> None:
        since = "the beginning" if self._last_ns is None else f"{self._last_ns * 1e-9:.3f} s"
        with self._changed:
            lost, self._lost = self._lost, 0
        _log.warning("%s: %d messages from %s to %s (bus clock) are lost: %s", where, lost, since, until, reason)
