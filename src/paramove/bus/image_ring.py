"""Images by shared memory: the topic carries a handle, and the pixels lie in a ring that its publisher keeps.

The ring is a file without a name (memfd), so nothing of it is left when the last process that has it open ends, however
it ends. A subscriber opens it through `/proc`, which Linux allows to the same user only. Each slot begins with the
epoch and the sequence of the message in it; the publisher clears them before it overwrites a slot, and a subscriber
compares them after it has read: what was overwritten meanwhile, as the subscriber was slow or stopped, is a lost
message. Nobody waits for anybody.
"""

from __future__ import annotations

import contextlib
import ctypes
import functools
import os
import struct

from paramove.bus.envelope import Envelope, Reason, RejectedError

SLOTS = 16
"""A second of images."""
SMALLEST = 100_000
"""Bytes of a payload from which the ring is faster than the socket."""
_HANDLE = struct.Struct("<QQIIQQ")
"""Inode of the publisher's PID namespace, process, descriptor, number of the ring, offset of the slot, bytes."""
_SLOT = struct.Struct("<II Q")
"""Epoch, 0, sequence; 0 while the slot is being written."""
_PAGE = 4096
_NAME = "paramove_images"
_M_TRIM_THRESHOLD, _M_MMAP_THRESHOLD = -1, -3


class OverwrittenError(Exception):
    """The publisher has used the slot again, or has ended: the message is lost."""


class RingWriter:
    """The publisher's side. Takes the memory with the first payload, and anew for a larger one."""

    def __init__(self) -> None:
        self._file = -1
        self._number = self._slot_bytes = self._next = 0
        self._namespace = _pid_namespace()

    def write(self, payload: bytes, envelope: Envelope) -> bytes:
        """Stores a payload and returns its handle. Raises OSError if there is no memory."""
        if self._file < 0 or _SLOT.size + len(payload) > self._slot_bytes:
            self._take(_SLOT.size + len(payload))
        offset = self._next * self._slot_bytes
        self._next = (self._next + 1) % SLOTS
        os.pwrite(self._file, bytes(_SLOT.size), offset)
        os.pwrite(self._file, payload, offset + _SLOT.size)
        os.pwrite(self._file, _SLOT.pack(envelope.epoch, 0, envelope.sequence), offset)
        return _HANDLE.pack(self._namespace, os.getpid(), self._file, self._number, offset, len(payload))

    def _take(self, slot_bytes: int) -> None:
        self.close()
        keep_freed_memory()
        self._slot_bytes = (slot_bytes + _PAGE - 1) // _PAGE * _PAGE
        self._file = os.memfd_create(_NAME)
        self._number += 1
        try:
            os.posix_fallocate(self._file, 0, SLOTS * self._slot_bytes)
        except OSError:
            self.close()
            raise

    def close(self) -> None:
        """Gives the memory back; subscribers that have it open still read what is in it."""
        if self._file >= 0:
            os.close(self._file)
            self._file = -1


class RingReader:
    """The subscriber's side."""

    def __init__(self) -> None:
        self._file = -1
        self._bytes = 0
        self._opened: tuple[int, int] | None = None

    def read(self, handle: bytes, envelope: Envelope, max_bytes: int) -> bytes:
        """The payload.

        Raises:
            OverwrittenError: It is gone.
            RejectedError: The handle is damaged, or of a process that cannot be reached from here.
        """
        if len(handle) != _HANDLE.size:
            raise RejectedError(Reason.LENGTH, f"a handle has {_HANDLE.size} bytes, found {len(handle)}")
        namespace, process, descriptor, number, offset, length = _HANDLE.unpack(handle)
        if length > max_bytes:
            raise RejectedError(Reason.LENGTH, f"a handle of {length} bytes, allowed are {max_bytes}")
        if self._opened != (envelope.epoch, number):
            self._open(namespace, process, descriptor)
            self._opened = (envelope.epoch, number)
        if offset + _SLOT.size + length > self._bytes:
            raise RejectedError(
                Reason.LENGTH, f"a handle of {length} bytes at {offset}, behind the end of a ring of {self._bytes}"
            )
        payload = os.pread(self._file, length, offset + _SLOT.size)
        if os.pread(self._file, _SLOT.size, offset) != _SLOT.pack(envelope.epoch, 0, envelope.sequence):
            raise OverwrittenError
        return payload

    def close(self) -> None:
        """Closes the ring, which the publisher may have replaced."""
        self._opened = None
        if self._file >= 0:
            os.close(self._file)
            self._file = -1

    def _open(self, namespace: int, process: int, descriptor: int) -> None:
        self.close()
        keep_freed_memory()
        if namespace != _pid_namespace():
            raise RejectedError(
                Reason.RING,
                "the publisher of these images runs in another PID namespace, so its memory cannot be opened; run both "
                "containers in one (--pid)",
            )
        path = f"/proc/{process}/fd/{descriptor}"
        try:
            if not os.readlink(path).startswith(f"/memfd:{_NAME}"):
                raise OverwrittenError  # the publisher has ended, and another process has its number
            self._file = os.open(path, os.O_RDONLY | os.O_CLOEXEC | os.O_NONBLOCK)
            self._bytes = os.fstat(self._file).st_size
        except FileNotFoundError:
            raise OverwrittenError from None
        except OSError as error:
            raise RejectedError(
                Reason.RING, f"the memory of process {process} cannot be opened: {error.strerror}; run both as one user"
            ) from error


@functools.cache
def keep_freed_memory() -> None:
    """Have glibc keep freed memory for the next image: new pages for 1 MB cost a millisecond, more than all copies."""
    with contextlib.suppress(AttributeError):  # another C library
        mallopt = ctypes.CDLL(None).mallopt
        mallopt(_M_MMAP_THRESHOLD, 32 * 2**20)
        mallopt(_M_TRIM_THRESHOLD, 64 * 2**20)


def _pid_namespace() -> int:
    return os.stat("/proc/self/ns/pid").st_ino
