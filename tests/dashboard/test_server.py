"""The page's server: what it serves and to whom, and that nobody can make it wait or grow."""

from __future__ import annotations

import contextlib
import json
import os
import re
import select
import socket
import subprocess
import sys
import time
from pathlib import Path

import psutil
import pytest
from websockets.exceptions import ConnectionClosed, InvalidStatus
from websockets.sync.client import ClientConnection

from paramove.dashboard.link_file import NAME, link_in
from paramove.dashboard.mutual_proof import Side, nonce, proof
from paramove.dashboard.server import MAX_BROWSERS, PageServer
from tests.dashboard.conftest import WAIT_S, Visitor

MEGABYTE = 2**20
NOBODY = 65534
PROMPT_S = 0.25
"""For a stop on a busy computer; without others it takes about a millisecond."""


def pressed(page: PageServer) -> bool:
    """Waits until the stop button has been pressed."""
    return bool(select.select([page.pressed], [], [], WAIT_S)[0]) and page.was_pressed()


def status_of_socket(visitor: Visitor, **options: object) -> int:
    with pytest.raises(InvalidStatus) as rejected, visitor.socket(**options):
        pass
    return rejected.value.response.status_code


def until_closed(live: ClientConnection) -> tuple[list[str | bytes], int]:
    """What the server still says, and the code with which it closes."""
    messages: list[str | bytes] = []
    try:
        while True:
            messages.append(live.recv(WAIT_S))
    except ConnectionClosed as closed:
        return messages, closed.rcvd.code if closed.rcvd is not None else 0


def test_the_page_and_its_files_are_served_with_strict_headers(page: PageServer, visitor: Visitor) -> None:
    status, headers, body = visitor.get("/")
    assert status == 200
    assert b"<title>paramove</title>" in body
    files = [name for name in (b"page.js", b"page.css", b"icon.svg") if name in body]
    assert len(files) == 3
    for name in ("page.js", "page.css", "icon.svg", "world.js", "camera.js", "colours.js", "shapes.js"):
        status, headers, body = visitor.get(f"/{name}")
        assert (status, headers["X-Content-Type-Options"]) == (200, "nosniff")
        assert body
    policy = headers["Content-Security-Policy"]
    assert "default-src 'none'" in policy
    assert "script-src 'self';" in policy
    assert "frame-ancestors 'none'" in policy
    assert "unsafe" not in policy
    assert headers["Referrer-Policy"] == "no-referrer"
    assert headers["Cache-Control"] == "no-store"


def test_no_file_of_the_page_loads_anything_from_elsewhere_or_makes_markup_of_data() -> None:
    folder = Path(__file__).parents[2] / "src/paramove/dashboard/page"
    for path in folder.iterdir():
        text = path.read_text(encoding="utf-8").replace("http://www.w3.org/2000/svg", "")
        for unwanted in (
            "http://",
            "https://",
            "innerHTML",
            "outerHTML",
            "insertAdjacentHTML",
            "document.write",
            "eval(",
        ):
            assert unwanted not in text, f"{path.name}: {unwanted}"
    html = (folder / "index.html").read_text(encoding="utf-8")
    assert " style=" not in html
    assert re.findall(r"\son\w+=", html) == []
    assert html.count("<script") == 1


def test_the_cookie_is_strict_and_the_link_works_once(page: PageServer, tmp_path: Path) -> None:
    link = page.link
    visitor = Visitor(page.port)
    target = link.partition(visitor.host)[2]
    status, headers, _ = visitor.get(target)
    assert status == 200
    assert headers["Set-Cookie"].endswith("; Path=/; HttpOnly; SameSite=Strict")
    assert visitor.get(target)[0] == 403
    fresh = link_in(tmp_path)
    assert fresh not in ("", link)
    assert fresh == page.link
    other = Visitor(page.port)
    other.open_link(fresh)
    assert other.get("/")[0] == 200
    assert b'content=""' in other.get("/")[2], "the key is given with the token only"


