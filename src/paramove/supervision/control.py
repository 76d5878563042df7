"""One node of a running application stopped, started or restarted by hand: the socket `control` in the bus folder.

A request is a line of JSON, `{"do": "restart", "node": "camera"}`, and so is the answer: `{"ok": true, "sentence": …}`
or `{"ok": false, "sentence": …}`. The folder belongs to the user alone (0700), so other users cannot send requests.
"""

from __future__ import annotations

import contextlib
import json
import os
import socket
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any, Self

from paramove.bus import socket_path

NAME = "control"
LONGEST_REQUEST = 4096
TIMEOUT_S = 2.0
"""A client that has not finished its request by then is disconnected."""

Answer = dict[str, Any]


class NoRunError(RuntimeError):
    """No running application was found; the text has the folder that was searched."""


class ControlServer:
    """The supervisor's end. Never waits.

    Args:
        folder: Bus folder.
        answer: Gets each request and returns the answer.
    """

    def __init__(self, folder: Path, answer: Callable[[dict[str, Any]], Answer]) -> None:
        self._path = socket_path(folder, NAME)
        self._answer = answer
        self._clients: dict[socket.socket, tuple[float, bytearray]] = {}
        self._socket = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM | socket.SOCK_NONBLOCK | socket.SOCK_CLOEXEC)
        self._path.unlink(missing_ok=True)
        self._socket.bind(os.fspath(self._path))
        self._path.chmod(0o600)
        self._socket.listen(8)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        for client in (*self._clients, self._socket):
            client.close()
        self._path.unlink(missing_ok=True)

    @property
    def descriptors(self) -> list[int]:
        """To be polled for reading."""
        return [self._socket.fileno(), *(client.fileno() for client in self._clients)]

    def serve(self) -> None:
        """Answers what has come in."""
        with contextlib.suppress(OSError):  # no client, or one that has disconnected
            while True:
                client, _ = self._socket.accept()
                client.setblocking(False)
                self._clients[client] = (time.monotonic(), bytearray())
        for client in list(self._clients):
            if self._is_done(client):
                del self._clients[client]
                client.close()

    def _is_done(self, client: socket.socket) -> bool:
        """Reads from a client; answers a whole line; returns whether the client is done."""
        since_s, received = self._clients[client]
        try:
            chunk = client.recv(LONGEST_REQUEST)
            received += chunk
            line, newline, _ = received.partition(b"\n")
            if newline:
                client.sendall(json.dumps(self._answer_to(bytes(line))).encode() + b"\n")
            return bool(newline) or not chunk or len(received) > LONGEST_REQUEST
        except BlockingIOError:
            return time.monotonic() > since_s + TIMEOUT_S
        except OSError:
            return True

    def _answer_to(self, line: bytes) -> Answer:
        request = json_object(line)
        if request is None:
            return {"ok": False, "sentence": "a request is an object in JSON on one line"}
        return self._answer(request)


def json_object(line: bytes) -> dict[str, Any] | None:
    """The object that a line of JSON holds; None if it holds anything else."""
    try:
        content = json.loads(line)
    except ValueError:
        return None
    return content if isinstance(content, dict) else None


def ask(folder: Path, request: dict[str, Any]) -> Answer:
    """Sends a request to the supervisor of a bus folder; raises NoRunError if there is none or it does not answer."""
    nothing_runs = f"no application is running at {folder}; start one with `paramove launch`"
    try:
        with socket.socket(socket.AF_UNIX, socket.SOCK_STREAM) as client:
            client.settimeout(5.0)
            client.connect(os.fspath(socket_path(folder, NAME)))
            client.sendall(json.dumps(request).encode() + b"\n")
            line = client.makefile("rb").readline()
    except TimeoutError as error:
        raise NoRunError(f"the launcher at {folder} does not answer within 5 s; it hangs or is stopped") from error
    except OSError as error:
        raise NoRunError(nothing_runs) from error
    if not line:
        raise NoRunError(nothing_runs)
    answer: Answer = json.loads(line)
    return answer
