"""The pointing application: a person points, the tracker finds where, judged by what is true."""

import json

import pytest

pytestmark = pytest.mark.slow


def test_targets_that_a_person_points_at_are_found_and_tracked_again_without_truth(launcher):
    """Then with one of the two cameras, from the recording of the run, with the measures that lie beside it."""
    code, shown = launcher.run("pointing", "--seed", "3", "--set", "simulator.targets=2", timeout_s=400)
    assert code == 0, shown
    assert "SUCCESS: 2 of 2 pointings were answered" in shown
    summary = json.loads((launcher.latest / "run.json").read_text())
    assert summary["target_error_cm"]["worst"] < 10.0
    assert all(value < 5.0 for value in summary["hand_rms_cm"])
    assert (launcher.latest / "pointing.mp4").stat().st_size > 10_000
    assert "<video" in (launcher.latest / "report.html").read_text()

    folder = launcher.latest.resolve()
    cameras = folder / "cameras.yaml"
    text = cameras.read_text()
    one = launcher.folder / "one_camera.yaml"
    one.write_text(text[: text.index("name: camera_2")].rpartition("-")[0])
    code, shown = launcher.run(
        "pointing", "--with", "replay", "--set", f"camera_1.source=recording:{folder}/recording.mcap#camera_1/image",
        "--set", "camera_1.width=320", "--set", "camera_1.height=240", "--set", f"action_tracker.cameras={one}",
        "--set", f"action_tracker.person={folder}/person.yaml", timeout_s=200,
    )  # fmt: skip
    assert code == 0, shown
    again = launcher.latest.resolve()
    assert again != folder
    assert (again / "recording.mcap").stat().st_size > 100_000


@pytest.mark.long
def test_a_stereo_body_tracker_and_a_window_of_its_poses_find_the_target_too(launcher):
    """Paper 5.4: markers instead of silhouettes, the last part of pointing instead of a filter."""
    arguments = ("--with", "sim", "--with", "stereo", "--seed", "9", "--set", "simulator.targets=1")
    code, shown = launcher.run("pointing", *arguments, timeout_s=300)
    assert code == 0, shown
    assert "SUCCESS: 1 of 1 pointings were answered" in shown
    summary = json.loads((launcher.latest / "run.json").read_text())
    assert summary["target_error_cm"]["worst"] < 5.0
    assert summary["spurious"] == 0
    assert (launcher.latest / "pointing.mp4").stat().st_size > 10_000
    assert "How sure" not in (launcher.latest / "report.html").read_text()
