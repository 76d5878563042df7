"""Where cylinders are put."""

from __future__ import annotations

import numpy as np
import pytest

from sim import places


def test_redraw_rate_is_small(capsys: pytest.CaptureFixture[str]) -> None:
    """A layout is drawn again only because the swept open hand would touch another cylinder."""
    rate = places.redraw_rate(seed=0, count=1000)
    with capsys.disabled():
        print(f"\nlayouts drawn again: {100 * rate:.1f} %")  # noqa: T201 - the rate is to be seen in the test's output
    assert 0.0 < rate < 0.4  # the hand is broad: fingers, open thumb and wrist housing


def test_layouts_leave_gaps_and_room_for_the_hand() -> None:
    draw = np.random.default_rng(1)
    for _ in range(100):
        layout, _ = places.draw_layout(draw)
        apart = np.linalg.norm(layout[:, None] - layout[None], axis=2)[~np.eye(3, dtype=bool)]
        assert apart.min() >= places.MIN_GAP
        assert (layout[:, 0] >= places.STRIP_X[0]).all()
        assert (layout[:, 0] <= places.STRIP_X[1]).all()
        assert places.hand_has_room(layout)


def test_hand_has_no_room_where_another_cylinder_stands_in_its_way() -> None:
    target = np.array((0.185, -0.02))
    ahead = (target - places.ELBOW) / np.linalg.norm(target - places.ELBOW)
    right, left = np.array((ahead[1], -ahead[0])), np.array((-ahead[1], ahead[0]))
    before = target - 0.03 * ahead
    assert not places.hand_has_room(np.array((target, before + 0.035 * right)))
    assert not places.hand_has_room(np.array((target, before + 0.043 * left)))
    # Each of two neighbours has the other on one side, so the wider side decides.
    assert not places.hand_has_room(np.array((target, target + 0.045 * right)))
    assert places.hand_has_room(np.array((target, target + 0.052 * right)))
    assert places.hand_has_room(np.array((target, target + 0.052 * left)))


def test_another_place_keeps_clear_of_what_stands() -> None:
    draw = np.random.default_rng(2)
    standing = [np.array((0.185, -0.07)), np.array((0.180, 0.05))]
    for _ in range(20):
        place = places.draw_place(draw, standing)
        assert min(np.linalg.norm(place - other) for other in standing) >= places.MIN_GAP
