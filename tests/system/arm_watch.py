"""Prints what the arm's driver publishes on a host's bus, a line of JSON each, until it is ended.

Usage: python arm_watch.py FOLDER_OF_THE_BUS. Times are seconds of that host's clock.
"""

import json
import sys
from pathlib import Path

import zmq

from paramove.bus import BusVisitor, topics


def main(folder):
    with BusVisitor(folder, "arm_watch") as bus:
        watched = [bus.subscriber(topic) for topic in (topics.ARM_JOINT_STATES_FAST, topics.ARM_SAFETY)]
        while True:
            watched[0].socket.poll(50, zmq.POLLIN)
            for subscriber in watched:
                subscriber.revive()
                while (received := subscriber.receive()) is not None:
                    sys.stdout.write(json.dumps(content(received)) + "\n")
            sys.stdout.flush()


def content(received):
    message, time_s = received.message, 1e-9 * received.captured_ns
    if received.topic == topics.ARM_SAFETY:
        return [time_s, message.State.Name(message.state), [fault.detail for fault in message.faults]]
    return [time_s, [one.position for one in message.joints]]


if __name__ == "__main__":
    main(Path(sys.argv[1]))
