"""A finished run read from its folder: the messages on the bus and the ground truth.

Everything is cut at the time at which the application reported that it was done: how much is recorded after that
depends on how fast the processes were stopped, and so on the wall clock.
"""

from __future__ import annotations

import json
from bisect import bisect_right
from collections import defaultdict
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from paramove.bus import topics
from paramove.documents import Floats, InputError, read_document
from paramove.msgs.rule_pb2 import ApplicationStage
from paramove.recording import PartedRecording, Recorded
from paramove.runs.traffic import Traffic

Kind = TypeVar("Kind")

HEAVY = frozenset(
    topic.name
    for topic in (
        *(topics.CAMERA_IMAGE, *topics.CAMERA_IMAGES, topics.WIRE_HOAP3_STREAM),
        *(topics.ACTION_OUTLINE, topics.ACTION_SCENE),
    )
)
"""Topics of which only the traffic is stored."""
AT_THE_END = frozenset({topics.APPLICATION_STAGE.name, topics.SPEECH.name})


class RunFolderError(InputError):
    """A folder that holds no run that can be evaluated; the message names what is missing."""


@dataclass(frozen=True, eq=False)
class Truth:
    """The ground truth, in the right shoulder's frame, m. N states.

    Attributes:
        layout: The world's constants (`TruthLayout`, world frame).
        time_s: [N].
        gripper, commanded: Gripper site in the world, and of the commanded joints by forward kinematics, each [N, 3].
        objects: Name -> centres, [N, 3].
        upright: Name -> cosine of the tilt, [N].
        held_by_instructor: Name -> [N].
        unwanted_contacts, penetration_mm: Since the start, [N].
        contacts: Pairs in contact, per state.
        instructor: What the instructor does, per state.
    """

    layout: Any
    time_s: Floats
    gripper: Floats
    commanded: Floats
    objects: dict[str, Floats]
    upright: dict[str, Floats]
    held_by_instructor: dict[str, NDArray[np.bool_]]
    unwanted_contacts: NDArray[np.int_]
    penetration_mm: Floats
    contacts: tuple[tuple[str, ...], ...]
    instructor: tuple[str, ...]

    @property
    def shoulder(self) -> Floats:
        """Origin of the shoulder's frame in the world, [3], m."""
        return np.array(self.layout.world_from_shoulder)

    @property
    def surface_z(self) -> float:
        """Height of the working plane, m."""
        return float(self.layout.surface_z - self.shoulder[2])

    @property
    def openings(self) -> dict[str, Floats]:
        """Name -> centre (x, y), m."""
        return {o.name: np.array([o.x, o.y]) - self.shoulder[:2] for o in self.layout.openings}

    @property
    def opening_of(self) -> dict[str, str]:
        """Object -> name of the opening that it belongs to."""
        return {rule.object: rule.opening for rule in self.layout.rules}

    def half_height_of(self, name: str) -> float:
        """Of an object, m; recordings that lack it are of cylinders of 50 mm."""
        return next((item.height / 2 for item in self.layout.objects if item.name == name), 0.025)

    def at(self, time_s: float) -> int:
        """Index of the state nearest to a time."""
        return int(np.abs(self.time_s - time_s).argmin())


@dataclass(frozen=True)
class RecordingGap:
    """Nothing was recorded between two times, s, in `recording` (the messages) or `truth`."""

    recording: str
    begin_s: float
    end_s: float


