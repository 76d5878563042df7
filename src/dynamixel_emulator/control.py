"""A Unix socket at which emulated servos are told what shall go wrong: one line a verb, one line an answer.

An answer is `ok`, `ok` and text, or `error:` and what would have been right. Only the user who opened it may connect.
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

LONGEST_PATH = 107
"""Bytes of the name of a Unix socket."""
LONGEST_LINE = 4096
IDLE_S = 0.05
ANSWER_S = 10.0


class ControlSocket:
    """Open while it is a context.

    Args:
        path: Where; its folder is there, and nothing else is in its place.
        do: What a line does; it returns the answer, or raises EmulatorError.
    """

    def __init__(self, path: Path, do: Callable[[str], str]) -> None:
        self.path, self._do = path, do
        self._stopped = threading.Event()
        self._thread = threading.Thread(target=self._serve, name="emulator_control", daemon=True)

    def __enter__(self) -> Self:
        if len(os.fsencode(self.path)) > LONGEST_PATH:
            raise EmulatorError(f"{self.path} is too long for a socket: at most {LONGEST_PATH} bytes")
        _clear_away(self.path)
        self._listener = socket.socket(socket.AF_UNIX)
        os.fchmod(self._listener.fileno(), 0o600)
        try:
            self._listener.bind(str(self.path))
        except OSError as error:
            self._listener.close()
            missing = error.errno == errno.ENOENT
            raise EmulatorError(f"no control socket at {self.path}: {error.strerror}", missing=missing) from error
        self._listener.listen()
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._stopped.set()
        self._thread.join()
        self._listener.close()
        self.path.unlink(missing_ok=True)

    def _serve(self) -> None:
        """One caller after the other; the next waits until this one has hung up."""
        while not self._stopped.is_set():
            ready, _, _ = select.select([self._listener], [], [], IDLE_S)
            if ready:
                caller, _ = self._listener.accept()
                with caller, contextlib.suppress(ConnectionError):
                    self._read(caller)

    def _read(self, caller: socket.socket) -> None:
        heard = b""
        while not self._stopped.is_set():
            ready, _, _ = select.select([caller], [], [], IDLE_S)
            if not ready:
                continue
            data = caller.recv(LONGEST_LINE)
            heard += data
            *lines, heard = heard.split(b"\n")
            for line in lines:
                caller.sendall(self._answer(line).encode() + b"\n")
            if not data or len(heard) > LONGEST_LINE:
                return

    def _answer(self, line: bytes) -> str:
        try:
            return f"ok {self._do(line.decode(errors='replace').strip())}".rstrip()
        except EmulatorError as error:
            return f"error: {error}"


def request(path: Path, line: str) -> str:
    """Send a line to the socket there; returns the text after `ok`.

    Raises:
        EmulatorError: Nobody listens there, or the line was rejected.
    """
    with socket.socket(socket.AF_UNIX) as caller:
        caller.settimeout(ANSWER_S)
        try:
            caller.connect(str(path))
            caller.sendall(line.encode() + b"\n")
            answer = caller.makefile(encoding="utf-8").readline().strip()
        except OSError as error:
            raise EmulatorError(f"no emulator listens at {path}: {error}", missing=True) from error
    kind, _, text = answer.partition(" ")
    if kind != "ok":
        raise EmulatorError(text or f"the emulator at {path} hung up")
    return text


def _clear_away(path: Path) -> None:
    """A socket that a killed program left behind. Raises EmulatorError for one in use, and for anything else."""
    if not path.exists():
        return
    if not path.is_socket():
        raise EmulatorError(f"{path} is there already and no socket: name another path for the control socket")
    with socket.socket(socket.AF_UNIX) as caller:
        try:
            caller.connect(str(path))
        except OSError:
            path.unlink(missing_ok=True)
        else:
            raise EmulatorError(f"{path} is the control socket of a running program: name another path")
