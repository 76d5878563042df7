"""Messages, a line each, over a pipe or a socket that is read and written without waiting."""

from __future__ import annotations

import os
from collections.abc import Iterator
from typing import Generic, TypeVar

from paramove.documents import Message, MessageError, MessageReader

Kind = TypeVar("Kind", bound=Message)
_PART = 65_536
_MOST_PARTS = 16
"""Read at once, so that a flood leaves time for everything else."""


class Channel(Generic[Kind]):
    """One end of a connection.

    Args:
        reads: Descriptor that is read.
        writes: Descriptor that is written; None for an end that only reads.
        reader: Of what may come.

    Attributes:
        ended: Whether the other side has closed it.
    """

    def __init__(self, reads: int, writes: int | None, reader: MessageReader[Kind]) -> None:
        self.ended = False
        self._reads, self._writes, self._reader = reads, writes, reader
        self._received = b""
        self._waiting = bytearray()
        self._skips = False
        for descriptor in {reads, reads if writes is None else writes}:
            os.set_blocking(descriptor, False)

    @property
    def descriptor(self) -> int:
        """Readable when something has come in, or the other side has closed it."""
        return self._reads

    @property
    def is_behind(self) -> bool:
        """Whether the other side has not taken all that was sent."""
        return bool(self._waiting)

    def read(self) -> Iterator[Kind | MessageError]:
        """Messages that have come in, in order; an error for each line that is none. Blank lines are left out.

        Each is parsed when it is asked for: who needs the first one only does not pay for others.
        """
        for _ in range(_MOST_PARTS):
            try:
                part = os.read(self._reads, _PART)
            except BlockingIOError:
                break
            except OSError:  # a connection that was reset
                part = b""
            if not part:
                self.ended = True
                break
            self._received += part
        *lines, self._received = self._received.split(b"\n")
        if lines and self._skips:
            del lines[0]
            self._skips = False
        if len(self._received) > self._reader.max_bytes:
            if not self._skips:
                lines.append(self._received)
            self._received, self._skips = b"", True
        return (self._message(line) for line in lines if line.strip())

    def send_line_break(self) -> None:
        """Ends a line that something else has begun on this connection, such as a shell's start-up file."""
        self._waiting += b"\n"
        self.flush()

    def send(self, message: Message) -> None:
        """Sends a message as far as the other side takes it; the rest waits for `flush`."""
        self._waiting += message.line() + b"\n"
        self.flush()

    def flush(self) -> None:
        """Sends what waits, as far as the other side takes it."""
        while self._waiting and self._writes is not None:
            try:
                sent = os.write(self._writes, self._waiting[:_PART])
            except BlockingIOError:
                return
            except OSError:  # nobody reads it any more
                self._waiting.clear()
                return
            del self._waiting[:sent]

    def _message(self, line: bytes) -> Kind | MessageError:
        try:
            return self._reader.read(line)
        except MessageError as error:
            return error
