"""Frames of a video come at the times of the file, whatever its nominal rate is."""

from pathlib import Path

import numpy as np
import pytest

from paramove.cameras.calibration_images import VideoImages
from paramove.cameras.frame_sources import FileFrames
from paramove.cameras.frames import EndOfFrames, Frame, FrameError, SourceError
from paramove.cameras.video_file import VideoFile
from tests.cameras.videos import KINDS, presentation_times, write_video

TICK_NS = 1_000_000_000 // 15
TO_A_FRAME_S = 0.002
"""Stamps of some containers are in ms, as those of the first frame, from which times are counted."""
SLOWER = np.concatenate([np.arange(0.0, 2.0, 1 / 30), np.arange(2.0, 4.0, 1 / 10)])
"""A phone halves its rate when it gets dark."""
STILL = np.concatenate([np.arange(0.0, 1.0, 1 / 30), np.arange(3.0, 4.0, 1 / 30)])
"""A screen recorder leaves out what does not change."""
LATE = np.arange(5.0, 7.0, 1 / 30)
"""A clip out of a longer recording keeps its times."""


def play(source: FileFrames, seconds: float = 10.0) -> tuple[list[Frame], list[FrameError]]:
    """Frames of a source that is asked at every tick, and faults, of which the last one is the end."""
    frames: list[Frame] = []
    faults: list[FrameError] = []
    for tick in range(round(15 * seconds)):
        try:
            frame = source.frame(tick * TICK_NS)
        except FrameError as fault:
            faults.append(fault)
            if isinstance(fault, EndOfFrames):
                break
            continue
        if frame is not None:
            frames.append(frame)
    source.close()
    return frames, faults


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("times_s", [SLOWER, STILL, LATE], ids=["slower", "still", "late"])
def test_frames_of_a_video_have_the_times_of_the_file(tmp_path: Path, kind: str, times_s: np.ndarray) -> None:
    path = write_video(tmp_path / kind, times_s, kind)
    frames, faults = play(FileFrames(path))
    assert [type(fault) for fault in faults] == [EndOfFrames]
    assert "cut off" not in str(faults[0])
    expected = times_s - times_s[0]
    witness = presentation_times(path)
    assert len(witness) == len(times_s)
    for frame in frames:
        assert frame.captured_ns * 1e-9 == pytest.approx(expected[frame.index], abs=TO_A_FRAME_S + 0.25 / 15)
        assert witness[frame.index] == pytest.approx(expected[frame.index], abs=TO_A_FRAME_S)
    assert frames[-1].index == len(times_s) - 1
    largest_gap_s = np.diff([frame.captured_ns for frame in frames]).max() * 1e-9
    assert largest_gap_s <= np.diff(times_s).max() + 1 / 15


def test_the_latest_frame_that_is_due_is_given(tmp_path: Path) -> None:
    path = write_video(tmp_path / "clip.mkv", np.arange(0.0, 1.0, 1 / 30))
    source = FileFrames(path)
    assert [source.frame(at_ms * 1_000_000).index for at_ms in (700, 800, 1000)] == [0, 3, 9]
    source.close()


@pytest.mark.parametrize(
    ("stamp", "wrong"),
    [
        (lambda time_s: 2.0 if 1.0 <= time_s < 2.0 else time_s, 30),
        (lambda time_s: 3.0 - time_s if 1.0 <= time_s < 1.5 else time_s, 30),
        (lambda time_s: time_s + 36000.0 if time_s >= 1.0 else time_s, 60),
    ],
    ids=["standing still", "going back", "ten hours later"],
)
def test_wrong_times_are_reported_and_the_video_ends(tmp_path: Path, stamp, wrong: int) -> None:
    path = write_video(tmp_path / "clip.mkv", np.arange(0.0, 3.0, 1 / 30), stamp=stamp)
    frames, faults = play(FileFrames(path))
    assert type(faults.pop()) is EndOfFrames
    assert {fault.kind for fault in faults} == {"time"}
    assert len(faults) == pytest.approx(wrong, abs=2)
    assert np.all(np.diff([frame.captured_ns for frame in frames]) > 0)
    with pytest.raises(SourceError, match="before"):
        VideoImages(path).held()


def test_frames_that_an_avi_gives_no_time_for_follow_the_others(tmp_path: Path) -> None:
    """XviD's B frames: the decoder gives the last ones at the end, and OpenCV no stamp for them."""
    import av

    path = tmp_path / "clip.avi"
    with av.open(str(path), "w") as container:
        stream = container.add_stream("mpeg4", rate=30, options={"bf": "2"})
        stream.width, stream.height, stream.pix_fmt = 64, 48, "yuv420p"
        for number in range(30):
            grey = np.full((48, 64, 3), 20 + 5 * number, np.uint8)
            container.mux(stream.encode(av.VideoFrame.from_ndarray(grey, format="bgr24")))
        container.mux(stream.encode())
    video = VideoFile(path)
    times_s = [frame.time_s for frame in iter(video.read, None)]
    np.testing.assert_allclose(times_s, np.arange(30) / 30, rtol=0, atol=1e-6)


def test_a_video_that_is_cut_off_says_how_much_is_missing(tmp_path: Path) -> None:
    whole = write_video(tmp_path / "whole.mkv", np.arange(0.0, 6.0, 1 / 30))
    path = tmp_path / "cut.mkv"
    path.write_bytes(whole.read_bytes()[: whole.stat().st_size // 2])
    _, faults = play(FileFrames(path))
    assert "cut off" in str(faults[-1])


def test_a_name_with_a_colon_is_a_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    write_video(tmp_path / "take:1.mkv", [0.0, 0.1])
    assert FileFrames(Path("take:1.mkv")).frame(0) is not None


@pytest.mark.parametrize("kind", ["browser.webm", "phone.mp4"])
def test_a_calibration_looks_at_a_video_by_its_own_time(tmp_path: Path, kind: str) -> None:
    looked_at = VideoImages(write_video(tmp_path / kind, SLOWER, kind)).held().looked_at
    assert looked_at == pytest.approx(4.0 * 5.0, abs=1)
