"""The page in a real browser: the node's own code feeds it, and what a person sees and presses is checked."""

from __future__ import annotations

import http.server
import json
import threading
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from websockets.sync.server import ServerConnection, serve

from paramove.bus import topics
from paramove.dashboard.live_picture import LivePicture, Texts
from paramove.dashboard.server import PageServer
from paramove.dashboard.stop_button import StopButton
from paramove.msgs.relocation_pb2 import RelocationStatus
from paramove.msgs.rule_pb2 import Rule, Rules, Speech
from paramove.msgs.safety_state_pb2 import SafetyState, StopRequest
from paramove.robots import SurfaceParameters
from paramove.safety.gate_io import PERSON_STOP
from tests.dashboard import scene
from tests.dashboard.browser import Browser, program
from tests.robots.hoap3.movements import HOAP3

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(
        program() is None, reason="no Chromium here; as root run: apt-get install -y --no-install-recommends chromium"
    ),
]
TEXTS = Texts(
    stages=("calibrate", "learn", "apply", "done"),
    belongs="belongs in the opening at",
)
STOPPED = "stopped from the page by a person"


class Run:
    """A run that stands still until a test lets it say something; the gate stops when it is asked to."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.alive = True
        self.picture = LivePicture(HOAP3, "Learn rules by watching", SurfaceParameters(), TEXTS, wall_s=lambda: 0.0)
        self.page = PageServer(folder)
        self.said: list[StopRequest] = []
        self.button = StopButton(self.page.was_pressed, self.said.append)
        self.obeys = True
        self._number = 0
        self._end = threading.Event()
        self._lock = threading.Lock()
        self._ticking = threading.Thread(target=self._tick)

    def breaks(self) -> None:
        """The page's process dies, all at once."""
        with self._lock:
            self.page.__exit__(RuntimeError, RuntimeError(), None)
            self.alive = False

    def comes_back(self) -> None:
        """The supervisor starts it again."""
        with self._lock:
            self.page = PageServer(self.folder)
            self.button = StopButton(self.page.was_pressed, self.said.append)
            self.picture = LivePicture(HOAP3, "Learn rules by watching", SurfaceParameters(), TEXTS, wall_s=lambda: 0.0)
            self.page.__enter__()
            self.alive = True

    def publish(self, *said: tuple[topics.Topic, Any]) -> None:
        with self._lock:
            self._number += 1
            for heard in scene.heard(list(said), self._number * 1_000_000_000):
                self.picture.handle(heard)
                self.button.handle(heard)
            self._show()

    def _show(self) -> None:
        changes = self.picture.changes(self._number * 1_000_000_000, self.button.section())
        self.page.show(changes, self.picture.image())

    def _tick(self) -> None:
        while not self._end.wait(0.05):
            with self._lock:
                if not self.alive:
                    continue
                self.button.look(self._number * 1_000_000_000)
                self._show()
            if self.said and self.obeys:
                self.publish((topics.ARM_SAFETY, scene.safety(SafetyState.STATE_HOLD, (PERSON_STOP, STOPPED))))

    def __enter__(self) -> Run:
        self.page.__enter__()
        self._ticking.start()
        return self

    def __exit__(self, *error: Any) -> None:
        self._end.set()
        self._ticking.join()
        self.page.__exit__(None, None, None)


@pytest.fixture
def run(tmp_path: Path) -> Iterator[Run]:
    with Run(tmp_path) as made:
        yield made


@pytest.fixture(scope="module")
def one_browser(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Browser]:
    with Browser(tmp_path_factory.mktemp("profile")) as made:
        yield made


@pytest.fixture
def browser(one_browser: Browser) -> Iterator[Browser]:
    """The same browser for all tests; each page has a port, and so an origin and a storage, of its own."""
    one_browser.begin()
    yield one_browser
    one_browser.open("about:blank")


