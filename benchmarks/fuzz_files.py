"""Damages files of every kind that the project reads, and bombs them; anything but a reading or one message fails.

    python benchmarks/fuzz_files.py [--seconds 600] [--seed 0]

Files of each kind are made by the project's own writers, by libraries, and taken from the workspace. Their bytes are
changed, and what is in them: arrays of archives, messages of recordings, words of texts, sizes of pictures. The real
readers read them in a process of its own; its largest memory and processor time, with its children's, are measured for
each file. A file on which 30 s of it are spent counts as rejected, but slow. Prints a table; the exit code is 1, and
the files are kept, if anything but a rejection was raised, or 5 s or 1 GB were not enough.
"""

from __future__ import annotations

import contextlib
import io
import multiprocessing
import os
import random
import re
import resource
import shutil
import struct
import sys
import tempfile
import time
import traceback
import zipfile
import zlib
from collections import Counter
from collections.abc import Callable, Generator, Iterator
from itertools import pairwise
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any, NamedTuple

import cv2
import numpy as np
import psutil

ROOT = Path(__file__).parents[1]
sys.path.insert(0, str(ROOT))  # run as a program, only this folder is known

from benchmarks.fuzz_bus import mutate, run  # noqa: E402
from paramove.cameras import FrameError  # noqa: E402
from paramove.documents import DocumentError, InputError  # noqa: E402

MOST_S = 5.0
HANGS_S = 30.0
"""Of processor time; so much time altogether, times `BUSY`, is a hang too."""
BUSY = 20
MOST_MIB = 1024.0
LIMIT_BYTES = 6 * 2**30
"""Of the reading process, so that the machine outlives it."""
MAX_BYTES = 2**23
REFUSALS = (InputError, DocumentError, FrameError)
COUNTS = ("rejected", "read", "traceback", "over 5 s", "over 1 GB")
FAILURES = COUNTS[2:]


class Kind(NamedTuple):
    """Files of one kind: their ending, examples, and how what is in them is changed."""

    ending: str
    examples: list[bytes]
    change: Callable[[bytes, random.Random], bytes]


# What reads -------------------------------------------------------------------------------------------------------


def _import(path: Path) -> Iterator[None]:
    from paramove.demonstrations import DemonstrationSet, write_set
    from paramove.demonstrations.importing import ImportOptions, import_file

    imported = import_file(path, ImportOptions(unit="mm"))
    folder = path.with_suffix(".set")
    yield
    try:
        write_set(folder, imported.takes, imported.parameter_names)
        yield
        DemonstrationSet.load(folder)
    finally:
        shutil.rmtree(folder, ignore_errors=True)


def _recording(path: Path) -> object:
    from paramove.demonstrations import read_poses
    from paramove.recording import read, recover

    goal = path.with_suffix(".whole.mcap")
    with contextlib.suppress(InputError):
        recover(path, goal)
    goal.unlink(missing_ok=True)
    with contextlib.suppress(KeyError):  # a topic that the table does not know
        list(read(path))
    return read_poses(path)


def _model(path: Path) -> object:
    from paramove.phmm import ParametricHMM

    return ParametricHMM.load(path)


def _labels(path: Path) -> object:
    from paramove.demonstrations import load_labels

    return load_labels(path)


def _launch(path: Path) -> object:
    from paramove.supervision import load
    from paramove.workspace import Workspace

    return load(Workspace.at(ROOT), str(path), overlays=[])


def _robot(path: Path) -> object:
    from paramove.robots import RobotDescription

    return RobotDescription.load(path)


def _calibration(path: Path) -> object:
    from paramove.robots.dynamixel import ArmCalibration

    return ArmCalibration.read(path)


def _cameras(path: Path) -> object:
    from paramove.cameras import read_cameras

    return read_cameras(path)


def _person(path: Path) -> object:
    from paramove.action_space import read_person

    return read_person(path)


def _grammar(path: Path) -> object:
    from paramove.action_space import read_grammar

    return read_grammar(path)


def _mapping(path: Path) -> object:
    from paramove.demonstrations.importing import read_mapping_file

    return read_mapping_file(path)


def _node(path: Path) -> object:
    from paramove.bus import NodeConfig, read_node_file

    return read_node_file(path, NodeConfig)


