"""Rendered clips: the arm is where the truth says, in all views; the same number gives the same images."""

import mujoco
import numpy as np
import pytest

from sim import performances, performances_scene
from sim.performances import Lens, Studio, contact_sheet, missing
from sim.performances_scene import Room, as_calibrated, draw_cameras, rendered_px
from sim.persons.clips import TABLE, read_clips
from sim.persons.performances import kind_named, perform, stream


@pytest.fixture(scope="module")
def studio():
    made = Studio(perform(kind_named("pointing"), 1))
    yield made
    made.close()


def arm_pixels(studio, time_s, view):
    """Where the image changes when the arm is taken away."""
    with_arm = studio.film(time_s, view).astype(int)
    for name in ("upper_arm", "forearm", "hand"):
        studio._data.mocap_pos[studio._model.body(name).mocapid[0]] = (0.0, 0.0, -9.0)
    mujoco.mj_kinematics(studio._model, studio._data)
    studio._eye._scene.flags[mujoco.mjtRndFlag.mjRND_SHADOW] = 0
    without = studio._lenses[view].image(studio._eye.look(studio._data, studio.cameras[view].name)).astype(int)
    studio._place(time_s)
    lit = studio._lenses[view].image(studio._eye.look(studio._data, studio.cameras[view].name)).astype(int)
    studio._eye._scene.flags[mujoco.mjtRndFlag.mjRND_SHADOW] = 1
    assert np.abs(with_arm - lit).mean() < 40
    return np.abs(lit - without).max(axis=2) > 10


@pytest.mark.parametrize("view", range(4))
def test_truth_projects_onto_the_arm(studio, view):
    act = studio.performance.acts[0]
    time_s = float(act.arrives_s[0]) + 0.1
    mask, frame = arm_pixels(studio, time_s, view), studio.at(time_s)
    shoulder, elbow, tip = frame.pose.reshape(3, 3)
    inner = tip + 0.006 * (frame.wrist - tip) / np.linalg.norm(frame.wrist - tip)
    for point in (0.5 * (shoulder + elbow), elbow, frame.wrist, inner):
        column, row = studio.cameras[view].project(point).round().astype(int)
        assert mask[row - 1 : row + 2, column - 1 : column + 2].any()
    column, row = studio.cameras[view].project(tip + 0.05 * (tip - frame.wrist) / 0.185).round().astype(int)
    assert not mask[row - 1 : row + 2, column - 1 : column + 2].any()
    assert 700 < mask.sum() < 12000


def test_a_tracker_sees_the_person_as_measured_and_the_cameras_as_calibrated(studio, tmp_path):
    clip, truth, person = studio.clip(tmp_path), studio.truth(), studio.performance.person
    for name in ("upper_arm", "forearm", "hand"):
        seen, true = getattr(clip.sizes, name), getattr(truth.sizes, name)
        assert seen != true
        assert (seen, true) == (getattr(person.measured, name), getattr(person.sizes, name))
    np.testing.assert_array_equal(clip.shoulder, person.measured_shoulder)
    np.testing.assert_array_equal(truth.shoulder, person.shoulder)
    assert (clip.shoulder != truth.shoulder).all()
    assert (clip.cameras, truth.cameras) == (studio.calibrated, studio.cameras)
    assert all(
        (a.camera_from_world != b.camera_from_world).any() for a, b in zip(clip.cameras, truth.cameras, strict=True)
    )


def test_the_same_number_gives_the_same_images(studio):
    again = Studio(perform(kind_named("pointing"), 1))
    try:
        np.testing.assert_array_equal(studio.film(1.0, 2), again.film(1.0, 2))
    finally:
        again.close()


def test_what_is_seen_does_not_depend_on_what_was_seen_before(studio):
    first = studio.film(0.0, 0).copy()
    studio.film(2.0, 3)
    np.testing.assert_array_equal(first, studio.film(0.0, 0))


def test_looks_differ_from_clip_to_clip():
    kind = kind_named("pointing")
    rooms = [Room.draw(stream(kind, number, 1)) for number in range(24)]
    assert {room.person.pattern for room in rooms} == {"plain", "stripes", "checks", "speckles"}
    assert np.std([room.brightness for room in rooms]) > 0.15
    assert min(room.noise for room in rooms) < 3.0 < 5.0 < max(room.noise for room in rooms)


