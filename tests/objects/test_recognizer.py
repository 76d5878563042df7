import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from paramove.msgs.plane_calibration_pb2 import PlaneCalibration
from paramove.msgs.tracked_objects_pb2 import TrackedObject
from paramove.objects.homography import HomographyError
from paramove.objects.recognizer import Recognizer
from tests.objects.tracks import HEIGHT, Play, hand_with_tip, image_of, line, standing

AWAY = (60.0, 330.0)


def _resting(*places: tuple[str, float, float]) -> Play:
    return Play().show(*(standing(*place) for place in places), ticks=12)


def test_an_object_at_rest_appears_once() -> None:
    play = Play().show(standing("blue", 200, 150), ticks=7)
    assert play.kinds("blue") == []
    play.show(standing("blue", 200, 150), ticks=60)
    assert play.kinds("blue") == ["APPEARED"]
    assert (play.gestures[0].u_px, play.gestures[0].v_px) == (200, 150)


def test_scatter_of_the_borders_is_no_motion() -> None:
    draw = np.random.default_rng(1)
    play = _resting(("blue", 200, 150))
    for _ in range(300):
        play.show(standing("blue", 200 + draw.normal(0, 0.4), 150 + draw.normal(0, 0.4)))
    assert play.kinds("blue") == ["APPEARED"]


def test_flicker_of_one_frame_is_nothing() -> None:
    play = _resting(("blue", 200, 150))
    play.show().show(standing("blue", 200, 150), ticks=5)
    play.show(standing("blue", 320, 80)).show(standing("blue", 200, 150), ticks=5)
    play.show(standing("blue", 200, 150), standing("green", 90, 90)).show(standing("blue", 200, 150), ticks=40)
    assert play.kinds("blue") == ["APPEARED"]
    assert play.kinds("green") == []


def test_carried_object_moves_and_rests() -> None:
    play = _resting(("blue", 200, 150))
    for u, v in line((200, 150), (280, 180), 20):
        play.show(standing("blue", u, v))
    play.show(standing("blue", 280, 180), ticks=10)
    assert play.kinds("blue") == ["APPEARED", "MOVED", "RESTED"]
    assert (play.gestures[1].u_px, play.gestures[1].v_px) == (200, 150)
    assert (play.gestures[2].u_px, play.gestures[2].v_px) == (280, 180)


@pytest.mark.parametrize("cut", [{"cut_above": 12.0}, {"cut_below": 12.0}, {"cut_above": 8.0, "cut_below": 8.0}])
def test_partly_hidden_is_no_motion(cut: dict[str, float]) -> None:
    play = _resting(("blue", 200, 150)).show(standing("blue", 200, 150, **cut), ticks=20)
    play.show(standing("blue", 200, 150), ticks=10)
    assert play.kinds("blue") == ["APPEARED"]


def test_a_hidden_place_of_rest_is_said_again_when_seen_in_full() -> None:
    play = _resting(("blue", 200, 150))
    for u, v in line((200, 150), (280, 180), 20):
        play.show(standing("blue", u, v, cut_above=8.0))
    play.show(standing("blue", 280, 180, cut_above=8.0), ticks=50)
    assert play.kinds("blue") == ["APPEARED", "MOVED", "RESTED"]
    assert play.gestures[-1].confidence < 0.9
    play.show(standing("blue", 280, 180), ticks=20)
    assert play.kinds("blue") == ["APPEARED", "MOVED", "RESTED", "RESTED"]
    assert play.gestures[-1].v_px == pytest.approx(180, abs=0.1)
    assert play.gestures[-1].confidence > 0.9


def test_hidden_by_the_arm_while_carried_vanishes_and_appears_elsewhere() -> None:
    play = _resting(("blue", 200, 150))
    for u, v in line((200, 150), (230, 150), 8):
        play.show(standing("blue", u, v))
    play.show(ticks=15).show(standing("blue", 280, 180), ticks=12)
    assert play.kinds("blue") == ["APPEARED", "MOVED", "VANISHED", "APPEARED"]
    assert play.gestures[2].u_px == pytest.approx(230, abs=1)
    assert play.gestures[3].u_px == 280


def test_an_object_that_the_hand_covers_has_not_vanished() -> None:
    play = _resting(("blue", 200, 150))
    play.show(hand_with_tip(215, 150), ticks=40).show(standing("blue", 200, 150), ticks=20)
    assert "VANISHED" not in play.kinds("blue")
    play.show(ticks=40)
    assert play.kinds("blue")[-1] == "VANISHED"
    assert (play.gestures[-1].u_px, play.gestures[-1].v_px) == (200, 150)


def _sink(play: Play, u: float, v: float, step: float, cut_above: float) -> None:
    """Lower an object from 40 px above (u, v) into an opening whose near rim hides all below the standing object."""
    for height in np.arange(40.0, 0.0, -step):
        play.show(standing("blue", u, v - height, cut_above=cut_above))
    depth = 0.0
    while HEIGHT - cut_above - depth > 1.0:
        play.show(standing("blue", u, v + depth, cut_above=cut_above, cut_below=depth))
        depth += step