def _picture(path: Path) -> object:
    from paramove.cameras import PICTURES, file_source, open_source

    found = file_source(path.parent).held()
    return open_source(f"folder:{path.parent}@10", 64, 48).frame(0) if path.suffix in PICTURES else found


def _video(path: Path) -> object:
    from paramove.cameras import FileFrames

    frames = FileFrames(path)
    try:
        return [frames.frame(round(number * 0.1e9)) for number in range(12)]
    finally:
        frames.close()


READERS: dict[str, Callable[[Path], object]] = {
    **dict.fromkeys(("NPZ", "C3D", "BVH", "CSV"), _import),
    "model": _model,
    "MCAP": _recording,
    "labels": _labels,
    "launch": _launch,
    "robot": _robot,
    "arm": _calibration,
    "cameras": _cameras,
    "person": _person,
    "grammar": _grammar,
    "mapping": _mapping,
    "node": _node,
    **dict.fromkeys(("png", "jpg", "bmp", "webp", "tiff"), _picture),
    **dict.fromkeys(("mp4", "avi"), _video),
}


# What is changed --------------------------------------------------------------------------------------------------


def _bytes_of(content: bytes, generator: random.Random) -> bytes:
    return content


def _archive(content: bytes, generator: random.Random) -> bytes:
    """An array is damaged, exchanged, deflated out of zeros, or packed in an unusual way; its checksum fits."""
    with zipfile.ZipFile(io.BytesIO(content)) as old:
        members = {name: old.read(name) for name in old.namelist()}
    name = generator.choice([*members])
    way = generator.randrange(7)
    if way == 0:
        members[name] = mutate(members[name], members[name], generator, MAX_BYTES)
    elif way == 1:
        members[name] = re.sub(rb"\d+", lambda _: b"%d" % generator.choice([0, 3, 6000, 10**9]), members[name][:128])
    elif way == 2:
        shape = generator.choice([(10**7,), (4000, 4000), (0,), (1, 10**8), (3 * 10**8,)])
        header = io.BytesIO()
        kind = generator.choice(["<f8", "|O", "<U9", "|V0", "|u1"])
        np.lib.format.write_array_header_1_0(header, {"descr": kind, "fortran_order": False, "shape": shape})
        members[name] = header.getvalue() + bytes(generator.choice([0, 10**5, 3 * 10**7]))
    elif way == 3:
        whole = io.BytesIO()
        np.save(whole, np.array(generator.choice([-1, 0, 1e300, np.nan, "x" * 9, 10**9])))
        members[name] = whole.getvalue()
    elif way == 4:
        digits = re.compile("[0-9]\0\0\0")
        members[name] = digits.sub("9\0\0\0", members[name].decode("latin-1"), generator.randrange(9)).encode("latin-1")
    elif way == 5:
        del members[name]
    method = generator.choice([zipfile.ZIP_DEFLATED, zipfile.ZIP_DEFLATED, zipfile.ZIP_BZIP2, zipfile.ZIP_LZMA])
    new = io.BytesIO()
    with zipfile.ZipFile(new, "w", method) as archive:
        for name, data in members.items():
            archive.writestr(name, data)
    return new.getvalue()


def _messages(content: bytes, generator: random.Random) -> bytes:
    """Messages are damaged, or a chunk is one that grows to any size; checksums fit."""
    from mcap.reader import make_reader
    from mcap.writer import CompressionType, Writer

    new = io.BytesIO()
    kind = generator.choice([*CompressionType])
    writer = Writer(new, chunk_size=generator.choice([100, 10_000, 2**20, 2**27]), compression=kind)
    writer.start()
    channels: dict[int, int] = {}
    bomb = generator.random() < 0.1
    for schema, channel, message in make_reader(io.BytesIO(content)).iter_messages():
        if channel.id not in channels:
            assert schema is not None
            number = writer.register_schema(schema.name, schema.encoding, schema.data)
            channels[channel.id] = writer.register_channel(channel.topic, channel.message_encoding, number)
        data = message.data
        if bomb:
            data, bomb = bytes(generator.choice([10**6, 4 * 10**7])), False
        elif generator.random() < 0.1:
            data = mutate(data, data, generator)
        at = generator.choice([message.log_time, 0, 2**64 - 1]) if generator.random() < 0.05 else message.log_time
        writer.add_message(channels[channel.id], at, data, message.publish_time, message.sequence % 2**32)
    writer.finish()  # type: ignore[no-untyped-call]
    return new.getvalue()


