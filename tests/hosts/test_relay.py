"""Topics from one host to another: the very same messages, counted as on one host."""

from __future__ import annotations

import contextlib
import os
import selectors
import socket
import time

import numpy as np
import pytest
from foxglove_schemas_protobuf.RawImage_pb2 import RawImage

from benchmarks.fuzz_protocols import RawHost
from benchmarks.hosts import free_ports
from paramove.bus import LATEST_NS, Envelope, pack, schema_hash, topics
from paramove.hosts import HostKeyError, HostKeys, link, relay
from paramove.hosts.own_time import in_own_time
from paramove.msgs.clock_pb2 import TickDone
from paramove.msgs.joint_trajectory_pb2 import JointTrajectory
from paramove.msgs.parameters_pb2 import ParameterRequest
from paramove.msgs.rule_pb2 import Rule, Rules, Speech
from paramove.msgs.safety_state_pb2 import ArmRequest, StopRequest


def test_messages_arrive_as_they_were_published_each_once(two_hosts):
    hosts = two_hosts((topics.SPEECH,))
    published, subscriber = hosts.connected(topics.SPEECH)
    received = []

    def receive():
        while (one := subscriber.receive()) is not None:
            received.append(one)

    for number in range(200):
        published.publish(Speech(text=str(number)), 10 * number, 10 * number + 1)
    hosts.until(lambda: len(received) == 200, receive)
    assert [one.message.text for one in received] == [str(number) for number in range(200)]
    assert [(one.sequence, one.captured_ns, one.published_ns) for one in received] == [
        (number + 1, 10 * number, 10 * number + 1) for number in range(200)
    ]
    counter = subscriber.counter
    assert (counter.lost, counter.repeated, counter.rejected.total()) == (0, 0, 0)
    assert counter.epoch == published.epoch


def test_a_latched_topic_is_there_for_who_comes_late_whichever_came_first(two_hosts):
    hosts = two_hosts((topics.RULES,), ())
    published = hosts.visitor("here").publisher(topics.RULES)
    published.publish(Rules(rules=[Rule(object="blue")]), 1, 1)
    hosts.start("here")
    hosts.until(lambda: True, published.serve)
    hosts.start("there")
    subscriber = hosts.visitor("there").subscriber(topics.RULES)
    received = hosts.until(subscriber.receive, published.serve)
    assert received.message.rules[0].object == "blue"
    assert subscriber.counter.lost == 0


def test_a_restarted_publisher_is_a_new_epoch_and_no_loss(two_hosts):
    hosts = two_hosts((topics.SPEECH,))
    subscriber = hosts.visitor("there").subscriber(topics.SPEECH)
    hosts.start()
    for start in range(3):
        with hosts.visitor("here") as visitor:
            published = visitor.publisher(topics.SPEECH)
            hosts.until(lambda: subscriber.counter.epoch == published.epoch, subscriber.receive, published.serve)  # noqa: B023
            published.publish(Speech(text=str(start)), 1, 1)
            assert hosts.until(subscriber.receive).message.text == str(start)
    assert (subscriber.counter.epochs, subscriber.counter.lost) == (3, 0)


def test_images_cross_too_and_only_the_latest_waits_for_a_slow_reader(two_hosts):
    hosts = two_hosts((topics.CAMERA_IMAGE_RAW,))
    published, subscriber = hosts.connected(topics.CAMERA_IMAGE_RAW)
    pixels = np.random.default_rng(0).integers(0, 256, (480, 640, 3), dtype=np.uint8).tobytes()
    (asker,) = hosts.relays["here"]._offers[True].askers.values()
    for number in range(1, 21):  # while the other host does nothing
        before = (asker.under_way.total(), asker.waiting.get("camera/image_raw"))
        published.publish(RawImage(width=number, height=480, data=pixels), 1, 1)
        hosts.until(lambda: (asker.under_way.total(), asker.waiting.get("camera/image_raw")) != before, only="here")  # noqa: B023
    received = []

    def receive():
        while (one := subscriber.receive()) is not None:
            received.append(one)

    hosts.until(lambda: received and received[-1].message.width == 20, receive)
    assert [one.message.width for one in received] == [1, 2, 20]
    assert all(one.message.data == pixels for one in received)
    assert subscriber.counter.lost == 17


