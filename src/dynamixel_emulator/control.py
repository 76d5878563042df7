"""Unix socket for fault commands to emulated servos: one line per command, one line per reply.

A reply is `ok`, `ok` and text, or `error:` and a message. Only the user who opened the socket can connect.
"""

from __future__ import annotations

import contextlib
import errno
import os
import select
import socket
import threading
from collections.abc import Callable
from pathlib import Path
from typing import Self

from dynamixel_emulator.errors import EmulatorError

MAX_PATH_BYTES = 107
"""Maximum length of the path of a Unix socket."""
MAX_LINE_BYTES = 4096
IDLE_S = 0.05
REPLY_TIMEOUT_S = 10.0


class ControlSocket:
    """Context manager that serves a control socket.

    Args:
        path: Path of the socket; its folder exists, the file does not.
        do: Executes a line; returns the reply, or raises EmulatorError.
    """

    def __init__(self, path: Path, do: Callable[[str], str]) -> None:
        self.path, self._do = path, do
        self._stopped = threading.Event()
        self._thread = threading.Thread(target=self._serve, name="emulator_control", daemon=True)

    def __enter__(self) -> Self:
        if len(os.fsencode(self.path)) > MAX_PATH_BYTES:
            raise EmulatorError(f"{self.path} is too long for a socket path: at most {MAX_PATH_BYTES} bytes")
        _remove_stale_socket(self.path)
        self._listener = socket.socket(socket.AF_UNIX)
        os.fchmod(self._listener.fileno(), 0o600)
        try:
            self._listener.bind(str(self.path))
        except OSError as error:
            self._listener.close()
            missing = error.errno == errno.ENOENT
            raise EmulatorError(
                f"cannot open a control socket at {self.path}: {error.strerror}", missing=missing
            ) from error
        self._listener.listen()
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._stopped.set()
        self._thread.join()
        self._listener.close()
        self.path.unlink(missing_ok=True)

    def _serve(self) -> None:
        """Serves one client at a time; the next one waits until the client disconnects."""
        while not self._stopped.is_set():
            ready, _, _ = select.select([self._listener], [], [], IDLE_S)
            if ready:
                client, _ = self._listener.accept()
                with client, contextlib.suppress(ConnectionError):
                    self._read(client)

    def _read(self, client: socket.socket) -> None:
        received = b""
        while not self._stopped.is_set():
            ready, _, _ = select.select([client], [], [], IDLE_S)
            if not ready:
                continue
            data = client.recv(MAX_LINE_BYTES)
            received += data
            *lines, received = received.split(b"\n")
            for line in lines:
                client.sendall(self._reply(line).encode() + b"\n")
            if not data or len(received) > MAX_LINE_BYTES:
                return

    def _reply(self, line: bytes) -> str:
        try:
            return f"ok {self._do(line.decode(errors='replace').strip())}".rstrip()
        except EmulatorError as error:
            return f"error: {error}"


def request(path: Path, line: str) -> str:
    """Sends a line to the control socket at `path`; returns the text after `ok`.

    Raises:
        EmulatorError: No emulator listens there, or the emulator rejected the line.
    """
    with socket.socket(socket.AF_UNIX) as client:
        client.settimeout(REPLY_TIMEOUT_S)
        try:
            client.connect(str(path))
            client.sendall(line.encode() + b"\n")
            reply = client.makefile(encoding="utf-8").readline().strip()
        except OSError as error:
            raise EmulatorError(f"no emulator listens at {path}: {error}", missing=True) from error
    kind, _, text = reply.partition(" ")
    if kind != "ok":
        raise EmulatorError(text or f"the emulator at {path} closed the connection")
    return text


def _remove_stale_socket(path: Path) -> None:
    """Removes the socket of a killed program. Raises EmulatorError for a socket in use and for any other file."""
    if not path.exists():
        return
    if not path.is_socket():
        raise EmulatorError(f"{path} exists and is not a socket: choose another path for the control socket")
    with socket.socket(socket.AF_UNIX) as client:
        try:
            client.connect(str(path))
        except OSError:
            path.unlink(missing_ok=True)
        else:
            raise EmulatorError(f"{path} is the control socket of a running program: choose another path")
