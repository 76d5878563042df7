"""BVH files: a hierarchy of joints and the rotations of each; the points are the positions of the joints.

A joint's position is its parent's position plus its OFFSET turned by all rotations above it. Rotations are about the
joint's own axes in the order in which its channels are listed, in degrees. Position channels replace the OFFSET. The
end of a limb ("End Site") is a point too: `<joint>_end`.
"""

from __future__ import annotations

import itertools
import math
import re
from array import array
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from paramove.demonstrations import DemonstrationError
from paramove.demonstrations.importing.checking import RawTake, check_length
from paramove.documents import Floats, read_text

MAX_LEVELS = 200
MAX_JOINTS = 1000
LINE_LETTERS = 2**20
FRAMES_AT_ONCE = 10_000
"""Number of frames whose rotations are in memory at once."""
CHANNEL = re.compile(r"([XYZ])(position|rotation)", re.IGNORECASE)


@dataclass(frozen=True)
class Joint:
    """A joint, or the end of a limb.

    Attributes:
        name: Unique in its file.
        parent: Number of its parent, which comes before it; -1 of the root.
        offset: From the parent, at rest. Shape (3,).
        channels: Such as "Xposition", in the order of the file.
    """

    name: str
    parent: int
    offset: Floats
    channels: tuple[str, ...] = ()


@dataclass(frozen=True)
class Motion:
    """Hierarchy and values of all channels, shape (T, C); frame time in s."""

    joints: tuple[Joint, ...]
    values: Floats
    frame_time: float


def read_bvh(path: Path) -> list[RawTake]:
    """Positions of all joints over time. BVH defines no unit; by custom y points up, z forward, x left.

    Raises DemonstrationError with the line of what is wrong.
    """
    motion = parse(read_text(path, "BVH file", DemonstrationError), str(path))
    names = tuple(joint.name for joint in motion.joints)
    positions = joint_positions(motion.joints, motion.values)
    time: Floats = np.arange(len(positions), dtype=np.float64) * motion.frame_time
    return [RawTake(path.stem, time, positions, names, axes="y_up", time_unit_s=1.0)]


def joint_positions(joints: tuple[Joint, ...], values: Floats) -> Floats:
    """Forward kinematics. Shapes: values (T, C), C channels of all joints in their order -> (T, J, 3)."""
    positions = np.zeros((len(values), len(joints), 3))
    for begin in range(0, len(values), FRAMES_AT_ONCE):
        positions[begin : begin + FRAMES_AT_ONCE] = _positions(joints, values[begin : begin + FRAMES_AT_ONCE])
    return positions


def _positions(joints: tuple[Joint, ...], values: Floats) -> Floats:
    positions = np.zeros((len(values), len(joints), 3))
    rotations: list[Floats] = []
    column = 0
    for number, joint in enumerate(joints):
        position = np.broadcast_to(joint.offset, (len(values), 3)).copy()
        rotation = np.broadcast_to(np.eye(3), (len(values), 3, 3))
        for channel in joint.channels:
            axis, kind = channel[0].lower(), channel[1:].lower()
            if kind == "position":
                position[:, "xyz".index(axis)] = values[:, column]
            else:
                rotation = (
                    rotation @ Rotation.from_euler(axis, values[:, column : column + 1], degrees=True).as_matrix()
                )
            column += 1
        if joint.parent >= 0:
            above = rotations[joint.parent]
            position = positions[:, joint.parent] + np.einsum("tij,tj->ti", above, position)
            rotation = above @ rotation
        positions[:, number] = position
        rotations.append(np.asarray(rotation))
    return positions


def parse(text: str, source: str) -> Motion:
    """A BVH text; raises DemonstrationError with `source` and line of the fault."""
    return _Parser(text, source).motion()


