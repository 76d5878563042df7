import cv2
import numpy as np
import pytest
from foxglove_schemas_protobuf.CompressedImage_pb2 import CompressedImage
from foxglove_schemas_protobuf.RawImage_pb2 import RawImage
from hypothesis import given, settings
from hypothesis import strategies as st

from paramove.cameras.frames import Frame, FrameChecks, FrameError, decode, encode, image_of_raw


def _grey(level: int, width: int = 48, height: int = 32) -> np.ndarray:
    return np.full((height, width, 3), level, np.uint8)


def test_passes_a_good_frame_as_it_is() -> None:
    frame = Frame(_grey(90), 5, 0)
    assert FrameChecks(48, 32).passed(frame) is frame


@pytest.mark.parametrize(
    ("image", "words"),
    [
        (_grey(90, 32, 48), "has 32 x 48 px, 48 x 32 expected"),
        (_grey(0), "black"),
        (_grey(255), "saturated"),
        (np.zeros((32, 48), np.uint8), r"\[H, W, 3\] uint8 expected"),
        (np.zeros((32, 48, 3)), r"\[H, W, 3\] uint8 expected"),
    ],
)
def test_refuses_bad_frames(image: np.ndarray, words: str) -> None:
    with pytest.raises(FrameError, match=words):
        FrameChecks(48, 32).passed(Frame(image, 0, 0))


def test_a_frozen_camera_is_told_and_a_new_picture_heals() -> None:
    checks = FrameChecks(48, 32, frozen_after=3)
    for index in range(2):
        checks.passed(Frame(_grey(90), index, index))
    for index in range(2, 4):
        with pytest.raises(FrameError, match="frozen"):
            checks.passed(Frame(_grey(90), index, index))
    checks.passed(Frame(_grey(91), 4, 4))


def test_equal_frames_may_be_allowed() -> None:
    checks = FrameChecks(48, 32, frozen_after=0)
    for index in range(50):
        checks.passed(Frame(_grey(90), index, index))


@pytest.mark.parametrize("encoding", ["bgr8", "rgb8"])
@pytest.mark.parametrize("padding", [0, 5])
def test_raw_images_of_both_orders_and_with_padded_rows(encoding: str, padding: int) -> None:
    image = np.random.default_rng(0).integers(0, 255, (4, 6, 3), dtype=np.uint8)
    sent = image if encoding == "bgr8" else image[:, :, ::-1]
    data = b"".join(row.tobytes() + bytes(padding) for row in sent)
    raw = RawImage(encoding=encoding, width=6, height=4, step=18 + padding, data=data)
    np.testing.assert_array_equal(image_of_raw(raw), image)


@pytest.mark.parametrize(
    "raw",
    [
        RawImage(encoding="mono16", width=2, height=2, step=4, data=bytes(8)),
        RawImage(encoding="bgr8", width=2, height=2, step=6, data=bytes(11)),
        RawImage(encoding="bgr8", width=2, height=2, step=5, data=bytes(10)),
        RawImage(encoding="bgr8"),
    ],
)
def test_refuses_raw_images_that_contradict_themselves(raw: RawImage) -> None:
    with pytest.raises(FrameError, match="expected"):
        image_of_raw(raw)


def test_compression_keeps_the_picture_and_its_time() -> None:
    draw = np.random.default_rng(0)
    image = np.clip(draw.normal(90, 4, (360, 480, 3)), 0, 255).astype(np.uint8)
    message = encode(Frame(image, 1_500_000_000, 3), jpeg_quality=95)
    assert (message.timestamp.seconds, message.timestamp.nanos) == (1, 500_000_000)
    assert np.abs(decode(message).astype(int) - image).mean() < 4


@settings(deadline=None, max_examples=80, derandomize=True)
@given(st.binary(max_size=200), st.integers(0, 400))
def test_corrupt_data_is_refused_or_decoded_but_never_worse(junk: bytes, cut: int) -> None:
    good = encode(Frame(_grey(90), 0, 0)).data
    for data in (junk, good[:cut], good[:cut] + junk):
        try:
            image = decode(CompressedImage(format="jpeg", data=data))
        except FrameError:
            continue
        assert image.dtype == np.uint8
        assert image.ndim == 3


def test_a_cut_picture_is_refused_and_not_filled_with_grey() -> None:
    draw = np.random.default_rng(0)
    data = encode(Frame(draw.integers(0, 255, (120, 160, 3), dtype=np.uint8), 0, 0)).data
    for cut in range(3, len(data) - 2, 97):
        with pytest.raises(FrameError, match=r"is cut off|cannot be decoded") as fault:
            decode(CompressedImage(format="jpeg", data=data[:cut]))
        assert fault.value.kind == "corrupt"


@pytest.mark.parametrize("form", ["jpeg", "png"])
def test_a_size_that_no_camera_has_is_refused_before_memory_is_taken(form: str) -> None:
    if form == "jpeg":
        data = bytearray(encode(Frame(_grey(90), 0, 0)).data)
        place = data.index(b"\xff\xc0") + 5
        data[place : place + 4] = b"\xff\xff\xff\xff"
    else:
        data = bytearray(cv2.imencode(".png", _grey(90))[1].tobytes())
        data[16:24] = (60_000).to_bytes(4, "big") * 2
    with pytest.raises(FrameError, match=r"claims 6\d{4} x 6\d{4} px"):
        decode(CompressedImage(format=form, data=bytes(data)))


def test_png_is_read_too() -> None:
    data = cv2.imencode(".png", _grey(90))[1].tobytes()
    np.testing.assert_array_equal(decode(CompressedImage(format="png", data=data)), _grey(90))


def test_a_dark_frame_names_the_remedy() -> None:
    with pytest.raises(FrameError, match=r"too dark for colours .* switch on the light") as fault:
        FrameChecks(48, 32).passed(Frame(_grey(12), 0, 0))
    assert fault.value.kind == "dark"
