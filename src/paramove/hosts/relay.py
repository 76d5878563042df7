"""Forwards the topics that cross between this host and others, each once per host, as they are.

A topic's messages keep epoch and sequence of their publisher, so that a subscriber on another host counts what is lost
exactly as one on the same host. Times become those of this host's clock. What a person requests at another host is
published as the relay's own, as the topic is this host's persons'. While the hosts reply from which the arm's commands
come, the relay reports that to the arm's driver. What stops an arm, or keeps it going, has a connection of its own and
is forwarded before and between all else, so that nothing delays a stop. So have images, of which only the latest one
waits for a slow link. In lockstep the members' answers cross as well: the simulator's
host watches the relay in place of a member, and the relay on the member's host reports its end.
"""

from __future__ import annotations

import contextlib
import logging
import math
import os
import select
import time
from typing import Any, NamedTuple

import zmq
from google.protobuf.message import DecodeError  # type: ignore[import-untyped]

from paramove.bus import (
    FLAG_LAST_VALUE,
    FLAG_RING,
    FLAG_WELCOME,
    SIZE,
    Bus,
    Envelope,
    Publisher,
    RejectedError,
    Subscriber,
    Topic,
    answers_socket,
    can_read,
    decoded,
    member_mark,
    member_socket,
    pack,
    schema_hash,
    topics,
    unpack,
)
from paramove.hosts.clock_offset import ClockOffset
from paramove.hosts.keys import HostKeyError, HostKeys
from paramove.hosts.link import (
    BEAT_S,
    IMAGES_BEAT_S,
    MAX_ASKED_BYTES,
    MOST_AT_ONCE,
    Answered,
    Asker,
    Content,
    Gatekeeper,
    Offer,
    Rejections,
    Request,
    Taken,
)
from paramove.hosts.own_time import LARGEST_BOUND_NS, UnknownTimeError, in_own_time
from paramove.hosts.settings import Peer, RelaySettings
from paramove.msgs.clock_pb2 import TickDone, TopicMark
from paramove.msgs.safety_state_pb2 import LinkState

UNDER_WAY = 2
"""Images of a topic on their way to a host at once."""
_LONGEST_POLL_S = 0.02
_LOOK_S = 0.25
_log = logging.getLogger(__name__)


class _Lanes(NamedTuple):
    """Connections to one host, in the order in which they are read: one of them never waits for another's messages.

    Attributes:
        urgent: Requests to stop and to arm. By its replies the link is watched.
        topics: All other topics but images.
        images: They come from an offer of their own.
    """

    urgent: Request
    topics: Request
    images: Request