YAML_WORDS = [
    "&a [",
    "*a",
    "? ",
    "!!python/object:os.system x",
    "- " * 30,
    "[" * 300,
    "{" * 30,
    "'",
    '"',
    "|\n",
    "%TAG !\n",
]
YAML_WORDS += [
    "1" * 5000,
    ".nan",
    "1e999",
    "<<: ",
    "\t",
    "---\n",
    ": ",
    "2026-13-45",
    "0x" + "f" * 99,
    "null",
    "[]",
    "{}",
]
YAML_WORDS += ["a: &a [x, x]\nb: &b [*a, *a]\n", "0", "-1", "x" * 70_000, "- - - a\n", "\0", "\ufeff", "é"]


def _lines_of(words: list[str]) -> Callable[[bytes, random.Random], bytes]:
    def change(content: bytes, generator: random.Random) -> bytes:
        """Words in place of others; lines lost, repeated and exchanged."""
        lines = content.decode("utf-8", "replace").splitlines(keepends=True)
        for _ in range(generator.choice([1, 1, 2, 5])):
            at, way = generator.randrange(len(lines)), generator.randrange(5)
            if way == 0:
                lines[at : at + 1] = []
            elif way == 1:
                lines[at:at] = lines[at : at + generator.randrange(1, 9)] * generator.choice([1, 2, 300])
            else:
                parts = re.split(r"(\W+)", lines[at])
                parts[generator.randrange(len(parts))] = generator.choice(words)
                lines[at] = "".join(parts)
            lines = lines or ["\n"]
        return "".join(lines).encode("utf-8", "replace")[:MAX_BYTES]

    return change


NUMBERS = ["nan", "1e308", "-0", "1" * 400, "x", '"', "'", ",", ";", "\n", "{", "}", "9" * 140_000, "1e9", "0", "\0"]
NUMBERS += [
    "JOINT a\n{\nOFFSET 0 0 0\n" * 1000,
    "End Site",
    "CHANNELS 999999999",
    "Frames: 100000000",
    '"' + "1," * 90_000,
]


def _size_of_picture(content: bytes, generator: random.Random) -> bytes:
    """Another size in the header; of a PNG with its checksum."""
    found = bytearray(content)
    width, height = (generator.choice([0, 1, 4000, 7000, 30_000, 60_000]) for _ in range(2))
    if content[:4] == b"\x89PNG":
        found[16:24] = struct.pack(">II", width, height)
        found[29:33] = struct.pack(">I", zlib.crc32(bytes(found[12:29])))
    elif content[:2] == b"\xff\xd8":
        at = content.find(b"\xff\xc0") + 5
        found[at : at + 4] = struct.pack(">HH", height, width)
    else:
        at = generator.randrange(8, min(len(found), 60))
        found[at : at + 2] = struct.pack("<H", width)
    return bytes(found)


# What there is ----------------------------------------------------------------------------------------------------


def kinds(folder: Path) -> dict[str, Kind]:
    """Every kind with its examples, which are made in a folder."""
    yaml, numbers = _lines_of(YAML_WORDS), _lines_of(NUMBERS)
    launches = [path.read_bytes() for path in sorted((ROOT / "launch").glob("*.yaml"))]
    robots = [path.read_bytes() for path in sorted((ROOT / "robot_description").glob("*/robot.yaml"))]
    grammar = b"begin: point(a)\nafter:\n  point(a):\n    - withdraw(a): 2\n  withdraw(b): point(a)\n"
    mapping = b"unit: mm\naxes: y_up\npoints: {wrist: [RWRA, RWRB], index: RFIN}\n"
    person = b"shoulder: [-0.27, -0.18, 0.35]\nupper_arm: 0.28\nforearm: 0.24\nhand: 0.17\n"
    node = b"node: camera\nbus: {folder: /tmp/x}\nparameters: {}\nrun_folder: /tmp\n"
    takes, recording, labels = _demonstrations(folder)
    return {
        "NPZ": Kind(".npz", takes[".npz"], _archive),
        "C3D": Kind(".c3d", takes[".c3d"], _bytes_of),
        "BVH": Kind(".bvh", takes[".bvh"], numbers),
        "CSV": Kind(".csv", takes[".csv"], numbers),
        "model": Kind(".npz", models(folder), _archive),
        "MCAP": Kind(".mcap", [recording], _messages),
        "labels": Kind(".yaml", [labels], yaml),
        "launch": Kind(".yaml", launches, yaml),
        "robot": Kind(".yaml", robots, yaml),
        "arm": Kind(".yaml", [_arm(folder)], yaml),
        "cameras": Kind(".yaml", [_two_cameras(folder)], yaml),
        "person": Kind(".yaml", [person], yaml),
        "grammar": Kind(".yaml", [grammar], yaml),
        "mapping": Kind(".yaml", [mapping], yaml),
        "node": Kind(".yaml", [node], yaml),
        **{
            name: Kind(f".{name}", [_drawn(name)], _size_of_picture)
            for name, read in READERS.items()
            if read is _picture
        },
        **{
            name: Kind(f".{name}", [_film(folder, name)], _bytes_of) for name, read in READERS.items() if read is _video
        },
    }