def test_calibration_errs_a_little():
    """Points around the table are seen within about a pixel of where the calibration says, and not exactly there."""
    rng = np.random.default_rng(3)
    points = np.array([[0.1, -0.2, 0.1], [-0.27, -0.18, 0.35], [0.2, 0.2, 0.0], [-0.2, -0.3, -0.2]])
    errors = []
    for _ in range(20):
        for camera in draw_cameras(rng):
            errors.append(as_calibrated(camera, rng).project(points) - camera.project(points))
            assert np.linalg.norm(as_calibrated(camera, rng).position - camera.position) < 0.002
    size = np.linalg.norm(np.concatenate(errors), axis=1)
    assert 0.1 < np.median(size) < 0.6
    assert size.max() < 1.5


def test_lens_shows_a_point_where_the_camera_projects_it():
    """A white dot in the picture of a pinhole camera lands where the distorted projection is."""
    camera = draw_cameras(np.random.default_rng(11))[1]
    width, height = rendered_px()
    ray = np.array([0.28, -0.17])
    middle = (np.array([width, height]) - 1) / 2
    scale = width / (camera.width_px + 32)
    spot = middle + scale * camera.matrix[0, 0] * ray
    row, column = np.mgrid[:height, :width]
    picture = np.zeros((height, width, 3), dtype=np.uint8)
    picture[(column - spot[0]) ** 2 + (row - spot[1]) ** 2 < 9.0] = 255
    image = Lens(camera).image(picture)[..., 0].astype(np.float64)
    found = np.array([(image * axis).sum() for axis in np.mgrid[:240, :320][::-1]]) / image.sum()
    in_world = np.linalg.inv(camera.camera_from_world) @ np.array([*ray, 1.0, 1.0])
    np.testing.assert_allclose(found, camera.project(in_world[:3]), rtol=0.0, atol=0.35)


def test_clips_are_rendered_once(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(Studio, "times_s", property(lambda self: np.arange(3) / 50.0))
    kinds = [kind_named("pointing_50fps")]
    assert len(missing(tmp_path, kinds)) == kinds[0].clips
    arguments = ["--kind", "pointing_50fps", "--clips", "1", "--out", str(tmp_path)]
    sheet = tmp_path / "sheet.png"
    assert performances.main([*arguments, "--contact-sheet", str(sheet)]) == 0
    (clip,) = read_clips(tmp_path)
    assert clip.views == (0,)
    assert sheet.exists()
    assert contact_sheet([clip], columns=2).shape == (240, 640, 3)
    assert clip.truth.poses.shape == (3, 9)
    assert (tmp_path / "manifest.yaml").exists()
    assert "1 clips of pointing_50fps" in capsys.readouterr().out
    written = (clip.folder / "seen.npz").stat().st_mtime_ns
    assert performances.main(arguments) == 0
    assert (clip.folder / "seen.npz").stat().st_mtime_ns == written


def test_an_interrupted_rendering_goes_on(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(Studio, "times_s", property(lambda self: np.arange(2) / 50.0))
    done = []

    def render(kind, number, *where):
        if number == 1 and not done:
            done.append(number)
            raise KeyboardInterrupt
        return whole(kind, number, *where)

    whole = performances.render
    monkeypatch.setattr(performances, "render", render)
    arguments = ["--kind", "pointing_50fps", "--clips", "2", "--out", str(tmp_path)]
    assert performances.main(arguments) == 130
    assert str(tmp_path) in capsys.readouterr().out
    assert [clip.number for clip in read_clips(tmp_path)] == [0]
    assert performances.main(arguments) == 0
    assert [clip.number for clip in read_clips(tmp_path)] == [0, 1]


def test_without_recordings_their_clips_are_left_out(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(Studio, "times_s", property(lambda self: np.arange(2) / 50.0))
    arguments = ["--clips", "1", "--out", str(tmp_path), "--data", str(tmp_path / "nowhere")]
    assert performances.main([*arguments, "--kind", "pointing", "--kind", "recorded"]) == 0
    assert "clips of kind recorded are left out" in capsys.readouterr().out
    assert [clip.kind for clip in read_clips(tmp_path)] == ["pointing"]


def test_unknown_kind_is_refused(capsys):
    with pytest.raises(SystemExit):
        performances.main(["--kind", "waving"])
    assert "pointing_far" in capsys.readouterr().err


def test_the_table_is_where_the_tracker_is_told():
    near_right, _, far_left, _ = TABLE
    assert near_right == (performances_scene.NEAR_EDGE, performances_scene.RIGHT_EDGE)
    assert far_left == (performances_scene.FAR_EDGE, performances_scene.LEFT_EDGE)
