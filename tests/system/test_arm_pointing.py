"""The rule-learning demonstration with an arm that is tracked in action space: its first seconds, in all processes.

The whole of it is what `paramove evaluate rule_learning --with sim --with action_space` runs.
"""

import numpy as np
import pytest

from paramove.bus import topics
from paramove.recording.parts import PartedRecording
from sim.arm import TIP
from sim.instructor import SEATED_S
from sim.scenes import at_the_tool_box
from sim.simulator import Config
from tests.system.conftest import ROOT

SEED = 4


@pytest.mark.slow
def test_a_seated_arm_is_tracked_in_lockstep_and_told_in_the_robots_frame(launcher):
    _, shown = launcher.run(
        "rule_learning", "--with", "sim", "--with", "action_space", "--seed", str(SEED), "--headless",
        "--set", f"simulator.max_duration_s={SEATED_S + 1}", timeout_s=300,
    )  # fmt: skip
    folder = launcher.latest.resolve()
    recorded = list(PartedRecording(folder / "recording.mcap").read())
    assert not any(one.topic.startswith("truth/") for one in recorded)
    estimates = [one.message for one in recorded if one.topic == topics.ACTION_ESTIMATE.name]
    times_s = np.array([one.captured.ToNanoseconds() for one in estimates]) * 1e-9
    assert np.allclose(np.diff(times_s), 2 / 15, rtol=0, atol=0.002), shown  # every second tick, and none is left out
    robot = ROOT / "robot_description" / "hoap3"
    simulation = at_the_tool_box(Config(scene="rule_learning_whole_arm", seed=SEED, robot=robot, camera=False))
    assert simulation.person.arm is not None
    simulation.run_to_tick(15)
    tip = simulation.person.arm.posture[TIP]
    seated = [one for one, time_s in zip(estimates, times_s, strict=True) if 2.0 < time_s < SEATED_S]
    assert len(seated) > 10
    assert all(one.frame == "right_shoulder" and one.views == 2 and not one.lost for one in seated)
    hands = np.array([(one.hand.x, one.hand.y, one.hand.z) for one in seated])
    assert np.median(np.linalg.norm(hands - tip, axis=1)) < 0.02