def test_a_topic_crosses_to_each_of_several_hosts(two_hosts, tmp_path):
    hosts = two_hosts((topics.SPEECH,))
    third = HostKeys(tmp_path / "third").own().public
    hosts.keys["here"].trust("third", third)
    peers = hosts.settings["here"].peers
    peers = {**peers, "third": peers["there"].model_copy(update={"key": third, "port": free_ports()})}
    hosts.settings["here"] = hosts.settings["here"].model_copy(update={"peers": peers})
    published, subscriber = hosts.connected(topics.SPEECH)
    for number in range(100):
        published.publish(Speech(text=str(number)), 1, 1)
    hosts.until(lambda: subscriber.counter.messages == 100, subscriber.receive)
    assert subscriber.counter.lost == 0


def test_a_host_gets_and_gives_only_what_the_launch_file_lets_cross(two_hosts):
    hosts = two_hosts((topics.SPEECH,))
    stolen = hosts.settings["there"].peers["here"]
    more = {**stolen.gives, topics.GESTURES.name: topics.GESTURES.name}
    hosts.settings["there"] = hosts.settings["there"].model_copy(
        update={"peers": {"here": stolen.model_copy(update={"gives": more})}}
    )
    visitor = hosts.visitor("there")
    spoken, seen = visitor.subscriber(topics.SPEECH), visitor.subscriber(topics.GESTURES)
    published = hosts.visitor("here").publisher(topics.SPEECH)
    hosts.start()
    hosts.until(lambda: spoken.welcomed, spoken.receive, published.serve)
    hosts.until(lambda: "rejected" in hosts.relays["here"].detail, published.serve)
    assert not seen.welcomed


def test_what_a_trusted_host_may_not_give_is_rejected_and_counted(two_hosts):
    """A camera's computer in other hands publishes a trajectory."""
    hosts = two_hosts((topics.SPEECH, topics.ARM_TRAJECTORY))
    honest = hosts.settings["there"].peers["here"]
    hosts.settings["there"] = hosts.settings["there"].model_copy(
        update={"peers": {"here": honest.model_copy(update={"gives": {topics.SPEECH.name: topics.SPEECH.name}})}}
    )
    moves = hosts.visitor("there").subscriber(topics.ARM_TRAJECTORY)
    hosts.start()
    here = hosts.relays["here"]
    offer = here._offers[0]
    hosts.until(lambda: len(offer.askers) == 2)  # one of them for what is urgent
    for asker in offer.askers.values():
        offer.send(asker, link.Content(topic="arm/trajectory"), bytes(56), b"anything")
    hosts.until(lambda: "2 rejected" in hosts.relays["there"].detail)
    assert not moves.welcomed


def test_another_key_gets_no_connection(two_hosts, tmp_path):
    hosts = two_hosts((topics.SPEECH,))
    subscriber = hosts.visitor("there").subscriber(topics.SPEECH)
    (hosts.keys["there"].folder / "own.key").unlink()  # it was set up anew, and is not trusted again
    published = hosts.visitor("here").publisher(topics.SPEECH)
    hosts.start()
    hosts.until(lambda: "rejected" in hosts.relays["here"].detail, published.serve)
    assert not subscriber.welcomed
    assert hosts.relays["there"].trouble == "no link to here"


def test_a_host_whose_key_is_not_trusted_is_no_peer(two_hosts):
    hosts = two_hosts((topics.SPEECH,))
    (hosts.keys["here"].folder / "trusted").unlink()
    with pytest.raises(HostKeyError, match="there"):
        hosts.start("here")