def _demonstrations(folder: Path) -> tuple[dict[str, list[bytes]], bytes, bytes]:
    """A movement of three points as every kind of file, as a recording, and the labels of that."""
    import ezc3d

    from paramove.demonstrations import Label, RecordingsError, data_folder, write_set
    from paramove.demonstrations.importing import ImportOptions, import_file

    names = ("shoulder", "elbow", "wrist")
    time_s = np.arange(120) * 0.01
    points = np.random.default_rng(0).normal(0.0, 300.0, (1, 3, 3)) + 100.0 * np.sin(time_s)[:, None, None]
    np.savez_compressed(folder / "take.npz", positions=points, points=np.array(names), rate_hz=100.0, unit="mm")
    columns = ",".join(f"{name}_{axis}" for name in names for axis in "xyz")
    rows = "\n".join(",".join(f"{value:.3f}" for value in row) for row in np.c_[time_s, points.reshape(120, -1)])
    (folder / "take.csv").write_text(f"time,{columns}\n{rows}\n")
    channels = "CHANNELS 6 Xposition Yposition Zposition Zrotation Xrotation Yrotation"
    joint = "JOINT b\n{\nOFFSET 1 2 3\nCHANNELS 3 Zrotation Xrotation Yrotation\nEnd Site\n{\nOFFSET 0 0 9\n}\n}\n"
    frames = "\n".join(" ".join(f"{value:.2f}" for value in row) for row in points.reshape(120, -1))
    head = f"HIERARCHY\nROOT a\n{{\nOFFSET 0 0 0\n{channels}\n{joint}}}\nMOTION\nFrames: 120\nFrame Time: 0.01\n"
    (folder / "take.bvh").write_text(f"{head}{frames}\n")
    file = ezc3d.c3d()
    file["parameters"]["POINT"]["RATE"]["value"] = [100.0]
    file["parameters"]["POINT"]["LABELS"]["value"] = list(names)
    file["parameters"]["POINT"]["UNITS"]["value"] = ["mm"]
    file["data"]["points"] = np.concatenate([points.transpose(2, 1, 0), np.ones((1, 3, 120))])
    file.write(str(folder / "take.c3d"))
    takes = {ending: [(folder / f"take{ending}").read_bytes()] for ending in (".npz", ".csv", ".bvh", ".c3d")}
    with contextlib.suppress(RecordingsError):  # the recordings of persons are no part of the repository
        takes[".npz"] += [_first_takes(path) for path in sorted(data_folder().glob("*/data.npz"))]
    label = Label(0, 120, "reaching", (0.1, 0.2))
    imported = import_file(folder / "take.csv", ImportOptions(unit="mm"), label)
    write_set(folder / "set", imported.takes, ("u", "v"))
    return takes, (folder / "set" / "take.mcap").read_bytes(), (folder / "set" / "labels.yaml").read_bytes()


def _first_takes(path: Path, count: int = 20) -> bytes:
    """The archive with its first takes only: a whole one takes seconds to read, in which dozens can be tried."""
    with np.load(path, allow_pickle=False) as archive:
        arrays = dict(archive)
    n_takes, n_frames = len(arrays["offsets"]) - 1, len(arrays["flat"])
    cut = {n_takes + 1: count + 1, n_takes: count, n_frames: int(arrays["offsets"][count])}
    content = io.BytesIO()
    np.savez_compressed(
        content, **{name: array[: cut.get(len(array))] if array.ndim else array for name, array in arrays.items()}
    )
    return content.getvalue()