@dataclass(frozen=True, eq=False)
class RecordedRun:
    """All that is needed to evaluate a run.

    Attributes:
        folder: Of the run.
        messages: Topic name -> messages in order; without those of `HEAVY`.
        traffic: Counts of every recorded topic.
        truth: The ground truth.
        verdict: Of `truth.json`.
        facts: Of `run.yaml`.
        end_s: When the application was done, else when the recording ended.
        done: Whether the application reported that it was done.
        begun_ns: When it began, by its clock; all other times count from there.
        gaps: Times at which nothing was recorded: the recorder or the judge was being started again, or the disk full.
    """

    folder: Path
    messages: dict[str, list[Recorded]]
    traffic: Traffic
    truth: Truth
    verdict: dict[str, Any]
    facts: dict[str, Any]
    end_s: float
    done: bool
    begun_ns: int
    gaps: tuple[RecordingGap, ...]

    def title(self, application: str) -> str:
        """With robot and seed."""
        robot = robot_in(self.folder)
        return ", ".join((application, *([] if robot is None else [robot.name]), f"seed {self.truth.layout.seed}"))

    def captured_s(self, message: Any) -> float:
        """Capture time of a message."""
        return float(1e-9 * (message.captured.ToNanoseconds() - self.begun_ns))

    def recording(self, name: str) -> PartedRecording:
        """Its `recording` or `truth`, to be read again for what is not in `messages`."""
        return recording_in(self.folder, name, self.begun_ns)

    def received(self, topic: topics.Topic) -> list[Recorded]:
        """Messages of a topic, in order."""
        return self.messages.get(topic.name, [])

    def latest(self, topic: topics.Topic, time_s: float, stamp: str = "publish_ns") -> Recorded | None:
        """The latest message of a topic whose stamp (or its `log_ns`) is not after a time, s; None before the first."""
        messages = self.received(topic)
        index = bisect_right(messages, time_s, key=lambda recorded: 1e-9 * getattr(recorded, stamp))
        return messages[index - 1] if index else None


def load_run(folder: Path) -> RecordedRun:
    """Read a run's folder.

    Raises:
        RunFolderError: There is no recording or no truth in it, or they are empty.
    """
    facts = read_facts(folder)
    begun_ns = int(facts.get("begun_ns", 0))
    recording, truth_file = (recording_in(folder, name, begun_ns) for name in ("recording", "truth"))
    recorded, traffic = _read_recording(recording)
    end_ns, done = _end_of(recorded, traffic)
    until_end = {
        name: [m for m in messages if m.publish_ns < end_ns or (m.publish_ns == end_ns and name in AT_THE_END)]
        for name, messages in recorded.items()
    }
    traffic.cut(end_ns)
    truth = _read_truth(truth_file, begun_ns, end_ns)
    return RecordedRun(
        folder=folder,
        messages=until_end,
        traffic=traffic,
        truth=truth,
        verdict=judged(folder / "truth.json", "the judge wrote no truth.json"),
        facts=facts,
        end_s=end_ns * 1e-9,
        done=done,
        begun_ns=begun_ns,
        gaps=_gaps({"recording": recording, "truth": truth_file}, end_ns),
    )


def gaps_in(folder: Path) -> tuple[RecordingGap, ...]:
    """The gaps of all recordings of a run, which has them only where there are further parts; from its begin."""
    begun_ns = int(read_facts(folder).get("begun_ns", 0))
    recordings = {name: PartedRecording(folder / f"{name}.mcap", begun_ns) for name in ("recording", "truth")}
    for recording in recordings.values():
        if len(recording.parts) > 1:
            for _ in recording.read():
                pass  # the recording learns of its gaps
    return _gaps(recordings)


def _gaps(recordings: Mapping[str, PartedRecording], end_ns: float = float("inf")) -> tuple[RecordingGap, ...]:
    return tuple(
        RecordingGap(name, gap.begin_ns * 1e-9, min(gap.end_ns, end_ns) * 1e-9)
        for name, parts in recordings.items()
        for gap in parts.gaps
        if gap.begin_ns < end_ns
    )


def recording_in(folder: Path, name: str, begun_ns: int = 0) -> PartedRecording:
    """The `recording` or `truth` of a run, finished or not, with all its parts; raises RunFolderError."""
    recording = PartedRecording(folder / f"{name}.mcap", begun_ns)
    if recording.parts:
        return recording
    content = ", ".join(sorted(path.name for path in folder.iterdir())) if folder.is_dir() else "no such folder"
    raise RunFolderError(
        f"{folder} holds no {name}.mcap ({content}); a folder below runs/ of a simulated run is needed"
    )


