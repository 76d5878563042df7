"""Who may see the page: every request that breaks one rule is refused, whatever else it brings."""

from __future__ import annotations

import http

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from paramove.dashboard.access import Access, Kind, Secrets, Verdict

PORT = 4711
SECRETS = Secrets(token="a-token", session="a-session", key="a-key")
ACCESS = Access(PORT, frozenset({"page.js", "page.css"}), SECRETS)
HOST = ("Host", f"127.0.0.1:{PORT}")
COOKIE = ("Cookie", f"paramove_{PORT}=a-session")
ORIGIN = ("Origin", f"http://127.0.0.1:{PORT}")


def judged(target: str, *headers: tuple[str, str], method: str = "GET") -> Verdict:
    return ACCESS.judge(method, target, headers)


def test_the_link_opens_the_page_and_the_cookie_the_rest() -> None:
    assert judged("/?token=a-token", HOST) == Verdict(Kind.PAGE, by_token=True)
    assert judged("/", HOST, COOKIE) == Verdict(Kind.PAGE)
    assert judged("/page.js", HOST, COOKIE) == Verdict(Kind.FILE, file="page.js")
    assert judged("/live", HOST, COOKIE, ORIGIN).kind is Kind.SOCKET


def test_localhost_is_the_same_place_but_another_origin() -> None:
    local = ("Host", f"localhost:{PORT}")
    assert judged("/live", local, COOKIE, ("Origin", f"http://localhost:{PORT}")).kind is Kind.SOCKET
    assert judged("/live", local, COOKIE, ORIGIN).status is http.HTTPStatus.FORBIDDEN


HOSTS = ["evil.example", f"evil.example:{PORT}", "127.0.0.1", "127.0.0.1:4712", f"127.0.0.1.evil.example:{PORT}", ""]
HOSTS += [f"127.0.0.1:{PORT}@evil.example", f"[::1]:{PORT}", f"0.0.0.0:{PORT}", f"LOCALHOST.:{PORT}"]
TARGETS = ["/", "/?token=a-token", "/page.js", "/live", "/nothing"]


@pytest.mark.parametrize("target", TARGETS)
@pytest.mark.parametrize("host", HOSTS)
def test_a_foreign_host_name_is_refused_on_every_route(host: str, target: str) -> None:
    found = judged(target, ("Host", host), COOKIE, ORIGIN)
    assert (found.kind, found.status) == (Kind.REJECTED, http.HTTPStatus.FORBIDDEN)


@pytest.mark.parametrize("target", TARGETS)
def test_no_host_and_two_hosts_are_refused(target: str) -> None:
    assert judged(target, COOKIE, ORIGIN).kind is Kind.REJECTED
    assert judged(target, HOST, HOST, COOKIE, ORIGIN).kind is Kind.REJECTED


ORIGINS = ["http://evil.example", f"https://127.0.0.1:{PORT}", "http://127.0.0.1", "http://127.0.0.1:4712", "null", ""]
ORIGINS += [f"http://127.0.0.1:{PORT}/", f"http://127.0.0.1:{PORT}.evil.example", f"HTTP://127.0.0.1:{PORT}"]


@pytest.mark.parametrize("origin", ORIGINS)
def test_a_foreign_origin_gets_no_socket(origin: str) -> None:
    found = judged("/live", HOST, COOKIE, ("Origin", origin))
    assert (found.kind, found.status) == (Kind.REJECTED, http.HTTPStatus.FORBIDDEN)


def test_a_missing_or_second_origin_gets_no_socket() -> None:
    assert judged("/live", HOST, COOKIE).kind is Kind.REJECTED
    assert judged("/live", HOST, COOKIE, ORIGIN, ("origin", "http://evil.example")).kind is Kind.REJECTED


def test_a_page_whose_cookie_the_browser_dropped_still_gets_its_socket() -> None:
    assert judged("/live", HOST, ORIGIN).kind is Kind.SOCKET


COOKIES = [
    "",
    "paramove_4711=",
    "paramove_4711=wrong",
    "paramove_4712=a-session",
    "a-session",
    "\x00=;;=",
    "é=a-session",
]


