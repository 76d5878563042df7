"""What is lost of a recording when the recorder is killed, and whether it keeps up.

    python benchmarks/recorder_kills.py [--kills 40] [--seed 1] [--folder DIR] [--json FILE]

Each time a new recorder receives bursts of messages (small ones at 20 to 200 Hz, images of 50 kB at 15 Hz) and pauses
of up to 3 s, and is killed (kill -9) at a random time of a burst or of a pause. The published messages are compared
with the unfinished file: a message that was published more than 0.5 s before the kill must be there. The last recorder
receives 30 MB a second for ten seconds and is then ended: it must have everything, however long the disk takes.
"""

from __future__ import annotations

import argparse
import json
import random
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

import numpy as np

ROOT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT))

from paramove.bus import Bus, BusSettings, topics  # noqa: E402
from paramove.recording import read  # noqa: E402

ALLOWED_S = 0.5
SMALL, IMAGE, STATUS = topics.GESTURES, topics.CAMERA_IMAGE, topics.status("recorder")


class RecordedPublisher:
    """A bus, its recorder, and what was published: topic and sequence number -> when, s."""

    def __init__(self, folder: Path) -> None:
        folder.mkdir()
        self.file = folder / "recording.mcap"
        self.published_s: dict[tuple[str, int], float] = {}
        settings = BusSettings(folder=folder / "bus")
        self.bus = Bus("speaker", settings, (STATUS,), (SMALL, IMAGE))
        config = folder / "recorder.yaml"
        bus = settings.model_dump(mode="json", exclude_defaults=True)
        config.write_text(json.dumps({"node": "recorder", "bus": bus, "run_folder": str(folder)}))
        command = [sys.executable, "-m", "nodes.recorder", "--config", str(config)]
        self.recorder = subprocess.Popen(command, cwd=ROOT, stderr=(folder / "log").open("wb"))
        publishers = [self.bus.exchange.publishers[topic.name] for topic in (SMALL, IMAGE)]
        while not all(publisher.subscriptions for publisher in publishers):
            self.bus.exchange.wait(0.1)

    def publish(self, topic: topics.Topic, message: Any) -> None:
        """Publishes a message and notes when."""
        self.bus.publish(topic, message)
        self.published_s[topic.name, self.bus.exchange.publishers[topic.name].sequence] = time.monotonic()

    def burst(self, until_s: float, rate_hz: float, image_bytes: int, image_hz: float) -> None:
        """Publishes both topics until a time of the monotonic clock."""
        image = IMAGE.type(data=bytes(image_bytes))
        due_s = {SMALL.name: time.monotonic(), IMAGE.name: time.monotonic()}
        while (now_s := time.monotonic()) < until_s:
            for topic, message, hz in ((SMALL, SMALL.type(), rate_hz), (IMAGE, image, image_hz)):
                if due_s[topic.name] <= now_s:
                    due_s[topic.name] += 1 / hz
                    self.publish(topic, message)
            self.bus.idle(max(0.0, min(*due_s.values(), until_s) - time.monotonic()))

    def missing_s(self, file: Path) -> list[float]:
        """When the messages that are not in the file were published."""
        recorded_keys = {(recorded.topic, recorded.sequence) for recorded in read(file)}
        return [at_s for key, at_s in self.published_s.items() if key not in recorded_keys]

    def close(self) -> None:
        """Ends the recorder."""
        self.recorder.kill()
        self.recorder.wait()
        self.bus.close()


def killed(folder: Path, rng: random.Random, in_silence: bool) -> dict[str, Any]:
    """One kill: how old the oldest message was that is lost, and how many were older than allowed."""
    publisher = RecordedPublisher(folder)
    for _ in range(rng.randrange(3)):
        publisher.burst(time.monotonic() + rng.uniform(0.2, 1.5), rng.uniform(20, 200), 50_000, 15)
        publisher.bus.idle(rng.uniform(0.0, 1.5))
    publisher.burst(time.monotonic() + rng.uniform(0.2, 1.5), rng.uniform(20, 200), 50_000, 15)
    if in_silence:
        publisher.bus.idle(rng.uniform(0.0, 3.0))
    killed_s = time.monotonic()
    publisher.close()
    ages_s = [killed_s - at_s for at_s in publisher.missing_s(publisher.file.with_name("recording.mcap.part"))]
    return {
        "in_silence": in_silence,
        "said": len(publisher.published_s),
        "lost": len(ages_s),
        "lost_older_than_allowed": sum(age_s > ALLOWED_S for age_s in ages_s),
        "oldest_lost_s": max(ages_s, default=0.0),
    }


def loaded(folder: Path, seconds: float) -> dict[str, Any]:
    """1000 small messages and 15 images of 2 MB a second, and then an end in order."""
    publisher = RecordedPublisher(folder)
    publisher.burst(time.monotonic() + seconds, 1000, 2_000_000, 15)
    publisher.bus.idle(1.5)
    publisher.recorder.terminate()
    while publisher.recorder.poll() is None:
        publisher.bus.idle(0.05)
    last = publisher.bus.exchange.take([STATUS.name])[-1].message
    on_the_bus = sum(count.lost + count.rejected for count in last.received)
    lost = len(publisher.missing_s(publisher.file))
    publisher.close()
    return {"said": len(publisher.published_s), "lost": lost, "lost_on_the_bus": on_the_bus}


def main() -> None:
    """Prints what was lost."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--kills", type=int, default=40)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--folder", type=Path, help="where recordings are written; its disk is measured too")
    parser.add_argument("--json", type=Path)
    arguments = parser.parse_args()
    rng = random.Random(arguments.seed)
    with tempfile.TemporaryDirectory(prefix="recorder-", dir=arguments.folder) as name:
        kills = [killed(Path(name) / str(number), rng, number % 2 == 1) for number in range(arguments.kills)]
        load = loaded(Path(name) / "load", 10.0)
    oldest_s = np.array([one["oldest_lost_s"] for one in kills])
    sys.stdout.write(
        f"{len(kills)} kills, {sum(one['in_silence'] for one in kills)} of them in a pause: "
        f"{sum(one['said'] for one in kills)} messages published, {sum(one['lost'] for one in kills)} lost, "
        f"{sum(one['lost_older_than_allowed'] for one in kills)} of them older than {ALLOWED_S} s; "
        f"the oldest lost one median {np.median(oldest_s):.3f} s, largest {oldest_s.max():.3f} s\n"
        f"30 MB/s for 10 s: {load['said']} messages published, {load['lost']} lost, {load['lost_on_the_bus']} of them "
        "before the recorder had them\n"
    )
    if arguments.json:
        arguments.json.write_text(json.dumps({"kills": kills, "load": load}, indent=2) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