def test_garbage_and_a_thousand_connections_at_the_port_change_nothing(two_hosts):
    hosts = two_hosts((topics.SPEECH,))
    published, subscriber = hosts.connected(topics.SPEECH)
    draw = np.random.default_rng(0)
    with contextlib.ExitStack() as opened:
        for number in range(1000):
            one = opened.enter_context(socket.socket())
            one.connect(("127.0.0.1", hosts.ports["here"] + number % 2))
            with contextlib.suppress(OSError):  # it was ended already
                one.send(draw.bytes(int(draw.integers(1, 200))) if number % 3 else b"GET / HTTP/1.1\r\n\r\n")
            if number % 100 == 0:
                published.publish(Speech(text=str(number)), 1, 1)
                assert hosts.until(subscriber.receive).message.text == str(number)
        foreign = [offer.foreign for offer in hosts.relays["here"]._offers]
        hosts.until(lambda: sum(one.count for one in foreign) >= 900)
    assert subscriber.counter.lost == 0


def test_a_link_that_was_cut_is_reported_and_made_anew(two_hosts):
    hosts = two_hosts((topics.RULES,), ())
    published = hosts.visitor("here").publisher(topics.RULES)
    subscriber = hosts.visitor("there").subscriber(topics.RULES)
    hosts.start()
    published.publish(Rules(rules=[Rule(object="blue")]), 1, 1)
    hosts.until(subscriber.receive, published.serve)
    hosts.stop("here")
    hosts.until(lambda: hosts.relays["there"].trouble == "no link to here")
    published.publish(Rules(rules=[Rule(object="green")]), 2, 2)
    published.publish(Rules(rules=[Rule(object="yellow")]), 3, 3)
    hosts.start("here")
    received = hosts.until(subscriber.receive, published.serve)
    assert received.message.rules[0].object == "yellow"
    assert (subscriber.counter.messages, subscriber.counter.lost) == (2, 1)
    hosts.until(lambda: not hosts.relays["there"].trouble)


@pytest.fixture
def clock_ahead(monkeypatch):
    """The clock of the relay that offers is 100 s ahead."""
    sent = link.Offer.send

    def send(self, asker, message, *behind):
        if isinstance(message, link.Beat):
            message = message.model_copy(update={"there_ns": message.there_ns + 100_000_000_000})
        return sent(self, asker, message, *behind)

    monkeypatch.setattr(link.Offer, "send", send)


def test_the_first_request_of_a_program_on_another_host_reaches_who_waits_for_it(two_hosts):
    hosts = two_hosts((topics.PARAMETERS_SET,))
    there = hosts.settings["there"]
    peer = there.peers["here"].model_copy(update={"outside": (topics.PARAMETERS_SET.name,)})
    hosts.settings["there"] = there.model_copy(update={"peers": {"here": peer}})
    node = hosts.visitor("there").subscriber(topics.PARAMETERS_SET)
    hosts.start()
    hosts.until(lambda: node.welcomed, node.receive)
    program = hosts.visitor("here").publisher(topics.PARAMETERS_SET)
    hosts.until(lambda: program.subscriptions, program.serve)
    program.publish(ParameterRequest(node="driver", name="goal_m", value="2.0"), 0, 0)
    received = hosts.until(node.receive)
    assert received.message.value == "2.0"
    assert node.counter.lost == 0


def test_times_become_those_of_the_receiving_host(two_hosts, clock_ahead):
    hosts = two_hosts((topics.SPEECH,), real_time=True)
    published, subscriber = hosts.connected(topics.SPEECH)
    before_ns = time.monotonic_ns()
    speech = Speech(text="one")
    speech.captured.FromNanoseconds(before_ns + 100_000_000_000)
    published.publish(speech, before_ns + 100_000_000_000, before_ns + 100_000_000_007)
    received = hosts.until(subscriber.receive)
    assert abs(received.captured_ns - before_ns) < 1e9
    assert received.published_ns - received.captured_ns == 7
    assert received.message.captured.ToNanoseconds() == received.captured_ns
    assert received.sequence == 1
    hosts.until(lambda: "clock +100.000 s ± " in hosts.relays["there"].detail)


