"""Which tracks there are, under which name their results are kept, and that a clip is tracked from its images alone."""

import json
from dataclasses import replace

import numpy as np
import pytest

from paramove.action_space.person import PersonPlacement
from paramove.cameras.calibrated import CalibratedCamera, write_cameras
from paramove.demonstrations.synthetic import RESTING_SHOULDER
from paramove.documents.input_error import InputError
from paramove.observation.arm_body import ArmSizes
from paramove.observation.arm_observer import ArmObserver
from sim.persons.actions import EYE, FAR_ORIGIN, far_place
from sim.persons.clips import TRUE_CAMERAS, Clip, Truth, read_clip, write_clip
from sim.persons.performances import KINDS, Act, kind_named
from studies.chapter6 import experiments
from studies.chapter6.experiments import ClipsMissingError, Piece, Selection, pieces, tracked_cases
from studies.chapter6.measures import Track
from studies.chapter6.report import write_results
from studies.chapter6.vocabularies import ACTIONS, knowledge_of, on_far_plane
from tests.studies.chapter6.synthetic_tracks import act, true_hand

FRAMES = 12


def camera(name, place, towards):
    forward = np.subtract(towards, place) / np.linalg.norm(np.subtract(towards, place))
    right = np.cross(forward, (0.0, 0.0, 1.0))
    turn = np.stack([right / np.linalg.norm(right), np.cross(forward, right / np.linalg.norm(right)), forward])
    camera_from_world = np.eye(4)
    camera_from_world[:3, :3], camera_from_world[:3, 3] = turn, -turn @ np.asarray(place)
    matrix = np.array([[340.0, 0.0, 159.5], [0.0, 340.0, 119.5], [0.0, 0.0, 1.0]])
    return CalibratedCamera(name, 320, 240, matrix, np.zeros(0), camera_from_world)


CAMERAS = tuple(
    camera(f"camera_{number + 1}", place, (-0.1, -0.2, 0.2))
    for number, place in enumerate([(0.3, -1.8, 0.9), (1.2, -0.5, 1.6), (1.2, 0.5, 1.6), (-0.5, -1.7, 1.3)])
)


def filmed(root, poses):
    """A clip of kind "pointing" whose images show the silhouette of the arm, light before a dark wall."""
    sizes, times = ArmSizes(), np.arange(len(poses)) / 8.0
    observer = ArmObserver(sizes, CAMERAS, threads=1)
    images = {view: [silhouette(observer.outline(pose, view)) for pose in poses] for view in range(4)}
    clip = Clip(root / "pointing_00", "pointing_00", "pointing", 0, times, (0, 1, 2, 3), CAMERAS, sizes,
                RESTING_SHOULDER, 1.0)  # fmt: skip
    target = np.array([[0.1, 0.1, 0.07]])
    one = Act("pointing", 0.1, 1.4, np.array([[0.4, 0.5]]), target, np.array([1.2]), np.array([1.3]))
    truth = Truth(poses, poses[:, 6:], np.array(["pointing"] * len(poses)), (one,), sizes, RESTING_SHOULDER, CAMERAS)
    write_clip(clip, truth, images)
    return clip


def silhouette(outline):
    import cv2

    image = np.full((240, 320, 3), 40, np.uint8)
    cv2.fillPoly(image, [np.round(outline).astype(np.int32)], (200, 150, 130))
    return image


@pytest.fixture(scope="module")
def root(tmp_path_factory):
    folder = tmp_path_factory.mktemp("clips")
    model = knowledge_of("pointing", 0).vocabulary.actions[0]
    poses = model.poses(np.tile([0.4, 0.5], (FRAMES, 1)), np.linspace(0.0, 0.45, FRAMES))
    filmed(folder, poses)
    return folder


def test_a_clip_is_tracked_from_its_images_and_kept_as_json(root):
    piece = Piece(root / "pointing_00", "pointing", 0, (0, 1, 2, 3))
    found = piece.run()
    track = Track(json.loads(json.dumps(found)))
    assert (track.clip, track.kind, track.split, track.views) == ("pointing_00", "pointing", "tuning", (0, 1, 2, 3))
    errors = np.linalg.norm(track.hand_errors, axis=1)
    assert np.median(errors) < 0.05
    assert track.effective.shape == track.times_s.shape == (FRAMES,)
    assert found["sight"] is None
    assert track.acts[0].from_true_poses is not None
    np.testing.assert_allclose([sum(row) for row in zip(*track.actions.values(), strict=True)], 1.0, rtol=0, atol=1e-3)
    again = piece.run()
    del found["values"]["seconds"], again["values"]["seconds"]
    assert again == found, "the same piece gives the same result"


