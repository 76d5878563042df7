"""What goes wrong at the table in rule learning: the robot reports it, does nothing unsafe, and finishes its task."""

import json

import pytest

pytestmark = pytest.mark.long
SAID = {
    "hand_in_the_way": "I wait, as I see a hand",
    "out_of_reach": "I cannot reach",
    "slippery": "Please put it to another place",
    "two_of_one_colour": "I see more than one",
    "too_wide": "mm wide as it stands; this gripper holds",
    "too_tall": "mm high; the arm moves objects of 50 mm",
    "fallen": "has fallen over. Please stand it up",
    "covered_opening": "Please uncover the opening",
    "moved_camera": "Was the camera moved, or my base? I calibrate again",
    "moved_base": "Was the camera moved, or my base? I calibrate again",
}


@pytest.mark.parametrize(
    ("robot", "seed", "mishaps"),
    [
        ("koch_v1_1", 7, ("out_of_reach", "two_of_one_colour", "too_wide")),
        ("open_manipulator_x", 7, ("covered_opening", "too_tall", "hand_in_the_way")),
        ("open_manipulator_x", 9, ("fallen", "fallen")),
        ("koch_v1_1", 6, ("slippery", "moved_camera")),
        ("koch_v1_1", 8, ("slippery", "moved_base")),
    ],
)
def test_what_goes_wrong_is_said_and_ends_well(launcher, robot, seed, mishaps):
    given = [f"simulator.mishaps={json.dumps(mishaps)}", "simulator.max_duration_s=900"]
    options = [word for setting in given for word in ("--set", setting)]
    code, shown = launcher.run(
        "rule_learning", "--robot", robot, "--seed", str(seed), "--headless", *options, timeout_s=900
    )
    assert code == 0, shown
    for mishap in mishaps:
        assert SAID[mishap] in shown, (mishap, shown)
    truth = launcher.truth()
    assert truth["placed"] == 3, truth
    assert truth["unwanted_contacts"] == 0, truth
