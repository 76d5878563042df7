"""How many connections of whom may be open before they prove anything."""

from __future__ import annotations

from paramove.dashboard.opening import EACH, OTHERS, OWN, OpeningConnections

OWNER = 1000


def test_another_user_gets_a_few() -> None:
    opening = OpeningConnections[str](OWNER)
    for number in range(EACH):
        assert opening.admits(7)
        assert opening.add(f"a{number}", 7) is None
    assert not opening.admits(7)
    assert opening.add("accepted in the same round", 7) == "a0"
    assert opening.admits(8)
    assert opening.admits(None)


def test_the_owner_keeps_its_places_whatever_others_do() -> None:
    opening = OpeningConnections[str](OWNER)
    for number in range(OWN):
        assert opening.add(f"own{number}", OWNER) is None
    for user in (None, 0, *range(2000, 2100)):
        if opening.admits(user):
            assert opening.add(f"of {user}", user) is None
    assert len(opening) == OWN + OTHERS
    assert opening.admits(OWNER)
    assert opening.add("own, new", OWNER) == "own0"


def test_one_that_proved_itself_or_is_closed_counts_no_more() -> None:
    opening = OpeningConnections[str](OWNER)
    for number in range(3 * EACH):
        assert opening.add(f"a{number}", 7) is None
        opening.remove(f"a{number}")
        opening.remove(f"a{number}")
    assert len(opening) == 0