def opened(browser: Browser, run: Run) -> None:
    run.publish(*scene.messages())
    browser.open(run.page.link)
    browser.until("document.getElementById('gate-state')?.textContent === 'armed'", "the gate's state is shown")


def expect_clean(browser: Browser) -> None:
    browser.run("1")  # events that are under way arrive before the answer
    assert browser.console == []


def test_all_that_a_person_wants_to_know_is_on_the_page(run: Run, browser: Browser) -> None:
    opened(browser, run)
    pixel = "(([r, g, b]) => r > 200 && g > 80 && g < 160 && b < 60)"
    read = """(() => { const spot = new OffscreenCanvas(1, 1).getContext('2d', {willReadFrequently: true});
      spot.drawImage(document.getElementById('camera'), 20, 20, 1, 1, 0, 0, 1, 1);
      return spot.getImageData(0, 0, 1, 1).data; })()"""
    browser.until(f"{pixel}({read})", "the camera's image is drawn")
    labels = browser.until(
        "[...document.querySelectorAll('#labels span')].map((s) => s.textContent).sort().join()", "objects in 3D"
    )
    assert labels == "blue,green,yellow"
    text = browser.text()
    for words in (
        "Learn rules by watching",
        scene.SENTENCE,
        "relocate green",
        "carry",
        "attempt 2",
        "13.1, 1.8 cm",
        "not learned yet",
        "in an opening",
        "2 of 3 learned",
        "calibration refused",
        "frames from topic:camera/image_raw",
    ):
        assert words in text, words
    assert browser.run("document.querySelector('#stages .now').textContent") == "Apply"
    assert browser.run("document.querySelectorAll('#stages .past').length") == 2
    assert browser.run("document.querySelector('.pointed').textContent").startswith("green")
    assert browser.run("location.href").endswith("/"), "the token is not left in the address"
    assert browser.run("document.cookie") == "", "scripts cannot read the session"
    expect_clean(browser)


def test_a_run_without_a_robot_has_picture_and_processes(run: Run, browser: Browser) -> None:
    run.picture = LivePicture(None, "Point", SurfaceParameters(), wall_s=lambda: 0.0)
    run.publish(*scene.messages())
    browser.open(run.page.link)
    browser.until("document.body?.classList.contains('without-robot')", "the page has its title")
    shown = "[...document.querySelectorAll('.card, #stop, #gate')].filter((e) => e.checkVisibility())"
    assert browser.run(f"{shown}.map((e) => e.className).join()") == "card camera,card nodes"
    expect_clean(browser)


def test_two_arms_have_a_row_each_and_one_stop(run: Run, browser: Browser) -> None:
    run.picture = LivePicture(None, "Hand over", SurfaceParameters(), has_arms=True, wall_s=lambda: 0.0)
    gates = {name: topics.topic_in(name, topics.ARM_SAFETY) for name in ("left", "right")}
    goal = scene.goal()
    run.publish(
        (gates["left"], scene.safety(SafetyState.STATE_ARMED)),
        (gates["right"], scene.safety(SafetyState.STATE_HOLD, ("jump", "joint2 jumped"))),
        (topics.topic_in("left", topics.RELOCATION_GOAL), goal),
        (topics.topic_in("left", topics.SPEECH), Speech(text="I bring the red one")),
    )
    browser.open(run.page.link)
    rows = (
        "[...document.querySelectorAll('#arms tr')].map((r) => [...r.cells].map((c) => c.textContent).join('|')).join()"
    )
    shown = browser.until(rows, "the arms are shown")
    assert shown == "left|armed|relocate green, requested, → 13.1, 1.8 cm|I bring the red one,right|hold|nothing yet|"
    visible = "[...document.querySelectorAll('.card, #stop, #gate')].filter((e) => e.checkVisibility())"
    assert "card arms" in browser.run(f"{visible}.map((e) => e.className || e.id).join()").split(",")
    assert "right: joint2 jumped" in browser.text()
    run.obeys = False
    browser.click("#stop")
    browser.wait(lambda: run.said, "the stop is published")
    stop = scene.safety(SafetyState.STATE_HOLD, (PERSON_STOP, STOPPED))
    run.publish((gates["left"], stop))
    browser.run("1")
    assert run.button.section()["progress"] == "asked", "one arm of two has answered"
    run.publish((gates["right"], stop))
    browser.until("document.getElementById('stop-word').textContent === 'STOPPED'", "both arms have stopped")
    expect_clean(browser)


