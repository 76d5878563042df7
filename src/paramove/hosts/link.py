"""The two ends of a link between hosts: ZeroMQ's TCP with CURVE both ways.

Each relay offers its topics at a ROUTER and asks the other hosts for theirs with a DEALER. Who asks is known by its key
alone: it is pinned, so no host can take another one's place, and gets only what the launch file lets cross to it. What
a host gives is checked against the topics that may come from it. The first frame is one of the messages below:

    Want      names of topics                        asker to offerer, five times a second
    Beat      time of sending                        asker to offerer, 10 times a second, 100 for what is urgent
    Beat      that time, time of the reply           the reply, each by its own host's monotonic clock
    Content   topic; header, payload                 offerer to asker; header and payload are those of the bus
    Taken     topic                                  asker to offerer: an image has arrived, send the next
    Answered  header, answer                         asker to offerer: a member of lockstep has answered
"""

from __future__ import annotations

import contextlib
import logging
import time
from collections import Counter
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import Annotated, Any, Literal

import zmq
from pydantic import Field
from zmq.auth.thread import ThreadAuthenticator

from paramove.bus import LATEST_NS, ForeignConnections, can_read, is_logged
from paramove.documents import Message, MessageError, MessageReader, Text
from paramove.hosts.clock_offset import ClockOffset
from paramove.hosts.keys import KeyPair
from paramove.hosts.settings import Peer

WANT_S, BEAT_S, IMAGES_BEAT_S = 0.2, 0.01, 0.1
LOST_S = 2.0
"""Without a reply for so long, a connection counts as lost."""
REOPEN_S = 4.0
MAX_ASKED_BYTES = 65_536
MOST_AT_ONCE = 100
"""Messages read from one socket before the others have their turn."""
MOST_CONNECTIONS = 8
"""Of one host at once: two, and those that it has left in the last `LOST_S`."""
_log = logging.getLogger(__name__)

Nanoseconds = Annotated[int, Field(ge=0, le=LATEST_NS)]


class Want(Message):
    """Names of the topics that a host asks for."""

    kind: Literal["want"] = "want"
    names: list[Text] = Field(max_length=1000)


class Beat(Message):
    """A round trip, by which clocks are compared and links watched."""

    kind: Literal["beat"] = "beat"
    sent_ns: Nanoseconds
    there_ns: Nanoseconds | None = None


class Content(Message):
    """A message of the bus, in the two frames that follow."""

    kind: Literal["content"] = "content"
    topic: Text


class Taken(Message):
    """An image has arrived."""

    kind: Literal["taken"] = "taken"
    topic: Text


class Answered(Message):
    """An answer of a member of lockstep, in the two frames that follow."""

    kind: Literal["answered"] = "answered"


Asked = Want | Beat | Taken | Answered
ASKED: MessageReader[Any] = MessageReader(Want, Beat, Taken, Answered, max_bytes=MAX_ASKED_BYTES)
GIVEN: MessageReader[Any] = MessageReader(Beat, Content, max_bytes=MAX_ASKED_BYTES)
_FRAMES_BEHIND: dict[type[Message], int] = {Content: 2, Answered: 2}


def _read(reader: MessageReader[Any], frames: list[bytes]) -> tuple[Any, list[bytes]]:
    """The message in the first frame, and those behind it; raises MessageError if their number does not fit."""
    message = reader.read(frames[0])
    behind = frames[1:]
    if len(behind) != _FRAMES_BEHIND.get(type(message), 0):
        raise MessageError(f"{len(behind)} frames behind {message.kind}")
    return message, behind


