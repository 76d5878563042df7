"""Other buses under the load of `benchmarks/bus.py`, each where it is installed; paramove itself never imports them.

A peer is a pair of functions: `publish(messages)` publishes the time and filler once a millisecond after a line on
its standard input; `subscribe(messages, go)` calls `go()` once it has subscribed and returns the latencies in ns. A
message has 216 bytes.
"""

from __future__ import annotations

import importlib
import importlib.util
import struct
import sys
import threading
import time
from collections.abc import Callable, Iterator

PAYLOAD_BYTES = 216
PERIOD_NS = 1_000_000
NAME = "bus_benchmark"
TIMEOUT_S = 5.0

Go = Callable[[], None]


def paced(messages: int, period_ns: int = PERIOD_NS) -> Iterator[int]:
    """Counts up once a period, by absolute times."""
    start_ns = time.monotonic_ns()
    for number in range(messages):
        left_ns = start_ns + number * period_ns - time.monotonic_ns()
        if left_ns > 0:
            time.sleep(left_ns * 1e-9)
        yield number


def stamped() -> bytes:
    """A payload that begins with the time."""
    return struct.pack("<q", time.monotonic_ns()) + b"\0" * (PAYLOAD_BYTES - 8)


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


def publish_zenoh(messages: int) -> None:
    zenoh = importlib.import_module("zenoh")

    with zenoh.open(zenoh.Config()) as session:
        publisher = session.declare_publisher(NAME)
        sys.stdin.readline()
        for _ in paced(messages):
            publisher.put(stamped())
        sys.stdin.readline()


def subscribe_zenoh(messages: int, go: Go) -> list[int]:
    zenoh = importlib.import_module("zenoh")

    arrivals = Arrivals(messages)
    with zenoh.open(zenoh.Config()) as session:
        session.declare_subscriber(NAME, lambda sample: arrivals.take(sample.payload.to_bytes()))
        time.sleep(2)  # until the two have found each other
        go()
        return arrivals.wait()


def publish_lcm(messages: int) -> None:
    lcm = importlib.import_module("lcm")

    bus = lcm.LCM("udpm://239.255.76.67:7667?ttl=0")
    sys.stdin.readline()
    for _ in paced(messages):
        bus.publish(NAME, stamped())
    sys.stdin.readline()


def subscribe_lcm(messages: int, go: Go) -> list[int]:
    lcm = importlib.import_module("lcm")

    arrivals = Arrivals(messages)
    bus = lcm.LCM("udpm://239.255.76.67:7667?ttl=0")
    bus.subscribe(NAME, lambda _, payload: arrivals.take(payload))
    go()
    while not arrivals.complete:
        bus.handle_timeout(100)
    return arrivals.latencies


def publish_rospy(messages: int) -> None:
    rospy = importlib.import_module("rospy")
    string = importlib.import_module("std_msgs.msg").String

    rospy.init_node(NAME + "_speaker", disable_signals=True)
    publisher = rospy.Publisher(NAME, string, queue_size=1000)
    sys.stdin.readline()
    for _ in paced(messages):
        publisher.publish(string(data=stamped().decode("latin-1")))
    sys.stdin.readline()


def subscribe_rospy(messages: int, go: Go) -> list[int]:
    rospy = importlib.import_module("rospy")
    string = importlib.import_module("std_msgs.msg").String

    rospy.init_node(NAME + "_listener", disable_signals=True)
    arrivals = Arrivals(messages)
    rospy.Subscriber(NAME, string, lambda received: arrivals.take(received.data.encode("latin-1")), tcp_nodelay=True)
    time.sleep(2)  # until roscore has introduced the two
    go()
    return arrivals.wait()


PEERS: dict[str, tuple[Callable[[int], None], Callable[[int, Go], list[int]]]] = {
    "rospy": (publish_rospy, subscribe_rospy),
    "zenoh": (publish_zenoh, subscribe_zenoh),
    "lcm": (publish_lcm, subscribe_lcm),
}


def installed(peer: str) -> bool:
    """Whether the peer's Python module is installed."""
    return importlib.util.find_spec(peer) is not None


def describe(error: BaseException) -> str:
    """First line of an error."""
    return (str(error).splitlines() or [type(error).__name__])[0]