def test_after_the_end_nothing_is_armed(run: Run, browser: Browser) -> None:
    opened(browser, run)
    run.page.say_farewell("all is done")
    with run._lock:
        run.page.__exit__(None, None, None)
        run.alive = False
    browser.until("document.getElementById('gate-state').textContent === 'ended'", "the gate's state is over")
    assert browser.run("document.getElementById('gate').dataset.state") == "ended"
    run.comes_back()


def test_the_3d_view_draws_the_robot(run: Run, browser: Browser, tmp_path: Path) -> None:
    opened(browser, run)
    browser.until("document.querySelectorAll('#labels span').length === 3", "the 3D view is drawn")
    drawn = """(async () => { const c = document.getElementById('world');
      c.dispatchEvent(new WheelEvent('wheel', {deltaY: 1, cancelable: true}));
      const copy = new OffscreenCanvas(c.width, c.height).getContext('2d'); copy.drawImage(c, 0, 0);
      const data = copy.getImageData(0, 0, c.width, c.height).data; let white = 0, table = 0;
      for (let i = 0; i < data.length; i += 4) {
        const [r, g, b, a] = data.slice(i, i + 4);
        if (a > 200 && Math.min(r, g, b) > 170) white++;
        if (a > 200 && r > b + 8 && r > 90) table++;
      }
      return [white / (data.length / 4), table / (data.length / 4)]; })()"""
    white, table = browser.run(drawn)
    assert white > 0.01, "the robot's shell"
    assert table > 0.01, "the table"
    expect_clean(browser)


@pytest.mark.parametrize("how", ["click", "space", "escape"])
def test_stop_reaches_the_bus_and_the_page_says_how_far_it_came(run: Run, browser: Browser, how: str) -> None:
    opened(browser, run)
    if how == "click":
        browser.click("#stop")
    else:
        browser.press(*{"space": (" ", "Space"), "escape": ("Escape", "Escape")}[how])
    browser.until("document.getElementById('gate-state').textContent === 'hold'", "the gate holds")
    assert run.said[0].source == "page"
    browser.until("document.getElementById('stop-word').textContent === 'STOPPED'", "the button says so")
    shown = browser.until("document.getElementById('alert').textContent", "the page says so")
    assert STOPPED in shown
    expect_clean(browser)


class ForeignPage(http.server.BaseHTTPRequestHandler):
    """A page of another program on another port of this host, which stores cookies of its own."""

    def do_GET(self) -> None:
        self.send_response(200)
        for cookie in ['state={"a": [1, "b"]}', "é=ü", "a b=c", "=nameless", "paramove_1=x", "half='\""]:
            self.send_header("Set-Cookie", f"{cookie}; Path=/")
        for number in range(40):
            self.send_header("Set-Cookie", f"other_{number}={'v' * 400}; Path=/")
        self.end_headers()
        self.wfile.write(b"<p id=there>")

    def log_message(self, format: str, *arguments: object) -> None:
        """Writes nothing."""