@pytest.mark.parametrize(
    "target",
    ["/", "/page.js", "/nothing", "/?token=", "/?token=wrong", "/?token", "/?token=a-session", "/?token=a-key"],
)
@pytest.mark.parametrize("cookie", COOKIES)
def test_without_a_session_everything_is_refused_alike(cookie: str, target: str) -> None:
    found = judged(target, HOST, ORIGIN, ("Cookie", cookie))
    assert (found.kind, found.status) == (Kind.REJECTED, http.HTTPStatus.FORBIDDEN)


FOREIGN_COOKIES = [
    'state={"a": [1, 2]}',
    "a b=c d; é=ü; \x80\xff=\xfe",
    'quoted="half; other="',
    "=nameless; bare; ;; a==b; $Version=1; __Host-x={}; a=1; a=2",
    f"paramove_{PORT}=wrong; paramove_{PORT}=; paramove_{PORT}; paramove_{PORT}x=a-session",
    "; ".join(f"other_{number}={'v' * 200}" for number in range(180)),
]


@pytest.mark.parametrize("cookie", FOREIGN_COOKIES)
def test_cookies_of_other_programs_on_this_host_change_nothing(cookie: str) -> None:
    """Cookies are shared by all ports of a host, and many programs write ones that no parser takes."""
    for headers in (
        [("Cookie", f"{cookie}; {COOKIE[1]}")],
        [("Cookie", f"{COOKIE[1]}; {cookie}")],
        [("Cookie", cookie), COOKIE],
    ):
        assert judged("/", HOST, *headers) == Verdict(Kind.PAGE)
        assert judged("/page.js", HOST, *headers).kind is Kind.FILE
        assert judged("/live", HOST, ORIGIN, *headers).kind is Kind.SOCKET
    assert judged("/?token=a-token", HOST, ("Cookie", cookie)) == Verdict(Kind.PAGE, by_token=True)
    assert judged("/", HOST, ("Cookie", cookie)).status is http.HTTPStatus.FORBIDDEN


@pytest.mark.parametrize("method", ["POST", "PUT", "DELETE", "HEAD", "OPTIONS", "CONNECT", "get", ""])
def test_only_get_is_answered(method: str) -> None:
    assert judged("/", HOST, COOKIE, method=method).status is http.HTTPStatus.METHOD_NOT_ALLOWED


PATHS = ["/../page.js", "/..%2fpage.js", "/%2e%2e/etc/passwd", "/....//page.js", "//page.js", "/page.js/", "/./page.js"]
PATHS += [
    "/../../../../etc/passwd",
    "/page.js%00",
    "/PAGE.JS",
    "/index.html",
    "/live_page.json",
    "/access.py",
    "page.js/..",
    "",
]
PATHS += ["/live/", "http://127.0.0.1:4711/etc/passwd", "/page%2ejs", "/\\..\\page.js", "*"]


@pytest.mark.parametrize("path", PATHS)
def test_paths_are_names_and_lead_nowhere_else(path: str) -> None:
    assert judged(path, HOST, COOKIE, ORIGIN).status is http.HTTPStatus.NOT_FOUND


TEXT = st.text(st.characters(min_codepoint=0, max_codepoint=255), max_size=60)


@settings(deadline=None, derandomize=True, max_examples=300)
@given(method=TEXT, target=TEXT, headers=st.lists(st.tuples(TEXT, TEXT), max_size=6))
def test_no_request_without_a_secret_gets_anything(method: str, target: str, headers: list[tuple[str, str]]) -> None:
    for more in ([], [HOST], [HOST, ORIGIN]):
        assert ACCESS.judge("GET", target, [*headers, *more]).kind is Kind.REJECTED
        assert ACCESS.judge(method, target, [*headers, *more]).kind is Kind.REJECTED


def test_a_refusal_repeats_nothing_of_the_request() -> None:
    payload = "<script>alert(1)</script>"
    for found in (
        judged(f"/{payload}", HOST, COOKIE),
        judged("/", ("Host", payload)),
        judged(f"/?token={payload}", HOST),
        judged("/", HOST, COOKIE, method=payload),
    ):
        assert found.kind is Kind.REJECTED
        assert payload not in found.detail


def test_secrets_are_not_shown_by_accident() -> None:
    assert "a-token" not in repr(SECRETS)
    assert "a-session" not in repr(ACCESS)
