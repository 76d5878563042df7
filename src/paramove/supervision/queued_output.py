"""Standard output and standard error that never block."""

from __future__ import annotations

import io
import os
import select
import signal
import sys
import threading
from collections import deque
from collections.abc import Callable
from contextlib import suppress
from typing import Self, TextIO

LONGEST_QUEUE = 256
"""Pieces of text, of a line or of a whole table each."""
LAST_WAIT_S = 1.0
"""For a slow reader, at the end."""

_Piece = tuple[int, bytes]


class QueuedOutput:
    """While the block lasts, `sys.stdout` and `sys.stderr` are a queue, and a thread writes what is in it.

    A terminal that blocks (a stalled ssh, a full pipe, Ctrl-S) stops only that thread. A full queue drops its
    oldest text. If text is left at the end, both streams stay queues: later output does not block either.

    Attributes:
        dropped: How many pieces of text the queue has dropped.
    """

    def __init__(self) -> None:
        self.dropped = 0
        self._pieces: deque[_Piece | None] = deque(maxlen=LONGEST_QUEUE)  # None ends the thread
        self._changed = threading.Condition()
        self._writer = threading.Thread(target=self._write_all, name="output", daemon=True)

    def __enter__(self) -> Self:
        self._before = sys.stdout, sys.stderr
        self._stdout = _descriptor(sys.stdout)
        self._is_terminal = self._stdout is not None and os.isatty(self._stdout)
        sys.stdout, sys.stderr = self._queue(sys.stdout), self._queue(sys.stderr)
        self._writer.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._put(None)
        with suppress(KeyboardInterrupt):  # Ctrl-C skips the rest
            self._writer.join(LAST_WAIT_S)
        if not self._writer.is_alive():
            sys.stdout, sys.stderr = self._before

    @property
    def closed_by(self) -> signal.Signals | None:
        """None while standard output has a reader; then SIGHUP if it was a terminal, else SIGPIPE.

        With `nohup` the run survives its terminal: None then, too.
        """
        if self._stdout is None or (self._is_terminal and ignored_by_nohup(signal.SIGHUP)):
            return None
        poll = select.poll()
        poll.register(self._stdout, 0)
        if any(event & (select.POLLERR | select.POLLHUP) for _, event in poll.poll(0)):
            return signal.SIGHUP if self._is_terminal else signal.SIGPIPE
        return None

    @property
    def is_behind(self) -> bool:
        """Whether text is waiting, so that transient output should be skipped."""
        return bool(self._pieces)

    def _queue(self, stream: TextIO) -> TextIO:
        """The stream's replacement; a stream without a file descriptor never blocks, and stays."""
        descriptor = _descriptor(stream)
        if descriptor is None:
            return stream
        stream.flush()
        raw = _Raw(descriptor, self._put)
        return io.TextIOWrapper(raw, encoding=stream.encoding, errors="backslashreplace", write_through=True)  # type: ignore[type-var]

    def _put(self, piece: _Piece | None) -> None:
        with self._changed:
            self.dropped += len(self._pieces) == LONGEST_QUEUE
            self._pieces.append(piece)
            self._changed.notify()

    def _write_all(self) -> None:
        # Signals are for the main thread. SIGTTOU, if not blocked, would stop a launcher that writes in the background.
        signal.pthread_sigmask(signal.SIG_BLOCK, signal.valid_signals())
        while True:
            with self._changed:
                self._changed.wait_for(lambda: self._pieces)
                piece = self._pieces.popleft()
            if piece is None:
                return
            with suppress(OSError):  # closed, or a full disk: this text is lost
                _write(*piece)


class _Raw(io.RawIOBase):
    """Puts what is written to a file descriptor into a queue."""

    def __init__(self, descriptor: int, put: Callable[[_Piece], None]) -> None:
        self._descriptor = descriptor
        self._put = put

    def writable(self) -> bool:
        return True

    def fileno(self) -> int:
        return self._descriptor

    def isatty(self) -> bool:
        return os.isatty(self._descriptor)

    def write(self, data: bytes) -> int:  # type: ignore[override]
        self._put((self._descriptor, bytes(data)))
        return len(data)


def ignored_by_nohup(number: signal.Signals) -> bool:
    """Whether this is SIGHUP and was ignored when this process started, as `nohup` and `trap '' HUP` do."""
    return number == signal.SIGHUP and signal.getsignal(number) is signal.SIG_IGN


def _descriptor(stream: TextIO | None) -> int | None:
    """Of the stream's file; None for one in memory, and where a process was started without."""
    try:
        return None if stream is None else stream.fileno()
    except (OSError, ValueError):
        return None


def _write(descriptor: int, data: bytes) -> None:
    """All of it, however long it takes."""
    while data:
        try:
            data = data[os.write(descriptor, data) :]
        except BlockingIOError:  # another program with the same file set O_NONBLOCK
            select.select([], [descriptor], [])
