"""The gate of an arm at 100 Hz: what is checked at arming, how often it is asked, reports, following, clearance."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from benchmarks.safety_steps import MS
from paramove.safety.gate_io import ArmingRequest, Fault, SafetySettings, State
from paramove.safety.stopping import stop_ramp, straight_move
from tests.safety.small_arm import HOME, LIMITS, PATH, SmallArm

VOLTAGE, MODEL = Fault("voltage", "", "9.1 V, allowed 11 to 13 V"), Fault("model", "wrist", "XL430, allowed XM430")


def test_a_movement_at_100_hz_passes_unchanged() -> None:
    arm = SmallArm()
    arm.arm()
    arm.follow(PATH, len(PATH))
    assert arm.core.faults == ()
    np.testing.assert_array_equal(arm.stream[1 : len(PATH) + 1], PATH)
    np.testing.assert_array_equal(arm.core.held(len(PATH)), PATH[-1])


def test_all_failing_checks_are_told_together_and_nobody_is_armed() -> None:
    arm = SmallArm()
    away = np.array([0.0, 2.1, np.nan])
    robot = replace(arm.measured(), captured_ns=arm.now + 10 * MS, at_rest=False, commanded=np.array([0, -2.1, 0]))
    word = ArmingRequest(arm.now + 10 * MS, "", True, by_person=True)
    _, state, faults = arm.step(measured=robot, word=word, arming_faults=(VOLTAGE, MODEL))
    assert state is State.DISARMED
    assert faults == ("voltage", "model", "arming_source", "arming_moving", "arming_pose_outside")
    word = replace(word, captured_ns=word.captured_ns + 10 * MS, source="a person")
    _, state, faults = arm.step(measured=replace(arm.measured(), captured_ns=arm.now, positions=away), word=word)
    assert (state, faults) == (State.DISARMED, ("arming_pose_unknown",))
    assert arm.arm()[1:] == (State.ARMED, ())
    # A check that fails later forbids arming, it does not stop.
    assert arm.step(arming_faults=(VOLTAGE,))[1:] == (State.ARMED, ())


@pytest.mark.parametrize(("offset", "arms"), [(0.008, True), (0.0095, False), (-0.0095, True)])
def test_the_pose_may_lie_half_a_degree_outside_the_mechanical_range(offset: float, arms: bool) -> None:
    arm = SmallArm()
    arm.stream = np.array([[2.0 + offset, 0.0, 0.0]])
    _, state, faults = arm.arm()
    assert (state is State.ARMED) is arms
    if not arms:
        detail = arm.core.faults[0].detail
        assert detail == (
            "joint shoulder is measured at 115.14 deg, allowed -114.59 to 114.59 deg; move it inside by hand"
        )
        assert faults == ("arming_pose_outside", "arming_pose_outside")


@pytest.mark.parametrize("side", [1, -1])
def test_a_pose_exactly_at_the_tolerance_arms(side: int) -> None:
    for offset, state in ((0.5, State.ARMED), (0.50001, State.DISARMED)):
        arm = SmallArm(SafetySettings(pose_tolerance=0.5))
        arm.stream = np.array([[0.0, side * (2.0 + offset), 0.0]])
        assert arm.arm()[1] is state


@pytest.mark.parametrize(("age_ms", "faults"), [(1000, ()), (1001, ("arming_stale",))])
def test_a_word_to_arm_may_be_a_second_old(age_ms: int, faults: tuple[str, ...]) -> None:
    arm = SmallArm()
    for _ in range(4):
        arm.step(ms=300)
    assert arm.step(word=ArmingRequest(arm.now + (10 - age_ms) * MS, "a person", True, by_person=True))[2] == faults


@pytest.mark.parametrize(
    ("age_ms", "checks_ms", "told"),
    [
        (4000, 3000, ()),
        (3000, 3000, ()),
        (2, 3001, ()),  # said while earlier words were judged
        (4001, 3000, ("arming_stale",)),
        (3001, 3001, ("arming_slow",)),
        (4500, 3100, ("arming_stale", "arming_slow")),
        (-1001, 3100, ("arming_stale",)),
        (1001, -5000, ("arming_stale",)),  # checks cannot begin in the future
    ],
)
def test_what_the_checks_take_does_not_make_a_word_old(age_ms: int, checks_ms: int, told: tuple[str, ...]) -> None:
    arm = SmallArm()
    arm.step(ms=5000)
    now = arm.now + 10 * MS
    word = ArmingRequest(now - age_ms * MS, "a person", True, by_person=True)
    assert arm.step(word=word, checks_began_ns=now - checks_ms * MS)[2] == told
    assert (arm.core.state is State.ARMED) == (told == ())
    if "arming_slow" in told:
        assert (arm.core.faults[-1].code, arm.core.faults[-1].joint) == ("arming_slow", "")
        assert f"took {checks_ms} ms, allowed 3000 ms" in arm.core.faults[-1].detail
        assert arm.core.faults[-1].detail.endswith("busy, then arm again")
    assert arm.arm()[1] is State.ARMED


def test_an_arm_that_is_moved_by_hand_while_held_is_disarmed_at_once() -> None:
    arm = SmallArm()
    assert arm.step(stop=VOLTAGE)[1] is State.HOLD
    moved = replace(arm.measured(), captured_ns=arm.now + 10 * MS, at_rest=False)
    assert (
        arm.step(measured=moved, word=ArmingRequest(arm.now + 10 * MS, "a person", False, by_person=True))[1]
        is State.DISARMED
    )


def test_outside_its_soft_range_an_arm_comes_back_slowly() -> None:
    arm = SmallArm()
    arm.stream = np.array([[1.6, 0.0, 0.0]])
    arm.arm()
    slow = 1.6 - 0.3 * (lambda u: 10 * u**3 - 15 * u**4 + 6 * u**5)(np.linspace(0, 1, 150)[1:])
    path = np.zeros((149, 3))
    path[:, 0] = slow
    arm.follow(path, 149)
    assert (arm.core.state, arm.core.faults) == (State.ARMED, ())
    np.testing.assert_allclose(arm.stream[-1], [1.3, 0, 0], rtol=0, atol=1e-12)
    arm = SmallArm()
    arm.stream = np.array([[1.6, 0.0, 0.0]])
    arm.arm()
    path[:, 0] = 3.2 - slow
    assert arm.step(proposal=lambda: arm.proposal(path))[1:] == (State.HOLD, ("joint_limit",))


@pytest.mark.parametrize("rate", [None, 100.0])
def test_more_proposals_than_the_rate_allows_stop_the_arm(rate: float | None) -> None:
    arm = SmallArm(SafetySettings(proposals_per_s=rate))
    arm.arm()
    for _ in range(60):
        arm.step(proposal=arm.proposal)
    assert arm.core.state is State.ARMED, "the nominal rate passes"
    for k in range(40):
        arm.step(ms=0, proposal=replace(arm.proposal(), captured_ns=arm.now - k))
    assert arm.core.state is (State.ARMED if rate is None else State.STOPPING)
    assert [fault.code for fault in arm.core.faults] == ([] if rate is None else ["rate"])


def test_the_same_proposal_again_is_counted_once() -> None:
    arm = SmallArm(SafetySettings(proposals_per_s=4.0))
    arm.arm()
    proposal = arm.proposal()
    for _ in range(20):
        arm.step(ms=0, proposal=proposal)
    assert arm.core.state is State.ARMED


def test_arm_words_that_come_too_often_do_not_arm_but_those_that_disarm_are_heard() -> None:
    arm = SmallArm(SafetySettings(words_per_s=20.0))
    for k in range(6):
        assert arm.step(word=ArmingRequest(arm.now + 10 * MS, "a person", k % 2 == 0, by_person=True))[1] is (
            State.ARMED if k % 2 == 0 else State.DISARMED
        )
    assert arm.arm()[1:] == (State.DISARMED, ("arming_rate",))
    assert "6 within 250 ms" in arm.core.faults[0].detail
    arm.step(ms=300)
    assert arm.arm()[1] is State.ARMED
    for _ in range(10):
        state = arm.step(ms=1, word=ArmingRequest(arm.now + MS, "a person", False, by_person=True))[1]
    assert state is State.DISARMED


@pytest.mark.parametrize("captured_ns", [-(2**63), 0, 2**63 - 1])
def test_a_request_to_disarm_has_no_age_and_earlier_ones_to_arm_are_void(captured_ns: int) -> None:
    arm = SmallArm()
    arm.arm()
    assert arm.step(word=ArmingRequest(captured_ns, "a person", False))[1] is State.DISARMED
    assert arm.step(ms=1, word=ArmingRequest(arm.now, "a person", True, by_person=True))[1] is State.DISARMED
    assert arm.arm()[1] is State.ARMED


@pytest.mark.parametrize(
    "fields",
    [
        {"positions": np.zeros(2)},
        {"commanded": np.zeros((1, 3))},
        {"next_index": -1},
        {"next_index": 10_000},
        {"next_index": 3},
    ],
)
def test_a_report_that_cannot_be_true_stops_the_arm(fields: dict) -> None:
    arm = SmallArm()
    arm.in_motion()
    robot = replace(arm.measured(), captured_ns=arm.now + 10 * MS, **fields)
    _, state, faults = arm.step(measured=robot, proposal=arm.proposal)
    assert (state, faults) == (State.STOPPING, ("report",))
    assert "allowed" in arm.core.faults[0].detail


def test_a_report_from_before_the_stream_is_not_taken_for_a_place_in_it() -> None:
    arm = SmallArm()
    arm.arm(measured=replace(arm.measured(), captured_ns=arm.now, next_index=-5))
    _, state, faults = arm.step(measured=replace(arm.measured(), captured_ns=arm.now, next_index=-5))
    assert state is not State.ARMED
    assert faults == ("report",)


def test_time_that_goes_back_stops_the_arm() -> None:
    arm = SmallArm()
    arm.in_motion()
    _, state, faults = arm.step(ms=0)
    assert state is State.ARMED
    arm.now -= 7 * MS
    _, state, faults = arm.step(ms=0, proposal=arm.proposal)
    assert (state, faults) == (State.STOPPING, ("clock",))
    check_faults(arm, ("clock", "", "the time went back by 7 ms, allowed 0 ms", "arm again"))


@pytest.mark.parametrize("age_ms", [501, -501])
def test_a_report_of_another_time_is_silence(age_ms: int) -> None:
    arm = SmallArm()
    arm.arm()
    robot = replace(arm.measured(), captured_ns=arm.now + (10 - age_ms) * MS)
    assert arm.step(measured=robot)[1:] == (State.DISCONNECTED, ("robot_silent",))
    check_faults(arm, ("robot_silent", "", "501 ms, allowed 500 ms", "comes to rest"))


def test_no_report_for_half_a_second_is_silence_too() -> None:
    arm = SmallArm()
    arm.arm()
    assert arm.step(ms=500, measured=None)[1] is State.ARMED
    assert arm.step(ms=1, measured=None)[1] is State.DISCONNECTED
    assert arm.step(measured=None)[2] == ("robot_silent",)


def test_a_refused_movement_begins_the_stop_at_once_where_it_would_have_begun() -> None:
    arm = SmallArm()
    arm.in_motion()
    wanted = arm.proposal()
    jump = replace(wanted, captured_ns=arm.now + 10 * MS, rows=wanted.rows + 0.1)
    targets, state, faults = arm.step(proposal=jump)
    assert (state, faults) == (State.STOPPING, ("jump",))
    assert targets is not None
    assert (targets.first_index, targets.ramp_rows) == (jump.first_index, len(targets.rows))


def test_what_was_found_before_the_silence_stays_and_refusals_to_arm_do_not() -> None:
    arm = SmallArm()
    arm.in_motion()
    arm.step(stop=VOLTAGE)
    assert arm.step(ms=501, measured=None)[1:] == (State.DISCONNECTED, (VOLTAGE.code, "robot_silent"))
    assert arm.step()[1:] == (State.DISARMED, (VOLTAGE.code, "robot_silent"))
    arm.arm(arming_faults=(MODEL,))
    assert arm.core.faults == (MODEL,)
    assert arm.step(ms=501, measured=None)[1:] == (State.DISCONNECTED, ("robot_silent",))
    arm.step()
    arm.arm(arming_faults=(MODEL,))
    assert arm.step(stop=VOLTAGE)[1:] == (State.HOLD, (VOLTAGE.code,))


def test_a_joint_that_is_held_is_given_way_to_in_motion() -> None:
    arm = SmallArm(SafetySettings(following=np.full(3, 0.1)))
    arm.in_motion()
    arm.push = np.array([0.0, 0.15, 0.0])
    for _ in range(10):
        assert arm.step(proposal=arm.proposal)[1] is State.ARMED
    pose = arm.stream[arm.played + 1] + arm.push
    targets, state, faults = arm.step(proposal=arm.proposal)
    assert (state, faults) == (State.STOPPING, ("following",))
    assert arm.core.faults[0].joint == "elbow"
    assert targets is not None
    assert targets.first_index == arm.played + 2
    np.testing.assert_allclose(targets.rows[-1], pose, rtol=0, atol=1e-9)
    assert targets.ramp_rows == len(targets.rows)
    for _ in range(100):
        arm.step()
    assert arm.core.state is State.HOLD
    assert arm.arm()[2] == ("arming_following",)
    check_faults(arm, ("arming_following", "elbow", "not at their commanded position: elbow;"))
    arm.push = np.zeros(3)
    assert arm.arm()[1] is State.ARMED


def test_a_joint_that_is_pushed_at_rest_is_given_way_to() -> None:
    arm = SmallArm(SafetySettings(following=np.full(3, 0.1)))
    arm.arm()
    arm.push = np.array([0.2, 0.0, 0.0])
    given = [arm.step()[0] for _ in range(12)]
    assert [targets is not None for targets in given] == [False] * 10 + [True, False]
    np.testing.assert_allclose(arm.stream[-1], [0.2, 0, 0], rtol=0, atol=1e-12)


def test_without_limits_of_following_a_held_joint_stops_nothing() -> None:
    arm = SmallArm()
    arm.in_motion()
    arm.push = np.array([0.0, 0.9, 0.0])
    for _ in range(20):
        assert arm.step(proposal=arm.proposal)[1] is State.ARMED


class Wall:
    """A wall that the first joint reaches at an angle of `at` rad, a metre a radian."""

    def __init__(self, at: float) -> None:
        self.at = at

    def distances(self, q: np.ndarray) -> tuple[float, str, str]:
        return self.at - float(q[0]), "hand", "wall"


@pytest.mark.parametrize(("at", "passes"), [(1.5, True), (0.9, False), (1.003, False)])
def test_a_movement_to_a_wall_is_refused_before_it_gets_there(at: float, passes: bool) -> None:
    arm = SmallArm(clearance=Wall(at))
    arm.arm()
    arm.follow(PATH, len(PATH))
    if passes:
        assert arm.core.faults == ()
        return
    assert [fault.code for fault in arm.core.faults] == ["clearance"]
    assert "hand and wall come within" in arm.core.faults[0].detail
    for _ in range(100):
        arm.step()
    assert arm.stream[:, 0].max() < at - 0.005


def test_the_stop_after_the_rows_is_looked_at_too() -> None:
    arm = SmallArm(clearance=Wall(PATH[29, 0] + 0.021))
    arm.arm()
    assert arm.step(proposal=arm.proposal)[2] == ("clearance",)
    assert "in the stop after these rows" in arm.core.faults[0].detail


def test_a_word_from_the_future_neither_arms_nor_silences_later_ones() -> None:
    arm = SmallArm()
    assert arm.step(word=ArmingRequest(arm.now + 1011 * MS, "a person", True, by_person=True))[2] == ("arming_stale",)
    assert arm.arm()[1] is State.ARMED
    arm.step(word=ArmingRequest(arm.now + 10**15, "a person", True, by_person=True))
    assert arm.step(word=ArmingRequest(arm.now + 10 * MS, "a person", False, by_person=True))[1] is State.DISARMED


@pytest.mark.parametrize("while_stopping", [True, False])
def test_disarmed_in_motion_it_stops_first_and_is_not_held(while_stopping: bool) -> None:
    arm = SmallArm()
    arm.in_motion()
    if while_stopping:
        assert arm.step(stop=VOLTAGE, proposal=arm.proposal)[1] is State.STOPPING
    targets, state, _ = arm.step(
        word=ArmingRequest(arm.now + 10 * MS, "a person", False, by_person=True), proposal=arm.proposal
    )
    assert state is State.STOPPING
    assert (targets is None) is while_stopping
    for _ in range(60):
        arm.step()
    assert arm.core.state is State.DISARMED


@pytest.mark.parametrize("at_rest", [True, False])
def test_rows_that_were_lost_are_waited_for_half_a_second_and_until_the_robot_rests(at_rest: bool) -> None:
    arm = SmallArm()
    arm.arm()
    arm.step(proposal=arm.proposal)
    robot = arm.measured()
    arm.step(stop=VOLTAGE, measured=replace(robot, captured_ns=arm.now + 10 * MS, at_rest=True, next_index=0))
    for k in range(50):
        assert arm.core.state is State.STOPPING, k
        arm.step(measured=replace(robot, captured_ns=arm.now + 10 * MS, at_rest=at_rest or k == 49, next_index=0))
    assert arm.core.state is State.HOLD


def test_faults_do_not_pile_up_while_held() -> None:
    arm = SmallArm()
    arm.step(stop=VOLTAGE)
    for _ in range(5):
        assert arm.step(stop=VOLTAGE)[1:] == (State.HOLD, ("voltage",))
    assert arm.step(stop=MODEL)[2] == ("voltage", "model")
    assert arm.step(stop=replace(MODEL, joint="elbow"))[2] == ("voltage", "model", "model")


def test_rows_whose_stop_would_leave_the_range_are_refused_in_time() -> None:
    path = straight_move(HOME, np.array([3.0, 0.0, 0.0]), LIMITS)
    inside = path[path[:, 0] <= 1.5]
    arm = SmallArm()
    arm.arm()
    arm.follow(inside, len(inside))
    assert [fault.code for fault in arm.core.faults] == ["joint_limit"]
    assert arm.core.faults[0].joint == "shoulder"
    assert arm.core.faults[0].detail.startswith("in the stop after these rows: joint shoulder leaves its range at")
    for _ in range(100):
        arm.step()
    assert 0.1 < arm.stream[-1, 0] <= 1.5
    assert arm.core.state is State.HOLD


def disarmed_in_motion() -> SmallArm:
    arm = SmallArm()
    arm.in_motion()
    arm.step(word=ArmingRequest(arm.now + 10 * MS, "a person", False, by_person=True), proposal=arm.proposal)
    assert arm.core.state is State.STOPPING
    return arm


def test_a_fault_after_the_word_to_disarm_is_held() -> None:
    arm = disarmed_in_motion()
    arm.step(stop=VOLTAGE)
    for _ in range(60):
        arm.step()
    assert arm.core.state is State.HOLD


def test_a_word_to_disarm_is_forgotten_with_the_robot_that_it_was_for() -> None:
    arm = disarmed_in_motion()
    assert arm.step(ms=600, measured=None)[1] is State.DISCONNECTED
    assert arm.step()[1] is State.DISARMED
    arm.arm()
    assert arm.step(stop=VOLTAGE)[1] is State.HOLD


def test_after_a_word_to_disarm_in_motion_a_later_fault_is_held() -> None:
    arm = disarmed_in_motion()
    for _ in range(60):
        arm.step()
    assert (arm.core.state, arm.core.faults) == (State.DISARMED, ())
    arm.arm()
    assert arm.step(stop=VOLTAGE)[1] is State.HOLD


def test_a_silent_robot_is_not_disarmed_by_a_word() -> None:
    arm = SmallArm()
    arm.arm()
    robot = arm.measured()
    word = ArmingRequest(arm.now + 600 * MS, "a person", False, by_person=True)
    assert arm.step(ms=600, measured=robot, word=word)[1] is State.DISCONNECTED


def test_what_the_faults_of_arming_say() -> None:
    arm = SmallArm()
    robot = replace(arm.measured(), captured_ns=arm.now + 2000 * MS, at_rest=False)
    lost = replace(robot, positions=np.array([0.0, np.nan, 0.0]), commanded=np.array([0.0, -2.1, 0.0]))
    arm.step(ms=2000, measured=lost, word=ArmingRequest(arm.now + 500 * MS, "", True, by_person=True))
    check_faults(
        arm,
        ("arming_stale", "", "1500 ms old, allowed 1000 ms", "arm again"),
        ("arming_source", "", "no source", "name who arms"),
        ("arming_moving", "", "the robot is moving", "arm it at rest"),
        ("arming_pose_unknown", "", "measured pose is unknown: [ 0. nan  0.]"),
        (
            "arming_pose_outside",
            "elbow",
            "joint elbow is commanded at -120.32 deg, allowed -114.59 to 114.59 deg",
            "move it inside by hand",
        ),
    )
    arm = SmallArm(SafetySettings(following=np.full(3, 0.1), words_per_s=3.0))
    arm.push = np.array([0.2, 0.0, 0.2])
    arm.arm()
    arm.arm()
    check_faults(
        arm,
        ("arming_following", "shoulder", "shoulder, wrist", "what blocks them", "or command"),
        ("arming_rate", "", "arming requests", "allowed: 1 within 250 ms", "wait"),
    )


def check_faults(arm: SmallArm, *expected: tuple[str, ...]) -> None:
    """Codes and joints of all faults, and parts of each message: the facts, and what to do."""
    assert [(fault.code, fault.joint) for fault in arm.core.faults] == [(one[0], one[1]) for one in expected]
    for fault, (_, _, *parts) in zip(arm.core.faults, expected, strict=True):
        assert [part for part in parts if part not in fault.detail] == []


def test_what_the_faults_of_reports_and_time_say() -> None:
    arm = SmallArm()
    arm.arm()
    arm.now -= 1
    arm.step(ms=0)
    assert [(f.code, f.joint) for f in arm.core.faults] == [("clock", "")]
    arm = SmallArm()
    arm.arm()
    arm.step(measured=replace(arm.measured(), captured_ns=arm.now + 10 * MS, positions=np.zeros(2)))
    check_faults(arm, ("report", "", "poses of shape (2,) and (3,), allowed (3,)"))
    arm = SmallArm()
    arm.arm()
    arm.step(measured=replace(arm.measured(), captured_ns=arm.now + 10 * MS, next_index=4))
    check_faults(arm, ("report", "", "the robot is at row 4, allowed 0 to 0", "restarted"))
    arm = SmallArm()
    arm.arm()
    arm.step(ms=501, measured=None)
    check_faults(
        arm, ("robot_silent", "", "501 ms, allowed 500 ms", "comes to rest by itself", "arm again once it is back")
    )


@pytest.mark.parametrize(
    ("fields", "code", "parts"),
    [
        (
            {"joint_names": ("a", "b")},
            "names",
            ("rows are of 2 other joints, allowed: shoulder, elbow, wrist",),
        ),
        ({"rows": PATH[:4, :2]}, "length", ("rows have shape (4, 2), allowed [up to 5000, 3]",)),
        ({"ahead": PATH[0]}, "length", ("rows have shape (3,), allowed [up to 5000, 3]",)),
        ({"rows": np.zeros((5001, 3))}, "length", ("rows have shape (5001, 3), allowed [up to 5000, 3]",)),
        ({"rows": PATH[:0]}, "length", ("empty", "at least one row is needed")),
        ({"epoch": 4}, "epoch", ("rows of epoch 4, allowed 5", "restart")),
        ({"first_index": -1}, "played", ("rows from index -1, allowed from 0", "played")),
        ({"first_index": 1}, "gap", ("rows from index 1, allowed up to 0", "gap")),
    ],
)
def test_what_the_faults_of_proposals_say(fields: dict, code: str, parts: tuple[str, ...]) -> None:
    arm = SmallArm()
    arm.arm()
    arm.step(proposal=lambda: replace(arm.proposal(), **fields))
    check_faults(arm, (code, "", *parts))


def test_rows_that_break_a_limit_are_told_with_their_joint() -> None:
    arm = SmallArm()
    arm.arm()
    rows = PATH[:4] + np.array([0.0, 1.0, 0.0])
    arm.step(proposal=lambda: replace(arm.proposal(), rows=rows))
    assert [(fault.code, fault.joint) for fault in arm.core.faults] == [("jump", "elbow")]


def test_rows_with_nothing_after_them_must_end_at_rest() -> None:
    arm = SmallArm()
    arm.arm()
    targets, _, faults = arm.step(proposal=lambda: replace(arm.proposal(), ahead=PATH[:0]))
    assert (targets, faults) == (None, ("acceleration",))


def test_what_is_sent_is_what_was_proposed_and_the_stop_along_what_would_follow() -> None:
    arm = SmallArm()
    arm.arm()
    for n_rows in (30, 1):
        targets = arm.step(ms=0, proposal=lambda n_rows=n_rows: arm.proposal(rows=n_rows))[0]
        assert targets is not None
        ramp = stop_ramp(PATH[n_rows - 1], PATH[n_rows : n_rows + 60], LIMITS)
        np.testing.assert_array_equal(targets.rows, np.concatenate([PATH[:n_rows], ramp]))
        assert targets.ramp_rows == len(ramp) > 0


@pytest.mark.parametrize(("age_ms", "passes"), [(0, True), (250, True), (251, False), (-1, False)])
def test_a_proposal_may_be_a_quarter_of_a_second_old(age_ms: int, passes: bool) -> None:
    arm = SmallArm()
    arm.arm()
    arm.step(proposal=lambda: replace(arm.proposal(), captured_ns=arm.now - age_ms * MS))
    check_faults(arm, *[] if passes else [("stale", "", f"rows are {age_ms} ms old, allowed 0 to 250 ms")])


def test_as_many_rows_as_the_buffer_takes_pass_and_a_rate_that_is_broken_is_told() -> None:
    arm = SmallArm(SafetySettings(proposals_per_s=4.0))
    arm.arm()
    still = np.zeros((5000, 3))
    targets = arm.step(proposal=lambda: replace(arm.proposal(), rows=still, ahead=still[:0]))[0]
    assert targets is not None
    assert len(targets.rows) == 5000
    arm.step(proposal=lambda: replace(arm.proposal(), first_index=5000, rows=still[:2], ahead=still[:0]))
    check_faults(arm, ("rate", "", "more proposals than allowed: 1 within 250 ms"))
