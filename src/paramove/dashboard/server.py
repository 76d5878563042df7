"""The page's server: a few files and one socket for each browser, on loopback, in a thread of its own.

The bus's thread leaves the latest content with `show` and never waits. Each browser is sent the changes since its
last message once it has sent "next", which means that it has drawn that message. So a slow one gets fewer pictures but
no older ones, and nothing is queued, not even in the sockets. The only other message of a browser is "stop"; it makes
`pressed` readable, which the bus's thread watches. Before that both sides prove that they have the key
(`mutual_proof.py`).

Other users of the machine can connect, too. Each round of the loop accepts few connections, and those that prove
nothing are limited in number and time (`opening.py`), so that neither a new browser nor a stop waits for them.
"""

from __future__ import annotations

import asyncio
import functools
import http
import importlib.resources
import json
import logging
import os
import threading
import time
from collections.abc import Mapping
from pathlib import Path
from types import TracebackType
from typing import Any

from websockets import http11
from websockets.asyncio.server import ServerConnection, serve
from websockets.datastructures import Headers
from websockets.exceptions import ConnectionClosed
from websockets.http11 import Request, Response

from paramove.dashboard.access import Access, Kind, Verdict
from paramove.dashboard.link_file import LinkFile
from paramove.dashboard.mutual_proof import Side, is_nonce, is_proof, nonce, proof
from paramove.dashboard.opening import OpeningConnections, ScreenedSocket
from paramove.dashboard.peer_user import PeerUsers

_log = logging.getLogger(__name__)

http11.MAX_LINE_LENGTH, http11.MAX_NUM_HEADERS = 65536, 32
"""Bytes of a line, and lines, of a request's head. A browser sends less than 20 lines; one of them holds the cookies of
all ports of this host, which are easily more than the library's 8192 bytes."""
ADDRESS = "127.0.0.1"
MAX_BROWSERS = 16
OPENING_S = 5.0
"""Timeout for a request, for reading the answer, and for the proof of a browser."""
ACCEPTED_AT_ONCE, WAITING_CONNECTIONS = 8, 4096
"""Connections that one round of the loop accepts; those that the kernel keeps for the next rounds."""
SEND_PERIOD_S = 0.05
HEARTBEAT_PERIOD_S = 1.0
LOGGED_REJECTIONS = 20
FAREWELL_TIMEOUT_S = 3.0
STOP, NEXT = "stop", "next"

MEDIA_TYPES = {".html": "text/html", ".js": "text/javascript", ".css": "text/css", ".svg": "image/svg+xml"}
KEY_MARK = b"{{key}}"
START = "index.html"


