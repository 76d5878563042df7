"""Answers that may still come to questions that nobody answered in time, told from others by their lengths.

After silences, a read asks for some bytes more than it needs: an answer to an earlier question then has the wrong
length. Servos answer in the order of the questions, so an answer to one of them says that nobody answers any more to
those before it.
"""

from __future__ import annotations

import time
from collections import deque

MOST_OWED, MANY_OWED, REST_S = 16, 8, 0.05
"""So many lengths are remembered; when many are owed, one question in a while is enough: an arm that comes back has
little to answer, and a length is used again after half a second."""


class LateAnswers:
    """Lengths of the data that is owed, oldest first."""

    def __init__(self) -> None:
        self._lengths: deque[int] = deque(maxlen=MOST_OWED)
        self._asked_s = 0.0

    def __bool__(self) -> bool:
        """Whether any may come."""
        return bool(self._lengths)

    @property
    def many(self) -> bool:
        """Whether it is time to ask less often."""
        return len(self._lengths) >= MANY_OWED

    @property
    def rest_s(self) -> float:
        """Until the next question, if many are owed."""
        return max(0.0, self._asked_s + REST_S - time.monotonic()) if self.many else 0.0

    def length_for(self, size: int) -> int:
        """As few bytes as possible, from `size` on, that no late answer has."""
        return next(one for one in range(size, size + MOST_OWED + 1) if one not in self._lengths)

    def asked(self) -> None:
        """A question goes out now."""
        self._asked_s = time.monotonic()

    def answered(self) -> None:
        """Somebody answered the question that was asked last."""
        self._lengths.clear()

    def missed(self, length: int) -> None:
        """Somebody did not answer it in time, with so many bytes of data."""
        self._lengths.append(length)

    def heard(self, length: int) -> None:
        """An answer of this length came late."""
        for _ in range(self._lengths.index(length) if length in self._lengths else 0):
            self._lengths.popleft()
