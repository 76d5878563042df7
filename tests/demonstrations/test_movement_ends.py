"""The last parts of movements that a body tracker's model learns from."""

import numpy as np

from paramove.demonstrations import table_place
from paramove.demonstrations.movement_ends import FRAMES, last_parts


def test_last_parts_end_where_they_point():
    shown = last_parts("pointing", ("elbow", "index"), persons=2, repetitions=1)
    assert len(shown.sequences) == len(shown.theta) == len(shown.groups) == 30
    assert {sequence.shape for sequence in shown.sequences} == {(FRAMES, 6)}
    ends = np.array([sequence[-1, 3:] for sequence in shown.sequences])
    missed = np.linalg.norm(ends - table_place(shown.theta), axis=1)
    assert np.median(missed) < 0.03  # sizes and seats are known to a centimetre or two
    begins = np.array([sequence[0, 3:] for sequence in shown.sequences])
    assert np.linalg.norm(begins - ends, axis=1).min() > 0.1
    assert 0.5 < shown.duration_s < 1.5
    assert sorted(set(shown.groups)) == [0, 1]


def test_the_hand_rests_at_the_end():
    for sequence in last_parts("pointing", ("wrist", "index"), persons=1, repetitions=1).sequences:
        hand = sequence[:, 3:]
        assert np.linalg.norm(hand[-1] - hand[-5]) < 0.5 * np.linalg.norm(hand[4] - hand[0])


def test_the_same_seed_shows_the_same():
    one, other = (last_parts("reaching", ("elbow", "wrist"), 3, persons=1, repetitions=1) for _ in range(2))
    np.testing.assert_array_equal(one.sequences, other.sequences)