@pytest.mark.parametrize("foreign", ['state={"a": [1]}; é=\xff', "; ".join(f"o{n}={'v' * 300}" for n in range(180))])
def test_cookies_of_other_ports_keep_nobody_from_the_page_and_its_stop(page: PageServer, foreign: str) -> None:
    visitor = Visitor(page.port, foreign)
    visitor.open_link(page.link)
    cookies = f"{foreign}; {visitor.cookie}"
    for target in ("/", "/page.js"):
        assert visitor.get(target, Cookie=cookies)[0] == 200
    head = f"GET /live HTTP/1.1\r\nHost: {visitor.host}\r\nOrigin: http://{visitor.host}\r\n"
    head += f"Cookie: {cookies}\r\nConnection: Upgrade\r\nUpgrade: websocket\r\nSec-WebSocket-Version: 13\r\n"
    with socket.create_connection(("127.0.0.1", page.port), WAIT_S) as live:
        live.sendall(f"{head}Sec-WebSocket-Key: {'A' * 22}==\r\n\r\n".encode("latin-1"))
        assert b" 101 " in live.recv(65536)
        mine = nonce()
        live.sendall(b"\x81\xa0\0\0\0\0" + mine.encode())
        theirs, _ = live.recv(65536)[2:].decode().split()
        live.sendall(b"\x81\xc0\0\0\0\0" + proof(visitor.key, Side.BROWSER, visitor.host, mine, theirs).encode())
        live.sendall(b"\x81\x84\0\0\0\0stop")
        assert pressed(page)


def test_pages_on_two_ports_have_cookies_of_their_own(page: PageServer, visitor: Visitor, tmp_path: Path) -> None:
    (tmp_path / "second").mkdir()
    with PageServer(tmp_path / "second") as second:
        other = Visitor(second.port, visitor.cookie)
        other.open_link(second.link)
        both = {one.partition("=")[0]: one for one in (visitor.cookie, other.cookie)}
        assert len(both) == 2
        for one in (visitor, other):
            assert one.get("/", Cookie="; ".join(both.values()))[0] == 200


def test_without_the_link_nothing_is_shown(page: PageServer) -> None:
    stranger = Visitor(page.port)
    for target in ("/", "/page.js", "/live_page.json", "/../../etc/passwd", "/?token=", "/?token=x"):
        status, _, body = stranger.get(target)
        assert status == 403
        assert b"script" not in body
    with stranger.unproved() as live:
        stranger.proves(live)
        live.send(proof("wrong", Side.BROWSER, stranger.host, "0" * 32, "0" * 32))
        assert until_closed(live) == ([], 1008)
    assert not page.watched


@pytest.mark.parametrize("first", ["stop", "next", "", "0" * 31, "G" * 32, b"0" * 32])
def test_nothing_is_said_to_who_does_not_begin_with_a_proof(page: PageServer, visitor: Visitor, first: str) -> None:
    with visitor.unproved() as live:
        live.send(first)
        assert until_closed(live) == ([], 1008)
    assert not page.was_pressed()
    assert not page.watched


def test_a_proof_is_good_for_one_connection_and_one_address(page: PageServer, visitor: Visitor) -> None:
    mine = nonce()
    with visitor.unproved() as first, visitor.unproved() as second:
        for live in (first, second):
            live.send(mine)
        theirs, _ = str(first.recv(WAIT_S)).split()
        second.recv(WAIT_S)
        second.send(proof(visitor.key, Side.BROWSER, visitor.host, mine, theirs))
        assert until_closed(second) == ([], 1008)
        first.send(proof(visitor.key, Side.BROWSER, f"127.0.0.1:{page.port - 1}", mine, theirs))
        assert until_closed(first) == ([], 1008)
    assert not page.watched


@pytest.mark.parametrize("target", ["/", "/page.js", "/live", "/nothing"])
def test_a_foreign_host_name_is_refused(visitor: Visitor, target: str) -> None:
    assert visitor.get(target, Host="evil.example")[0] == 403
    assert visitor.get(target, Host=f"evil.example:{visitor.port}")[0] == 403


def test_a_foreign_page_gets_no_socket(page: PageServer, visitor: Visitor) -> None:
    for origin in ("http://evil.example", f"https://{visitor.host}", "http://127.0.0.1:1", "null"):
        assert status_of_socket(visitor, origin=origin) == 403
    assert status_of_socket(visitor, origin=None) == 403
    assert not page.watched


