"""Recordings for tests, and a process that writes one until it is killed."""

from __future__ import annotations

import sys
from pathlib import Path

from paramove.msgs.gesture_pb2 import Gesture
from paramove.msgs.rule_pb2 import Speech
from paramove.recording.writer import RecordingWriter

PERIOD_NS = 66_666_667


def messages(count: int):
    """Topic, message, log time, publish time, sequence of `count` messages on two topics."""
    for n in range(count):
        at = n * PERIOD_NS
        if n % 5:
            gesture = Gesture(kind=Gesture.KIND_MOVED, object=f"object {n}", u_px=n * 0.5)
            gesture.captured.FromNanoseconds(at)
            yield "gestures", gesture, at, at + 1000, n
        else:
            yield "speech", Speech(text=f"sentence {n} " + "x" * (n % 97)), at, at + 2000, n


def write(path: Path, count: int) -> list[tuple]:
    written = list(messages(count))
    with RecordingWriter(path, "a test") as recording:
        for one in written:
            recording.write(*one)
    return written


def write_for_ever(path: Path) -> None:
    """Tells after each message how many there are; never finishes the file."""
    recording = RecordingWriter(path, "a test that is killed")
    for number, one in enumerate(messages(10**9), start=1):
        recording.write(*one)
        sys.stdout.write(f"{number}\n")
        sys.stdout.flush()


if __name__ == "__main__":
    write_for_ever(Path(sys.argv[1]))