def test_a_clock_that_is_not_known_well_is_reported_and_its_commands_are_rejected(two_hosts, monkeypatch):
    hosts = two_hosts((topics.SPEECH, topics.ARM_TRAJECTORY), real_time=True)
    published, subscriber = hosts.connected(topics.ARM_TRAJECTORY)
    spoken = hosts.visitor("here").publisher(topics.SPEECH)
    received = hosts.visitor("there").subscriber(topics.SPEECH)
    hosts.until(lambda: received.welcomed, received.receive, spoken.serve)
    monkeypatch.setattr("paramove.hosts.clock_offset.ClockOffset.bound_ns", lambda self, now_ns: 6e6)
    there = hosts.relays["there"]
    assert "clock of here" in there.trouble
    now_ns = time.monotonic_ns()
    published.publish(JointTrajectory(id="move"), now_ns, now_ns)
    hosts.until(lambda: "1 rejected" in there.detail)
    spoken.publish(Speech(text="one"), now_ns, now_ns)
    assert hosts.until(received.receive).message.text == "one"
    assert subscriber.receive() is None


def test_the_driver_is_informed_for_as_long_as_the_host_that_commands_replies(two_hosts):
    hosts = two_hosts((topics.ARM_TRAJECTORY,), real_time=True)
    watch = hosts.visitor("there").subscriber(topics.HOSTS_LINK)
    hosts.start()
    first = hosts.until(watch.receive)
    assert list(first.message.hosts) == ["here"]
    second = hosts.until(watch.receive)
    assert first.captured_ns < second.captured_ns <= time.monotonic_ns()
    hosts.stop("here")
    cut_ns = time.monotonic_ns()
    hosts.until(lambda: time.monotonic_ns() > cut_ns + 300_000_000)
    last = None
    while (one := watch.receive()) is not None:  # what was on its way
        last = one
    assert last is None or last.captured_ns < cut_ns
    hosts.start("here")
    assert hosts.until(watch.receive).captured_ns > cut_ns


def test_what_persons_request_elsewhere_leaves_the_topic_to_those_here(two_hosts):
    hosts = two_hosts((topics.OPERATOR_ARM, topics.OPERATOR_STOP, topics.OPERATOR_ESTOP), real_time=True)
    here, there = hosts.visitor("here"), hosts.visitor("there")
    arms, stops = here.publisher(topics.OPERATOR_ARM), here.publisher(topics.OPERATOR_ESTOP)
    armed, stopped = there.subscriber(topics.OPERATOR_ARM_AWAY), there.subscriber(topics.OPERATOR_STOP_AWAY)
    hosts.start()
    hosts.until(lambda: not hosts.relays["there"].trouble, arms.serve)  # until its clock is known well
    now_ns = time.monotonic_ns()
    arms.publish(ArmRequest(source="terminal", armed=True, by_person=True), now_ns, now_ns)
    received = hosts.until(armed.receive, arms.serve)
    assert abs(received.captured_ns - now_ns) < 1e9
    stops.publish(StopRequest(source="terminal"), now_ns, now_ns)
    hosts.until(stopped.receive, stops.serve)
    there.publisher(topics.OPERATOR_ARM)
    there.publisher(topics.OPERATOR_ESTOP)
    hosts.stop("here")
    hosts.start("here")  # a link that is new repeats the latest values: nobody has requested anything
    hosts.until(lambda: not hosts.relays["there"].trouble and not hosts.relays["here"].trouble)
    begun_s = time.monotonic()
    hosts.until(lambda: time.monotonic() > begun_s + 0.5, arms.serve, stops.serve)
    assert armed.receive() is None
    assert stopped.receive() is None


def test_a_request_to_arm_from_elsewhere_is_for_the_arm_of_its_namespace(two_hosts):
    requests = topics.topic_in("left", topics.OPERATOR_ARM)
    hosts = two_hosts((requests, topics.topic_in("right", topics.OPERATOR_ARM)), real_time=True)
    here, there = hosts.visitor("here"), hosts.visitor("there")
    arms = here.publisher(requests)
    away = topics.OPERATOR_ARM_AWAY
    left, *others = (there.subscriber(topics.topic_in(name, away)) for name in ("left", "right", ""))
    hosts.start()
    hosts.until(lambda: not hosts.relays["there"].trouble, arms.serve)
    now_ns = time.monotonic_ns()
    arms.publish(ArmRequest(source="terminal", armed=True, by_person=True), now_ns, now_ns)
    assert hosts.until(left.receive, arms.serve).message.armed
    begun_s = time.monotonic()
    hosts.until(lambda: time.monotonic() > begun_s + 0.3, arms.serve)
    assert [one.receive() for one in others] == [None, None]


