"""Judge: records the truth of a simulated run, for the report after it, and judges while the run goes on.

Subscribes  truth/layout   TruthLayout         once, latched   world
            truth/state    TruthState          15 Hz           world
            truth/arm      TruthArm            15 Hz           table
            truth/view     foxglove.RawImage   15 Hz           if the simulator renders it

Writes `truth.mcap` (the view as JPEG) into the run folder and, with a verdict, `truth.json`, renewed every few seconds.
When its process is started again it goes on in `truth.2.mcap`, …. Outside of namespaces it records the truth of each.
"""

from __future__ import annotations

import contextlib
import json
import logging
import time
from pathlib import Path
from typing import Any, Literal

import cv2
import numpy as np
from foxglove_schemas_protobuf.CompressedImage_pb2 import CompressedImage
from foxglove_schemas_protobuf.RawImage_pb2 import RawImage
from pydantic import Field

from paramove.bus import Bus, NodeConfig, Received, main, topics
from paramove.documents import replacing
from paramove.recording import PartedRecording, Recorder
from sim.verdict import Verdict

_log = logging.getLogger(__name__)

SUBSCRIBES = (topics.TRUTH_LAYOUT, topics.TRUTH_STATE, topics.TRUTH_ARM, topics.TRUTH_VIEW)
PUBLISHES = ()

RENEW_STATES = 75


class Config(NodeConfig):
    """Parameters of the judge.

    Attributes:
        verdict: What is judged while the run goes on; None: nothing, the report after the run judges.
        jpeg_quality: Of the view's images.
    """

    verdict: Literal["rule_learning"] | None = None
    jpeg_quality: int = Field(default=88, ge=10, le=100)


def run(bus: Bus, config: Config) -> None:
    """Loop until the bus closes, then write the verdict."""
    cv2.setNumThreads(1)
    path = bus.run_folder / "truth.mcap"
    judge = Judge(bus.run_folder / "truth.json", bus.settings.begun_ns) if config.verdict is not None else None
    earlier = judge.recall(PartedRecording(path)) if judge is not None else 0
    detail = f"goes on after {earlier} recorded states" if earlier else "records the truth"
    with contextlib.ExitStack() as ending:
        recording = ending.enter_context(Recorder(bus, path, "paramove judge"))
        if judge is not None:
            ending.callback(judge.write)
        recording.tell(detail)
        for event in bus.events(tick=True):
            if isinstance(event, Received):
                view = event.topic.type is RawImage
                recording.keep(event, compressed(event.message, config.jpeg_quality) if view else None)
                detail = (judge.handle(event) if judge is not None else "") or detail
            recording.tell(detail)


class Judge:
    """A verdict and its file."""

    def __init__(self, path: Path, run_begun_ns: int = 0) -> None:
        self._path, self._run_begun_ns = path, run_begun_ns
        self._verdict: Verdict | None = None
        self._begun_s = 0.0

    def recall(self, recording: PartedRecording) -> int:
        """Take in what an earlier process recorded of this run; returns the number of states."""
        for recorded in recording.read({topics.TRUTH_LAYOUT.name, topics.TRUTH_STATE.name}):
            if recorded.topic == topics.TRUTH_LAYOUT.name:
                self.begin(recorded.message)
            elif self._verdict is not None:
                self._verdict.take(recorded.message)
        states = 0 if self._verdict is None else self._verdict.states
        if states:
            self._begun_s = self._begun_before()
        return states

    def _begun_before(self) -> float:
        """When an earlier process took in its first state, by the monotonic clock that all processes share."""
        try:
            return float(json.loads(self._path.read_text(encoding="utf-8"))["begun_monotonic_s"])
        except (OSError, ValueError, KeyError):
            return time.monotonic()

    def handle(self, received: Received) -> str:
        """Take in a message of the truth; now and then write the verdict and return it as text, else ""."""
        if received.topic is topics.TRUTH_LAYOUT:
            self.begin(received.message)
        return self.take(received.message) if received.topic is topics.TRUTH_STATE else ""

    def begin(self, layout: Any) -> None:
        """The run's layout is known. It is published once, and again after a restart."""
        if self._verdict is None:
            self._verdict = Verdict(layout, self._run_begun_ns)

    def take(self, state: Any) -> str:
        """Take in a state; now and then write the verdict and return it as a message, else ""."""
        if self._verdict is None:
            return ""  # this process was started late and has not received the layout yet
        if self._verdict.states == 0:
            self._begun_s = time.monotonic()
        self._verdict.take(state)
        if self._verdict.states % RENEW_STATES:
            return ""
        summary = self.write()
        return f"{summary['placed']} of {len(summary['objects'])} objects rest where the robot should put them"

    def write(self) -> dict[str, Any]:
        """Write the verdict as it stands; returns it."""
        if self._verdict is None:
            summary: dict[str, Any] = {"success": False, "reason": "the simulator published no layout"}
        else:
            summary = self._verdict.summary()
            wall_s = time.monotonic() - self._begun_s if self._verdict.states else 0.0
            summary["begun_monotonic_s"] = round(self._begun_s, 3)
            summary["wall_s"] = round(wall_s, 3)
            summary["realtime_factor"] = round(summary.get("simulated_s", 0.0) / wall_s, 3) if wall_s > 0 else None
        try:
            with replacing(self._path) as unfinished:
                unfinished.write_text(json.dumps(summary, indent=2) + "\n", encoding="utf-8")
        except OSError as error:  # a full disk ends no run
            _log.warning("%s cannot be written: %s", self._path, error.strerror)
        return summary


def compressed(image: RawImage, jpeg_quality: int) -> CompressedImage:
    """An RGB image as JPEG."""
    pixels = np.frombuffer(image.data, dtype=np.uint8).reshape(image.height, image.width, 3)
    _, encoded = cv2.imencode(".jpg", cv2.cvtColor(pixels, cv2.COLOR_RGB2BGR), [cv2.IMWRITE_JPEG_QUALITY, jpeg_quality])
    return CompressedImage(timestamp=image.timestamp, frame_id=image.frame_id, data=encoded.tobytes(), format="jpeg")


if __name__ == "__main__":
    main(run, SUBSCRIBES, PUBLISHES, Config, every_namespace=True)
