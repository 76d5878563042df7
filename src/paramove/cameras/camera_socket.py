"""A camera that another program offers at a Unix socket: JPEG images, each after its length, 4 bytes big-endian."""

from __future__ import annotations

import contextlib
import os
import socket
import struct
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from paramove.documents import InputError, decoded

_LENGTH = struct.Struct(">I")
MAX_BYTES = 2**24


class CameraSocket:
    """Receives the images as OpenCV's `VideoCapture` does; raises OSError if nobody offers them.

    Args:
        path: Of the socket.
    """

    def __init__(self, path: Path) -> None:
        self._socket = socket.socket(socket.AF_UNIX)
        self._encoded = b""
        try:
            with short_name(path) as name:
                self._socket.connect(name)
        except OSError:
            self._socket.close()
            raise

    def grab(self) -> bool:
        """Waits for an image; False once there will be none any more."""
        size = _LENGTH.unpack(self._receive(_LENGTH.size) or bytes(_LENGTH.size))[0]
        self._encoded = self._receive(size) if 0 < size <= MAX_BYTES else b""
        return bool(self._encoded)

    def retrieve(self) -> tuple[bool, Any]:
        """Whether the grabbed image is sound, and the image, BGR."""
        try:
            return True, decoded(self._encoded)
        except InputError:
            return False, None

    def set(self, prop: int, value: float) -> bool:
        """Nothing can be requested."""
        return False

    def release(self) -> None:
        """Disconnects."""
        self._socket.close()

    def _receive(self, size: int) -> bytes:
        """So many bytes; none if the connection ended before."""
        received = bytearray()
        while len(received) < size:
            part = self._socket.recv(size - len(received))
            if not part:
                return b""
            received += part
        return bytes(received)


def framed(encoded: bytes) -> bytes:
    """A JPEG image as it goes over the socket."""
    return _LENGTH.pack(len(encoded)) + encoded


@contextlib.contextmanager
def short_name(path: Path) -> Iterator[str]:
    """A name of a socket that is short enough for the system, however long its path is."""
    folder = os.open(path.absolute().parent, os.O_PATH | os.O_DIRECTORY)
    try:
        yield f"/proc/self/fd/{folder}/{path.name}"
    finally:
        os.close(folder)
