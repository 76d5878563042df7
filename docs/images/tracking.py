"""The pictures of the page on tracking: what the filter sees and estimates at four times of one clip.

python -m sim.performances --kind pointing --clips 1
python docs/images/tracking.py --out docs/images/tracking.jpg
"""

import argparse
from pathlib import Path

import cv2
import numpy as np

from paramove.action_space import ActionTracker, Grammar, PersonPlacement, Vocabulary, table_action, track_frame
from paramove.observation import ArmObserver
from sim.persons.clips import clips_folder, read_clip

TIMES_S = (0.6, 1.2, 1.5, 2.2)
DRAWN_HYPOTHESES = 40
SCALE = 1.05


def draw(out: Path, view: int) -> None:
    """Writes the picture: a column for each time; hypotheses before and after weighing, and what has changed."""
    clip = read_clip(clips_folder() / "pointing_00")
    observer = ArmObserver(clip.sizes, [clip.cameras[view]])
    placement = PersonPlacement.of_arm(clip.shoulder, clip.sizes.length)
    tracker = ActionTracker(Vocabulary([table_action("pointing")]), Grammar.loop("pointing"), placement)
    columns, times_left = [], list(TIMES_S)
    for time_s, images in zip(clip.times_s, clip.frames((view,)), strict=True):
        observer.look([images[view]])
        estimate = track_frame(tracker, observer, float(time_s))
        if times_left and time_s >= times_left[0]:
            times_left.pop(0)
            columns.append(column(images[view], observer, tracker, estimate))
    cv2.imwrite(str(out), np.hstack(columns)[:, :, ::-1], [cv2.IMWRITE_JPEG_QUALITY, 82])


def column(image, observer, tracker, estimate):
    """One time: the hypotheses, those with weight, the estimated arm with the ball; what has changed."""
    particles, rng = tracker.filter.particles, np.random.default_rng(0)
    poses = tracker.placement.in_world(particles.poses)
    before = outlined(
        image, observer, poses[rng.choice(len(poses), DRAWN_HYPOTHESES, replace=False)], (255, 210, 60), 1
    )
    after = outlined(
        image, observer, poses[rng.choice(len(poses), DRAWN_HYPOTHESES, p=particles.weights)], (90, 230, 255), 1
    )
    estimated = outlined(image, observer, estimate.pose[None], (60, 255, 100), 2)
    target = SCALE * (observer.cameras[0].project(estimate.targets[estimate.action]) + 0.5)
    sure = max(0.0, 1.0 - estimate.theta[estimate.action].deviation / 0.2)
    colour = (round(255 * min(1.0, 2 - 2 * sure)), round(255 * min(1.0, 2 * sure)), 30)
    cv2.circle(estimated, tuple(target.round().astype(int).tolist()), 7, colour, -1, cv2.LINE_AA)
    change = observer.change(0)
    changed = np.full((*change.shape, 3), 90, np.uint8)
    changed[change > 0] = (255, 255, 255)
    changed[change < 0] = (20, 20, 30)
    changed = cv2.resize(changed, before.shape[1::-1], interpolation=cv2.INTER_NEAREST)
    return np.vstack([before, after, estimated, changed])


def outlined(image, observer, poses, colour, width):
    """The image, enlarged, with the outlines of poses."""
    size = (round(SCALE * image.shape[1]), round(SCALE * image.shape[0]))
    picture = cv2.resize(image, size, interpolation=cv2.INTER_CUBIC)
    for pose in poses:
        points = SCALE * (observer.outline(pose, 0) + 0.5)
        cv2.polylines(picture, [points.round().astype(np.int32)], True, colour, width, cv2.LINE_AA)
    return picture


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--view", type=int, default=0, help="number of the camera, from 0")
    arguments = parser.parse_args()
    draw(arguments.out, arguments.view)
