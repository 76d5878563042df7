"""User of the process at the other end of a loopback TCP connection, from the kernel's table of sockets."""

from __future__ import annotations

import contextlib
import os
import socket
import struct
from types import TracebackType

SOCK_DIAG = 4
"""Netlink family; see sock_diag(7)."""
SOCK_DIAG_BY_FAMILY, NLM_F_REQUEST = 20, 1
ALL_STATES, ESTABLISHED = 0xFFFFFFFF, 1
NO_COOKIE = b"\xff" * 8

_HEADER = struct.Struct("=IHHII")
_REQUEST = struct.Struct("=BBBBI")
_PORTS = struct.Struct("!HH")
_ANSWER = struct.Struct("=BBBB48xIIIII")
"""inet_diag_msg: family, state, timer, retransmissions, the socket's id, expires, queues, user, inode."""


class PeerUsers:
    """Asks the kernel for one connection at a time: `/proc/net/tcp` would be read as a whole for each. Use as context.

    Root and other network namespaces may stand behind a connection, too: a container's proxy, ssh's forwarding.
    """

    def __init__(self) -> None:
        self._netlink: socket.socket | None = None
        with contextlib.suppress(OSError):
            self._netlink = socket.socket(socket.AF_NETLINK, socket.SOCK_RAW | socket.SOCK_NONBLOCK, SOCK_DIAG)
        self._number = 0

    def __enter__(self) -> PeerUsers:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if self._netlink is not None:
            self._netlink.close()

    def of(self, own: tuple[str, int], peer: tuple[str, int]) -> int | None:
        """User id of the process with the socket whose own address is `peer`; None if it is closed already.

        Where the kernel does not answer, as in a sandbox, everybody counts as this process's user.

        Args:
            own: IPv4 address and port of this end. peer: of the other end.
        """
        if self._netlink is None:
            return os.geteuid()
        self._number += 1
        connection = b"".join(
            (
                _PORTS.pack(peer[1], own[1]),
                socket.inet_aton(peer[0]).ljust(16, b"\0"),
                socket.inet_aton(own[0]).ljust(16, b"\0"),
                bytes(4),
                NO_COOKIE,
            )
        )
        request = _REQUEST.pack(socket.AF_INET, socket.IPPROTO_TCP, 0, 0, ALL_STATES) + connection
        length = _HEADER.size + len(request)
        try:
            self._netlink.send(_HEADER.pack(length, SOCK_DIAG_BY_FAMILY, NLM_F_REQUEST, self._number, 0) + request)
            answer = self._netlink.recv(8192)
        except OSError:
            return None
        _, kind, _, number, _ = _HEADER.unpack_from(answer)
        if kind != SOCK_DIAG_BY_FAMILY or number != self._number:
            return None
        _, state, _, _, _, _, _, user, _ = _ANSWER.unpack_from(answer, _HEADER.size)
        return int(user) if state == ESTABLISHED else None