@pytest.mark.parametrize(
    "path", ["/../page.js", "/%2e%2e/access.py", "//page.js", "/page.js%00", "/server.py", "/live_page.json"]
)
def test_there_is_no_way_out_of_the_page(visitor: Visitor, path: str) -> None:
    assert visitor.get(path)[0] == 404


@pytest.mark.parametrize(
    "request_",
    [
        b"POST / HTTP/1.1\r\nHost: 127.0.0.1\r\nContent-Length: 1073741824\r\n\r\n" + b"x" * MEGABYTE,
        b"POST /live HTTP/1.1\r\nHost: 127.0.0.1\r\nTransfer-Encoding: chunked\r\n\r\n" + b"ffff\r\n" + b"x" * MEGABYTE,
        b"GET /" + b"x" * MEGABYTE,
        b"GET / HTTP/1.1\r\n" + b"X: y\r\n" * 100_000,
        b"GET / HTTP/1.1\r\nX: " + b"y" * MEGABYTE,
        b"\x16\x03\x01\x02\x00" + b"\x00" * MEGABYTE,
        b"\x00" * MEGABYTE,
        b"\r\n\r\n" * 1000,
        b"GET / HTTP/9.9\r\n\r\n",
        b"POST / HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n",
    ],
    ids=["upload", "chunks", "long line", "many headers", "long header", "TLS", "zeros", "newlines", "version", "POST"],
)
def test_what_is_no_request_of_ours_is_refused_and_forgotten(
    page: PageServer, visitor: Visitor, request_: bytes
) -> None:
    before = psutil.Process().memory_info().rss
    for _ in range(5):
        try:
            status = visitor.raw(request_)[0]
        except (BrokenPipeError, ConnectionResetError):
            status = 0
        assert status == 0 or 400 <= status < 600
    assert psutil.Process().memory_info().rss - before < 64 * MEGABYTE
    assert visitor.get("/")[0] == 200
    assert not page.was_pressed()


def test_a_browser_gets_what_is_there_and_then_what_changes(page: PageServer, visitor: Visitor) -> None:
    page.show({"words": [], "clock": 1.0}, b"\xff\xd8image")
    with visitor.socket() as live:
        assert live.recv(WAIT_S) == b"\xff\xd8image"
        first = json.loads(live.recv(WAIT_S))
        assert {"words": [], "clock": 1.0}.items() <= first.items()
        assert page.watched
        page.show({"clock": 2.0})
        live.send("next")
        while "clock" not in (message := json.loads(live.recv(WAIT_S))):
            assert "words" not in message
            live.send("next")
        assert message["clock"] == 2.0
        assert "words" not in message


def test_stop_reaches_the_other_side_and_nothing_else_does(page: PageServer, visitor: Visitor) -> None:
    with visitor.socket() as live:
        live.send("stop")
        assert pressed(page)
        live.send("stop")
        assert pressed(page)
    for word in ("STOP", "stop ", "arm", "", '{"stop": 1}', b"stop"):
        with visitor.socket() as live:
            live.send(word)
            assert until_closed(live)[1] == 1008, word
    with visitor.socket() as live:
        live.send("stop" * 1000)
        assert until_closed(live)[1] == 1009
    assert not page.was_pressed()


def test_many_browsers_are_limited_and_the_first_ones_served(page: PageServer, visitor: Visitor) -> None:
    page.show({"clock": 1.0})
    with contextlib.ExitStack() as stack:
        opened = [stack.enter_context(visitor.socket()) for _ in range(MAX_BROWSERS)]
        for live in opened:
            live.recv(WAIT_S)
        with visitor.unproved() as live:
            assert visitor.proves(live)
            assert until_closed(live) == ([], 1013)
        opened[0].send("stop")
        assert pressed(page)


