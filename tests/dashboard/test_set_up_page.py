"""The page of a set-up: what it sends, and that another page may follow it."""

import contextlib
import json

import numpy as np

from paramove.cameras import CalibratedCamera
from paramove.dashboard import PageServer, SetUpPage
from paramove.observation import BodyKeyPoints
from tests.dashboard.test_server import WAIT_S, Visitor, until_closed

CAMERAS = [CalibratedCamera(name, 64, 48, np.eye(3), np.zeros(0), np.eye(4)) for name in ("one", "two")]
IMAGE = np.full((48, 64, 3), 90, np.uint8)


def arms():
    """A right arm whose wrist is unknown, and no left one."""
    nobody = BodyKeyPoints.nobody()
    nobody.positions[0] = [[1.0, 2.0], [3.0, 4.0], [np.nan, np.nan], [5.04, 6.0]]
    return nobody


def test_picture_arms_and_prompt_reach_a_browser(tmp_path):
    with PageServer(tmp_path) as server:
        page = SetUpPage(server, "Measure a person")
        visitor = Visitor(server.port)
        visitor.open_link(server.link)
        with visitor.socket() as live:
            state = json.loads(live.recv(WAIT_S))
            assert state["page"]["title"] == "Measure a person"
            assert not state["page"]["robot"]
            page.prompt("let your arm hang")
            page.report("the board is detected")
            points = [("one", 0, arms()), ("two", 0, BodyKeyPoints.nobody())]
            assert list(page.drawing(iter(points), "one")) == points
            images = [(camera, 0, IMAGE) for camera in reversed(CAMERAS)]
            assert list(page.passing(iter(images), "one")) == images
            live.send("next")
            picture = live.recv(WAIT_S)
            assert picture.startswith(b"\xff\xd8")
            shown = json.loads(live.recv(WAIT_S))
    assert shown["words"][-1]["sentence"] == "let your arm hang"
    assert shown["stage"]["step"] == "the board is detected"
    (line,) = shown["arm"]["lines"]
    assert line["points"] == [[1.0, 2.0], [3.0, 4.0], [5.0, 6.0]]
    assert not line["closed"]
    assert len(shown["arm"]["balls"]) == 3


def test_a_page_that_is_followed_lets_browsers_wait(tmp_path):
    with contextlib.ExitStack() as stack:
        with PageServer(tmp_path, followed=True) as first:
            visitor = Visitor(first.port)
            visitor.open_link(first.link)
            live = stack.enter_context(visitor.socket())
            live.recv(WAIT_S)
        messages, code = until_closed(live)
    assert code == 1012
    assert not any("ended" in json.loads(one) for one in messages)
    with PageServer(tmp_path) as second:
        assert second.port == first.port
        visitor.key = visitor.next_key
        with visitor.socket() as again:
            assert "beat" in json.loads(again.recv(WAIT_S))
