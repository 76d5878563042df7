"""Connections to the page that have not proved yet to be a browser with its key: how many of whom may be open."""

from __future__ import annotations

import socket
import struct
from collections.abc import Callable, Iterator
from typing import Any, Generic, TypeVar

OWN, EACH, OTHERS = 64, 8, 32
"""Of the page's own user; of each other user; of all other users together."""

SCREENED_AT_ONCE = 8
"""Connections that are ended, at most, before others have their turn."""
_RESET = struct.pack("ii", 1, 0)
"""SO_LINGER that ends a connection at once, and leaves nothing of it in the kernel."""
Connection = TypeVar("Connection")


class OpeningConnections(Generic[Connection]):
    """Other users get a few and never take a place of the page's own user, whose oldest one gives way to a new one.

    So silent and slow connections keep no browser out: it needs milliseconds to prove itself.

    Args:
        owner: User id of the page's process.
    """

    def __init__(self, owner: int) -> None:
        self._owner = owner
        self._users: dict[Connection, int | None] = {}

    def __len__(self) -> int:
        return len(self._users)

    def __iter__(self) -> Iterator[Connection]:
        return iter(list(self._users))

    def admits(self, user: int | None) -> bool:
        """Whether this user may have one more; None: unknown."""
        if user == self._owner:
            return True
        foreign = [of for of in self._users.values() if of != self._owner]
        return len(foreign) < OTHERS and foreign.count(user) < EACH

    def add(self, connection: Connection, user: int | None) -> Connection | None:
        """Adds one; returns the user's oldest one, which is to be closed, if there are too many."""
        self._users[connection] = user
        same = [other for other, of in self._users.items() if of == user]
        return self._removed(same[0]) if len(same) > (OWN if user == self._owner else EACH) else None

    def remove(self, connection: Connection) -> None:
        """It has proved itself, or is closed."""
        self._users.pop(connection, None)

    def _removed(self, connection: Connection) -> Connection:
        del self._users[connection]
        return connection


class ScreenedSocket(socket.socket):
    """A socket that listens on a port, and ends connections that are not admitted before anything is done for them.

    Args:
        address: IPv4 address and port.
        admits: Decides about a connection by both its addresses, this end's first.
    """

    def __init__(self, address: tuple[str, int], admits: Callable[[tuple[str, int], tuple[str, int]], bool]) -> None:
        super().__init__(socket.AF_INET, socket.SOCK_STREAM)
        self._admits = admits
        try:
            self.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            self.bind(address)
        except OSError as error:
            self.close()
            raise OSError(error.errno, f"{error.strerror}: {address[0]} port {address[1]}") from error

    def accept(self) -> tuple[socket.socket, Any]:
        """The next connection that is admitted; BlockingIOError also after several that are not."""
        for _ in range(SCREENED_AT_ONCE):
            connection, peer = super().accept()
            if self._admits(connection.getsockname(), peer):
                return connection, peer
            connection.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, _RESET)
            connection.close()
        raise BlockingIOError