class _Parser:
    def __init__(self, text: str, source: str) -> None:
        self._source = source
        self._lines = text.splitlines()
        self._line = 0  # so many were begun
        self._words: list[str] = []  # of the line that was begun last, those that were not read yet
        if any(len(line) > LINE_LETTERS for line in self._lines):
            raise DemonstrationError(f"{source}: a line of more than {LINE_LETTERS} characters; no BVH file has one")
        self._joints: list[Joint] = []

    def motion(self) -> Motion:
        self._expect("HIERARCHY")
        self._expect("ROOT")
        self._joint(self._next("the name of the root"), -1, 1)
        self._expect("MOTION")
        self._expect("Frames:")
        frames = self._number("how many frames there are")
        check_length(frames, self._source)
        self._expect("Frame")
        self._expect("Time:")
        frame_time = self._number("the time of a frame in seconds")
        if not 0.0 < frame_time < 10.0:
            raise self._wrong(f"a frame time of {frame_time:g} s; expected such as 0.0083333")
        return Motion(tuple(self._joints), self._values(frames), frame_time)

    def _joint(self, name: str, parent: int, level: int) -> None:
        if level > MAX_LEVELS or len(self._joints) == MAX_JOINTS:
            raise self._wrong(f"more than {MAX_LEVELS} joints below each other, or than {MAX_JOINTS} altogether")
        if any(joint.name == name for joint in self._joints):
            raise self._wrong(f"a second joint '{name:.80}'; each needs its own name")
        number = len(self._joints)
        self._joints.append(Joint(name, parent, np.zeros(3)))
        self._expect("{")
        self._expect("OFFSET")
        offset = np.array([self._number("an offset") for _ in range(3)])
        channels = self._channels() if self._peek() == "CHANNELS" else ()
        self._joints[number] = Joint(name, parent, offset, channels)
        while (word := self._next("JOINT, End Site or }")) != "}":
            if word == "JOINT":
                self._joint(self._next("the name of a joint"), number, level + 1)
            elif word == "End":
                self._expect("Site")
                self._joint(f"{name}_end", number, level + 1)
            else:
                raise self._wrong(f"'{word}'; expected JOINT, End Site or }}")

    def _channels(self) -> tuple[str, ...]:
        self._expect("CHANNELS")
        count = self._number("how many channels there are")
        channels = tuple(self._next("the name of a channel") for _ in range(int(count)))
        for name in channels:
            if not CHANNEL.fullmatch(name):
                raise self._wrong(f"channel '{name:.40}'; expected such as Xposition or Zrotation")
        return channels

    def _values(self, frames: float) -> Floats:
        width = sum(len(joint.channels) for joint in self._joints)
        if len(self._joints) > 2 * width:
            raise self._wrong(f"{len(self._joints)} joints have only {width} channels")
        self._peek()
        first, numbers = self._line, array("d")
        rest = itertools.chain([self._words[::-1]], map(str.split, self._lines[first:]))
        for line, words in enumerate(rest, start=first):
            try:
                row = [float(word) for word in words]
            except ValueError as error:
                bad = next(word for word in words if not _is_number(word))
                raise self._wrong(f"'{bad:.40}' is no number", line) from error
            if not all(map(math.isfinite, row)):
                at = next(index for index, value in enumerate(row) if not math.isfinite(value))
                raise self._wrong(f"{words[at]:.40} in frame {(len(numbers) + at) // max(width, 1)}", line)
            numbers.extend(row)
        if len(numbers) != width * frames or frames < 1 or width == 0:
            raise self._wrong(
                f"{len(numbers)} numbers follow; {frames:g} frames of {width} channels need {width * frames:g}. "
                "The file is cut off, or its number of frames is wrong",
                first,
            )
        return np.array(numbers).reshape(-1, width)

    def _peek(self) -> str:
        """The next word, "" at the end."""
        while not self._words and self._line < len(self._lines):
            self._words = self._lines[self._line].split()[::-1]
            self._line += 1
        return self._words[-1] if self._words else ""

    def _next(self, what: str) -> str:
        if not self._peek():
            raise self._wrong(f"the file ends; expected {what}")
        return self._words.pop()

    def _expect(self, word: str) -> None:
        found = self._next(word)
        if found.upper() != word.upper():
            raise self._wrong(f"'{found:.40}'; expected {word}")

    def _number(self, what: str) -> float:
        word = self._next(what)
        if not _is_number(word) or not np.isfinite(float(word)):
            raise self._wrong(f"'{word:.40}'; expected {what}")
        return float(word)

    def _wrong(self, message: str, line: int = 0) -> DemonstrationError:
        return DemonstrationError(f"{self._source}:{line or max(self._line, 1)}: {message}")


def _is_number(word: str) -> bool:
    try:
        float(word)
    except ValueError:
        return False
    return True
