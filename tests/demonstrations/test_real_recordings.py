"""Recordings of real people go through the importer, the set and the body frame."""

import os
from pathlib import Path

import numpy as np
import pytest

from paramove.demonstrations.demonstration_set import DemonstrationSet
from paramove.demonstrations.importing import ImportOptions, import_file
from paramove.demonstrations.writing import write_set

DATA = Path(os.environ.get("PARAMOVE_DATA") or Path(__file__).parents[3] / "shared" / "data")
pytestmark = [
    pytest.mark.skipif(not DATA.is_dir(), reason=f"needs the recordings of people in {DATA} (PARAMOVE_DATA)"),
]
POINTING = {
    "index": ("indexFinger",),
    "wrist": ("hand",),
    "elbow": ("forearm",),
    "shoulder": ("rightShoulder",),
    "other_shoulder": ("leftShoulder",),
}


@pytest.fixture(scope="module")
def pointing(tmp_path_factory):
    """The set, with the movements in which the tracker repeated a position for long, instead of losing the point."""
    folder = tmp_path_factory.mktemp("pointing") / "set"
    found = import_file(DATA / "pointing27" / "data.npz", ImportOptions(points=POINTING), max_gap=0.1)
    assert 5 < len(found.rejected) < 25
    assert any("rightShoulder repeats its position exactly" in remark for remark in found.remarks)
    found = import_file(DATA / "pointing27" / "data.npz", ImportOptions(points=POINTING, repeats_are_lost=False))
    write_set(folder, found.takes, found.parameter_names)
    return DemonstrationSet.load(folder)


@pytest.fixture(scope="module")
def reaching(tmp_path_factory):
    folder = tmp_path_factory.mktemp("reaching") / "set"
    found = import_file(DATA / "table_reach" / "data.npz", ImportOptions())
    takes = [take for take in found.takes if take.labels[0].action == "reach_across"]
    write_set(folder, takes, found.parameter_names)
    return DemonstrationSet.load(folder)


def test_pointing_is_read_whole(pointing):
    with np.load(DATA / "pointing27" / "data.npz", allow_pickle=False) as file:
        count, first = int(file["ok"].sum()), int(np.flatnonzero(file["ok"])[0])
        begin = int(file["offsets"][first] + file["segment"][first, 0])
        index = file["flat"][begin, :3].astype(np.float64)
    assert len(pointing) == count == 390
    np.testing.assert_allclose(pointing[0].point("index")[0], [index[2], -index[0], index[1]], rtol=0.0, atol=0.0)


def test_arms_point_towards_their_targets_in_the_body_frame(pointing):
    """The way from shoulder to fingertip at the farthest reach leads towards the target, whoever points."""
    for one in pointing.in_body_frame()[::13]:
        path = one.point("index") - one.point("shoulder")
        farthest = path[np.linalg.norm(path, axis=1).argmax()]
        cosine = farthest @ one.theta / np.linalg.norm(farthest) / np.linalg.norm(one.theta)
        assert cosine > np.cos(np.radians(35.0)), one.source


def test_people_who_sit_turned_and_left_arms_come_together(reaching):
    """Everybody reaches forward and to the left with a right arm, also who sits turned by half a circle."""
    body = reaching.in_body_frame().with_right_arms()
    ways = np.array([one.point("index")[-1] - one.point("index")[0] for one in body])
    ends = np.array([one.point("index")[-1] for one in body])
    assert len(body.subjects) == 10
    assert (ways[:, 1] > 0.1).all()
    assert (ends[:, 0] > 0.2).all()
    raw = np.array([one.point("index")[-1] - one.point("index")[0] for one in reaching])
    assert (raw[:, 1] < -0.1).any()


def test_one_rule_cuts_every_action(reaching):
    cut = reaching.cut_by_speed()
    shares = [len(now.time) / len(was.time) for was, now in zip(reaching, cut, strict=True)]
    assert min(shares) > 0.5
    assert len(cut.split("subject", 0.2, 1)[1].subjects) == 2
