"""Files that claim, nest or compress to far more than they are: one message each, soon, and in little memory."""

from __future__ import annotations

import io
import json
import struct
import zipfile
import zlib
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest
from zstandard import ZstdCompressor

from benchmarks.fuzz_files import Reader, models
from paramove.bus.topics import HUMAN_ARM_POSE
from paramove.demonstrations.pose_recording import PoseRecording, read_poses, write_poses
from paramove.recording.recovery import recover

MOST_S = 5.0
MOST_MIB = 700.0
"""Numpy, OpenCV and compiled kernels take 300 of them before any file is read."""


@pytest.fixture(scope="module")
def reader() -> Iterator[Reader]:
    process = Reader()
    yield process
    process.close()


def npy(shape: str, data: bytes, kind: str = "<f8") -> bytes:
    header = f"{{'descr': '{kind}', 'fortran_order': False, 'shape': {shape}, }}".ljust(117) + "\n"
    return b"\x93NUMPY\x01\x00" + struct.pack("<H", len(header)) + header.encode() + data


def npz(member: bytes, method: int = zipfile.ZIP_DEFLATED) -> bytes:
    content = io.BytesIO()
    with zipfile.ZipFile(content, "w", method) as archive:
        archive.writestr("positions.npy", member)
    return content.getvalue()


def zeros_deflated() -> bytes:
    """400 MB in 400 kB."""
    return npz(npy("(50000000,)", bytes(400_000_000)))


def damaged_deflate() -> bytes:
    content = bytearray(npz(npy("(1000,)", np.random.default_rng(0).bytes(8000))))
    content[60:160] = bytes(100)
    return bytes(content)


def encrypted() -> bytes:
    content = bytearray(npz(npy("(3,)", bytes(24))))
    content[6] |= 1
    content[content.index(b"PK\x01\x02") + 8] |= 1
    return bytes(content)


def record(kind: int, content: bytes) -> bytes:
    return bytes([kind]) + struct.pack("<Q", len(content)) + content


def text(word: str) -> bytes:
    return struct.pack("<I", len(word)) + word.encode()


def recording(*messages: bytes, compressed: bytes | None = None, claimed: int | None = None) -> bytes:
    """With one chunk of arm poses; or of what was compressed by zstd."""
    channel = record(4, struct.pack("<HH", 1, 0) + text(HUMAN_ARM_POSE.name) + text("protobuf") + text(""))
    inside = channel + b"".join(record(5, struct.pack("<HIQQ", 1, 7, 1, 1) + message) for message in messages)
    data = ZstdCompressor().compress(inside) if compressed is None else compressed
    size, head = len(inside) if claimed is None else claimed, text("") + text("")
    chunk = struct.pack("<QQQI", 1, 1, size, 0) + text("zstd") + struct.pack("<Q", len(data)) + data
    return b"\x89MCAP0\r\n" + record(1, head) + record(6, chunk)


def zeros_by_zstd(claimed: int | None = None) -> bytes:
    """2 GB in 200 kB, of which `claimed` are told."""
    compressor = ZstdCompressor(level=3).compressobj()
    data = b"".join(compressor.compress(bytes(2**24)) for _ in range(128)) + compressor.flush()
    return recording(compressed=data, claimed=2**31 if claimed is None else claimed)


def picture(width: int, height: int) -> bytes:
    """A black PNG with rows as far as 4 MB go."""
    head = struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0)
    rows = zlib.compress(bytes(min((3 * width + 1) * height, 3 * 10**8)), 1)
    chunks = ((b"IHDR", head), (b"IDAT", rows), (b"IEND", b""))
    parts = [
        struct.pack(">I", len(data)) + name + data + struct.pack(">I", zlib.crc32(name + data)) for name, data in chunks
    ]
    return b"\x89PNG\r\n\x1a\n" + b"".join(parts)


def doubling(levels: int) -> bytes:
    """A list of two aliases of a list of two aliases of ..."""
    lines = ["a0: &a0 [x, x]"] + [f"a{n}: &a{n} [*a{n - 1}, *a{n - 1}]" for n in range(1, levels)]
    return "\n".join(lines).encode()


def deep_bvh(levels: int) -> bytes:
    joints = "".join(f"JOINT j{n}\n{{\nOFFSET 0 0 1\nCHANNELS 3 Zrotation Xrotation Yrotation\n" for n in range(levels))
    root = "HIERARCHY\nROOT r\n{\nOFFSET 0 0 0\nCHANNELS 3 Xposition Yposition Zposition\n"
    return (root + joints + "}\n" * (levels + 1) + "MOTION\nFrames: 1\nFrame Time: 0.01\n").encode()


def wide_bvh() -> bytes:
    """A joint with one channel, 100 000 frames, and 900 joints without: 900 times as many places as numbers."""
    joints = "".join(f"JOINT j{n}\n{{\nOFFSET 0 0 1\n}}\n" for n in range(900))
    root = f"HIERARCHY\nROOT r\n{{\nOFFSET 0 0 0\nCHANNELS 1 Xposition\n{joints}}}\n"
    return (root + "MOTION\nFrames: 100000\nFrame Time: 0.01\n" + "0\n" * 100_000).encode()