def test_a_stop_overtakes_trajectories_on_their_way_to_another_host(two_hosts, monkeypatch):
    """All of it has left the one host before the other reads anything."""
    hosts = two_hosts((topics.ARM_TRAJECTORY, topics.OPERATOR_ESTOP), real_time=True)
    here, there = hosts.visitor("here"), hosts.visitor("there")
    moves, stops = here.publisher(topics.ARM_TRAJECTORY), here.publisher(topics.OPERATOR_ESTOP)
    moved, stopped = there.subscriber(topics.ARM_TRAJECTORY), there.subscriber(topics.OPERATOR_STOP_AWAY)
    hosts.start()
    serving = (moves.serve, stops.serve)
    offer = hosts.relays["here"]._offers[0]
    hosts.until(lambda: sum(len(one.wanted) for one in offer.askers.values()) == 2, *serving)
    hosts.until(lambda: moved.welcomed, *serving, moved.receive)
    hosts.until(lambda: stopped.welcomed, stopped.receive)  # before anybody has stopped anything
    forwarded = []

    def recorded(topic, *arguments):
        forwarded.append(topic.name)
        return in_own_time(topic, *arguments)

    monkeypatch.setattr(relay, "in_own_time", recorded)
    long = JointTrajectory(id="long")
    for number in range(20_000):
        long.points.add().time_s = 0.01 * number
    now_ns = time.monotonic_ns()
    for _ in range(5):
        moves.publish(long, now_ns, now_ns)
    stops.publish(StopRequest(source="terminal"), now_ns, now_ns)
    sources = hosts.relays["here"]._sources.values()
    hosts.until(lambda: all(one.subscriber.counter.messages for one in sources), *serving, only="here")
    begun_s = time.monotonic()
    hosts.until(lambda: time.monotonic() > begun_s + 0.5, only="here")  # until it has crossed
    hosts.until(lambda: forwarded.count("arm/trajectory") == 5, only="there")
    assert forwarded.index("operator/estop") <= 1
    assert stopped.receive() is not None


class Proxy:
    """Between two relays: forwards and keeps what goes each way; once `replays`, sends what was kept instead."""

    def __init__(self, port, to):
        self.kept = {"asked": b"", "given": b""}
        self.replays = False
        self.replayed = 0
        self._to = to
        self._ways, self._sockets = selectors.DefaultSelector(), []
        self._listens = self._of(socket.create_server(("127.0.0.1", port)))
        self._ways.register(self._listens, selectors.EVENT_READ, None)

    def _of(self, one):
        self._sockets.append(one)
        return one

    def step(self):
        for key, _ in self._ways.select(0):
            if key.data is None:
                self._accept()
            else:
                self._copy(key.fileobj, *key.data)

    def _accept(self):
        asker = self._of(self._listens.accept()[0])
        if self.replays:
            self.replayed += 1
            asker.sendall(self.kept["given"])
            again = self._of(socket.create_connection(("127.0.0.1", self._to)))
            again.sendall(self.kept["asked"])
            return
        giver = self._of(socket.create_connection(("127.0.0.1", self._to)))
        self._ways.register(asker, selectors.EVENT_READ, (giver, "asked"))
        self._ways.register(giver, selectors.EVENT_READ, (asker, "given"))

    def _copy(self, one, other, way):
        with contextlib.suppress(OSError):
            if part := one.recv(65536):
                self.kept[way] += part
                other.sendall(part)
                return
        self._ways.unregister(one)

    def cut(self):
        for key in list(self._ways.get_map().values()):
            if key.data is not None:
                self._ways.unregister(key.fileobj)
                key.fileobj.close()

    def close(self):
        for one in self._sockets:
            one.close()
        self._ways.close()