def _read_recording(recording: PartedRecording) -> tuple[dict[str, list[Recorded]], Traffic]:
    messages: dict[str, list[Recorded]] = defaultdict(list)
    traffic = Traffic()
    for recorded in recording.read():
        traffic.take(recorded)
        if recorded.topic not in HEAVY:
            messages[recorded.topic].append(recorded)
    if not messages:
        raise RunFolderError(f"{_names(recording)} holds no message")
    return dict(messages), traffic


def _end_of(messages: dict[str, list[Recorded]], traffic: Traffic) -> tuple[int, bool]:
    for recorded in messages.get(topics.APPLICATION_STAGE.name, []):
        if recorded.message.stage == ApplicationStage.STAGE_DONE:
            return recorded.publish_ns, True
    return traffic.last_ns, False


def _names(recording: PartedRecording) -> str:
    return ", ".join(map(str, recording.parts))


def _read_truth(recording: PartedRecording, begun_ns: int, end_ns: int) -> Truth:
    layout: Any = None
    states: list[Any] = []
    for recorded in recording.read({topics.TRUTH_LAYOUT.name, topics.TRUTH_STATE.name}):
        if recorded.topic == topics.TRUTH_LAYOUT.name:
            layout = recorded.message
        elif recorded.message.time_ns - begun_ns <= end_ns:
            states.append(recorded.message)
    if layout is None or not states:
        raise RunFolderError(f"{_names(recording)} holds no {'state' if layout is not None else 'layout'} of the world")
    shoulder = np.array(layout.world_from_shoulder)
    objects: dict[str, list[Any]] = defaultdict(list)
    for state in states:
        for body in state.objects:
            objects[body.name].append(body)
    return Truth(
        layout=layout,
        time_s=np.array([state.time_ns - begun_ns for state in states]) * 1e-9,
        gripper=np.array([state.gripper for state in states]) - shoulder,
        commanded=np.array([state.gripper_commanded for state in states]) - shoulder,
        objects={name: np.array([(b.x, b.y, b.z) for b in bodies]) - shoulder for name, bodies in objects.items()},
        upright={name: np.array([_upright(b) for b in bodies]) for name, bodies in objects.items()},
        held_by_instructor={name: np.array([b.held_by_instructor for b in bodies]) for name, bodies in objects.items()},
        unwanted_contacts=np.array([state.unwanted_contacts for state in states]),
        penetration_mm=np.array([state.deepest_penetration_mm for state in states]),
        contacts=tuple(tuple(state.contacts) for state in states),
        instructor=tuple(state.instructor for state in states),
    )


def _upright(body: Any) -> float:
    x, y, _, _ = body.quaternion_xyzw
    return float(1 - 2 * (x * x + y * y))


def judged(path: Path, otherwise: str) -> dict[str, Any]:
    """A verdict on a run in a file; without the file, a failure with that reason."""
    if not path.is_file():
        return {"success": False, "reason": otherwise}
    content: dict[str, Any] = json.loads(path.read_text(encoding="utf-8"))
    return content


def parameter_in(folder: Path, node: str, name: str, kind: type[Kind]) -> Kind:
    """A parameter of this kind that a node of the run had; raises RunFolderError."""
    path = folder / "nodes" / f"{node}.yaml"
    try:
        value = read_document(path, "configuration of a node").data["parameters"][name]
    except (InputError, KeyError, TypeError) as error:
        raise RunFolderError(f"{path} has no {name} of the run ({error!r})") from error
    if not isinstance(value, kind):
        raise RunFolderError(f"{path} has no {name} of the run (found {value!r:.80})")
    return value


def robot_in(folder: Path) -> Path | None:
    """Folder of the robot's description that the run's synthesizer had; None if it had none. Raises RunFolderError."""
    path = folder / "nodes" / "synthesizer.yaml"
    if not path.is_file():
        return None
    robot = read_document(path, "configuration of a node", RunFolderError).data.get("parameters", {}).get("robot")
    return None if robot is None else Path(robot)


def read_facts(folder: Path) -> dict[str, Any]:
    """What the launcher wrote into `run.yaml`; empty without one. Raises RunFolderError."""
    path = folder / "run.yaml"
    if not path.is_file():
        return {}
    return read_document(path, "file of a run", RunFolderError).data