def test_cookies_of_another_port_do_not_keep_the_stop_from_the_bus(run: Run, browser: Browser) -> None:
    with http.server.ThreadingHTTPServer(("127.0.0.1", 0), ForeignPage) as foreign:
        threading.Thread(target=foreign.serve_forever, daemon=True).start()
        address = f"http://127.0.0.1:{foreign.server_port}/"
        browser.open(address)
        browser.until("document.getElementById('there') !== null", "the other program's page is there")
        stored = browser.call("Network.getCookies", urls=[address])["cookies"]
        assert sum(len(one["value"]) for one in stored) > 16000
        opened(browser, run)
        browser.open(f"http://127.0.0.1:{run.page.port}/")
        browser.until("document.getElementById('gate-state')?.textContent === 'armed'", "it opens again without a link")
        browser.click("#stop")
        browser.until("document.getElementById('gate-state').textContent === 'hold'", "the gate holds")
        foreign.shutdown()


def test_a_stop_that_nobody_confirms_is_not_shown_as_one(run: Run, browser: Browser) -> None:
    opened(browser, run)
    run.obeys = False
    browser.click("#stop")
    browser.until("document.getElementById('alert').textContent.includes('NOT confirmed')", "the page is honest")
    assert "power switch" in browser.run("document.getElementById('alert').textContent")
    assert run.said
    run.obeys = True
    browser.until("document.getElementById('alert').textContent.includes('by a person')", "the gate has confirmed it")


PAYLOADS = [
    "<img src=x onerror=alert(1)>",
    "<script>document.title='stolen'</script>",
    '"><svg onload=alert(1)>',
    "javascript:alert(1)",
    "{{constructor.constructor('alert(1)')()}}",
    "\u202egnihtemos \x1b[31mred\x1b[0m\r\nnext line\x00",
    "__proto__",
]


@pytest.mark.parametrize("payload", PAYLOADS)
def test_names_and_sentences_are_text_whatever_they_hold(run: Run, browser: Browser, payload: str) -> None:
    opened(browser, run)
    tracked = scene.tracked()
    tracked.objects[0].name = payload
    goal = scene.goal()
    goal.id, goal.object = "goal-10", payload
    failed = RelocationStatus(goal_id="goal-10", state=RelocationStatus.STATE_FAILED, reason=payload, phase=payload)
    run.publish(
        (topics.OBJECTS_TRACKED, tracked),
        (topics.RULES, Rules(rules=[Rule(object=payload, x=0.13, y=0.0)])),
        (topics.RELOCATION_GOAL, goal),
        (topics.RELOCATION_STATUS, failed),
        (topics.ARM_SAFETY, scene.safety(SafetyState.STATE_HOLD, ("jump", payload))),
        (topics.status("camera"), scene.status(payload, detail=payload)),
        (topics.SPEECH, Speech(text=payload)),
    )
    browser.until(
        f"document.getElementById('sentence').textContent.length > 5 "
        f"&& !document.getElementById('sentence').textContent.includes({scene.SENTENCE[:20]!r})",
        "the sentence is shown",
    )
    assert browser.run("document.getElementById('alert').hidden") is False
    assert browser.run("document.title").startswith("Learn rules by watching")
    assert (
        browser.run("document.querySelectorAll('img, iframe, object, embed, form, #nodes svg, main script').length")
        == 0
    )
    assert browser.run("document.querySelectorAll('script').length") == 1
    assert browser.run("'polluted' in {} || Object.getPrototypeOf({}) !== Object.prototype") is False
    expect_clean(browser)


def test_a_lost_connection_is_told_and_comes_back(run: Run, browser: Browser) -> None:
    opened(browser, run)
    run.breaks()
    browser.until("document.getElementById('alert').textContent.includes('Connection lost')", "the page tells it")
    browser.click("#stop")
    browser.until("document.getElementById('alert').textContent.includes('NOT confirmed')", "no stop is pretended")
    run.comes_back()
    run.publish((topics.SPEECH, Speech(text="Here I am again.")))
    browser.until("document.getElementById('sentence').textContent === 'Here I am again.'", "it goes on by itself")
    browser.wait(lambda: run.said, "the stop that was pressed meanwhile is sent now")


