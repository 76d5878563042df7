"""Other buses under the load of `benchmarks/bus.py`, each where it is installed; paramove itself never imports them.

A peer is a pair of functions: `publish(messages, load)` publishes the time and filler once a period after a line on
its standard input; `subscribe(messages, load, go)` calls `go()` once it has subscribed and returns the latencies in ns,
up to when a program has the message as bytes of its own.
"""

from __future__ import annotations

import ctypes
import importlib
import importlib.util
import struct
import sys
import threading
import time
from collections.abc import Callable, Iterator
from typing import Any, NamedTuple

PAYLOAD_BYTES = 216
PERIOD_NS = 1_000_000
NAME = "bus_benchmark"
TIMEOUT_S = 5.0

Go = Callable[[], None]


class Load(NamedTuple):
    """Bytes of a message, and ns between two of them."""

    size: int
    period_ns: int


SMALL = Load(PAYLOAD_BYTES, PERIOD_NS)
IMAGES = Load(1_000_000, 33_000_000)


def paced(messages: int, period_ns: int = PERIOD_NS) -> Iterator[int]:
    """Counts up once a period, by absolute times."""
    start_ns = time.monotonic_ns()
    for number in range(messages):
        left_ns = start_ns + number * period_ns - time.monotonic_ns()
        if left_ns > 0:
            time.sleep(left_ns * 1e-9)
        yield number


def stamped(size: int) -> bytes:
    """A payload that begins with the time."""
    return struct.pack("<q", time.monotonic_ns()) + b"\0" * (size - 8)


class Arrivals:
    """Latencies, taken in whatever thread the peer calls us."""

    def __init__(self, messages: int) -> None:
        self.latencies: list[int] = []
        self._messages = messages
        self._latest_s = time.monotonic()
        self._done = threading.Event()

    def take(self, payload: bytes) -> None:
        (sent_ns,) = struct.unpack("<q", payload[:8])
        self.latencies.append(time.monotonic_ns() - sent_ns)
        self._latest_s = time.monotonic()
        if len(self.latencies) >= self._messages:
            self._done.set()

    @property
    def complete(self) -> bool:
        """Whether all have come, or none for five seconds."""
        return self._done.is_set() or time.monotonic() - self._latest_s > TIMEOUT_S

    def wait(self) -> list[int]:
        self._latest_s = time.monotonic()
        while not self.complete:
            self._done.wait(0.1)
        return self.latencies


def publish_zenoh(messages: int, load: Load) -> None:
    zenoh = importlib.import_module("zenoh")

    with zenoh.open(zenoh.Config()) as session:
        publisher = session.declare_publisher(NAME)
        sys.stdin.readline()
        for _ in paced(messages, load.period_ns):
            publisher.put(stamped(load.size))
        sys.stdin.readline()


def subscribe_zenoh(messages: int, load: Load, go: Go) -> list[int]:
    zenoh = importlib.import_module("zenoh")

    arrivals = Arrivals(messages)
    with zenoh.open(zenoh.Config()) as session:
        session.declare_subscriber(NAME, lambda sample: arrivals.take(sample.payload.to_bytes()))
        time.sleep(2)  # until the two have found each other
        go()
        return arrivals.wait()


def publish_lcm(messages: int, load: Load) -> None:
    lcm = importlib.import_module("lcm")

    bus = lcm.LCM("udpm://239.255.76.67:7667?ttl=0")
    sys.stdin.readline()
    for _ in paced(messages, load.period_ns):
        bus.publish(NAME, stamped(load.size))
    sys.stdin.readline()


def subscribe_lcm(messages: int, load: Load, go: Go) -> list[int]:
    lcm = importlib.import_module("lcm")

    arrivals = Arrivals(messages)
    bus = lcm.LCM("udpm://239.255.76.67:7667?ttl=0")
    bus.subscribe(NAME, lambda _, payload: arrivals.take(payload))
    go()
    while not arrivals.complete:
        bus.handle_timeout(100)
    return arrivals.latencies


def publish_rospy(messages: int, load: Load) -> None:
    rospy = importlib.import_module("rospy")
    string = importlib.import_module("std_msgs.msg").String

    rospy.init_node(NAME + "_speaker", disable_signals=True)
    publisher = rospy.Publisher(NAME, string, queue_size=1000)
    sys.stdin.readline()
    for _ in paced(messages, load.period_ns):
        publisher.publish(string(data=stamped(load.size).decode("latin-1")))
    sys.stdin.readline()


def subscribe_rospy(messages: int, load: Load, go: Go) -> list[int]:
    rospy = importlib.import_module("rospy")
    string = importlib.import_module("std_msgs.msg").String

    rospy.init_node(NAME + "_listener", disable_signals=True)
    arrivals = Arrivals(messages)
    rospy.Subscriber(NAME, string, lambda received: arrivals.take(received.data.encode("latin-1")), tcp_nodelay=True)
    time.sleep(2)  # until roscore has introduced the two
    go()
    return arrivals.wait()


def _iceoryx2_service() -> tuple[Any, Any]:
    iox2 = importlib.import_module("iceoryx2")

    node = iox2.NodeBuilder.new().create(iox2.ServiceType.Ipc)
    service = node.service_builder(iox2.ServiceName.new(NAME)).publish_subscribe(iox2.Slice[ctypes.c_uint8])
    return iox2, service.open_or_create()


def publish_iceoryx2(messages: int, load: Load) -> None:
    _, service = _iceoryx2_service()
    publisher = service.publisher_builder().initial_max_slice_len(load.size).create()
    sys.stdin.readline()
    for _ in paced(messages, load.period_ns):
        payload = stamped(load.size)
        sample = publisher.loan_slice_uninit(load.size)
        ctypes.memmove(sample.payload().as_ptr(), payload, load.size)
        sample.assume_init().send()
    sys.stdin.readline()


def subscribe_iceoryx2(messages: int, load: Load, go: Go) -> list[int]:
    """It has no socket to wait for: polls ten times a millisecond."""
    _, service = _iceoryx2_service()
    subscriber = service.subscriber_builder().create()
    arrivals = Arrivals(messages)
    time.sleep(2)  # until the two have found each other
    go()
    while not arrivals.complete:
        sample = subscriber.receive()
        if sample is None:
            time.sleep(1e-4)
        else:
            arrivals.take(ctypes.string_at(sample.payload().as_ptr(), load.size))
    return arrivals.latencies


PEERS: dict[str, tuple[Callable[[int, Load], None], Callable[[int, Load, Go], list[int]]]] = {
    "rospy": (publish_rospy, subscribe_rospy),
    "zenoh": (publish_zenoh, subscribe_zenoh),
    "lcm": (publish_lcm, subscribe_lcm),
    "iceoryx2": (publish_iceoryx2, subscribe_iceoryx2),
}


def installed(peer: str) -> bool:
    """Whether the peer's Python module is installed."""
    return importlib.util.find_spec(peer) is not None


def describe(error: BaseException) -> str:
    """First line of an error."""
    return (str(error).splitlines() or [type(error).__name__])[0]
