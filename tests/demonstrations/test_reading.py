"""Sets that cannot be used: the segment, its line and the remedy are told; short losses of a point are filled."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from paramove.demonstrations.demonstration_set import DemonstrationSet
from paramove.demonstrations.labels import LabelsError
from paramove.demonstrations.pose_recording import PoseRecording, read_poses, write_poses
from paramove.msgs.arm_pose_pb2 import ArmPose
from paramove.recording.writer import RecordingWriter
from tests.demonstrations.movements import POINTS, movement, reach

LINE = "  - {{recording: {0}, start: {1}, end: {2}, action: reaching, subject: P1}}\n"
NS = 10**9


def record(folder, name="a.mcap", positions=None, points=POINTS, frame="body", time=None):
    whole_time, whole = reach((0.4, 0.1, -0.1))
    positions = whole if positions is None else positions
    time = whole_time if time is None else time
    write_poses(folder / name, PoseRecording(np.rint(time * NS).astype(np.int64), positions, points, frame), "a test")
    return positions


def labelled(folder, *segments, head=""):
    lines = "".join(LINE.format(*segment) for segment in segments)
    (folder / "labels.yaml").write_text(f"{head}segments:\n{lines}", encoding="utf-8")
    return folder


def rejected(folder):
    with pytest.raises(LabelsError) as wrong:
        DemonstrationSet.load(folder)
    assert wrong.value.exit_code == 78
    return str(wrong.value)


def test_start_and_end_are_the_first_and_last_frame(tmp_path):
    positions = record(tmp_path)
    (found,) = DemonstrationSet.load(labelled(tmp_path, ("a.mcap", 0.5, 0.9)))
    assert_allclose(found.positions, positions[25:46], rtol=0.0, atol=0.0)
    assert found.source == f"{tmp_path / 'labels.yaml'}:2: a.mcap, 0.5 to 0.9 s"


def test_every_fault_of_a_set_is_told_at_once_with_its_line(tmp_path):
    record(tmp_path)
    said = rejected(
        labelled(tmp_path, ("a.mcap", 0.5, 0.9), ("b.mcap", 0, 1), ("a.mcap", 1, 9), ("a.mcap", 0.501, 0.519))
    )
    path = tmp_path / "labels.yaml"
    assert said.splitlines() == [
        f"{path}:3:6: there is no recording b.mcap in {tmp_path}; did you mean 'a.mcap'?",
        f"{path}:4:5: a.mcap, 1 to 9 s ends after its recording, which covers 0 to 1.8 s: correct start and end, or, "
        "if a.mcap was cut off, see `paramove recover`",
        f"{path}:5:5: a.mcap, 0.501 to 0.519 s holds 0 frames of 91 (about 50 Hz); a movement has at least 2: "
        "make it longer",
    ]


def test_one_frame_is_no_movement(tmp_path):
    record(tmp_path)
    assert "holds 1 frame of 91" in rejected(labelled(tmp_path, ("a.mcap", 0.495, 0.505)))


def test_recordings_with_other_points_or_frames_are_told_with_the_remedy(tmp_path):
    positions = record(tmp_path)
    record(tmp_path, "b.mcap", positions[:, :4], POINTS[:4])
    both = labelled(tmp_path, ("a.mcap", 0, 1), ("b.mcap", 0, 1))
    said = rejected(both)
    assert "labels.yaml:3:6: b.mcap has the points sternum, shoulder, elbow, wrist; a.mcap has" in said
    assert "choose with `points` in labels.yaml what all have" in said
    labelled(tmp_path, ("a.mcap", 0, 1), ("b.mcap", 0, 1), head="points: [wrist, shoulder]\n")
    chosen = DemonstrationSet.load(tmp_path)
    assert chosen.point_names == ("wrist", "shoulder")
    assert_allclose(chosen[1].positions, positions[:51][:, [3, 1]], rtol=0.0, atol=0.0)


def test_points_in_another_order_are_the_same_points(tmp_path):
    positions = record(tmp_path)
    record(tmp_path, "b.mcap", positions[:, ::-1], POINTS[::-1])
    found = DemonstrationSet.load(labelled(tmp_path, ("a.mcap", 0, 1), ("b.mcap", 0, 1)))
    assert_allclose(found[0].positions, found[1].positions, rtol=0.0, atol=0.0)


def test_a_short_loss_is_filled_and_told(tmp_path):
    positions = record(tmp_path, "whole.mcap")
    holes = positions.copy()
    holes[40:44, 3] = np.nan
    record(tmp_path, "a.mcap", holes)
    found = DemonstrationSet.load(labelled(tmp_path, ("a.mcap", 0.5, 1.5)))
    assert_allclose(found[0].positions, positions[25:76], rtol=0.0, atol=2e-4)
    assert found.remarks == ("labels.yaml:2: a.mcap, 0.5 to 1.5 s: filled wrist in frames 40-43 (0.08 s)",)
    assert DemonstrationSet.load(labelled(tmp_path, ("a.mcap", 1.0, 1.5))).remarks == ()


def test_a_long_loss_is_refused_with_its_frames(tmp_path):
    positions = record(tmp_path, "whole.mcap")
    positions[40:48, 3] = np.nan
    positions[80:, 4] = np.nan
    record(tmp_path, "a.mcap", positions)
    said = rejected(labelled(tmp_path, ("a.mcap", 0.5, 1.5), ("a.mcap", 0, 1.8), ("a.mcap", 1.0, 1.5)))
    first, second = said.splitlines()
    assert "labels.yaml:2:5: a.mcap, 0.5 to 1.5 s: lost for longer than max_gap (0.1 s): wrist in frames 40-47" in first
    assert "wrist in frames 40-47 (0.16 s); index in frames 80-90 (it is not valid on both sides)" in second
    assert "Leave the point out with `points`, shorten the segment, or raise max_gap" in second
    assert len(DemonstrationSet.load(labelled(tmp_path, ("a.mcap", 0.5, 1.5), head="max_gap: 0.2\n"))) == 1


def test_numbers_that_are_not_finite_count_as_lost(tmp_path):
    with RecordingWriter(tmp_path / "a.mcap", "a test") as writer:
        for number in range(20):
            pose = ArmPose(frame="body")
            pose.captured.FromNanoseconds(number * 20_000_000)
            pose.points.add(name="index", x=float("nan") if number == 9 else number * 0.01, y=0.0, z=0.0)
            writer.write("human/arm_pose", pose, number * 20_000_000, 0, number)
    found = DemonstrationSet.load(labelled(tmp_path, ("a.mcap", 0, 0.38)))
    assert_allclose(found[0].positions[:, 0, 0], np.arange(20) * 0.01, rtol=0.0, atol=1e-12)
    assert "filled index in frame 9" in found.remarks[0]


@pytest.mark.parametrize(
    ("content", "detail"),
    [(b"no recording", "is no MCAP recording"), (b"\x89MCAP0\r\n", "holds no pose on human/arm_pose that can be read")],
)
def test_files_that_hold_no_poses(tmp_path, content, detail):
    (tmp_path / "a.mcap").write_bytes(content)
    assert detail in rejected(labelled(tmp_path, ("a.mcap", 0, 1)))


def test_times_that_go_back_are_told(tmp_path):
    time, _ = reach((0.4, 0.1, -0.1))
    time[30] = time[20]
    record(tmp_path, time=time)
    assert "pose 30 was captured at 0.400000 s, not after pose 29" in rejected(labelled(tmp_path, ("a.mcap", 0, 1)))


def test_a_recording_that_was_never_finished_is_read(tmp_path):
    positions = record(tmp_path)
    content = (tmp_path / "a.mcap").read_bytes()
    (tmp_path / "a.mcap").unlink()
    (tmp_path / "a.mcap.part").write_bytes(content[: len(content) * 2 // 3])
    found = read_poses(tmp_path / "a.mcap")
    assert 10 < len(found.time) < 91
    assert_allclose(found.positions, positions[: len(found.time)], rtol=0.0, atol=0.0)


def test_a_recording_of_the_live_recorder_can_be_labelled_and_read(tmp_path):
    """Other topics, and times that do not begin at 0, do not matter."""
    from paramove.msgs.rule_pb2 import Speech

    with RecordingWriter(tmp_path / "run.mcap", "paramove recorder") as writer:
        for number in range(100):
            at = 5 * NS + number * 20_000_000
            writer.write("speech", Speech(text="hello"), at, at, number)
            pose = ArmPose(frame="body")
            pose.captured.FromNanoseconds(at)
            pose.points.add(name="index", x=0.01 * number, y=0.0, z=1.0)
            writer.write("human/arm_pose", pose, at, at, number)
    (found,) = DemonstrationSet.load(labelled(tmp_path, ("run.mcap", 0.2, 0.4)))
    assert_allclose(found.positions[:, 0, 0], 0.01 * np.arange(10, 21), rtol=0.0, atol=0.0)
    assert found.time[0] == 0.0


def test_the_set_of_a_set_is_the_same_set(tmp_path):
    whole = DemonstrationSet((movement(), replace(movement(subject="P2"), recording="b.mcap")))
    whole.write(tmp_path / "one")
    DemonstrationSet.load(tmp_path / "one").write(tmp_path / "two")
    for file in (tmp_path / "one").iterdir():
        assert (tmp_path / "two" / file.name).read_bytes() == file.read_bytes()
