"""A node that tests start as a process: repeats each gesture as a sentence; `trouble` raises, `given up` gives up.

`missing` and `wrong` are inputs that it cannot use. With the greeting `farewell` it fails before anybody hears it.
"""

from __future__ import annotations

from paramove.bus import topics
from paramove.bus.node import Bus, NodeConfig, main
from paramove.documents.input_error import InputError
from paramove.msgs.rule_pb2 import Speech

SUBSCRIBES = (topics.GESTURES,)
PUBLISHES = (topics.SPEECH,)


class Config(NodeConfig):
    greeting: str = "hello"


def run(bus: Bus, config: Config) -> None:
    if config.greeting == "farewell":
        raise InputError("nothing to greet with", missing=True)
    bus.ready(config.greeting)
    for heard in bus.events(topics.GESTURES):
        if heard.message.object == "trouble":
            raise ValueError("found trouble")
        if heard.message.object in ("missing", "wrong"):
            raise InputError(f"{heard.message.object}.npz\ncannot be used", missing=heard.message.object == "missing")
        if heard.message.object == "given up":
            bus.failed("cannot go on")
            return
        bus.publish(topics.SPEECH, Speech(text=heard.message.object), captured_ns=heard.captured_ns)


if __name__ == "__main__":
    main(run, SUBSCRIBES, PUBLISHES, Config)