class Rejections:
    """Counts what hosts may not send, and logs the 1st, 10th, 100th … of each host: a flood fills no disk."""

    def __init__(self) -> None:
        self._counts: Counter[str] = Counter()

    @property
    def total(self) -> int:
        """Of all hosts."""
        return self._counts.total()

    def add(self, host: str, reason: str) -> None:
        """Counts one message of a host."""
        self._counts[host] += 1
        if is_logged(self._counts[host]):
            _log.warning("message from %s rejected: %s (number %d)", host, reason, self._counts[host])


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
        rejections: Counts requests that a host may not make.

    Attributes:
        askers: Those who are connected, by their identity.
        blocked: Messages for which a slow link had no room.
        foreign: Connections that did not speak ZeroMQ with CURVE.
    """

    def __init__(
        self,
        context: zmq.Context[Any],
        endpoint: str,
        own: KeyPair,
        peers: Mapping[str, Peer],
        name: str,
        rejections: Rejections,
    ) -> None:
        self.askers: dict[bytes, Asker] = {}
        self.blocked = 0
        self._rejections = rejections
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

    def requests(self) -> Iterator[tuple[Asker, Asked, list[bytes], frozenset[str]]]:
        """What has come in: who asks, what, frames behind it, and the topics that it wants and did not want before."""
        for _ in range(MOST_AT_ONCE):
            if not can_read(self.socket):
                return
            frames = self.socket.recv_multipart(zmq.NOBLOCK, copy=False)
            host = self._hosts.get(str(frames[-1].get("User-Id")), "")
            asker = self._asker(frames[0].bytes, host) if host else None
            if asker is None:
                self._rejections.add(host, f"more than {MOST_CONNECTIONS} connections at once")
                continue
            asker.latest_s = time.monotonic()
            try:
                message, behind = _read(ASKED, [frame.bytes for frame in frames[1:]])
                if isinstance(message, Taken) and message.topic not in asker.wanted:
                    raise MessageError(f"topic {message.topic!r:.60} was not sent there")
            except MessageError as error:
                self._rejections.add(host, str(error))
                continue
            if isinstance(message, Beat):
                self.send(asker, Beat(sent_ns=message.sent_ns, there_ns=time.monotonic_ns()))
                continue
            new: frozenset[str] = frozenset()
            if isinstance(message, Want):
                allowed = self._may_have.get(host, frozenset()).intersection(message.names)
                if forbidden := sorted(set(message.names) - allowed):
                    self._rejections.add(host, f"topic {forbidden[0]!r:.60} does not cross to it")
                new, asker.wanted = allowed - asker.wanted, allowed
            yield asker, message, behind, new

    def _asker(self, identity: bytes, host: str) -> Asker | None:
        """The connection with this identity; None for a new one of a host that has too many."""
        asker = self.askers.get(identity)
        if asker is not None:
            return asker
        if sum(asker.host == host for asker in self.askers.values()) >= MOST_CONNECTIONS:
            return None
        self.askers[identity] = Asker(identity, host)
        return self.askers[identity]

    def forget_silent(self) -> None:
        """Hosts that do not ask any more have gone."""
        now_s = time.monotonic()
        self.askers = {one: asker for one, asker in self.askers.items() if now_s - asker.latest_s < LOST_S}

    def send(self, asker: Asker, message: Message, *behind: bytes) -> bool:
        """Sends to one host; whether it could be sent at once."""
        try:
            self.socket.send_multipart([asker.identity, message.line(), *behind], zmq.NOBLOCK)
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
        host: Its name.
        rejections: Counts what may not come from there.
        max_bytes: Of a frame.
        beat_s: Time between two beats; default: where nothing urgent waits for it.

    Attributes:
        clock: That of the other host.
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
        host: str,
        rejections: Rejections,
        max_bytes: int,
        beat_s: float = IMAGES_BEAT_S,
    ) -> None:
        self.names = names
        self.clock = ClockOffset()
        self._host, self._rejections, self._max_bytes = host, rejections, max_bytes
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
            self.send(Beat(sent_ns=time.monotonic_ns()))
        if now_s >= self._want_due_s:
            self._want_due_s = now_s + WANT_S
            self.send(Want(names=sorted(self.names)))
        return min(self._beat_due_s, self._want_due_s)

    def send(self, message: Message, *behind: bytes) -> None:
        """Sends, unless the connection is down and too much waits already."""
        with contextlib.suppress(zmq.Again):
            self.socket.send_multipart([message.line(), *behind], zmq.NOBLOCK)

    def messages(self) -> Iterator[tuple[str, bytes, bytes]]:
        """What has come in: name on the bus, header, payload."""
        for _ in range(MOST_AT_ONCE):
            if not can_read(self.socket):
                return
            frames = self.socket.recv_multipart(zmq.NOBLOCK)
            try:
                message, behind = _read(GIVEN, frames)
                if isinstance(message, Beat):
                    self._measure(message)
                    continue
                if message.topic not in self.names:
                    raise MessageError(f"topic {message.topic!r:.60} is not to come from there")
            except MessageError as error:
                self._rejections.add(self._host, str(error))
                continue
            yield message.topic, behind[0], behind[1]

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
        self.socket.setsockopt(zmq.MAXMSGSIZE, self._max_bytes)
        self.socket.setsockopt(zmq.IMMEDIATE, 1)  # what cannot be sent now would be of no use later
        self.socket.setsockopt(zmq.RECONNECT_IVL, 50)
        self.socket.setsockopt(zmq.RECONNECT_IVL_MAX, 500)
        _keep_alive(self.socket)
        self.socket.connect(f"tcp://{self._peer.address}:{self._port}")

    def _measure(self, reply: Beat) -> None:
        now_ns = time.monotonic_ns()
        sent_ns, there_ns = reply.sent_ns, reply.there_ns
        if there_ns is None or not 0 < sent_ns <= now_ns:
            raise MessageError("a reply to a beat that was never sent")
        self._latest_s, round_trip_s = 1e-9 * now_ns, 1e-9 * (now_ns - sent_ns)
        self.confirmed_ns = max(sent_ns, self.confirmed_ns)
        jumps = self.clock.jumps
        self.clock.add(sent_ns, there_ns, now_ns)
        if self.clock.jumps > jumps and is_logged(self.clock.jumps):
            _log.warning("the clock of %s has jumped (number %d); it is estimated anew", self._host, self.clock.jumps)
        if not round_trip_s > self.round_trip_s or self._latest_s - self._best_s > 10.0:
            self._best_s, self.round_trip_s = self._latest_s, round_trip_s


def _keep_alive(socket: zmq.Socket[Any]) -> None:
    """A cut that TCP would notice after minutes ends the connection, and it is made anew."""
    socket.setsockopt(zmq.HANDSHAKE_IVL, round(1000 * LOST_S))
    socket.setsockopt(zmq.HEARTBEAT_IVL, 500)
    socket.setsockopt(zmq.HEARTBEAT_TIMEOUT, round(1000 * LOST_S))
    socket.setsockopt(zmq.HEARTBEAT_TTL, round(1000 * LOST_S))