def test_two_hundred_silent_connections_do_not_keep_a_browser_out(page: PageServer, visitor: Visitor) -> None:
    """The oldest give way, and the others are closed when they have not asked for anything in time."""
    with visitor.socket() as live, contextlib.ExitStack() as stack:
        idle = [socket.create_connection(("127.0.0.1", page.port), WAIT_S) for _ in range(200)]
        for connection in idle:
            stack.enter_context(connection)
        live.send("stop")
        assert pressed(page)
        assert visitor.get("/")[0] == 200
        with visitor.socket() as another:
            another.send("stop")
            assert pressed(page)
        while idle:
            readable = select.select(idle, [], [], WAIT_S)[0]
            assert readable, "a silent connection is closed in time"
            idle = [connection for connection in idle if connection not in readable]


HOSTILE = """
import os, socket, sys
"".encode("idna")  # loaded while this user may read it
os.setgroups([])
os.setuid(int(sys.argv[3]))
port, manner = int(sys.argv[1]), sys.argv[2]
REQUEST = f"GET /live HTTP/1.1\\r\\nHost: 127.0.0.1:{port}\\r\\nOrigin: http://127.0.0.1:{port}\\r\\n"
SOCKET = "Connection: Upgrade\\r\\nUpgrade: websocket\\r\\nSec-WebSocket-Version: 13\\r\\n"
SOCKET += "Sec-WebSocket-Key: AAAAAAAAAAAAAAAAAAAAAA==\\r\\n\\r\\n"
begun = {"silent": "", "slow": REQUEST, "unproved": REQUEST + SOCKET, "large": REQUEST + "X: " + "y" * 60000}[manner]
kept, told = [], False
while True:
    try:
        kept.append(socket.create_connection(("127.0.0.1", port), 5))
        kept[-1].sendall(begun.encode())
    except OSError:
        pass
    if manner == "slow" and kept:
        for connection in kept[-20:]:
            try:
                connection.send(b"X")
            except OSError:
                pass
    if len(kept) == 300 and not told:
        told = True
        print("begun", flush=True)
    while len(kept) > 400:
        kept.pop(0).close()
"""


@pytest.mark.skipif(os.geteuid() != 0, reason="only root can become another user")
@pytest.mark.parametrize("manner", ["silent", "slow", "unproved", "large"])
def test_connections_of_another_user_keep_out_no_browser_and_delay_no_stop(
    page: PageServer, visitor: Visitor, manner: str
) -> None:
    hostile = [sys.executable, "-c", HOSTILE, str(page.port), manner, str(NOBODY)]
    with (
        subprocess.Popen(hostile, stdout=subprocess.PIPE) as other,
        visitor.socket() as live,
    ):
        try:
            assert other.stdout is not None
            assert other.stdout.readline() == b"begun\n"
            for _ in range(10):
                pressed_s = time.monotonic()
                live.send("stop")
                assert pressed(page)
                assert time.monotonic() - pressed_s < PROMPT_S
                assert visitor.get("/")[0] == 200
                with visitor.socket() as another:
                    another.send("stop")
                    assert pressed(page)
        finally:
            other.kill()


def test_a_browser_that_does_not_read_or_answer_costs_nothing(page: PageServer, visitor: Visitor) -> None:
    """Of 400 images of 1 MB it gets one; the others are shown the newest."""
    image = b"\xff\xd8" + bytes(MEGABYTE)
    page.show({"clock": 0.0}, image)
    with visitor.socket(max_queue=1, close_timeout=0.1) as deaf, visitor.socket() as silent, visitor.socket() as quick:
        assert silent.recv(WAIT_S) == image
        assert "clock" in json.loads(silent.recv(WAIT_S))
        before = psutil.Process().memory_info().rss
        seen = -1.0
        for number in range(400):
            page.show({"clock": float(number)}, image)
            while number % 40 == 0 and seen < number:
                message = quick.recv(WAIT_S)
                if isinstance(message, str):
                    seen = json.loads(message).get("clock", seen)
                    quick.send("next")
        assert seen == 360
        assert psutil.Process().memory_info().rss - before < 48 * MEGABYTE
        silent.send("next")
        assert silent.recv(WAIT_S) == image
        assert json.loads(silent.recv(WAIT_S))["clock"] == 399, "what it missed is not sent later"
        assert deaf.recv(WAIT_S) == image


