"""The two ends of a link between hosts: ZeroMQ's TCP with CURVE both ways.

Each relay offers its topics at a ROUTER and asks the other hosts for theirs with a DEALER. Who asks is known by its key
alone: it is pinned, so no host can take another one's place, and gets only what the launch file lets cross to it. What
a host gives is checked against the topics that may come from it. Frames, after the kind of the message:

    WANT     names of topics                        asker to offerer, five times a second
    BEAT     time of sending                        asker to offerer, 10 times a second, 100 for commands
    BEAT     that time, time of the reply           the reply, each by its own host's monotonic clock
    MESSAGE  topic and header, payload              offerer to asker
    TAKEN    name of a topic                        asker to offerer: an image has arrived, send the next
    DONE     header, answer                         asker to offerer: a member of lockstep has answered
"""

from __future__ import annotations

import contextlib
import logging
import struct
import time
from collections import Counter
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any

import zmq
from zmq.auth.thread import ThreadAuthenticator

from paramove.bus import ForeignConnections, can_read, is_logged
from paramove.hosts.clock_offset import ClockOffset
from paramove.hosts.keys import KeyPair
from paramove.hosts.settings import Peer

WANT, BEAT, MESSAGE, TAKEN, DONE = b"W", b"B", b"M", b"C", b"D"
WANT_S, BEAT_S, IMAGES_BEAT_S = 0.2, 0.01, 0.1
LOST_S = 2.0
"""Without a reply for so long, a connection counts as lost."""
REOPEN_S = 4.0
MAX_ASKED_BYTES = 65_536
_TIME = struct.Struct("<q")
_log = logging.getLogger(__name__)


@dataclass
class Asker:
    """A connected host, while it asks.

    Attributes:
        identity: Of its connection.
        host: Its name.
        wanted: Names of the topics that it wants and may have.
        latest_s: When it asked last.
        under_way: By topic, how many images it has not confirmed.
        waiting: By topic, the latest image that waits until it has.
    """

    identity: bytes
    host: str
    wanted: frozenset[str] = frozenset()
    latest_s: float = 0.0
    under_way: Counter[str] = field(default_factory=Counter)
    waiting: dict[str, list[bytes]] = field(default_factory=dict)


class Gatekeeper:
    """Lets only those hosts connect whose keys are pinned; a thread of pyzmq answers for it.

    Attributes:
        rejected: How many connections had another key.
    """

    def __init__(self, context: zmq.Context[Any], hosts: Mapping[str, str]) -> None:
        self._keys = {key.encode("ascii") for key in hosts.values()}
        self.rejected = 0
        self._authenticator = ThreadAuthenticator(context)
        self._authenticator.start()
        self._authenticator.configure_curve_callback("*", self)
        self._authenticator.configure_curve_callback("paramove", self)

    def callback(self, domain: str, key: bytes) -> bool:
        """Whether this key may connect; called by pyzmq."""
        known = key in self._keys
        self.rejected += not known
        if is_logged(self.rejected) and not known:
            _log.warning("a computer with the unknown key %s was rejected (number %d)", key.decode(), self.rejected)
        return known

    def close(self) -> None:
        """Ends the thread."""
        self._authenticator.stop()