def test_packets_that_are_sent_again_are_worth_nothing(two_hosts, request):
    hosts = two_hosts((topics.SPEECH,))
    port = free_ports()
    proxy = Proxy(port, hosts.ports["here"])
    images = Proxy(port + 1, hosts.ports["here"] + 1)
    for one in (proxy, images):
        request.addfinalizer(one.close)
    honest = hosts.settings["there"].peers["here"].model_copy(update={"port": port})
    hosts.settings["there"] = hosts.settings["there"].model_copy(update={"peers": {"here": honest}})
    published, subscriber = (
        hosts.visitor("here").publisher(topics.SPEECH),
        hosts.visitor("there").subscriber(topics.SPEECH),
    )
    hosts.start()
    received = []

    def serve():
        proxy.step()
        images.step()
        published.serve()
        if (one := subscriber.receive()) is not None:
            received.append(one.message.text)

    hosts.until(lambda: subscriber.welcomed, serve)
    published.publish(Speech(text="move"), 1, 1)
    hosts.until(lambda: received == ["move"], serve)
    proxy.replays = True
    proxy.cut()
    hosts.until(lambda: proxy.replayed > 1 and hosts.relays["there"].trouble == "no link to here", serve)
    assert received == ["move"]
    offer = hosts.relays["here"]._offers[0]
    hosts.until(lambda: not offer.askers, serve)  # those of the cut link are forgotten
    proxy.replays = False
    hosts.until(lambda: any(asker.wanted for asker in offer.askers.values()), serve)
    published.publish(Speech(text="again"), 1, 1)
    hosts.until(lambda: received == ["move", "again"], serve)


class OtherHost(RawHost):
    """A trusted host in other hands, in place of the relay of there."""

    def __init__(self, hosts):
        here, there = (hosts.keys[name].own() for name in ("here", "there"))
        super().__init__(there, hosts.ports["there"], here.public, hosts.ports["here"])
        self.hosts = hosts

    def give(self, *frames):
        """Sends to the relay here, as its offer there would."""
        self.hosts.until(lambda: self.offer.poll(0))
        identity = self.offer.recv_multipart()[0]
        self.offer.send_multipart([identity, *frames])

    def ask(self, *frames):
        """Sends to the relay here, as a request from there would."""
        self.asks.send_multipart(frames)


@pytest.fixture
def other_host(two_hosts):
    hosts = two_hosts((topics.RULES,), (topics.SPEECH, topics.ARM_TRAJECTORY, topics.OPERATOR_ARM), real_time=True)
    members = hosts.settings["here"].peers["there"].model_copy(update={"members": ("tracker",)})
    hosts.settings["here"] = hosts.settings["here"].model_copy(update={"peers": {"there": members}})
    hosts.start("here")
    other = OtherHost(hosts)
    yield other
    other.close()


def trajectory(seconds):
    """A trajectory captured at an impossible time, as a defective publisher would send it."""
    message = JointTrajectory(id="move")
    message.captured.seconds = seconds
    payload = message.SerializeToString()
    now_ns = time.monotonic_ns()
    return pack(Envelope(schema_hash(JointTrajectory), 1, 2, 3, now_ns, now_ns), payload), payload


@pytest.mark.parametrize("seconds", [-(2**63), -1, 9_000_000_001, 2**63 - 1])
def test_an_impossible_time_is_rejected_and_ends_nothing(other_host, seconds):
    hosts = other_host.hosts
    beat = link.Beat(sent_ns=time.monotonic_ns(), there_ns=time.monotonic_ns())
    other_host.give(beat.line())
    other_host.give(link.Content(topic="arm/trajectory").line(), *trajectory(seconds))
    hosts.until(lambda: "1 rejected" in hosts.relays["here"].detail)