def test_words_of_the_run_stay_data(page: PageServer, visitor: Visitor) -> None:
    payload = "</script><script>alert(1)</script>\x1b[31m\r\n\x00\u2028\U0001f916"
    page.show({"words": [{"s": 0.0, "sentence": payload}]})
    with visitor.socket() as live:
        assert json.loads(live.recv(WAIT_S))["words"][0]["sentence"] == payload


def test_numbers_that_json_does_not_know_are_refused_at_the_source(page: PageServer) -> None:
    with pytest.raises(ValueError, match="JSON"):
        page.show({"clock": float("nan")})


def test_at_the_end_browsers_are_told_why(tmp_path: Path) -> None:
    with contextlib.ExitStack() as stack:
        with PageServer(tmp_path) as page:
            visitor = Visitor(page.port)
            visitor.open_link(page.link)
            live = stack.enter_context(visitor.socket())
            live.recv(WAIT_S)
            page.say_farewell("stopped from the page by a person")
        messages, code = until_closed(live)
    assert json.loads(messages[-1])["ended"] == "stopped from the page by a person"
    assert code == 1001
    assert not (tmp_path / NAME).exists()


def failing(folder: Path) -> Visitor:
    """A page fails; returns the browser that was connected to it."""
    with contextlib.suppress(RuntimeError), PageServer(folder) as first:
        visitor = Visitor(first.port)
        visitor.open_link(first.link)
        with visitor.socket():
            raise RuntimeError("a fault")
    return visitor


def test_a_page_that_failed_comes_back_where_it_was_and_a_connected_browser_follows(tmp_path: Path) -> None:
    visitor = failing(tmp_path)
    with PageServer(tmp_path) as second:
        assert second.port == visitor.port
        visitor.key = visitor.next_key
        with visitor.socket() as live:
            assert "beat" in json.loads(live.recv(WAIT_S))
            live.send("stop")
            assert pressed(second)
        assert visitor.next_key != visitor.key


def test_what_a_browser_had_of_a_page_ends_with_its_process(tmp_path: Path) -> None:
    with contextlib.suppress(RuntimeError), PageServer(tmp_path) as first:
        visitor, unused = Visitor(first.port), ""
        visitor.open_link(first.link)
        unused = first.link
        raise RuntimeError("a fault")
    with PageServer(tmp_path) as second:
        assert second.port == visitor.port
        assert visitor.get("/")[0] == 403
        assert visitor.get(unused.partition(visitor.host)[2])[0] == 403
        with visitor.unproved() as live:
            assert not visitor.proves(live)
        with visitor.unproved() as live:
            mine = nonce()
            live.send(mine)
            theirs = str(live.recv(WAIT_S)).split()[0]
            live.send(proof(visitor.key, Side.BROWSER, visitor.host, mine, theirs))
            assert until_closed(live) == ([], 1008)


def test_a_program_at_the_port_of_a_dead_page_cannot_relay_the_next_page(tmp_path: Path) -> None:
    visitor = failing(tmp_path)
    with socket.create_server(("127.0.0.1", visitor.port)), PageServer(tmp_path) as second:
        assert second.port != visitor.port
        visitor.key = visitor.next_key
        relay = Visitor(second.port)
        with relay.unproved() as live:
            mine = nonce()
            live.send(mine)
            theirs, given = str(live.recv(WAIT_S)).split()
            assert given != proof(visitor.key, Side.PAGE, visitor.host, mine, theirs), "the browser is at another port"
            live.send(proof(visitor.key, Side.BROWSER, visitor.host, mine, theirs))
            assert until_closed(live) == ([], 1008)


def test_a_port_that_is_asked_for_and_taken_is_named(tmp_path: Path) -> None:
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = taken.getsockname()[1]
        with pytest.raises(OSError, match=str(port)), PageServer(tmp_path, port):
            pass


def test_it_listens_on_loopback_only(page: PageServer) -> None:
    found = {item.laddr for item in psutil.Process().net_connections("tcp") if item.status == psutil.CONN_LISTEN}
    assert ("127.0.0.1", page.port) in found
    assert {address for address, port in found if port == page.port} == {"127.0.0.1"}
