"""Publisher and subscriber over real sockets."""

from __future__ import annotations

import os
import re
import signal
import socket
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest
import zmq

from paramove.bus import topics
from paramove.bus.endpoint import BusFolderError, TopicTakenError, is_alive, is_held, prepare_folder, socket_path
from paramove.bus.envelope import Reason, RejectedError
from paramove.bus.publisher import Publisher
from paramove.bus.subscriber import Subscriber, decoded
from paramove.msgs.clock_pb2 import Clock
from paramove.msgs.gesture_pb2 import Gesture
from paramove.msgs.joint_trajectory_pb2 import JointTrajectory, TrajectoryPoint
from paramove.msgs.rule_pb2 import Rules
from tests.bus.conftest import Wait

Context = zmq.Context[Any]


def _connect(publisher: Publisher, subscriber: Subscriber, wait: Wait) -> None:
    def welcomed() -> bool:
        assert subscriber.receive() is None
        return subscriber.welcomed

    wait(welcomed, publisher.serve)


def test_a_message_arrives_with_its_times(context: Context, folder: Path, wait: Wait) -> None:
    publisher = Publisher(context, folder, topics.GESTURES, "recognizer")
    subscriber = Subscriber(context, folder, topics.GESTURES)
    _connect(publisher, subscriber, wait)
    assert publisher.publish(Gesture(object="red"), captured_ns=-5, now_ns=7) == 1
    heard = wait(subscriber.receive)
    assert (heard.message.object, heard.captured_ns, heard.published_ns, heard.sequence) == ("red", -5, 7, 1)
    assert heard.message == Gesture(object="red")


def test_a_subscriber_may_come_first(context: Context, folder: Path, wait: Wait) -> None:
    subscriber = Subscriber(context, folder, topics.GESTURES)
    publisher = Publisher(context, folder, topics.GESTURES, "recognizer")
    _connect(publisher, subscriber, wait)


def test_a_late_joiner_gets_the_latched_value(context: Context, folder: Path, wait: Wait) -> None:
    publisher = Publisher(context, folder, topics.RULES, "rule_learner")
    first = Subscriber(context, folder, topics.RULES)
    _connect(publisher, first, wait)
    for name in ("old", "new"):
        publisher.publish(Rules(frame=name), 1, 2)
    late = Subscriber(context, folder, topics.RULES)
    heard = wait(late.receive, publisher.serve)
    assert (heard.message.frame, heard.sequence) == ("new", 2)
    # Whoever was there before sees the value again and drops it.
    newest = []
    wait(lambda: first.counter.repeated, publisher.serve, lambda: newest.append(first.receive()))
    assert [item.sequence for item in newest if item] == [1, 2]


def test_loss_at_a_subscriber_that_stopped_reading_is_counted_exactly(
    context: Context, folder: Path, wait: Wait
) -> None:
    publisher = Publisher(context, folder, topics.CAMERA_IMAGE, "camera")  # few may wait on each side
    subscriber = Subscriber(context, folder, topics.CAMERA_IMAGE)
    _connect(publisher, subscriber, wait)
    said = 300
    for number in range(said):
        publisher.publish(topics.CAMERA_IMAGE.type(data=b"x" * 50_000), 0, number * 10**8)
    heard = []
    # A second subscription brings a welcome, which shows what was lost last.
    wait(lambda: subscriber.receive() is None and subscriber.counter.messages)
    other = Subscriber(context, folder, topics.CAMERA_IMAGE)
    wait(
        lambda: subscriber.counter.sequence == said,
        publisher.serve,
        lambda: heard.append(subscriber.receive()),
        other.receive,
    )
    assert subscriber.counter.lost > 0
    assert subscriber.counter.messages + subscriber.counter.lost == said