CSV_HEAD = b"time,a_x,a_y,a_z\n"
ALIASED = ("robot", "arm", "cameras", "person", "grammar", "mapping", "node", "labels", "launch")
HOSTILE: dict[str, tuple[str, Callable[[], bytes], str]] = {
    "zeros deflated": ("NPZ", zeros_deflated, "found 1 of 381 MB in a file of 0.4 MB"),
    "damaged deflate": ("NPZ", damaged_deflate, "cut off or damaged"),
    "encrypted": ("NPZ", encrypted, "encrypted or compressed in an unusual way"),
    "bzip2": ("NPZ", lambda: npz(npy("(3,)", bytes(24)), zipfile.ZIP_BZIP2), "in an unusual way"),
    "lzma": ("NPZ", lambda: npz(npy("(3,)", bytes(24)), zipfile.ZIP_LZMA), "in an unusual way"),
    "half a character": ("NPZ", lambda: npz(npy("(1,)", b"\x80\xdc\0\0", "<U1")), "halves of characters"),
    "no character": ("NPZ", lambda: npz(npy("(1,)", b"\xff\xff\xff\x7f", "<U1")), "halves of characters"),
    "no length": ("NPZ", lambda: npz(npy("(1000000000000,)", b"", "<U0")), "values of no length"),
    "directory": ("NPZ", lambda: b"PK\x05\x06" + struct.pack("<HHHHIIH", 0, 0, 1, 1, 3 * 10**9, 0, 0), "damaged"),
    "zeros by zstd": ("MCAP", zeros_by_zstd, "holds no pose"),
    "zeros by zstd, hidden": ("MCAP", lambda: zeros_by_zstd(1000), "holds no pose"),
    "no message": ("MCAP", lambda: recording(b"\xff\xff\xff"), "message 7 on human/arm_pose is not a paramove."),
    "large picture": ("png", lambda: picture(30_000, 30_000), "claims 30000 x 30000 px"),
    "huge picture": ("png", lambda: picture(60_000, 60_000), "claims 60000 x 60000 px"),
    "unknown picture": ("png", lambda: b"P6\n60000 60000\n255\n" + bytes(99), "is no PNG"),
    "play list": ("mp4", lambda: b"#EXTM3U\n/etc/hostname\n", "is no video"),
    "deep BVH": ("BVH", lambda: deep_bvh(5000), "joints below each other"),
    "wide BVH": ("BVH", wide_bvh, "901 joints have only 1 channels"),
    "long cell": ("CSV", lambda: CSV_HEAD + b"0,1,2," + b"9" * 200_000 + b"\n", "take.csv:2: field larger than"),
    "open quote": ("CSV", lambda: CSV_HEAD + b'0,1,2,"3\n' + b"1,1,2,3\n" * 100, "take.csv:2: unexpected end of data"),
    "open quote in a long file": ("CSV", lambda: CSV_HEAD + b'0,1,2,"3\n' + b"1,1,2,3\n" * 50_000, "take.csv:2: field"),
    **{f"aliases in {name}": (name, lambda: doubling(30), "alias") for name in ALIASED},
    **{f"levels in {name}": (name, lambda: b"a: " + b"[" * 50_000, "levels of nesting") for name in ALIASED},
}  # fmt: skip
ENDINGS = {"NPZ": "npz", "MCAP": "mcap", "BVH": "bvh", "CSV": "csv", "png": "png", "mp4": "mp4"}


@pytest.mark.parametrize("case", HOSTILE)
def test_it_is_one_message_soon_and_in_little_memory(reader: Reader, tmp_path: Path, case: str) -> None:
    name, make, told = HOSTILE[case]
    path = tmp_path / f"take.{ENDINGS.get(name, 'yaml')}"
    path.write_bytes(make())
    found = reader.read(name, path)
    assert found.end == "rejected", found.raised
    assert told in found.raised
    assert str(path) in found.raised
    assert found.seconds < MOST_S
    assert found.mebibytes < MOST_MIB


@pytest.mark.parametrize("degree", [6000, 10**9, 3])
def test_a_model_whose_header_claims_another_degree(reader: Reader, tmp_path: Path, degree: int) -> None:
    models(tmp_path)
    path = tmp_path / "linear.npz"
    with np.load(path) as file:
        arrays = dict(file)
    header = json.loads(str(arrays["header"]))
    header["parameters"]["degree"] = degree
    np.savez(path, **arrays | {"header": np.array(json.dumps(header))})
    found = reader.read("model", path)
    assert found.end == "rejected", found.raised
    assert f"degree {degree}" in found.raised or "expected coefficients of shape" in found.raised
    assert found.seconds < MOST_S
    assert found.mebibytes < MOST_MIB


def test_a_recording_of_somebody_at_rest_is_read_whole(tmp_path: Path) -> None:
    """Nothing compresses more; of an honest file nothing is refused."""
    path, frames = tmp_path / "rest.mcap", 20_000
    time_ns = np.arange(frames, dtype=np.int64) * 10_000_000
    write_poses(path, PoseRecording(time_ns, np.zeros((frames, 3, 3)), ("a", "b", "c"), "table"), "test")
    assert len(read_poses(path).time_ns) == frames
    assert recover(path).kept == frames