class PageServer:
    """Answers browsers until it is left as a context.

    Args:
        folder: Of the run; the link is written there.
        port: 0: a free one. A page that was restarted in the same run takes the port it had.
        followed: Another page follows in this folder: browsers wait for it when this one ends.

    Attributes:
        pressed: An eventfd that can be read once the stop button was pressed.
        link: Link to open in a browser.
    """

    def __init__(self, folder: Path, port: int = 0, *, followed: bool = False) -> None:
        self._followed = followed
        self._files = _read_files()
        self._link_file = LinkFile.following(folder, port)
        self._sections: dict[str, tuple[int, str]] = {}
        self._image: tuple[int, bytes] = (0, b"")
        self._version = 0
        self._updated_s = time.monotonic()
        self._browsers = 0
        self._opening = OpeningConnections[_Connection](os.geteuid())
        self._rejections = 0
        self._farewell = "The run has ended."
        self._leaving = asyncio.Event()
        self._loop = asyncio.new_event_loop()
        self._started = threading.Event()
        self._failure: OSError | None = None
        self._thread = threading.Thread(target=self._run, name="page", daemon=True)
        self.pressed = os.eventfd(0, os.EFD_NONBLOCK | os.EFD_CLOEXEC)

    @property
    def link(self) -> str:
        """Link to open in a browser; works once, and then there is a fresh one."""
        return self._link_file.link

    @property
    def port(self) -> int:
        """Where the page listens."""
        return self._link_file.port

    @property
    def _access(self) -> Access:
        """The rules for the present port and secrets."""
        return Access(self._link_file.port, self._files.keys() - {START}, self._link_file.secrets)

    @property
    def watched(self) -> bool:
        """Whether any browser is connected."""
        return self._browsers > 0

    def was_pressed(self) -> bool:
        """Whether the stop button was pressed since the last call."""
        try:
            return os.eventfd_read(self.pressed) > 0
        except BlockingIOError:
            return False

    def show(self, sections: Mapping[str, Any], image: bytes | None = None) -> None:
        """Replaces sections of the page, JSON values, and the camera's image, a JPEG. Never waits."""
        self._updated_s = time.monotonic()
        for name, content in sections.items():
            self._version += 1
            self._sections[name] = (self._version, json.dumps(content, separators=(",", ":"), allow_nan=False))
        if image is not None:
            self._image = (self._image[0] + 1, image)

    def say_farewell(self, message: str) -> None:
        """Sets the message that browsers get when the server ends."""
        self._farewell = message

    def __enter__(self) -> PageServer:
        self._thread.start()
        self._started.wait()
        if self._failure is not None:
            self._thread.join()
            raise self._failure
        self._link_file.write()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        stays = self._followed or kind is not None  # the page will be restarted: browsers wait for it
        if stays:
            self._farewell = ""
        self._loop.call_soon_threadsafe(self._leaving.set)
        self._thread.join()
        os.close(self.pressed)
        if not stays:  # a page that follows needs its key
            self._link_file.remove()

    def _run(self) -> None:
        with asyncio.Runner(loop_factory=lambda: self._loop) as runner:
            try:
                runner.run(self._serve())
            except OSError as error:
                self._failure = error
            finally:
                self._started.set()

    async def _serve(self) -> None:
        listening = self._bound()
        self._link_file = self._link_file.at(listening.getsockname()[1])
        with PeerUsers() as self._peer_users:
            server = await serve(self._attend, **self._options(listening))
            listening.listen(WAITING_CONNECTIONS)  # asyncio has one number for this and for those accepted at once
            self._started.set()
            await self._leaving.wait()
            end_s = time.monotonic() + FAREWELL_TIMEOUT_S
            while self._browsers and time.monotonic() < end_s:  # until the farewell is sent
                await asyncio.sleep(SEND_PERIOD_S)
            server.close()
            await server.wait_closed()
            for connection in self._opening:  # admitted in the last round
                connection.transport.abort()
            await asyncio.sleep(SEND_PERIOD_S)

    def _options(self, listening: ScreenedSocket) -> dict[str, Any]:
        return {
            "sock": listening,
            "backlog": ACCEPTED_AT_ONCE,
            "process_request": self._answer,
            "create_connection": functools.partial(_Connection, self),
            "compression": None,
            "open_timeout": OPENING_S,
            "close_timeout": 1.0,
            "ping_interval": 10.0,
            "ping_timeout": 30.0,
            "max_size": 64,  # a proof
            "max_queue": 4,
            "server_header": None,
            "logger": _quiet_logger(),
        }

    def _bound(self) -> ScreenedSocket:
        try:
            return ScreenedSocket((ADDRESS, self._link_file.port), self._admits)
        except OSError:
            if not self._link_file.path.exists():  # the port was chosen by the user
                raise
            _log.warning("port %d of the page before is taken; another one is used", self._link_file.port)
            return ScreenedSocket((ADDRESS, 0), self._admits)

    def _admits(self, own: tuple[str, int], peer: tuple[str, int]) -> bool:
        return not self._leaving.is_set() and self._opening.admits(self._peer_users.of(own, peer))

    def _answer(self, connection: ServerConnection, request: Request) -> Response | None:
        """Response with a file or a rejection; None opens the socket."""
        verdict = self._access.judge(request.method, request.path, request.headers.raw_items())
        if verdict.kind is Kind.SOCKET:
            return None
        if verdict.kind is Kind.REJECTED:
            self._log_rejection(request, verdict)
            return self._response(verdict.status, "text/plain", verdict.detail.encode() + b"\n")
        if verdict.kind is Kind.FILE:
            return self._response(http.HTTPStatus.OK, MEDIA_TYPES[Path(verdict.file).suffix], self._files[verdict.file])
        return self._page(verdict.by_token)

    def _page(self, by_token: bool) -> Response:
        """The page. With the token it has the session and the key, and the token is used up."""
        secrets = self._link_file.secrets
        key = secrets.key.encode() if by_token else b""
        response = self._response(http.HTTPStatus.OK, "text/html", self._files[START].replace(KEY_MARK, key))
        if by_token:
            cookie = f"{self._access.cookie}={secrets.session}; Path=/; HttpOnly; SameSite=Strict"
            response.headers["Set-Cookie"] = cookie
            self._link_file = self._link_file.with_fresh_token()
            self._link_file.write()
        return response

    def _response(self, status: http.HTTPStatus, media_type: str, body: bytes) -> Response:
        sockets = " ".join(f"ws://{host}" for host in self._access.hosts)
        headers = Headers(
            {
                "Content-Type": f"{media_type}; charset=utf-8",
                "Content-Length": str(len(body)),
                "Connection": "close",
                "Cache-Control": "no-store",
                "Content-Security-Policy": (
                    "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self'; "
                    f"connect-src 'self' {sockets}; base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
                ),
                "X-Content-Type-Options": "nosniff",
                "X-Frame-Options": "DENY",
                "Referrer-Policy": "no-referrer",
                "Cross-Origin-Opener-Policy": "same-origin",
                "Cross-Origin-Resource-Policy": "same-origin",
            }
        )
        return Response(status.value, status.phrase, headers, body)

    def _log_rejection(self, request: Request, verdict: Verdict) -> None:
        self._rejections += 1
        if self._rejections <= LOGGED_REJECTIONS:
            path = request.path.partition("?")[0]
            _log.warning("rejected with %d: %.20r %.80r: %s", verdict.status, request.method, path, verdict.detail)

    async def _attend(self, connection: ServerConnection) -> None:
        """Serves one browser until it disconnects."""
        try:
            async with asyncio.timeout(OPENING_S):
                if not await self._proved(connection):
                    return
        except (ConnectionClosed, TimeoutError):
            return
        self._opening.remove(connection)  # type: ignore[arg-type]
        self._browsers += 1
        ready = asyncio.Event()
        ready.set()
        listening = asyncio.create_task(self._listen(connection, ready))
        try:
            await self._send_changes(connection, ready)
        except ConnectionClosed:
            pass
        finally:
            self._browsers -= 1
            listening.cancel()

    async def _proved(self, connection: ServerConnection) -> bool:
        """Proves to be the page with the key, and returns whether the browser proves that it has it, too.

        Then the browser is given the key of the next process, which nobody else can ask for.
        """
        key, page_nonce = self._link_file.secrets.key, nonce()
        browser_nonce = await connection.recv()
        if not is_nonce(browser_nonce):
            await connection.close(1008, "the first message is 32 hexadecimal digits")
            return False
        assert connection.request is not None
        nonces = (connection.request.headers["Host"], str(browser_nonce), page_nonce)
        await connection.send(f"{page_nonce} {proof(key, Side.PAGE, *nonces)}")
        if not is_proof(await connection.recv(), proof(key, Side.BROWSER, *nonces)):
            await connection.close(1008, "no proof of the key")
            return False
        if self._browsers >= MAX_BROWSERS:
            await connection.close(1013, f"{MAX_BROWSERS} browsers are already connected; close one of them")
            return False
        await connection.send(json.dumps({"next_key": self._link_file.next_key}))
        return True

    async def _listen(self, connection: ServerConnection, ready: asyncio.Event) -> None:
        try:
            async for message in connection:
                if message == STOP:
                    os.eventfd_write(self.pressed, 1)
                elif message == NEXT:
                    ready.set()
                else:
                    await connection.close(1008, f"only {STOP!r} and {NEXT!r} are accepted")
                    return
        except ConnectionClosed:
            return

    async def _send_changes(self, connection: ServerConnection, ready: asyncio.Event) -> None:
        """Sends what is new, an image first, whenever the browser is ready for it."""
        sent: dict[str, int] = {}
        image_sent = 0
        sent_s = 0.0
        while not self._leaving.is_set():
            await asyncio.sleep(SEND_PERIOD_S)
            if not ready.is_set():
                continue
            new = {name: item for name, item in dict(self._sections).items() if sent.get(name) != item[0]}
            number, image = self._image
            if not new and number == image_sent and time.monotonic() - sent_s < HEARTBEAT_PERIOD_S:
                continue
            ready.clear()
            sent_s = time.monotonic()
            if number != image_sent:
                image_sent = number
                await connection.send(image)
            sent.update((name, version) for name, (version, _) in new.items())
            await connection.send(_text({name: text for name, (_, text) in new.items()}, sent_s - self._updated_s))
        if self._farewell:
            await connection.send(_text({"ended": json.dumps(self._farewell)}, 0.0))
        await connection.close(1001 if self._farewell else 1012)