def test_the_tracker_is_given_nothing_that_is_true(root):
    """Whatever the truth says of the body, where it sits, the cameras and the movement: the beliefs are the same."""
    piece = Piece(root / "pointing_00", "pointing", 0, (1,))
    expected = piece.run()
    folder = root / "moved"
    folder.mkdir()
    for file in (root / "pointing_00").iterdir():
        (folder / file.name).write_bytes(file.read_bytes())
    moved = {
        key: value * 1.1 + 0.05 if value.dtype.kind == "f" else value
        for key, value in np.load(folder / "truth.npz").items()
    }
    np.savez_compressed(folder / "truth.npz", **moved)
    write_cameras(folder / TRUE_CAMERAS, tuple(replace(one, matrix=one.matrix * (2, 1, 1)) for one in CAMERAS))
    found = Piece(folder, "pointing", 0, (1,)).run()
    assert read_clip(folder).truth.sizes.forearm > 1.2 * ArmSizes().forearm
    assert found["truth"] != expected["truth"]
    assert (expected["sight"]["focal_px"], found["sight"]["focal_px"]) == (340.0, 680.0)
    del found["values"]["seconds"], expected["values"]["seconds"]
    assert found["values"] == expected["values"]


def test_the_page_shows_images_of_the_clip_and_the_worst_depth(root, tmp_path):
    results = [Piece(root / "pointing_00", "pointing", 0, views).run() for views in ((0, 1, 2, 3), (1,))]
    write_results(results, tmp_path, {"pointing_00": read_clip(root / "pointing_00")})
    page = (tmp_path / "report.html").read_text(encoding="utf-8")
    assert page.count("src='data:image/jpeg;base64,") == 2
    assert "tracked by camera 2: of all tracks with one camera that are not lost" in page


def test_keys_follow_from_images_and_arguments(root, tmp_path):
    piece = Piece(root / "pointing_00", "pointing", 0, (1,))
    copy = tmp_path / "pointing_00"
    copy.mkdir()
    for file in (root / "pointing_00").iterdir():
        (copy / file.name).write_bytes(file.read_bytes())
    assert Piece(copy, "pointing", 0, (1,)).key() == piece.key()
    others = [
        Piece(root / "pointing_00", "pointing", 0, (2,)),
        Piece(root / "pointing_00", "pointing", 0, (1,), "simple"),
        Piece(root / "pointing_00", "pointing", 0, (1,), seed=1),
    ]
    experiments._clip_digest.cache_clear()
    (copy / "seen.npz").write_bytes((copy / "seen.npz").read_bytes() + b" ")
    keys = {one.key() for one in (piece, *others, Piece(copy, "pointing", 0, (1,)))}
    assert len(keys) == 5


def test_all_kinds_are_tracked_with_all_and_with_single_views():
    cases = {kind.name: list(tracked_cases(kind, 5)) for kind in KINDS}
    assert cases["pointing_50fps"] == [((1,), "matched"), ((1,), "simple")]
    matched = [(0, 1, 2, 3), (0,), (1,), (2,), (3,), (1, 3)]
    for name in ("pouring", "box", "complex", "recorded"):
        assert cases[name] == [(views, "matched") for views in matched]
    assert cases["pointing"][6:] == [(views, "simple") for views in matched[:-1]]


def test_a_third_is_held_out_and_the_rest_is_for_tuning():
    numbers = {split: {n for kind, n in Selection(split, ("pointing",)).clips()} for split in ("tuning", "held_out")}
    assert len(numbers["held_out"]) == kind_named("pointing").clips // 3
    assert numbers["tuning"] | numbers["held_out"] == set(range(kind_named("pointing").clips))
    with pytest.raises(InputError, match="every third is held out"):
        Selection("held_out", ("pointing",), first=2).clips()


def test_missing_clips_are_refused_with_the_command_that_renders_them(root):
    with pytest.raises(ClipsMissingError, match=r"23 of 24 clips are missing") as caught:
        pieces(Selection("all", ("pointing",)), root)
    assert caught.value.command == f"python -m sim.performances --kind pointing --out {root}"
    with pytest.raises(ClipsMissingError) as caught:
        pieces(Selection("all", ("pointing", "box"), first=2), root)
    assert caught.value.command == f"python -m sim.performances --kind pointing --kind box --clips 2 --out {root}"
    assert len(pieces(Selection("all", ("pointing",), first=1, quick=True), root)) == 2


def test_every_kind_of_clip_has_its_actions():
    assert set(ACTIONS) == {kind.name for kind in KINDS}
    grammar = knowledge_of("complex", 0).grammar
    steps = {step.name: [grammar.steps[one.step].name for one in step.followers] for step in grammar.steps}
    assert steps == {"point": ["redirect", "withdraw"], "redirect": ["withdraw"], "withdraw": ["point"]}
    assert set(knowledge_of("box", 0).vocabulary.names) == {"table_to_box", "box_to_table"}


def test_a_far_place_is_where_the_line_from_the_eye_meets_the_plane():
    placement = PersonPlacement((-0.2, -0.1, 0.4), 1.1)
    place = placement.in_world(far_place([0.3, 0.8]))
    found, eye = on_far_plane(place, placement), placement.in_world(EYE)
    assert found[0] == pytest.approx(FAR_ORIGIN[0])
    np.testing.assert_allclose(np.cross(found - eye, place - eye), 0.0, rtol=0.0, atol=1e-12)


def test_made_up_hands_are_at_their_targets():
    one = act()
    np.testing.assert_allclose(true_hand(np.array(one["arrives_s"]), [one]), one["targets"], rtol=0.0, atol=1e-12)