@pytest.mark.parametrize("captured", [{"seconds": 2**62}, {"seconds": -1}, {"nanos": 2**31 - 1}, {"nanos": -1}])
def test_an_impossible_time_in_a_request_to_arm_is_rejected_and_ends_nothing(other_host, captured):
    hosts = other_host.hosts
    payload = ArmRequest(armed=True, by_person=True, captured=captured).SerializeToString()
    now_ns = time.monotonic_ns()
    header = pack(Envelope(schema_hash(ArmRequest), 1, 2, 3, now_ns, now_ns), payload)

    def beat():
        now_ns = time.monotonic_ns()
        other_host.give(link.Beat(sent_ns=now_ns, there_ns=now_ns).line())

    clock = hosts.relays["here"]._requests["there"].urgent.clock
    hosts.until(lambda: clock.bound_ns(time.monotonic_ns()) < 5e6, beat)
    for _ in range(20):  # to both connections; that of the other topics rejects it as one that may not come there
        other_host.give(link.Content(topic="operator/arm").line(), header, payload)
    hosts.until(lambda: "20 rejected" in hosts.relays["here"].detail)


@pytest.mark.parametrize("time_ns", [-(2**63), -LATEST_NS - 1, 2**63 - 1])
def test_an_impossible_time_in_a_header_is_rejected_and_ends_nothing(other_host, time_ns):
    hosts = other_host.hosts
    payload = Speech(text="one").SerializeToString()
    header = pack(Envelope(schema_hash(Speech), 1, 2, 3, time_ns, time_ns), payload)
    other_host.give(link.Beat(sent_ns=time.monotonic_ns(), there_ns=0).line())
    other_host.give(link.Content(topic="speech").line(), header, payload)
    hosts.until(lambda: "1 rejected" in hosts.relays["here"].detail)


@pytest.mark.parametrize(
    "frames",
    [
        (b"",),
        (b"[" * 60_000,),
        (b'{"kind": ["want"]}',),
        (b'{"kind": "beat", "sent_ns": 1e999}',),
        (b'{"kind": "beat", "sent_ns": -1}',),
        (b'{"kind": "want", "names": {"a": 1}}',),
        (b'{"kind": "taken", "topic": "camera/image"}', b"more"),
        (b'{"kind": "answered"}',),
        (b'{"kind": "answered"}', b"no header", b"no answer"),
        (b"\xff\x00",) * 30,
    ],
)
def test_what_is_no_request_is_rejected_and_ends_nothing(other_host, frames):
    hosts = other_host.hosts
    other_host.ask(*frames)
    hosts.until(lambda: "1 rejected" in hosts.relays["here"].detail)


def test_answers_of_invented_members_open_nothing_and_fill_no_log(other_host, caplog):
    hosts = other_host.hosts
    before = len(os.listdir("/proc/self/fd"))
    for number in range(1100):
        payload = TickDone(node=f"invented_{number}", pid=number, kind=TickDone.KIND_JOIN).SerializeToString()
        header = pack(Envelope(schema_hash(TickDone), 0, 0, 0, 0, 0), payload)
        other_host.ask(link.Answered().line(), header, payload)
    hosts.until(lambda: "1100 rejected" in hosts.relays["here"].detail)
    assert len(os.listdir("/proc/self/fd")) < before + 20
    assert sum("rejected" in record.getMessage() for record in caplog.records) < 10


def test_invented_images_keep_no_memory(other_host):
    hosts = other_host.hosts
    for number in range(300):
        other_host.ask(link.Taken(topic=f"{number:01900d}").line())
    hosts.until(lambda: "300 rejected" in hosts.relays["here"].detail)
    (asker,) = hosts.relays["here"]._offers[0].askers.values()
    assert not asker.under_way
    assert not asker.waiting


def test_more_connections_than_a_host_needs_are_not_served(other_host):
    hosts = other_host.hosts
    with contextlib.ExitStack() as opened:
        for _ in range(20):
            opened.enter_context(other_host.connection()).send(link.Want(names=[]).line())
        hosts.until(lambda: "rejected" in hosts.relays["here"].detail)
        assert len(hosts.relays["here"]._offers[0].askers) == link.MOST_CONNECTIONS


def test_a_clock_that_jumped_is_shown(other_host):
    hosts = other_host.hosts
    for ahead_ns in (0, 10**12):
        now_ns = time.monotonic_ns()
        other_host.give(link.Beat(sent_ns=now_ns, there_ns=now_ns + ahead_ns).line())
    hosts.until(lambda: "1 jumps" in hosts.relays["here"].detail)
