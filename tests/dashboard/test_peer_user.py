"""The user at the other end of a connection, from the kernel."""

from __future__ import annotations

import os
import socket
import subprocess
import sys

import pytest

from paramove.dashboard.peer_user import PeerUsers

CONNECT = """
import os, socket, sys
"".encode("idna")  # loaded while this user may read it
os.setgroups([])
os.setuid(int(sys.argv[2]))
with socket.create_connection(("127.0.0.1", int(sys.argv[1]))) as connection:
    connection.recv(1)
"""


@pytest.mark.skipif(os.geteuid() != 0, reason="only root can become another user")
@pytest.mark.parametrize("user", [0, 1000, 65534])
def test_it_is_that_of_the_process_that_connected(user: int) -> None:
    with PeerUsers() as users, socket.create_server(("127.0.0.1", 0)) as server:
        command = [sys.executable, "-I", "-c", CONNECT, str(server.getsockname()[1]), str(user)]
        with subprocess.Popen(command):
            connection, peer = server.accept()
            with connection:
                assert users.of(connection.getsockname(), peer) == user


def test_a_closed_connection_and_one_that_never_was_have_no_user() -> None:
    with PeerUsers() as users, socket.create_server(("127.0.0.1", 0)) as server:
        with socket.create_connection(server.getsockname()) as client:
            connection, peer = server.accept()
            assert users.of(connection.getsockname(), peer) == os.geteuid()
            client.close()
            assert users.of(connection.getsockname(), peer) is None
            connection.close()
        assert users.of(("127.0.0.1", 1), ("127.0.0.1", 2)) is None
