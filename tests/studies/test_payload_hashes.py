"""What counts as the same in two measurements of payloads and numbers."""

import pytest

from studies.payload_hashes import same

NAN = float("nan")


@pytest.mark.parametrize(
    ("before", "after", "expected"),
    [
        (1, 1.0, True),
        (1, 1.5, False),
        (NAN, NAN, True),
        (NAN, 1.0, False),
        (1, None, False),
        ({"9": "a", "10": "b"}, {"9": "a", "10": "b"}, True),
        ({"9": "a", "10": "b"}, {"10": "b", "11": "c"}, True),
        ({"9": "a", "10": "b"}, {"10": "c", "11": "d"}, False),
        ({"9": "a"}, {"70": "b"}, False),
        ({"9": "a"}, None, False),
    ],
)
def test_two_runs_are_the_same_up_to_the_end_of_the_shorter_one(before, after, expected):
    assert same(before, after) is expected
    assert same(after, before) is expected