class _Connection(ServerConnection):
    """A connection that counts as opening, of its user, until the browser has proved itself."""

    def __init__(self, page: PageServer, *args: Any, **kwargs: Any) -> None:
        super().__init__(*args, **kwargs)
        self._page = page

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        super().connection_made(transport)
        ends = transport.get_extra_info("sockname"), transport.get_extra_info("peername")
        user = self._page._peer_users.of(*ends) if all(ends) else None
        if (oldest := self._page._opening.add(self, user)) is not None:
            oldest.transport.abort()

    def connection_lost(self, exc: Exception | None) -> None:
        self._page._opening.remove(self)
        super().connection_lost(exc)


def _text(sections: Mapping[str, str], quiet_s: float) -> str:
    """One message of sections that are JSON already, and how long ago the run last sent an update."""
    parts = [f"{json.dumps(name)}:{text}" for name, text in sections.items()]
    return "{" + ",".join([*parts, f'"beat":{{"quiet_s":{quiet_s:.1f}}}']) + "}"


def _read_files() -> dict[str, bytes]:
    folder = importlib.resources.files("paramove.dashboard") / "page"
    return {item.name: item.read_bytes() for item in folder.iterdir() if Path(item.name).suffix in MEDIA_TYPES}


def _quiet_logger() -> logging.Logger:
    """For the library, which would otherwise log a traceback for every broken request."""
    logger = _log.getChild("websockets")
    logger.setLevel(logging.CRITICAL)
    logger.propagate = False
    return logger
