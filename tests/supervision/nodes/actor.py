"""A node that behaves as its parameters say: starts late or never, crashes, ignores SIGTERM, tells a story."""

import argparse
import os
import select
import signal
import subprocess
import sys
import time
from pathlib import Path

import zmq
from ruamel.yaml import YAML

from paramove.bus import topics
from paramove.bus.publisher import Publisher
from paramove.msgs.node_status_pb2 import NodeStatus
from paramove.msgs.rule_pb2 import Speech

SUBSCRIBES = ()
PUBLISHES = (topics.SPEECH,)

STUBBORN_CHILD = "import signal; signal.signal(signal.SIGTERM, signal.SIG_IGN); signal.pause()"


class Actor:
    def __init__(self, config):
        self.name, self.parameters = config["node"], config["parameters"]
        self.events = Path(config["run_folder"]) / "events.txt"
        context, folder = zmq.Context(), Path(config["bus"]["folder"])
        self.publishers = {"status": Publisher(context, folder, topics.status(self.name), self.name)}
        if self.parameters.get("say"):
            self.publishers["speech"] = Publisher(context, folder, topics.SPEECH, self.name)
        self.ended, self.asked = os.pipe()

    def event(self, text):
        with self.events.open("a") as file:
            file.write(f"{self.name} {text}\n")

    def status(self, state, detail):
        message = NodeStatus(node=self.name, state=state, detail=detail, pid=os.getpid())
        self.publishers["status"].publish(message, 0, time.monotonic_ns())

    def act(self):
        parameters = self.parameters
        ignores = parameters.get("ignores_sigterm")
        signal.signal(signal.SIGTERM, signal.SIG_IGN if ignores else lambda *_: os.write(self.asked, b"x"))
        self.event("started")
        if parameters.get("child"):
            subprocess.Popen([sys.executable, "-c", STUBBORN_CHILD])
        ballast = bytearray(int(parameters.get("ballast_mb", 0) * 2**20))
        ballast[::4096] = b"x" * len(ballast[::4096])  # so that the pages exist
        starts = self.events.read_text().splitlines().count(f"{self.name} started")
        if starts <= parameters.get("crashes", 0):
            raise RuntimeError(f"crash number {starts}")
        self.status(NodeStatus.STATE_STARTING, "warming up the lamp")
        if not parameters.get("hangs"):
            self.status(NodeStatus.STATE_READY, "all set")
            self.event("ready")
        self.serve(time.monotonic() + parameters.get("lasts_s", 1e6))
        self.event("ended")
        sys.exit(parameters.get("exit_code", 0))

    def serve(self, end_s):
        """Answers subscriptions until SIGTERM or the end of its time; says its sentence again and again."""
        next_status_s = time.monotonic()
        while time.monotonic() < end_s and not select.select([self.ended], [], [], 0.02)[0]:
            for publisher in self.publishers.values():
                publisher.serve()
            if time.monotonic() > next_status_s and not self.parameters.get("hangs"):
                next_status_s += 0.2
                if not self.parameters.get("silent"):
                    self.status(NodeStatus.STATE_READY, "all set")
            if "speech" in self.publishers:
                self.publishers["speech"].publish(
                    Speech(text=self.parameters["say"].replace("<bell>", "\a")), 0, time.monotonic_ns()
                )


if __name__ == "__main__":
    arguments = argparse.ArgumentParser()
    arguments.add_argument("--config", type=Path)
    Actor(YAML(typ="safe").load(arguments.parse_args().config.read_text())).act()