def models(folder: Path) -> list[bytes]:
    from paramove.phmm import InterpolativePHMM, LinearPHMM

    time_s = np.linspace(0.0, 1.0, 30)[:, None]
    theta = np.array([[u, v] for u in (0.0, 1.0) for v in (0.0, 1.0)])
    generator = np.random.default_rng(0)
    shown = [time_s * one + generator.normal(0.0, 0.01, (30, 2)) for one in np.repeat(theta, 3, axis=0)]
    linear = LinearPHMM(4, d_max=20).fit(shown, np.repeat(theta, 3, axis=0))
    interpolative = InterpolativePHMM(4, d_max=20).fit(shown, np.repeat(theta, 3, axis=0))
    for name, model in (("linear.npz", linear), ("interpolative.npz", interpolative)):
        model.save(folder / name)
    return [(folder / name).read_bytes() for name in ("linear.npz", "interpolative.npz")]


def _arm(folder: Path) -> bytes:
    from paramove.robots.dynamixel import ArmCalibration, CalibratedBus, JointCalibration

    joint: dict[str, Any] = {"model": "xl430_w250", "firmware": 45, "sign": 1, "operating_mode": 3}
    joint |= {"homing_offset": 0, "zero_counts": 2048, "min_counts": 1000, "max_counts": 3000}
    joints = {f"joint{number}": JointCalibration(id=number, **joint) for number in range(1, 6)}
    bus = CalibratedBus(serial="FT6Z5NCH", baud_rate=1_000_000)
    arm = ArmCalibration(created="2026-11-23T02:00:00+00:00", tool="paramove", robot="arm", bus=bus, joints=joints)
    arm.save(folder / "arm.yaml")
    return (folder / "arm.yaml").read_bytes()


def _two_cameras(folder: Path) -> bytes:
    from paramove.cameras import CalibratedCamera, write_cameras

    matrix = np.array([[500.0, 0.0, 320.0], [0.0, 500.0, 240.0], [0.0, 0.0, 1.0]])
    two = [CalibratedCamera(name, 640, 480, matrix, np.zeros(5), np.eye(4)) for name in ("left", "right")]
    write_cameras(folder / "cameras.yaml", two)
    return (folder / "cameras.yaml").read_bytes()


def _image(number: int = 0) -> Any:
    return np.random.default_rng(number).integers(60, 200, (48, 64, 3), dtype=np.uint8)


def _drawn(name: str) -> bytes:
    return bytes(cv2.imencode(f".{name}", _image())[1].tobytes())


def _film(folder: Path, name: str) -> bytes:
    path = folder / f"film.{name}"
    code = cv2.VideoWriter.fourcc(*("mp4v" if name == "mp4" else "MJPG"))
    writer = cv2.VideoWriter(str(path), code, 10.0, (64, 48))
    for number in range(12):
        writer.write(_image(number))
    writer.release()
    return path.read_bytes()


# What happens -----------------------------------------------------------------------------------------------------


class Outcome(NamedTuple):
    """How reading one file ended: "read", "rejected" or "traceback", and what was raised; processor time and memory."""

    end: str
    raised: str
    seconds: float
    mebibytes: float


def peak_mib(anew: bool = False) -> float:
    """Largest resident memory of this process; from now on if it begins anew."""
    if anew:
        Path("/proc/self/clear_refs").write_text("5")
    return int(re.findall(r"VmHWM:\s+(\d+)", Path("/proc/self/status").read_text())[0]) / 1024


def attempt(read: Callable[[Path], object], path: Path) -> Outcome:
    """Reads a file in this process. Of a reader that yields between several calls the longest counts."""
    peak_mib(anew=True)
    marks_s = [sum(os.times()[:4])]
    end, raised = "read", ""
    try:
        calls = read(path)
        for _ in calls if isinstance(calls, Generator) else ():
            marks_s.append(sum(os.times()[:4]))
    except REFUSALS as error:
        end, raised = "rejected", str(error)
    except Exception:
        end, raised = "traceback", traceback.format_exc()
    peak = max(peak_mib(), resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss / 1024)
    marks_s.append(sum(os.times()[:4]))
    return Outcome(end, raised, max(end_s - begin_s for begin_s, end_s in pairwise(marks_s)), peak)


