"""One node of a running application stopped, started or restarted by hand: the socket `control` in the bus folder.

A client sends one `Request` and gets one `Answer` (see `messages.py`). The folder belongs to the user alone (0700), so
other users cannot send requests.
"""

from __future__ import annotations

import contextlib
import os
import select
import socket
import time
from collections.abc import Callable
from pathlib import Path
from typing import Self

from paramove.bus import socket_path
from paramove.documents import MessageError, printable
from paramove.supervision.channel import Channel
from paramove.supervision.messages import ANSWERS, REQUESTS, Answer, Request

NAME = "control"
TIMEOUT_S = 2.0
"""A client that has not finished its request, or taken its answer, by then is disconnected."""
ANSWER_S = 5.0
MOST_CLIENTS = 32
"""At once; further ones are disconnected."""


class NoRunError(RuntimeError):
    """No running application was found; the text has the folder that was searched."""


class _Client:
    """One connection: a request, then an answer."""

    def __init__(self, connection: socket.socket, answer: Callable[[Request], Answer]) -> None:
        self.connection = connection
        self._answer = answer
        self._channel = Channel(connection.fileno(), connection.fileno(), REQUESTS)
        self._until_s = time.monotonic() + TIMEOUT_S
        self._is_answered = False

    def is_done(self) -> bool:
        """Reads and answers as far as that needs no waiting; whether nothing is left to be done."""
        requests = self._channel.read()
        if not self._is_answered and (request := next(requests, None)) is not None:
            self._is_answered = True
            if isinstance(request, MessageError):
                self._channel.send(Answer(ok=False, sentence=printable(f"no request: {request}")))
            else:
                self._channel.send(self._answer(request))
        self._channel.flush()
        is_over = self._is_answered and not self._channel.is_behind
        return is_over or self._channel.ended or time.monotonic() > self._until_s


class ControlServer:
    """The supervisor's end. Never waits.

    Args:
        folder: Bus folder.
        answer: Gets each request and returns the answer.
    """

    def __init__(self, folder: Path, answer: Callable[[Request], Answer]) -> None:
        self._path = socket_path(folder, NAME)
        self._answer = answer
        self._clients: list[_Client] = []
        self._socket = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM | socket.SOCK_NONBLOCK | socket.SOCK_CLOEXEC)
        self._path.unlink(missing_ok=True)
        self._socket.bind(os.fspath(self._path))
        self._path.chmod(0o600)
        self._socket.listen(8)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        for client in self._clients:
            client.connection.close()
        self._socket.close()
        self._path.unlink(missing_ok=True)

    @property
    def descriptors(self) -> list[int]:
        """To be polled for reading."""
        return [self._socket.fileno(), *(client.connection.fileno() for client in self._clients)]

    def serve(self) -> None:
        """Answers what has come in."""
        with contextlib.suppress(OSError):  # no client, or one that has disconnected
            while True:
                connection, _ = self._socket.accept()
                if len(self._clients) < MOST_CLIENTS:
                    self._clients.append(_Client(connection, self._answer))
                else:
                    connection.close()
        left = []
        for client in self._clients:
            if client.is_done():
                client.connection.close()
            else:
                left.append(client)
        self._clients = left


def ask(folder: Path, request: Request) -> Answer:
    """Sends a request to the supervisor of a bus folder; raises NoRunError if there is none or it does not answer."""
    nothing_runs = f"no application is running at {folder}; start one with `paramove launch`"
    until_s = time.monotonic() + ANSWER_S
    with socket.socket(socket.AF_UNIX, socket.SOCK_STREAM) as client:
        try:
            client.settimeout(ANSWER_S)
            client.connect(os.fspath(socket_path(folder, NAME)))
        except OSError as error:
            raise NoRunError(nothing_runs) from error
        channel = Channel(client.fileno(), client.fileno(), ANSWERS)
        channel.send(request)
        while time.monotonic() < until_s:
            select.select([client], [], [], max(0.0, until_s - time.monotonic()))
            for answer in channel.read():
                if isinstance(answer, MessageError):
                    raise NoRunError(f"the launcher at {folder} answers what this release cannot read: {answer}")
                return answer
            if channel.ended:
                raise NoRunError(nothing_runs)
    raise NoRunError(f"the launcher at {folder} does not answer within {ANSWER_S:g} s; it hangs or is stopped")