class Relay:
    """One host's relay, while it is a context.

    Args:
        bus: Of its node; used for its status, folder and name.
        settings: What crosses, and how the hosts are reached.

    Attributes:
        detail: The links, for people; renewed every second.
    """

    def __init__(self, bus: Bus, settings: RelaySettings) -> None:
        self._bus, self._settings = bus, settings
        self._opened = contextlib.ExitStack()
        keys = HostKeys(settings.keys)
        own, trusted = keys.own(), set(keys.trusted().values())
        if strangers := [host for host, peer in settings.peers.items() if peer.key not in trusted]:
            names = ", ".join(strangers)
            raise HostKeyError(f"the keys of {names} are not trusted here: `paramove host trust`, from the launcher")
        self._owned = self._opened.enter_context(contextlib.ExitStack())  # released after the contexts have ended
        self._here: zmq.Context[Any] = self._opened.enter_context(zmq.Context())
        away: zmq.Context[Any] = self._opened.enter_context(zmq.Context())
        self._gate = Gatekeeper(away, {host: peer.key for host, peer in settings.peers.items()})
        self._opened.callback(self._gate.close)
        self._poller = zmq.Poller()
        self._rejections = Rejections()
        endpoint = f"tcp://{settings.address}:"
        self._offers = tuple(
            Offer(away, f"{endpoint}{settings.port + index}", own, settings.peers, f"relay {name}", self._rejections)
            for index, name in enumerate(("topics", "images"))
        )
        self._foreign = [offer.foreign for offer in self._offers]
        self._real_time = bus.settings.clock == "monotonic"
        beat_s = BEAT_S if self._real_time else IMAGES_BEAT_S
        self._requests: dict[str, _Lanes] = {}
        self._topics: dict[str, Topic] = {}
        self._sources: dict[str, _Source] = {}
        self._publishers: dict[str, Publisher] = {}
        self._urgent_publishers: list[Publisher] = []
        for host, peer in settings.peers.items():
            rows = {name: topics.by_name(row) for name, row in {**peer.wants, **peer.gives}.items()}
            self._topics |= rows
            for name in peer.wants.keys() - self._sources.keys():  # a topic may cross to several hosts
                self._sources[name] = _Source(self._here, bus, rows[name], name)
            urgent = frozenset(name for name in peer.gives if rows[name].is_urgent)
            images = frozenset(name for name in peer.gives if rows[name].is_image)
            largest = max((rows[name].max_bytes for name in peer.gives), default=0)
            reach = host, self._rejections, max(largest, MAX_ASKED_BYTES)
            self._requests[host] = _Lanes(
                Request(away, peer.port, own, peer, urgent, *reach, beat_s),
                Request(away, peer.port, own, peer, frozenset(peer.gives) - urgent - images, *reach),
                Request(away, peer.port + 1, own, peer, images, *reach),
            )
        self._urgent = tuple(source for source in self._sources.values() if source.topic.is_urgent)
        bus.exchange.forwards(self._sources)
        self._answers: _Answers | None = None
        if settings.clock_from is not None:
            self._answers = _Answers(self._here, bus, frozenset(settings.members))
            self._foreign.append(self._answers.foreign)
            self._owned.callback(self._answers.ownership.release)
        self._members: dict[str, zmq.Socket[Any]] = {}
        self._latest: dict[tuple[str, str], tuple[int, int]] = {}
        self._link = LinkState(hosts=sorted(host for host, peer in settings.peers.items() if peer.commands))
        self._confirmed_ns = 0
        for peer in settings.peers.values():
            self._open_requests(peer)
        self._look_due_s = self._detail_due_s = 0.0
        self.detail = ""
        ends: list[Subscriber | Offer | Request | _Answers] = [*self._ends(), *self._offers]
        for end in [*ends, self._answers] if self._answers else ends:
            self._poller.register(end.socket, zmq.POLLIN)
            self._opened.callback(end.close)

    def __enter__(self) -> Relay:
        return self

    def __exit__(self, *_: object) -> None:
        self._opened.close()

    @property
    def trouble(self) -> str:
        """Which links are down, and of which hosts the clock is not known well; "" if there are none."""
        down = [host for host, lanes in self._requests.items() if not (lanes.urgent.is_up and lanes.topics.is_up)]
        if down:
            return f"no link to {', '.join(down)}"
        now_ns, allowed_ms = time.monotonic_ns(), 1e-6 * LARGEST_BOUND_NS
        bounds_ms = {
            host: 1e-6 * max(lanes.urgent.clock.bound_ns(now_ns), lanes.topics.clock.bound_ns(now_ns))
            for host, lanes in self._requests.items()
        }
        return "; ".join(
            f"the clock of {host} is known to {bound_ms:.0f} ms, allowed {allowed_ms:g} ms: its commands are rejected"
            for host, bound_ms in bounds_ms.items()
            if self._real_time and bound_ms > allowed_ms
        )

    def _links(self) -> str:
        rejected = self._gate.rejected + self._rejections.total
        links = [
            f"{host}: {_milliseconds(lanes.urgent.round_trip_s)}{_about(lanes.urgent.clock) if self._real_time else ''}"
            for host, lanes in sorted(self._requests.items())
        ]
        more = [f"{rejected} rejected"] if rejected else []
        blocked = sum(offer.blocked for offer in self._offers)
        return ", ".join([*links, *more, *([f"{blocked} lost on a slow link"] if blocked else [])])

    def step(self) -> None:
        """Waits for something to forward, at most 20 ms, and forwards all that there is."""
        due_s = min(request.ask() for request in self._each_request())
        now_s = time.monotonic()
        if now_s >= self._look_due_s:
            self._look_due_s = now_s + _LOOK_S
            self._look_after()
        ready = {socket for socket, _ in self._poller.poll(round(1e3 * min(max(0.0, due_s - now_s), _LONGEST_POLL_S)))}
        for publisher in self._publishers.values():
            if publisher.socket in ready:
                publisher.serve()
        self._forward_urgent()
        for source in self._sources.values():
            for envelope, payload in source.messages() if source.subscriber.socket in ready else ():
                self._send_all(source, envelope, payload)
                self._forward_urgent()
        for offer in self._offers:
            for asker, message, behind, new in offer.requests() if offer.socket in ready else ():
                if isinstance(message, Answered):
                    self._answer(asker.host, *behind)
                elif isinstance(message, Taken):
                    self._taken(offer, asker, message.topic)
                for name in sorted(new):
                    self._greet(offer, asker, self._sources[name])
        for host, lanes in self._requests.items():
            for request in (lanes.topics, lanes.images):
                for name, header, payload in request.messages() if request.socket in ready else ():
                    self._publish(request, host, name, header, payload)
                    self._forward_urgent()
        if self._answers is not None and self._settings.clock_from is not None:
            request = self._requests[self._settings.clock_from].topics
            for header, payload in self._answers.collect() if request.is_up else ():
                request.send(Answered(), header, payload)

    def _each_request(self) -> list[Request]:
        return [request for lanes in self._requests.values() for request in lanes]

    def _ends(self) -> list[Subscriber | Request]:
        """Those that receive, and that may have to be opened anew."""
        return [*(source.subscriber for source in self._sources.values()), *self._each_request()]

    def _look_after(self) -> None:
        if time.monotonic() >= self._detail_due_s:
            self._detail_due_s, self.detail = time.monotonic() + 1.0, self._links()
        for end in self._ends():
            before = end.socket
            if end.revive():
                self._poller.unregister(before)
                self._poller.register(end.socket, zmq.POLLIN)
        for foreign in self._foreign:
            foreign.look()
        for offer in self._offers:
            offer.forget_silent()

    def _forward_urgent(self) -> None:
        """Both ways, all that there is, and the state of the link; called between any two other messages."""
        for publisher in self._urgent_publishers:
            publisher.serve()
        for source in self._urgent:
            for envelope, payload in source.messages():
                self._send_all(source, envelope, payload)
        for host, lanes in self._requests.items():
            lanes.urgent.ask()
            for name, header, payload in lanes.urgent.messages():
                self._publish(lanes.urgent, host, name, header, payload)
        self._report_link()

    # -- what others want ---------------------------------------------------------------------------------------------

    def _send_all(self, source: _Source, envelope: Envelope, payload: bytes) -> None:
        offer, is_image = self._offers[source.topic.is_image], source.topic.is_image and not envelope.is_welcome
        frames = source.frames(envelope, payload)
        for asker in list(offer.askers.values()):
            if source.name not in asker.wanted:
                continue
            if is_image and asker.under_way[source.name] >= UNDER_WAY:
                asker.waiting[source.name] = frames  # the one that waited is no longer the latest
            elif offer.send(asker, source.head, *frames):
                asker.under_way[source.name] += is_image

    def _taken(self, offer: Offer, asker: Asker, name: str) -> None:
        asker.under_way[name] = max(0, asker.under_way[name] - 1)
        if name in asker.waiting:
            asker.under_way[name] += offer.send(asker, self._sources[name].head, *asker.waiting.pop(name))

    def _greet(self, offer: Offer, asker: Asker, source: _Source) -> None:
        """A host that asks anew gets the state of the topic: from where on to count, and the last value."""
        state = source.state()
        if state is not None:
            offer.send(asker, source.head, *source.frames(*state))

    def _answer(self, host: str, header: bytes, payload: bytes) -> None:
        """A member on another host has answered a tick: this process stands for it at the simulator's."""
        try:
            envelope = unpack(header, payload, schema_hash(TickDone), MAX_ASKED_BYTES)
            answer = TickDone.FromString(payload)
        except (RejectedError, DecodeError) as error:
            self._rejections.add(host, f"answer of lockstep: {error}")
            return
        if answer.node not in self._settings.peers[host].members:
            self._rejections.add(host, f"answer of lockstep: {answer.node!r:.60} is no member on that host")
            return
        answer.watched_pid = os.getpid()
        payload = answer.SerializeToString()
        if answer.node not in self._members:
            self._members[answer.node] = member_socket(self._here, self._bus.settings.folder, answer.node)
            self._opened.callback(self._members[answer.node].close)
        with contextlib.suppress(zmq.Again):
            self._members[answer.node].send_multipart([pack(envelope, payload), payload], zmq.NOBLOCK)

    # -- what others give ---------------------------------------------------------------------------------------------

    def _open_requests(self, peer: Peer) -> None:
        """Opens the topics of persons and programs there: their first message waits for no subscriber here."""
        for name, row in peer.gives.items():
            if row in topics.AWAY:
                self._publisher(topics.AWAY[row], _away_name(name, row))
            elif name in peer.outside:
                self._publisher(self._topics[name], name)

    def _publish(self, request: Request, host: str, name: str, header: bytes, payload: bytes) -> None:
        topic = self._topics[name]
        away = topics.AWAY.get(topic.name)
        now_ns, message = time.monotonic_ns(), None
        try:
            envelope = unpack(header, payload, schema_hash(topic.type), topic.max_bytes)
            if topic.is_image and not envelope.is_welcome:
                request.send(Taken(topic=name))
            if self._real_time and envelope.has_message:
                envelope, message = in_own_time(topic, envelope, payload, request.clock, now_ns)
            elif away is not None and envelope.has_message:
                message = decoded(topic, payload)
        except (RejectedError, UnknownTimeError) as error:
            self._rejections.add(host, f"topic {name}: {error}")
            return
        if away is None:
            payload = payload if message is None else message.SerializeToString(deterministic=True)
            self._publisher(topic, name).forward(envelope._replace(flags=envelope.flags & ~FLAG_RING), payload)
        elif message is not None and self._latest.get((host, name)) != (envelope.epoch, envelope.sequence):
            self._latest[host, name] = envelope.epoch, envelope.sequence  # a new link repeats the last one
            self._publisher(away, _away_name(name, topic.name)).publish(message, envelope.captured_ns, now_ns)

    def _publisher(self, topic: Topic, name: str) -> Publisher:
        if name not in self._publishers:
            publisher = Publisher(self._here, self._bus.settings.folder, topic, self._bus.node, name)
            self._owned.callback(publisher.ownership.release)
            self._opened.callback(publisher.close)
            self._foreign.append(publisher.foreign)
            self._publishers[name] = publisher
            if topic.is_urgent:
                self._urgent_publishers.append(publisher)
            self._poller.register(publisher.socket, zmq.POLLIN)
        return self._publishers[name]

    # -- the link as a part of the arm's safety -----------------------------------------------------------------------

    def _report_link(self) -> None:
        """Once all hosts that command have answered a later request."""
        confirmed_ns = min((self._requests[host].urgent.confirmed_ns for host in self._link.hosts), default=0)
        if confirmed_ns > self._confirmed_ns:
            self._confirmed_ns = confirmed_ns
            self._link.captured.FromNanoseconds(confirmed_ns)
            topic = topics.HOSTS_LINK
            self._publisher(topic, topic.name).publish(self._link, confirmed_ns, time.monotonic_ns())


