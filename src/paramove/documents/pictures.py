"""Pictures and videos, whose size in pixels is checked before memory is allocated."""

from __future__ import annotations

import struct
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from paramove.documents.files import MEBIBYTE, read_bytes, size_of, unreadable
from paramove.documents.input_error import InputError

MAX_PIXELS = 50_000_000
"""Limit for one picture: a header of a few bytes may claim more than memory holds."""
AS_CAPTURED = cv2.IMREAD_COLOR | cv2.IMREAD_IGNORE_ORIENTATION
"""Pixels as the sensor gives them, for which a lens is calibrated, whichever way up the camera was held."""
PICTURE_BYTES = 256 * MEBIBYTE
VIDEO_BYTES = 2**40
JPEG = b"\xff\xd8"
_PNG = b"\x89PNG\r\n\x1a\n"
_NO_FRAME_HEADER = frozenset((0xC4, 0xC8, 0xCC))
_TIFF = {b"II*\0": "<", b"MM\0*": ">"}
_TIFF_WIDTH, _TIFF_HEIGHT, _TIFF_ORIENTATION = 256, 257, 274
_UPRIGHT = 1
_VIDEOS = (b"....ftyp", b"RIFF....AVI ", b"\x1aE\xdf\xa3", b"....moov", b"....mdat", b"....free", b"....wide")


def decoded(data: bytes) -> NDArray[np.uint8]:
    """BGR pixels [H, W, 3] of a PNG, JPEG, BMP, WebP or TIFF file, as they are stored: not turned by an EXIF tag.

    Raises InputError with what is wrong with the data, without their source.
    """
    width, height = claimed_size(data)
    if not width * height:
        raise InputError("is no PNG, JPEG, BMP, WebP or TIFF: a whole JPEG or PNG expected")
    if width * height > MAX_PIXELS:
        raise InputError(f"claims {width} x {height} px, {MAX_PIXELS} px together allowed")
    if data[:4] in _TIFF and (orientation := _tiff_tags(data)[_TIFF_ORIENTATION]) > _UPRIGHT:
        raise InputError(f"is a TIFF of orientation {orientation}, by which OpenCV always turns it: a PNG expected")
    try:
        image: Any = cv2.imdecode(np.frombuffer(data, np.uint8), AS_CAPTURED)
    except cv2.error as error:
        raise InputError(f"cannot be decoded ({error.err}): a whole JPEG or PNG expected") from error
    if image is None:
        raise InputError("cannot be decoded: a whole JPEG or PNG expected")
    return np.asarray(image, dtype=np.uint8)


def read_picture(path: Path) -> NDArray[np.uint8]:
    """BGR pixels [H, W, 3] of a file. Raises InputError for a missing or damaged file, and for huge pictures."""
    data = read_bytes(path, "picture", max_bytes=PICTURE_BYTES)
    try:
        return decoded(data)
    except InputError as error:
        raise InputError(f"{path} ({len(data)} bytes) cannot be read: it {error}; remove the file") from error


def claimed_size(data: bytes) -> tuple[int, int]:
    """Width and height, px, in the header of a picture; 0, 0 of anything else."""
    try:
        if data[:8] == _PNG:
            width, height = struct.unpack_from(">II", data, 16)
        elif data[:2] == JPEG:
            width, height = _of_jpeg(data)
        elif data[:2] == b"BM":
            old = struct.unpack_from("<I", data, 14)[0] == 12
            width, height = struct.unpack_from("<HH" if old else "<ii", data, 18)
        elif data[:4] == b"RIFF" and data[8:12] == b"WEBP":
            width, height = _of_webp(data)
        elif data[:4] in _TIFF:
            tags = _tiff_tags(data)
            width, height = tags[_TIFF_WIDTH], tags[_TIFF_HEIGHT]
        else:
            return 0, 0
    except (struct.error, IndexError):  # the header is cut off
        return 0, 0
    return abs(width), abs(height)


def _of_jpeg(data: bytes) -> tuple[int, int]:
    offset = 2
    while data[offset] == 0xFF:
        marker = data[offset + 1]
        if 0xC0 <= marker <= 0xCF and marker not in _NO_FRAME_HEADER:
            height, width = struct.unpack_from(">HH", data, offset + 5)
            return width, height
        offset += 2 + int.from_bytes(data[offset + 2 : offset + 4], "big")
    return 0, 0


def _of_webp(data: bytes) -> tuple[int, int]:
    if data[12:16] == b"VP8X":
        return 1 + int.from_bytes(data[24:27], "little"), 1 + int.from_bytes(data[27:30], "little")
    if data[12:16] == b"VP8L":
        bits = struct.unpack_from("<I", data, 21)[0]
        return 1 + (bits & 0x3FFF), 1 + (bits >> 14 & 0x3FFF)
    width, height = struct.unpack_from("<HH", data, 26)
    return width & 0x3FFF, height & 0x3FFF


def _tiff_tags(data: bytes) -> dict[int, int]:
    """Width, height and orientation by their tags; 0 of those that the first image of a TIFF does not have."""
    order = _TIFF[data[:4]]
    values = dict.fromkeys((_TIFF_WIDTH, _TIFF_HEIGHT, _TIFF_ORIENTATION), 0)
    begin = struct.unpack_from(order + "I", data, 4)[0]
    for number in range(struct.unpack_from(order + "H", data, begin)[0]):
        tag, kind, _ = struct.unpack_from(order + "HHI", data, begin + 2 + 12 * number)
        if tag in values:
            values[tag] = struct.unpack_from(order + ("H" if kind == 3 else "I"), data, begin + 10 + 12 * number)[0]
    return values


def opened_video(path: Path, raising: type[InputError] = InputError) -> Any:
    """A cv2.VideoCapture, by FFmpeg, of an mp4, mov, avi, mkv or webm file with a sound size.

    Its nominal frame rate may be anything: a browser's recording has none.

    Raises `raising` for everything else, also for playlists, which refer to other files.
    """
    size = size_of(path, "video file (mp4, avi, ...)", raising, VIDEO_BYTES)
    try:
        with path.open("rb") as file:
            begin = file.read(12)
    except OSError as error:
        raise raising(unreadable(path, error)) from error
    known = any(all(part in (ord("."), byte) for part, byte in zip(one, begin, strict=False)) for one in _VIDEOS)
    name = str(path.absolute()) if known and len(begin) == 12 else ""  # a relative "take:1.mp4" would be a protocol
    capture: Any = cv2.VideoCapture(name, cv2.CAP_FFMPEG)
    pixels = capture.get(cv2.CAP_PROP_FRAME_WIDTH) * capture.get(cv2.CAP_PROP_FRAME_HEIGHT)
    if not capture.isOpened() or not 1 <= pixels <= MAX_PIXELS:
        capture.release()
        raise raising(
            f"{path} ({size} bytes) is no video that OpenCV can read, or is cut off: an mp4 or avi with frames of at "
            f"most {MAX_PIXELS} px expected"
        )
    return capture