class Offer:
    """The offering end, for all hosts.

    Args:
        context: With a `Gatekeeper`.
        endpoint: Where it is bound, `tcp://ADDRESS:PORT`.
        own: Keys of this host.
        peers: The hosts that may ask.
        name: For the log.

    Attributes:
        askers: Those who are connected, by their identity.
        blocked: Messages for which a slow link had no room.
        rejected: Requests that a host may not make.
        foreign: Connections that did not speak ZeroMQ with CURVE.
    """

    def __init__(
        self, context: zmq.Context[Any], endpoint: str, own: KeyPair, peers: Mapping[str, Peer], name: str
    ) -> None:
        self.askers: dict[bytes, Asker] = {}
        self.blocked = self.rejected = 0
        self._hosts = {peer.key: host for host, peer in peers.items()}
        self._may_have = {host: frozenset(peer.wants) for host, peer in peers.items()}
        self.socket: zmq.Socket[Any] = context.socket(zmq.ROUTER)
        self.socket.setsockopt(zmq.CURVE_SERVER, 1)
        self.socket.setsockopt_string(zmq.CURVE_SECRETKEY, own.secret)
        self.socket.setsockopt(zmq.ROUTER_MANDATORY, 1)
        self.socket.setsockopt(zmq.SNDHWM, 1000)
        self.socket.setsockopt(zmq.MAXMSGSIZE, MAX_ASKED_BYTES)
        _keep_alive(self.socket)
        self.foreign = ForeignConnections(self.socket, name)
        self.socket.bind(endpoint)

    def requests(self) -> Iterator[tuple[Asker, bytes, list[bytes], frozenset[str]]]:
        """What has come in: who asks, kind, frames, and the topics that it wants and did not want before."""
        while can_read(self.socket):
            frames = self.socket.recv_multipart(zmq.NOBLOCK, copy=False)
            identity, content = frames[0].bytes, [frame.bytes for frame in frames[1:]]
            asker = self.askers.get(identity)
            if asker is None:
                host = self._hosts.get(str(frames[-1].get("User-Id")), "")
                asker = self.askers[identity] = Asker(identity, host)
            asker.latest_s = time.monotonic()
            new: frozenset[str] = frozenset()
            if content[:1] == [BEAT] and len(content) == 2 and len(content[1]) == _TIME.size:
                self.send(asker, BEAT, content[1], _TIME.pack(time.monotonic_ns()))
                continue
            if content[:1] == [WANT] and len(content) == 2:
                names = frozenset(filter(None, content[1].decode("utf-8", "replace").split("\n")))
                allowed = names & self._may_have.get(asker.host, frozenset())
                self.rejected += allowed != names
                new, asker.wanted = allowed - asker.wanted, allowed
            elif content[:1] not in ([TAKEN], [DONE]):
                self.rejected += 1
                continue
            yield asker, content[0], content[1:], new

    def forget_silent(self) -> None:
        """Hosts that do not ask any more have gone."""
        now_s = time.monotonic()
        self.askers = {one: asker for one, asker in self.askers.items() if now_s - asker.latest_s < LOST_S}

    def send(self, asker: Asker, *frames: bytes) -> bool:
        """Sends to one host; whether it could be sent at once."""
        try:
            self.socket.send_multipart([asker.identity, *frames], zmq.NOBLOCK)
        except zmq.Again:
            self.blocked += 1
            return False
        except zmq.ZMQError as error:
            if error.errno != zmq.EHOSTUNREACH:
                raise
            self.askers.pop(asker.identity, None)
            return False
        return True

    def close(self) -> None:
        """Closes the socket."""
        self.foreign.close()
        self.socket.close(linger=200)