def _milliseconds(round_trip_s: float) -> str:
    """In whole milliseconds, so that a status does not change all the time."""
    if not math.isfinite(round_trip_s):
        return "no reply yet"
    return f"replies within {math.ceil(1e3 * round_trip_s)} ms"


def _about(clock: ClockOffset) -> str:
    now_ns, drift = time.monotonic_ns(), clock.drift
    bound_ns = clock.bound_ns(now_ns)
    if not math.isfinite(bound_ns):
        return ""
    jumps = f", {clock.jumps} jumps" if clock.jumps else ""
    drifts = "" if drift is None else f", drift {1e6 * drift[0]:+.0f} ± {1e6 * drift[1]:.0f} ppm"
    return f", clock {1e-9 * clock.offset_ns(now_ns):+.3f} s ± {math.ceil(1e-6 * bound_ns)} ms{drifts}{jumps}"


class _Source:
    """One topic of this host, as it is published.

    Attributes:
        head: First frame of its messages on a link.
    """

    def __init__(self, context: zmq.Context[Any], bus: Bus, topic: Topic, name: str) -> None:
        self.topic, self.name = topic, name
        self.head = Content(topic=name)
        by_own_clock = bus.settings.clock == "monotonic"
        self.subscriber = Subscriber(context, bus.settings.folder, topic, name, bus.node, by_own_clock)
        self._known: tuple[int | None, int] = (None, 0)
        self._last: tuple[Envelope, bytes] | None = None

    def frames(self, envelope: Envelope, payload: bytes) -> list[bytes]:
        """Header and payload of a message as it crosses."""
        return [pack(envelope, payload), payload]

    def messages(self) -> list[tuple[Envelope, bytes]]:
        """What has come in; a welcome where only that has shown how far the publisher is."""
        found = []
        for _ in range(MOST_AT_ONCE):
            raw = self.subscriber.receive_raw()
            if raw is None:
                break
            envelope, payload = raw
            envelope = envelope._replace(flags=envelope.flags & ~FLAG_RING)
            self._known = (envelope.epoch, envelope.sequence)
            self._last = (envelope, payload) if self.topic.profile is topics.Profile.LATCHED else None
            found.append((envelope, payload))
        counter = self.subscriber.counter
        if (counter.epoch, counter.sequence) != self._known:
            self._known, self._last = (counter.epoch, counter.sequence), None
            if (state := self.state()) is not None:
                found.append(state)
        return found

    def state(self) -> tuple[Envelope, bytes] | None:
        """The welcome for a new subscriber; None while the publisher is not known."""
        epoch, sequence = self._known
        if epoch is None:
            return None
        if self._last is not None:
            envelope, payload = self._last
            return envelope._replace(flags=FLAG_WELCOME | FLAG_LAST_VALUE), payload
        return Envelope(schema_hash(self.topic.type), 0, epoch, sequence, 0, 0, flags=FLAG_WELCOME), b""


