"""Access control of the page: rules for one HTTP request, without sockets.

The page listens on loopback, which other users of the machine and any web site in a browser can reach, too. So a
request must

1. be a GET for a host name of ours (against DNS rebinding: a foreign name that was made to point here),
2. carry the link's token, good for one use, or the session cookie that it was exchanged for,
3. name a route exactly; nothing is looked up in the file system, so there is no path to climb,
4. for the socket, come from the page itself (`Origin` exactly ours). What is sent there needs a proof of the key
   (`mutual_proof.py`). A cookie does not count there: all ports of a host share their cookies and one limit of them,
   and a browser that dropped ours for another program's must still be able to stop the arm.

All secrets end with the process of the page. A browser sends the cookie to any program at any port of this host: it
opens the page's files, which are public, but neither the key nor the socket.
"""

from __future__ import annotations

import enum
import hmac
import http
from collections.abc import Iterable, Set
from dataclasses import dataclass, field
from urllib.parse import parse_qs

SOCKET = "/live"
PAGE = "/"


class Kind(enum.Enum):
    """Kind of answer to a request."""

    REJECTED = "refused"
    PAGE = "page"
    FILE = "file"
    SOCKET = "socket"


@dataclass(frozen=True)
class Verdict:
    """Decision about a request.

    Attributes:
        status: HTTP status of a rejection.
        detail: Why it is rejected, for a person; has nothing of the request.
        file: Name of the requested file.
        by_token: The page was requested with the token, which is used up now.
    """

    kind: Kind
    status: http.HTTPStatus = http.HTTPStatus.OK
    detail: str = ""
    file: str = ""
    by_token: bool = False


@dataclass(frozen=True)
class Secrets:
    """Random strings of one process: the link's token, the session (cookie) and the key (for the socket)."""

    token: str = field(repr=False)
    session: str = field(repr=False)
    key: str = field(repr=False)


def _rejected(status: http.HTTPStatus, message: str) -> Verdict:
    return Verdict(Kind.REJECTED, status, message)


FORBIDDEN, NOT_FOUND = http.HTTPStatus.FORBIDDEN, http.HTTPStatus.NOT_FOUND
WITHOUT_LINK = (
    "This page opens by the link that `paramove launch --view` prints. A link works once; "
    "a fresh one is in live_page.json in the folder of the run."
)


@dataclass(frozen=True)
class Access:
    """Checks requests.

    Args:
        port: Where the page listens.
        files: Names of the files that belong to the page.
        secrets: The present ones.
    """

    port: int
    files: Set[str]
    secrets: Secrets

    @property
    def hosts(self) -> tuple[str, ...]:
        """Values of `Host` that mean this page."""
        return (f"127.0.0.1:{self.port}", f"localhost:{self.port}")

    @property
    def cookie(self) -> str:
        """Name of the session cookie; with the port, since cookies are shared by all ports of a host."""
        return f"paramove_{self.port}"

    def judge(self, method: str, target: str, headers: Iterable[tuple[str, str]]) -> Verdict:
        """What to answer; `target` is the request line's path with its query, as it was sent."""
        values: dict[str, list[str]] = {}
        for name, value in headers:
            values.setdefault(name.lower(), []).append(value)
        if method != "GET":
            return _rejected(http.HTTPStatus.METHOD_NOT_ALLOWED, "Only GET is accepted.")
        if len(values.get("host", ())) != 1 or values["host"][0] not in self.hosts:
            return _rejected(FORBIDDEN, f"Only {' and '.join(self.hosts)} are accepted as Host.")
        path, _, query = target.partition("?")
        parameters = parse_qs(query, max_num_fields=4) if query.count("&") < 4 else {}
        if path == PAGE and _same(parameters.get("token", [""])[0], self.secrets.token):
            return Verdict(Kind.PAGE, by_token=True)
        if path == SOCKET:
            return self._socket(values)
        if not self._has_session(values):
            return _rejected(FORBIDDEN, WITHOUT_LINK)
        if path == PAGE:
            return Verdict(Kind.PAGE)
        name = path.removeprefix("/")
        return Verdict(Kind.FILE, file=name) if name in self.files else _rejected(NOT_FOUND, "Not found.")

    def _has_session(self, headers: dict[str, list[str]]) -> bool:
        """Whether any cookie is ours; what other programs of this host store is split, never parsed."""
        pairs = (one.strip().partition("=") for line in headers.get("cookie", ()) for one in line.split(";"))
        return any(name == self.cookie and _same(value, self.secrets.session) for name, _, value in pairs)

    def _socket(self, headers: dict[str, list[str]]) -> Verdict:
        if headers.get("origin", []) != [f"http://{headers['host'][0]}"]:
            return _rejected(FORBIDDEN, "Only the page itself may open the socket.")
        return Verdict(Kind.SOCKET)


def _same(given: str, secret: str) -> bool:
    """Compares in constant time."""
    return hmac.compare_digest(given.encode("utf-8", "replace"), secret.encode())