class Request:
    """The asking end, to one host.

    Args:
        context: Of ZeroMQ.
        port: Of the offer there.
        own: Keys of this host.
        peer: Whom it asks: its pinned key must be the one there.
        names: Of the topics that it wants.
        beat_s: Time between two beats; default: where no command waits for it.

    Attributes:
        clock: That of the other host.
        rejected: Messages of topics that may not come from there.
        round_trip_s: The shortest of the last ten seconds.
        confirmed_ns: When the latest request was sent that has been answered, 0 before: what the other host gave until
            then has arrived.
    """

    def __init__(
        self,
        context: zmq.Context[Any],
        port: int,
        own: KeyPair,
        peer: Peer,
        names: frozenset[str],
        beat_s: float = IMAGES_BEAT_S,
    ) -> None:
        self.names = names
        self.clock = ClockOffset()
        self.rejected = 0
        self.round_trip_s = float("nan")
        self.confirmed_ns = 0
        self._latest_s = 0.0
        self._best_s = float("-inf")
        self._beat_s, self._beat_due_s, self._want_due_s = beat_s, 0.0, 0.0
        self._context, self._own, self._peer, self._port = context, own, peer, port
        self._open()

    @property
    def is_up(self) -> bool:
        """Whether the host replies."""
        return time.monotonic() - self._latest_s < LOST_S

    def ask(self) -> float:
        """Asks for the topics, and how late it is there, if that is due; returns when it is due again, s."""
        now_s = time.monotonic()
        if now_s >= self._beat_due_s:  # first: no message comes before the clock there is known
            self._beat_due_s = now_s + self._beat_s
            self.send(BEAT, _TIME.pack(time.monotonic_ns()))
        if now_s >= self._want_due_s:
            self._want_due_s = now_s + WANT_S
            self.send(WANT, "\n".join(sorted(self.names)).encode())
        return min(self._beat_due_s, self._want_due_s)

    def send(self, *frames: bytes) -> None:
        """Sends, unless the connection is down and too much waits already."""
        with contextlib.suppress(zmq.Again):
            self.socket.send_multipart(frames, zmq.NOBLOCK)

    def messages(self) -> Iterator[tuple[str, bytes, bytes]]:
        """What has come in: name on the bus, header, payload."""
        while can_read(self.socket):
            frames = self.socket.recv_multipart(zmq.NOBLOCK)
            if frames[0] == BEAT and [len(frame) for frame in frames[1:]] == [_TIME.size] * 2:
                self._measure(*_TIME.unpack(frames[1]), *_TIME.unpack(frames[2]))
                continue
            name, mark, header = frames[1].partition(b"\0") if len(frames) == 3 else (b"", b"", b"")
            if frames[0] != MESSAGE or not mark or name.decode("utf-8", "replace") not in self.names:
                self.rejected += 1
                if is_logged(self.rejected):
                    _log.warning("a message of %r is not to come from there (number %d)", name[:80], self.rejected)
                continue
            yield name.decode(), header, frames[2]

    def revive(self) -> bool:
        """Reopens the socket after a while without a reply; returns whether it did.

        libzmq gives up for good once somebody else has answered at that port, who lacks the other host's key.
        """
        if time.monotonic() - max(self._latest_s, self._opened_s) < REOPEN_S:
            return False
        self.socket.close(linger=0)
        self._open()
        return True

    def close(self) -> None:
        """Closes the socket."""
        self.socket.close(linger=200)

    def _open(self) -> None:
        self._opened_s = time.monotonic()
        self.socket: zmq.Socket[Any] = self._context.socket(zmq.DEALER)
        self.socket.setsockopt_string(zmq.CURVE_SERVERKEY, self._peer.key)
        self.socket.setsockopt_string(zmq.CURVE_PUBLICKEY, self._own.public)
        self.socket.setsockopt_string(zmq.CURVE_SECRETKEY, self._own.secret)
        self.socket.setsockopt(zmq.RCVHWM, 1000)
        self.socket.setsockopt(zmq.IMMEDIATE, 1)  # what cannot be sent now would be of no use later
        self.socket.setsockopt(zmq.RECONNECT_IVL, 50)
        self.socket.setsockopt(zmq.RECONNECT_IVL_MAX, 500)
        _keep_alive(self.socket)
        self.socket.connect(f"tcp://{self._peer.address}:{self._port}")

    def _measure(self, sent_ns: int, there_ns: int) -> None:
        now_ns = time.monotonic_ns()
        if not 0 < sent_ns <= now_ns:
            self.rejected += 1
            return
        self._latest_s, round_trip_s = 1e-9 * now_ns, 1e-9 * (now_ns - sent_ns)
        self.confirmed_ns = max(sent_ns, self.confirmed_ns)
        self.clock.add(sent_ns, there_ns, now_ns)
        if not round_trip_s > self.round_trip_s or self._latest_s - self._best_s > 10.0:
            self._best_s, self.round_trip_s = self._latest_s, round_trip_s


def _keep_alive(socket: zmq.Socket[Any]) -> None:
    """A cut that TCP would notice after minutes ends the connection, and it is made anew."""
    socket.setsockopt(zmq.HANDSHAKE_IVL, round(1000 * LOST_S))
    socket.setsockopt(zmq.HEARTBEAT_IVL, 500)
    socket.setsockopt(zmq.HEARTBEAT_TIMEOUT, round(1000 * LOST_S))
    socket.setsockopt(zmq.HEARTBEAT_TTL, round(1000 * LOST_S))