class _Answers:
    """Answers of this host's members of lockstep, whose simulator runs on another host; others are left out."""

    def __init__(self, context: zmq.Context[Any], bus: Bus, members: frozenset[str]) -> None:
        self._members = members
        self.socket, self.ownership, self.foreign = answers_socket(
            context, bus.settings.folder, bus.node, MAX_ASKED_BYTES
        )
        self._pidfds: dict[str, tuple[int, int]] = {}

    def collect(self) -> list[tuple[bytes, bytes]]:
        """Header and answer of each, and a farewell for a member that has ended without one."""
        found = []
        for _ in range(MOST_AT_ONCE):
            if not can_read(self.socket):
                break
            frames = self.socket.recv_multipart(zmq.NOBLOCK)
            if len(frames) == 3 and len(frames[1]) == SIZE and self._follow(frames[2]):
                found.append((frames[1], frames[2]))
        ended = select.select([descriptor for _, descriptor in self._pidfds.values()], [], [], 0.0)[0]
        return found + [self._farewell(node) for node, (_, its) in list(self._pidfds.items()) if its in ended]

    def _follow(self, payload: bytes) -> bool:
        """Whether it is an answer of a member; the process of one that joins is watched."""
        try:
            answer = TickDone.FromString(payload)
        except DecodeError:
            return False
        if answer.node not in self._members:
            return False
        if answer.kind in (TickDone.KIND_JOIN, TickDone.KIND_LEAVE):
            self._forget(answer.node)
        if answer.kind == TickDone.KIND_JOIN:
            with contextlib.suppress(OSError, OverflowError):  # no process has this number
                self._pidfds[answer.node] = (answer.pid, os.pidfd_open(answer.pid))
        return True

    def _farewell(self, node: str) -> tuple[bytes, bytes]:
        pid = self._pidfds[node][0]
        self._forget(node)
        mark = TopicMark(topic=member_mark(node), epoch=pid, sequence=0)
        payload = TickDone(node=node, pid=pid, kind=TickDone.KIND_LEAVE, published=[mark]).SerializeToString()
        return pack(Envelope(schema_hash(TickDone), 0, 0, 0, 0, 0), payload), payload

    def _forget(self, node: str) -> None:
        if node in self._pidfds:
            os.close(self._pidfds.pop(node)[1])

    def close(self) -> None:
        """Closes the socket; its path may be given up when its context has ended."""
        for node in list(self._pidfds):
            self._forget(node)
        self.foreign.close()
        self.socket.close()


def _away_name(name: str, row: str) -> str:
    """Name on the bus of what persons at other hosts request by the topic `name`, in the namespace of that arm."""
    namespace, local = topics.split_name(name)
    return topics.name_in(namespace if local == row else "", topics.AWAY[row].name)