def _serve(files: Connection) -> None:
    """Reads what it is given."""
    resource.setrlimit(resource.RLIMIT_AS, (LIMIT_BYTES, LIMIT_BYTES))
    while True:
        name, path = files.recv()
        files.send(attempt(READERS[name], path))


class Reader:
    """A process that reads; another one takes its place when it dies or hangs."""

    def __init__(self) -> None:
        self._start()

    def _start(self) -> None:
        self._files, theirs = multiprocessing.get_context("spawn").Pipe()
        self._process = multiprocessing.get_context("spawn").Process(target=_serve, args=(theirs,), daemon=True)
        self._process.start()
        theirs.close()

    def read(self, name: str, path: Path) -> Outcome:
        """One file of a kind."""
        try:
            process = psutil.Process(self._process.pid)
            begun_s = sum(process.cpu_times()[:4])
            self._files.send((name, path))
            for _ in range(round(BUSY * HANGS_S)):
                if self._files.poll(1.0):
                    outcome: Outcome = self._files.recv()
                    return outcome
                if sum(process.cpu_times()[:4]) > begun_s + HANGS_S:
                    break
            end, raised = "rejected", f"not read within {HANGS_S:g} s"
        except (EOFError, OSError, psutil.Error):
            self._process.join()
            end, raised = "traceback", f"the process ended with {self._process.exitcode}"
        self.close()
        self._start()
        return Outcome(end, raised, HANGS_S if "within" in raised else 0.0, 0.0)

    def close(self) -> None:
        """Ends the process."""
        self._files.close()
        self._process.kill()
        self._process.join()


def damaged(kind: Kind, generator: random.Random) -> bytes:
    """One damaged file."""
    content = generator.choice(kind.examples)
    if generator.random() < 0.6:
        content = kind.change(content, generator)
    if generator.random() < 0.5 or kind.change is _bytes_of:
        content = mutate(content, generator.choice(kind.examples), generator, MAX_BYTES)
    return content


def fuzz(seconds: float, seed: int, write: Callable[[str], object]) -> int:
    """Fuzzes and prints the counts; returns the exit code."""
    generator = random.Random(seed)
    counts: dict[str, Counter[str]] = {}
    wrong = Path(tempfile.mkdtemp(prefix="paramove-fuzz-files-"))
    with tempfile.TemporaryDirectory() as temporary:
        folder = Path(temporary)
        known = kinds(folder)
        reader = Reader()
        begun_s = time.monotonic()
        while time.monotonic() - begun_s < seconds:
            for name, kind in known.items():
                path = folder / "files" / f"{name}{kind.ending}"
                beside_robots(path.parent)
                path.write_bytes(damaged(kind, generator))
                outcome = reader.read(name, path)
                found = counts.setdefault(name, Counter())
                found.update([outcome.end, *(["over 5 s"] if outcome.seconds > MOST_S else [])])
                found.update(["over 1 GB"] if outcome.mebibytes > MOST_MIB else [])
                if outcome.end == "traceback" or outcome.seconds > MOST_S or outcome.mebibytes > MOST_MIB:
                    kept = wrong / f"{name}_{sum(found.values())}{kind.ending}"
                    shutil.copy(path, kept)
                    write(f"{kept}: {outcome.seconds:.1f} s, {outcome.mebibytes:.0f} MB: {outcome.raised[-700:]}\n")
                shutil.rmtree(path.parent)
        reader.close()
    write(f"{'':8} {'runs':>6} " + " ".join(f"{one:>9}" for one in COUNTS) + "\n")
    total: Counter[str] = sum(counts.values(), Counter())
    for name, found in [*counts.items(), ("all", total)]:
        runs = found["rejected"] + found["read"] + found["traceback"]
        write(f"{name:8} {runs:6} " + " ".join(f"{found[one]:9}" for one in COUNTS) + "\n")
    if not any(total[one] for one in FAILURES):
        wrong.rmdir()
        return 0
    write(f"seed {seed}; the files are in {wrong}\n")
    return 1


def beside_robots(folder: Path) -> None:
    """A folder for a damaged file, with the models that descriptions of robots name."""
    folder.mkdir()
    for path in sorted((ROOT / "robot_description").glob("*/*.xml")):
        shutil.copy(path, folder / path.name)


if __name__ == "__main__":
    run(__doc__, fuzz)
