"""Where a topic's socket lies in the file system, and who owns it.

libzmq's `ipc://` bind removes whatever lies at its path: a second publisher would silently take the topic over, and a
regular file would be gone. A lock file next to the socket, held for the publisher's life, prevents both.
"""

from __future__ import annotations

import fcntl
import os
import socket
import stat
from collections.abc import Mapping
from pathlib import Path
from types import TracebackType
from typing import Any

import zmq

from paramove.bus.connecting import locked_inodes
from paramove.bus.monitor import ForeignConnections
from paramove.documents import checked_name

PATH_BYTES = 107
"""Longest path of a Unix socket on Linux."""


class BusFolderError(Exception):
    """The bus folder cannot be used; the text says what to do."""


class TopicTakenError(Exception):
    """Another process already publishes this topic; the text names it."""


def socket_path(folder: Path, name: str) -> Path:
    """Path of the socket of the topic or service `name`.

    Raises InputError for a name that no file can have, BusFolderError for a path that is too long for a socket.
    """
    path = folder / checked_name(name.replace("/", "."), "topic")
    size = len(os.fsencode(path))
    if size > PATH_BYTES:
        raise BusFolderError(
            f"socket path {path} has {size} bytes, Linux allows {PATH_BYTES}; choose a bus folder that is at least "
            f"{size - PATH_BYTES} bytes shorter"
        )
    return path


def holder_of(path: Path) -> str:
    """What the holder of a socket path wrote into its lock, such as "pid 12 (camera)"; "" if nobody ever held it."""
    try:
        text = path.with_name(path.name + ".lock").read_text(encoding="utf-8", errors="replace")
    except OSError:
        return ""
    return text.partition("\n")[0][:200].strip()


def owner_of(path: Path) -> int | None:
    """Process id of the owner of a socket path; None if nobody owns it now."""
    words = holder_of(path).split()
    return int(words[1]) if words[:1] == ["pid"] and words[1].isdecimal() and is_held(path) else None


def is_held(path: Path) -> bool:
    """Whether a process holds the lock of the socket `path`, without touching lock or socket."""
    try:
        return path.with_name(path.name + ".lock").stat().st_ino in locked_inodes()
    except OSError:
        return False


def prepare_folder(folder: Path) -> None:
    """Makes the bus folder (mode 0700); raises BusFolderError if it belongs to others or is open to them."""
    try:
        folder.mkdir(mode=0o700, parents=True, exist_ok=True)
        folder_stat = folder.stat()
    except OSError as error:
        raise BusFolderError(
            f"bus folder {folder}: {error.strerror}; choose another one with $XDG_RUNTIME_DIR"
        ) from error
    if folder_stat.st_uid != os.geteuid():
        raise BusFolderError(f"bus folder {folder} belongs to user {folder_stat.st_uid}, not to us ({os.geteuid()})")
    if folder_stat.st_mode & 0o077:
        mode = stat.S_IMODE(folder_stat.st_mode)
        raise BusFolderError(f"bus folder {folder} is open to other users (mode {mode:04o}); run: chmod 700 {folder}")


class Ownership:
    """The right to bind one socket path, held until `release` or the end of the process.

    Raises:
        TopicTakenError: another living process holds it; names its pid.
        BusFolderError: something that is not our own stale socket lies at the path. It is not touched.
    """

    def __init__(self, path: Path, holder: str) -> None:
        self.path = path
        lock_path = path.with_name(path.name + ".lock")
        flags = os.O_RDWR | os.O_CREAT | os.O_CLOEXEC | os.O_NOFOLLOW
        try:
            self._lock = os.open(lock_path, flags, 0o600)
        except OSError as error:
            raise BusFolderError(f"lock {lock_path}: {error.strerror}; remove it and start again") from error
        try:
            fcntl.flock(self._lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
            _check_free(path)
        except BlockingIOError:
            owner = holder_of(path) or "a process that just started"
            os.close(self._lock)
            topic = path.name.replace(".", "/")
            raise TopicTakenError(f"{topic} is already published by {owner}; a topic has one publisher") from None
        except BusFolderError:
            os.close(self._lock)
            raise
        self._holder = f"pid {os.getpid()} ({holder})\n"
        self.write("")

    def write(self, more: str) -> None:
        """Writes who holds the lock and, from the second line on, `more` into the lock's file."""
        content = (self._holder + more).encode()
        os.pwrite(self._lock, content, 0)
        os.ftruncate(self._lock, len(content))

    def release(self) -> None:
        """Gives the path up. The socket must be closed before: libzmq removes its file when it closes."""
        if self._lock >= 0:
            os.close(self._lock)
            self._lock = -1

    def __enter__(self) -> Ownership:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.release()


def bound_socket(
    context: zmq.Context[Any], kind: int, folder: Path, name: str, holder: str, options: Mapping[zmq.SocketOption, int]
) -> tuple[zmq.Socket[Any], Ownership, ForeignConnections]:
    """A socket at the path of a topic or service, which no other process may have.

    Args:
        context: Of ZeroMQ; the ownership may be released only after it was terminated.
        kind: Of socket.
        folder: Bus folder.
        name: Of the topic or service.
        holder: Name of the node, for the error that a second process gets.
        options: Options of the socket and their values.

    Raises:
        TopicTakenError, BusFolderError: see `Ownership`.
    """
    path = socket_path(folder, name)
    ownership = Ownership(path, holder)
    socket: zmq.Socket[Any] = context.socket(kind)
    for option, value in options.items():
        socket.setsockopt(option, value)
    foreign = ForeignConnections(socket, name)
    socket.bind(f"ipc://{path}")
    return socket, ownership, foreign


def _check_free(path: Path) -> None:
    """Raises BusFolderError if there is anything at `path` but a socket of ours that no process listens on."""
    try:
        socket_stat = path.lstat()
    except FileNotFoundError:
        return
    if not stat.S_ISSOCK(socket_stat.st_mode):
        raise BusFolderError(f"{path} exists and is not a socket; it is not touched, move it away")
    if socket_stat.st_uid != os.geteuid():
        raise BusFolderError(f"socket {path} belongs to user {socket_stat.st_uid}, not to us ({os.geteuid()})")
    if is_alive(path):
        raise BusFolderError(f"a process listens on {path} without holding its lock; end that process")


def is_alive(path: Path) -> bool:
    """Whether a process listens on the socket `path`. Never waits."""
    with socket.socket(socket.AF_UNIX, socket.SOCK_STREAM) as probe:
        probe.setblocking(False)
        try:
            probe.connect(os.fspath(path))
        except BlockingIOError:
            return True  # the subscriber's queue is full: a process listens
        except OSError:
            return False
    return True
