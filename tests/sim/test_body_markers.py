"""Balls that a person wears are seen where the joints are, and nothing else in the room has their colours."""

import numpy as np
import pytest

from paramove.observation.body_tracking import BodyTrackingSetup
from sim.body_markers import muted
from sim.pointing_world import PointingWorld

MARKERS = {
    "elbow": {"hue_deg": (95.0, 155.0), "saturation": 0.5},
    "wrist": {"hue_deg": (200.0, 250.0), "saturation": 0.5},
    "index": {"hue_deg": (285.0, 335.0), "saturation": 0.5},
}


@pytest.mark.parametrize("seed", [2, 11])
def test_a_body_tracker_finds_the_joints_of_a_person_who_points(seed, tmp_path):
    world = PointingWorld(seed, 1, (1, 2), tuple(MARKERS))
    try:
        world.write_measures(tmp_path)
        tracking = BodyTrackingSetup.model_validate({"markers": MARKERS, "rate_hz": 2.5}).body_tracking(tmp_path)
        missed = {name: [] for name in MARKERS}
        for time_s in np.arange(0.0, world.duration_s, 0.4):
            truth = {point.name: (point.x, point.y, point.z) for point in world.truth(float(time_s)).points}
            for number, image_raw in enumerate(world.images_raw(float(time_s)), start=1):
                rgb = np.frombuffer(image_raw.data, np.uint8).reshape(image_raw.height, image_raw.width, 3)
                image = np.ascontiguousarray(rgb[:, :, ::-1])
                for moment in tracking.see(f"camera_{number}", round(time_s * 1e9), image):
                    for name, point in moment.points.items():
                        true = truth.get("hand" if name == "index" else name)
                        if true is not None:
                            missed[name].append(np.linalg.norm(point.position - true))
    finally:
        world.close()
    assert len(missed["elbow"]) > 8
    assert len(missed["index"]) > 3
    assert np.median(missed["index"]) < 0.012
    assert np.median(missed["elbow"]) < 0.035  # its ball is seen from outside


def test_muted_colours_keep_their_brightness_and_lose_their_hue():
    vivid = muted([[200, 20, 20], [90, 90, 90]])
    np.testing.assert_allclose(vivid, [[200, 160, 160], [90, 90, 90]], rtol=0, atol=1e-9)