class FalsePage:
    """Another program at the port of a page that died: accepts sockets, keeps what it is sent, shows a state."""

    def __init__(self, port: int) -> None:
        self.received: list[str] = []
        self._server = serve(self._attend, "127.0.0.1", port, compression=None)
        self._thread = threading.Thread(target=self._server.serve_forever)

    def _attend(self, connection: ServerConnection) -> None:
        assert connection.request is not None
        self.received += [connection.request.path, *map(str, connection.request.headers.raw_items())]
        for answer in (f"{'0' * 32} {'0' * 64}", json.dumps({"next_key": "x"}), json.dumps({"clock": 754.0})):
            self.received.append(str(connection.recv()))
            connection.send(answer)

    def __enter__(self) -> FalsePage:
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._server.shutdown()
        self._thread.join()


def test_another_program_at_the_port_of_a_dead_page_gets_no_key_and_is_not_believed(run: Run, browser: Browser) -> None:
    opened(browser, run)
    key = str(browser.run("localStorage.getItem('paramove-key')"))
    assert len(key) == 32
    run.breaks()
    with FalsePage(run.page.port) as false:
        browser.until("document.getElementById('alert').textContent.includes('does not prove')", "the page tells it")
        browser.click("#stop")
        browser.until("document.getElementById('alert').textContent.includes('NOT confirmed')", "no stop is pretended")
        browser.wait(lambda: len(false.received) > 40, "it tries again")
        assert "754" not in browser.text()
        assert key not in "".join(false.received)
        assert "stop" not in false.received
    run.comes_back()
    browser.until("document.getElementById('gate-state').textContent === 'hold'", "the true page is believed")


@pytest.mark.parametrize(("width", "height"), [(1280, 800), (390, 844), (820, 1180)])
def test_the_page_fits_the_screen(run: Run, browser: Browser, width: int, height: int) -> None:
    browser.resize(width, height)
    opened(browser, run)
    browser.until("document.querySelectorAll('#labels span').length === 3", "the 3D view is drawn")
    assert browser.run("document.documentElement.scrollWidth") <= width
    box = browser.run(
        "(({x, y, right, bottom}) => [x, y, right, bottom])(document.getElementById('stop').getBoundingClientRect())"
    )
    assert 0 <= box[0] < box[2] <= width
    assert 0 <= box[1] < box[3] <= height, "the stop button is in view without scrolling"
    browser.run("scrollTo(0, 10000)")
    assert 0 <= browser.run("document.getElementById('stop').getBoundingClientRect().y") < height, "and after scrolling"
    if width == 1280:
        assert browser.run("document.documentElement.scrollHeight") <= height


@pytest.mark.parametrize("dark", [True, False])
def test_words_can_be_read_in_dark_and_in_light(run: Run, browser: Browser, dark: bool) -> None:
    browser.appearance(dark)
    opened(browser, run)
    read = """((e) => { const n = (c) => c.match(/[\\d.]+/g).map(Number);
      const style = getComputedStyle(document.querySelector(e));
      let b = document.querySelector(e), back = 'rgba(0, 0, 0, 0)';
      while (b && n(back)[3] === 0) { back = getComputedStyle(b).backgroundColor; b = b.parentElement; }
      const linear = (v) => v <= 0.04 ? v / 12.92 : ((v + 0.055) / 1.055) ** 2.4;
      const l = (c) => n(c).slice(0, 3).map((v) => linear(v / 255))
        .reduce((s, v, i) => s + v * [0.2126, 0.7152, 0.0722][i], 0);
      const [hi, lo] = [l(style.color), l(back)].sort((x, y) => y - x); return (hi + 0.05) / (lo + 0.05); })"""
    for element in (
        "#sentence",
        "#gate-state",
        "#stop-word",
        "#goal",
        "#phase",
        "#nodes td",
        "#rules td",
        "#stages .now",
    ):
        assert browser.run(f"{read}({element!r})") >= 4.5, element