def test_a_restarted_publisher_is_no_loss(folder: Path, context: Context, wait: Wait) -> None:
    subscriber = Subscriber(context, folder, topics.GESTURES)
    for _ in range(2):
        with zmq.Context() as own:
            publisher = Publisher(own, folder, topics.GESTURES, "recognizer")
            epochs = subscriber.counter.epochs
            wait(
                lambda before=epochs: subscriber.receive() is None and subscriber.counter.epochs > before,
                publisher.serve,
            )
            for _ in range(5):
                publisher.publish(Gesture(), 0, 0)
            publisher.close()
        publisher.ownership.release()
        target = subscriber.counter.epochs * 5
        wait(lambda target=target: subscriber.receive() is None and subscriber.counter.messages == target)
    assert (subscriber.counter.messages, subscriber.counter.lost, subscriber.counter.epochs) == (10, 0, 2)


def test_a_second_publisher_is_refused_and_told_who_was_first(context: Context, folder: Path, wait: Wait) -> None:
    publisher = Publisher(context, folder, topics.GESTURES, "recognizer")
    with pytest.raises(TopicTakenError, match=rf"gestures is already published by pid {os.getpid()} \(recognizer\)"):
        Publisher(context, folder, topics.GESTURES, "impostor")
    subscriber = Subscriber(context, folder, topics.GESTURES)
    _connect(publisher, subscriber, wait)


_KILLED = """
import sys, zmq
from pathlib import Path
from paramove.bus import topics
from paramove.bus.publisher import Publisher
publisher = Publisher(zmq.Context(), Path(sys.argv[1]), topics.GESTURES, "recognizer")
sys.stdout.write("bound\\n")
sys.stdout.flush()
while True:
    publisher.socket.poll()
"""


def test_a_killed_publisher_is_named_while_it_lives_and_replaced_after(
    context: Context, folder: Path, wait: Wait
) -> None:
    with subprocess.Popen([sys.executable, "-c", _KILLED, str(folder)], stdout=subprocess.PIPE) as process:
        assert process.stdout is not None
        assert process.stdout.readline() == b"bound\n"
        with pytest.raises(TopicTakenError, match=f"pid {process.pid} "):
            Publisher(context, folder, topics.GESTURES, "recognizer")
        path = socket_path(folder, "gestures")
        assert is_held(path)
        process.send_signal(signal.SIGKILL)
    assert path.exists()
    assert not is_alive(path)
    assert not is_held(path)
    publisher = Publisher(context, folder, topics.GESTURES, "recognizer")
    subscriber = Subscriber(context, folder, topics.GESTURES)
    _connect(publisher, subscriber, wait)


def test_a_regular_file_is_left_alone(context: Context, folder: Path) -> None:
    path = folder / "gestures"
    path.write_text("mine", encoding="utf-8")
    with pytest.raises(BusFolderError, match="is not a socket"):
        Publisher(context, folder, topics.GESTURES, "recognizer")
    assert path.read_text(encoding="utf-8") == "mine"


def test_a_living_foreign_socket_is_left_alone(context: Context, folder: Path) -> None:
    with socket.socket(socket.AF_UNIX) as listener:
        listener.bind(str(folder / "gestures"))
        listener.listen()
        with pytest.raises(BusFolderError, match="without holding its lock"):
            Publisher(context, folder, topics.GESTURES, "recognizer")


def test_a_long_path_is_refused(context: Context, folder: Path) -> None:
    deep = folder / ("x" * 120)
    with pytest.raises(BusFolderError, match="Linux allows 107"):
        Publisher(context, deep, topics.GESTURES, "recognizer")


def test_the_folder_is_private(folder: Path) -> None:
    made = folder / "domain"
    prepare_folder(made)
    assert made.stat().st_mode & 0o777 == 0o700
    made.chmod(0o755)
    with pytest.raises(BusFolderError, match="run: chmod 700"):
        prepare_folder(made)


def test_another_type_than_the_topics_is_refused_by_the_publisher(context: Context, folder: Path) -> None:
    publisher = Publisher(context, folder, topics.GESTURES, "recognizer")
    with pytest.raises(TypeError, match=r"gestures carries paramove\.msgs\.Gesture, not paramove\.msgs\.Clock"):
        publisher.publish(Clock(), 0, 0)
    with pytest.raises(ValueError, match="the topic allows 65536"):
        publisher.publish(Gesture(object="x" * 2**20), 0, 0)


