"""A page on a free port, and a client that speaks raw HTTP to it."""

from __future__ import annotations

import contextlib
import json
import socket
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from urllib.parse import urlsplit

import pytest
from websockets.sync.client import ClientConnection, connect

from paramove.dashboard.mutual_proof import Side, nonce, proof
from paramove.dashboard.server import PageServer

WAIT_S = 30.0


@dataclass
class Visitor:
    """A browser that has opened the link: it holds the cookie and the key."""

    port: int
    cookie: str = ""
    key: str = ""
    next_key: str = ""

    @property
    def host(self) -> str:
        return f"127.0.0.1:{self.port}"

    def get(self, target: str, **headers: str) -> tuple[int, dict[str, str], bytes]:
        """Status, headers and body; `Host` and `Cookie` are ours unless they are given."""
        given = {"Host": self.host, **({"Cookie": self.cookie} if self.cookie else {}), **headers}
        lines = [f"GET {target} HTTP/1.1", *(f"{name}: {value}" for name, value in given.items())]
        return self.raw("\r\n".join([*lines, "", ""]).encode("latin-1"))

    def raw(self, request: bytes) -> tuple[int, dict[str, str], bytes]:
        """Sends bytes and reads until the server closes; status 0 for no answer."""
        with socket.create_connection(("127.0.0.1", self.port), WAIT_S) as connection:
            connection.sendall(request)
            answer = b""
            try:
                while chunk := connection.recv(65536):
                    answer += chunk
            except ConnectionResetError:
                pass
        head, _, body = answer.partition(b"\r\n\r\n")
        if not head:
            return 0, {}, b""
        first, *rest = head.decode("latin-1").split("\r\n")
        return int(first.split()[1]), dict(line.split(": ", 1) for line in rest), body

    def open_link(self, link: str) -> bytes:
        """Opens the link as a person does; keeps cookie and key."""
        parts = urlsplit(link)
        status, headers, body = self.get(f"{parts.path}?{parts.query}")
        assert status == 200
        self.cookie = headers["Set-Cookie"].partition(";")[0]
        self.key = body.partition(b'name="paramove-key" content="')[2].partition(b'"')[0].decode()
        return body

    def unproved(self, **options: object) -> ClientConnection:
        """Opens the socket as the page does; nothing is proved yet."""
        settings: dict[str, object] = {"origin": f"http://{self.host}", "additional_headers": {"Cookie": self.cookie}}
        settings |= {"compression": None, "proxy": None, "open_timeout": WAIT_S, "max_size": None}
        return connect(f"ws://{self.host}/live", **(settings | options))  # type: ignore[arg-type]

    @contextlib.contextmanager
    def socket(self, **options: object) -> Iterator[ClientConnection]:
        """Opens the socket as the page does, and proves to have the key once the other side has."""
        with self.unproved(**options) as live:
            assert self.proves(live), "this is not the page"
            self.next_key = json.loads(live.recv(WAIT_S))["next_key"]
            yield live

    def proves(self, live: ClientConnection) -> bool:
        """Whether the other side proves to be the page; then this one proves itself."""
        mine = nonce()
        live.send(mine)
        theirs, given = str(live.recv(WAIT_S)).split()
        if given != proof(self.key, Side.PAGE, self.host, mine, theirs):
            return False
        live.send(proof(self.key, Side.BROWSER, self.host, mine, theirs))
        return True


@pytest.fixture
def page(tmp_path: Path) -> Iterator[PageServer]:
    with PageServer(tmp_path) as server:
        yield server


@pytest.fixture
def visitor(page: PageServer) -> Visitor:
    made = Visitor(page.port)
    made.open_link(page.link)
    return made