@settings(deadline=None, max_examples=30, derandomize=True)
@given(st.floats(2.5, 14.0), st.floats(0.0, 20.0), st.floats(150, 330), st.floats(100, 200))
def test_vanished_where_it_stood_at_full_height(step: float, cut_above: float, u: float, v: float) -> None:
    play = _resting(("blue", 100, 150))
    for place in line((100, 150), (u, v - 40), 15):
        play.show(standing("blue", *place, cut_above=cut_above))
    play.show(standing("blue", u, v - 40, cut_above=cut_above), ticks=3)  # people stop before they change direction
    _sink(play, u, v, step, cut_above)
    play.show(ticks=12)
    assert play.kinds("blue") == ["APPEARED", "MOVED", "VANISHED"]
    assert play.gestures[-1].u_px == pytest.approx(u, abs=1.0)
    assert play.gestures[-1].v_px == pytest.approx(v, abs=1.5)


def test_a_remnant_in_the_opening_is_neither_rest_nor_appearance() -> None:
    play = _resting(("blue", 100, 150))
    for place in line((100, 150), (250, 110), 15):
        play.show(standing("blue", *place))
    _sink(play, 250, 150, 4.0, 0.0)
    play.show(standing("blue", 250, 178, cut_below=28.0), ticks=90)
    assert play.kinds("blue") == ["APPEARED", "MOVED", "VANISHED"]
    assert play.gestures[-1].v_px == pytest.approx(150, abs=1.5)


def test_the_hand_comes_and_goes_once() -> None:
    play = Play().show(hand_with_tip(*AWAY), ticks=20).show().show(hand_with_tip(*AWAY), ticks=3).show(ticks=20)
    assert play.kinds("") == ["HAND_APPEARED", "HAND_VANISHED"]


THREE = (("blue", 200.0, 150.0), ("green", 250.0, 150.0), ("yellow", 300.0, 150.0))


def _three() -> list[TrackedObject]:
    return [standing(*place) for place in THREE]


def test_a_hand_that_stays_near_points_once() -> None:
    play = _resting(*THREE)
    for u, v in line(AWAY, (190, 140), 10):
        play.show(*_three(), hand_with_tip(u, v))
    play.show(*_three(), hand_with_tip(190, 140), ticks=60)
    assert [g.object for g in play.gestures if g.kind == g.KIND_POINTED_AT] == ["blue"]
    pointed = play.gestures[-1]
    assert (pointed.u_px, pointed.v_px) == (200, 150)


def test_after_leaving_the_hand_can_point_again() -> None:
    play = _resting(*THREE)
    for _ in range(2):
        play.show(*_three(), hand_with_tip(190, 140), ticks=25).show(*_three(), hand_with_tip(*AWAY), ticks=5)
    assert play.kinds("blue").count("POINTED_AT") == 2


def test_a_hand_that_passes_by_does_not_point() -> None:
    play = _resting(*THREE)
    for u, v in line((60, 140), (420, 140), 50):  # 7 px, a centimetre, per image
        play.show(*_three(), hand_with_tip(u, v))
    assert not [g for g in play.gestures if g.kind == g.KIND_POINTED_AT]


def test_between_two_objects_nothing_is_pointed_at() -> None:
    play = _resting(("blue", 200, 150), ("green", 225, 150))
    play.show(standing("blue", 200, 150), standing("green", 225, 150), hand_with_tip(212, 140), ticks=30)
    assert not [g for g in play.gestures if g.kind == g.KIND_POINTED_AT]


def test_the_hand_that_puts_an_object_down_does_not_point_at_it() -> None:
    play = Play().show(standing("blue", 200, 100), hand_with_tip(190, 90), ticks=12)
    for u, v in line((200, 100), (200, 150), 12):
        play.show(standing("blue", u, v), hand_with_tip(u - 10, v - 10))
    play.show(standing("blue", 200, 150), hand_with_tip(190, 140), ticks=30)
    assert "POINTED_AT" not in play.kinds("blue")
    play.show(standing("blue", 200, 150), hand_with_tip(*AWAY), ticks=5)
    play.show(standing("blue", 200, 150), hand_with_tip(190, 140), ticks=25)
    assert play.kinds("blue")[-1] == "POINTED_AT"


def test_nothing_is_pointed_at_while_an_object_moves() -> None:
    play = _resting(*THREE)
    for u, v in line((300, 150), (300, 220), 40):
        play.show(*_three()[:2], standing("yellow", u, v), hand_with_tip(190, 140))
    moved = next(i for i, g in enumerate(play.gestures) if g.kind == g.KIND_MOVED)
    rested = next((i for i, g in enumerate(play.gestures) if g.kind == g.KIND_RESTED), len(play.gestures))
    assert not [g for g in play.gestures[moved:rested] if g.kind == g.KIND_POINTED_AT]


def test_an_image_that_is_not_newer_is_ignored() -> None:
    recognizer = Recognizer()
    for _ in range(30):
        assert recognizer.update(image_of(1_000_000_000, standing("blue", 200, 150))) == []


def test_refuses_a_calibration_without_homography() -> None:
    with pytest.raises(HomographyError, match="nine finite"):
        Recognizer().update(image_of(1, standing("blue", 200, 150)), PlaneCalibration(plane_from_image=[1.0]))


def test_a_hand_with_the_name_of_an_object_does_no_harm() -> None:
    play = _resting(("blue", 200, 150))
    hand = hand_with_tip(300, 200)
    hand.name = "blue"
    play.show(hand, ticks=2).show(standing("blue", 200, 150), ticks=20)
    assert play.kinds("blue") == ["APPEARED"]