def test_foreign_and_wrong_messages_are_counted_and_good_ones_still_heard(
    context: Context, folder: Path, wait: Wait, caplog: pytest.LogCaptureFixture
) -> None:
    """A program that is not ours speaks on the topic's socket."""
    foreign: zmq.Socket[Any] = context.socket(zmq.XPUB)
    foreign.bind(f"ipc://{folder / 'gestures'}")
    subscriber = Subscriber(context, folder, topics.GESTURES)
    wait(lambda: foreign.poll(0))
    helper = Publisher(context, folder, topics.CLOCK, "simulator")
    spy: zmq.Socket[Any] = context.socket(zmq.SUB)
    spy.connect(f"ipc://{folder / 'clock'}")
    spy.subscribe(b"")
    head, payload = wait(lambda: spy.poll(0) and spy.recv_multipart(), helper.serve)
    foreign.send_multipart([b"gestures\0GET / HTTP/1.1", b""])
    foreign.send_multipart([b"gestures\0"])
    foreign.send_multipart([b"gestures\0" + head.removeprefix(b"clock\0"), payload])
    for reason in (Reason.SIZE, Reason.FRAMES, Reason.SCHEMA):
        wait(lambda reason=reason: subscriber.receive() is None and subscriber.counter.rejected[reason] == 1)
    assert not subscriber.welcomed
    assert "paramove.msgs.Clock" in caplog.text


def test_a_prefix_of_a_topic_is_another_topic(context: Context, folder: Path, wait: Wait) -> None:
    """libzmq matches subscriptions as prefixes: the zero byte at the end keeps `arm` from hearing `arm/safety`."""
    publisher = Publisher(context, folder, topics.GESTURES, "recognizer")
    prefix: zmq.Socket[Any] = context.socket(zmq.SUB)
    prefix.connect(f"ipc://{folder / 'gestures'}")
    prefix.subscribe(b"gesture\0")
    subscriber = Subscriber(context, folder, topics.GESTURES)
    _connect(publisher, subscriber, wait)
    publisher.publish(Gesture(), 0, 0)
    wait(subscriber.receive)
    assert not prefix.poll(0)


def test_a_socket_gone_deaf_after_an_oversized_message_is_opened_anew_and_counted(
    context: Context, folder: Path, wait: Wait, caplog: pytest.LogCaptureFixture
) -> None:
    foreign: zmq.Socket[Any] = context.socket(zmq.XPUB)
    foreign.setsockopt(zmq.XPUB_VERBOSE, 1)
    foreign.bind(f"ipc://{folder / 'gestures'}")
    subscriber = Subscriber(context, folder, topics.GESTURES)
    wait(lambda: foreign.poll(0) and foreign.recv())
    foreign.send_multipart([b"gestures\0x", b"y" * (topics.GESTURES.max_bytes + 1)])
    wait(subscriber.revive, subscriber.receive)
    wait(lambda: foreign.poll(0) and foreign.recv() == b"\x01gestures\0")
    foreign.send_multipart([b"gestures\0x", b"y"])
    wait(lambda: subscriber.receive() is None and subscriber.counter.rejected[Reason.SIZE] == 1)
    assert subscriber.counter.rejected[Reason.CONNECTION] == 1
    assert not subscriber.revive()
    assert re.search("topic gestures: .*for good: a message above 65536 bytes, or no ZeroMQ", caplog.text)


def test_a_trajectory_of_too_many_points_is_rejected_before_it_is_decoded_and_never_published(
    context: Context, folder: Path
) -> None:
    most = topics.ARM_TRAJECTORY.max_points or 0
    message = JointTrajectory(id="long", points=[TrajectoryPoint(time_s=1.0)] * most)
    assert len(decoded(topics.ARM_TRAJECTORY, message.SerializeToString()).points) == most
    message.points.add()
    with pytest.raises(RejectedError) as raised:
        decoded(topics.ARM_TRAJECTORY, message.SerializeToString())
    assert raised.value.reason is Reason.LENGTH
    publisher = Publisher(context, folder, topics.ARM_TRAJECTORY, "synthesizer")
    with pytest.raises(ValueError, match=f"{most + 1} points"):
        publisher.publish(message, 0, 0)
    assert publisher.sequence == 0
