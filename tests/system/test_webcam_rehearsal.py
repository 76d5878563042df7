"""What a person types by the tutorial on a webcam, from files instead of a camera: from nothing to the ball.

The board and the pointing arm are drawn as the camera would see them; the key points of the person who is measured
are simulated at the measured noise, since no pose network finds a person in a drawing.
"""

from __future__ import annotations

import os
import pty
import select
import subprocess
import sys
import time

import cv2
import numpy as np
import pytest

from paramove.action_space import read_person
from paramove.cameras import CalibratedCamera, read_cameras
from paramove.demonstrations import RESTING_SHOULDER, table_place
from paramove.observation import ArmObserver, ArmSizes, key_points_message
from paramove.recording import RecordingWriter, read
from studies.teaching.simulated_person import RATE_HZ, key_points, movement
from tests.action_space.performances import performed
from tests.cameras.board_scene import Sheet, held, looking

pytestmark = pytest.mark.slow

MINUTES = 5.0
PLACE = (0.45, 0.4)
HEIGHT = "1.73m"
POSE = looking((0.75, -0.85, 0.85), (0.0, -0.15, 0.1))
MATRIX = np.array([[600.0, 0.0, 319.5], [0.0, 600.0, 239.5], [0.0, 0.0, 1.0]])
CAMERA = CalibratedCamera("webcam", 640, 480, MATRIX, np.zeros(5), POSE)


def write_video(path, images):
    writer = cv2.VideoWriter(str(path), cv2.VideoWriter.fourcc(*"MJPG"), RATE_HZ, (640, 480))
    for image in images:
        writer.write(image)
    writer.release()


def board_video(path):
    """The board held at many angles, half a second each, and then on the table."""
    sheet = Sheet("a3")
    views = [sheet.seen_by(CAMERA, held(CAMERA, number, distance=(0.5, 0.9)), seed=number) for number in range(18)]
    still = [view for view in views for _ in range(8)]
    write_video(path, [*still, *(sheet.seen_by(CAMERA, seed=90 + number) for number in range(20))])


def moving_arm(path):
    """Key points of a person whose arm hangs and then moves."""
    rng = np.random.default_rng(2)
    poses = np.concatenate([movement(target, rng) for target in ([0.2, 0.2, 0.0], [0.2, -0.5, 0.1])])
    with RecordingWriter(path, "a rehearsal") as writer:
        for number, points in enumerate(key_points(poses, CAMERA, rng), start=1):
            at_ns = round(number * 1e9 / RATE_HZ)
            writer.write("camera_1/key_points", key_points_message(points, at_ns), at_ns, at_ns, number)


def pointing_video(path):
    """An arm that points twice at one position, in a room with some edges."""
    _, poses = performed([PLACE, PLACE], np.random.default_rng(11), RATE_HZ)
    observer, noise = ArmObserver(ArmSizes(), [CAMERA], threads=1), np.random.default_rng(3)
    room = np.full((480, 640, 3), 60, np.uint8)
    for x in range(20, 640, 90):
        cv2.rectangle(room, (x, 20), (x + 40, 60), (40 + x // 5, 110, 150 - x // 5), -1)
    images = []
    for pose in poses:
        image = room.copy()
        cv2.fillPoly(image, [observer.outline(pose, 0).round().astype(np.int32)], (170, 190, 215))
        images.append(cv2.add(image, noise.integers(0, 6, image.shape, dtype=np.uint8)))
    write_video(path, images)


OVERLAY = f"""
needs:
  cameras:
    made_by: "paramove calibrate cameras file:rehearsal/board.avi --square 45mm --out {{action_tracker.cameras}}"
  person:
    made_by: "paramove webcam person --source recording:rehearsal/person.mcap --height {HEIGHT} --out person.yaml"
nodes:
  pose_detector: {{parameters: {{networks: rehearsal}}}}
"""


class Typist:
    """A person at a terminal, who presses Enter whenever asked to."""

    def __init__(self, command, folder, environment):
        self._terminal, end = pty.openpty()
        self.process = subprocess.Popen(
            command, cwd=folder, env=environment, stdin=end, stdout=end, stderr=end, start_new_session=True
        )
        os.close(end)
        self.shown = ""

    def until_the_end(self, timeout_s):
        ends_s, pressed = time.monotonic() + timeout_s, 0
        while time.monotonic() < ends_s:
            if not select.select([self._terminal], [], [], 1.0)[0]:
                continue
            try:
                self.shown += os.read(self._terminal, 65536).decode(errors="replace")
            except OSError:  # the last process has closed its end
                return self.process.wait(10.0)
            if self.shown.count("press Enter") > pressed:
                pressed += 1
                os.write(self._terminal, b"\n")
        self.process.terminate()
        raise TimeoutError(self.shown)


def test_from_nothing_to_the_ball_in_five_minutes(launcher, tmp_path):
    folder = tmp_path / "rehearsal"
    folder.mkdir()
    board_video(folder / "board.avi")
    moving_arm(folder / "person.mcap")
    pointing_video(folder / "pointing.avi")
    (tmp_path / "mine.yaml").write_text(OVERLAY)

    words = ("launch", "pointing", "--with", "real", "--with", "rehearsal", "--with", "mine.yaml", "--headless")
    began_s = time.monotonic()
    person_at_terminal = Typist([sys.executable, "-m", "paramove.cli.main", *words], tmp_path, launcher.environment)
    code = person_at_terminal.until_the_end(60.0 * MINUTES)
    took_s, said = time.monotonic() - began_s, person_at_terminal.shown
    assert code == 0, said

    steps = ("board.pdf is missing", "cameras.yaml is missing", "(good)", "person.yaml is missing", "hang still",
             "move your right arm", "person.yaml: written", "run folder")  # fmt: skip
    assert [said.index(step) for step in steps] == sorted(said.index(step) for step in steps)
    assert (tmp_path / "board.pdf").read_bytes().startswith(b"%PDF")
    assert np.linalg.norm(read_cameras(tmp_path / "cameras.yaml")[0].position - CAMERA.position) < 0.02
    person = read_person(tmp_path / "person.yaml")
    assert np.linalg.norm(np.array(person.shoulder) - RESTING_SHOULDER) < 0.2

    recording = tmp_path / "runs" / "latest" / "recording.mcap"
    estimates = [one.message for one in read(recording, ("action/estimate",))]
    certain = min(estimates, key=lambda one: max(one.pointed.x_deviation, one.pointed.y_deviation)).pointed
    off = np.hypot(*(np.array([certain.x, certain.y]) - table_place(PLACE)[:2]))
    assert off < 0.1, "one camera, without a ruler"
    scenes = [one.message for one in read(recording, ("action/scene",))]
    red = [one.entities[0].spheres[0].color.r for one in scenes]
    assert red[0] > 0.9, "nothing is known yet"
    assert min(red) < 0.6, "the ball never became certain"
    assert took_s < 60.0 * MINUTES


def test_without_a_terminal_the_first_step_is_named(launcher, tmp_path):
    command = [sys.executable, "-m", "paramove.cli.main", "launch", "pointing", "--with", "real"]
    done = subprocess.run(
        command, cwd=tmp_path, stdin=subprocess.DEVNULL, capture_output=True, text=True, env=launcher.environment
    )
    assert done.returncode == 66
    assert "paramove calibrate board --out board.pdf" in done.stderr
    assert not list(tmp_path.glob("*.pdf"))
