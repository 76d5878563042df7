"""The safety gate: it is armed only by a word from outside, and lets nothing pass that breaks a rule."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from paramove.safety.core import SafetyCore
from paramove.safety.gate_io import ArmingRequest, Fault, Inputs, Measured, Proposal, State
from tests.robots.hoap3.movements import HOAP3, swing

LIMITS = HOAP3.motion_limits
PATH = swing(HOAP3, duration_s=1.2)
MS = 1_000_000
START_NS = 5_000 * MS
EPOCH = 3


def gate() -> SafetyCore:
    return SafetyCore(LIMITS, (HOAP3.lower, HOAP3.upper), EPOCH, START_NS)


def measured(now_ns: int, *, at_rest: bool = True, next_index: int = 0, row: int = 0) -> Measured:
    return Measured(now_ns, PATH[row], PATH[row], at_rest, next_index)


def word(at_ns: int, *, armed: bool = True, source: str = "a person") -> ArmingRequest:
    return ArmingRequest(at_ns, source, armed, by_person=True)


def proposal(now_ns: int, first: int = 0, rows: int = 300, ahead: int = 400) -> Proposal:
    path = PATH[1:]
    return Proposal(
        now_ns, EPOCH, HOAP3.joint_names, first, path[first : first + rows], path[first + rows : first + rows + ahead]
    )


def armed() -> tuple[SafetyCore, int]:
    core, now = gate(), START_NS + 100 * MS
    core.step(now, Inputs(measured(now), word(now)))
    assert core.state is State.ARMED
    return core, now


def test_not_armed_by_default_and_lets_nothing_pass() -> None:
    core = gate()
    assert core.step(START_NS, Inputs()) == (None, State.DISCONNECTED, ())
    now = START_NS + MS
    assert core.step(now, Inputs(measured(now), proposal=proposal(now))) == (None, State.DISARMED, ())


def test_armed_rows_pass_unchanged_and_end_in_a_stop_ramp() -> None:
    core, now = armed()
    targets, state, faults = core.step(now, Inputs(measured(now), proposal=proposal(now)))
    assert (state, faults) == (State.ARMED, ())
    assert targets is not None
    assert targets.first_index == 0
    np.testing.assert_array_equal(targets.rows[:300], PATH[1:301])
    assert 0 < targets.ramp_rows == len(targets.rows) - 300
    assert np.abs(np.diff(targets.rows[-3:], axis=0)).max() < 1e-5


@pytest.mark.parametrize(
    ("arming_request", "robot", "code"),
    [
        (word(START_NS + MS, source=""), {}, "arming_source"),
        (word(START_NS + MS), {"at_rest": False}, "arming_moving"),
    ],
)
def test_arming_is_refused_with_the_failing_checks(arming_request: ArmingRequest, robot: dict, code: str) -> None:
    core, now = gate(), START_NS + 2 * MS
    _, state, faults = core.step(now, Inputs(measured(now, **robot), arming_request))
    assert state is State.DISARMED
    assert [fault.code for fault in faults] == [code]


@pytest.mark.parametrize(("value", "code"), [(np.nan, "arming_pose_unknown"), (0.5, "arming_pose_outside")])
def test_arming_needs_a_known_pose_inside_the_limits(value: float, code: str) -> None:
    core, now = gate(), START_NS + 2 * MS
    pose = PATH[0].copy()
    pose[HOAP3.index("right_elbow")] = value
    robot = replace(measured(now), positions=pose)
    _, state, faults = core.step(now, Inputs(robot, word(now)))
    assert state is State.DISARMED
    assert faults[0].code == code


@pytest.mark.parametrize("at_ns", [0, START_NS - MS, START_NS])
def test_words_from_an_earlier_life_are_not_heard(at_ns: int) -> None:
    core, now = gate(), START_NS + 2 * MS
    _, state, _ = core.step(now, Inputs(measured(now), word(at_ns)))
    assert state is State.DISARMED


def changed_rows(row: int, joint: str, value: float) -> np.ndarray:
    rows = PATH[1:301].copy()
    rows[row, HOAP3.index(joint)] = value
    return rows


@pytest.mark.parametrize(
    ("fields", "code"),
    [
        ({"joint_names": HOAP3.joint_names[:-1]}, "names"),
        ({"rows": PATH[1:301, :27]}, "length"),
        ({"rows": PATH[:0]}, "length"),
        ({"epoch": 2}, "epoch"),
        ({"captured_ns": START_NS - 1000 * MS}, "stale"),
        ({"captured_ns": START_NS + 10**12}, "stale"),
        ({"rows": changed_rows(40, "left_elbow", np.nan)}, "not_finite"),
        ({"rows": changed_rows(40, "left_elbow", np.inf)}, "not_finite"),
        ({"rows": changed_rows(40, "left_elbow", np.deg2rad(0.5))}, "joint_limit"),
        ({"rows": changed_rows(40, "left_elbow", np.deg2rad(-2))}, "jump"),
        ({"rows": changed_rows(40, "left_elbow", np.deg2rad(-0.2))}, "velocity"),
        ({"rows": changed_rows(40, "left_elbow", np.deg2rad(-0.1))}, "acceleration"),
        ({"rows": PATH[150:450]}, "jump"),
    ],
)
def test_a_violation_stops_and_is_latched(fields: dict, code: str) -> None:
    core, now = armed()
    bad = replace(proposal(now), **fields)
    targets, state, faults = core.step(now, Inputs(measured(now), proposal=bad))
    assert state in (State.STOPPING, State.HOLD)  # at once in HOLD where nothing had been sent
    assert [fault.code for fault in faults] == [code]
    assert "allowed" in faults[0].detail or "needed" in faults[0].detail
    if targets is not None:
        assert targets.ramp_rows == len(targets.rows)
    later = now + 600 * MS
    _, state, faults = core.step(later, Inputs(measured(later), proposal=proposal(later)))
    assert state is State.HOLD
    assert faults[0].code == code
    assert core.step(later, Inputs(measured(later), word(now), proposal(later)))[1] is State.HOLD
    rearmed = later + MS
    _, state, faults = core.step(rearmed, Inputs(measured(rearmed), word(rearmed)))
    assert (state, faults) == (State.ARMED, ())


def test_a_stop_in_motion_runs_along_the_path_from_the_first_free_index() -> None:
    core, now = armed()
    core.step(now, Inputs(measured(now), proposal=proposal(now)))
    now += 67 * MS
    moving = measured(now, at_rest=False, next_index=67)
    stop = Fault("test", "", "stop now")
    targets, state, faults = core.step(now, Inputs(moving, proposal=proposal(now, first=167), stop=stop))
    assert (state, faults) == (State.STOPPING, (stop,))
    assert targets is not None
    assert targets.first_index == 167
    assert targets.ramp_rows == len(targets.rows)
    rows = np.concatenate([PATH[160:168], targets.rows])
    acceleration = np.abs(rows[8:] - 2 * rows[4:-4] + rows[:-8]) / 16e-6
    assert (acceleration <= LIMITS.stop_acceleration * 1.001).all()
    later = now + 400 * MS
    assert core.step(later, Inputs(measured(later, at_rest=False, next_index=300)))[1] is State.STOPPING
    ended = measured(later, next_index=targets.end_index)
    assert core.step(later, Inputs(ended))[1] is State.HOLD


@pytest.mark.parametrize(("first", "code"), [(10, "played"), (900, "gap")])
def test_rows_must_join_what_was_accepted(first: int, code: str) -> None:
    core, now = armed()
    core.step(now, Inputs(measured(now), proposal=proposal(now)))
    now += 67 * MS
    moving = measured(now, at_rest=False, next_index=67)
    _, state, faults = core.step(now, Inputs(moving, proposal=proposal(now, first=first)))
    assert state is State.STOPPING
    assert faults[0].code == code


def test_a_silent_robot_disconnects_and_comes_back_disarmed() -> None:
    core, now = armed()
    old = measured(now)
    now += 501 * MS
    assert core.step(now, Inputs(old, word(now)))[1] is State.DISCONNECTED
    targets, state, faults = core.step(now, Inputs(measured(now), proposal=proposal(now)))
    assert (targets, state) == (None, State.DISARMED)
    assert faults[0].code == "robot_silent"


def test_disarming_at_rest_is_immediate() -> None:
    core, now = armed()
    now += MS
    assert core.step(now, Inputs(measured(now), word(now, armed=False)))[1] is State.DISARMED


ODD = st.one_of(st.floats(), st.sampled_from([0.0, 1e9, -1e9, 3.0]))


@settings(deadline=None, max_examples=150, derandomize=True)
@given(
    steps=st.lists(
        st.tuples(
            st.integers(min_value=0, max_value=400),  # ms passed
            st.sampled_from(["arm", "disarm", "old word", "nothing", "nothing", "nothing"]),
            st.sampled_from(["good", "good", "good", "none", "odd", "late"]),
            st.integers(min_value=0, max_value=299),
            st.integers(min_value=0, max_value=27),
            ODD,
        ),
        min_size=1,
        max_size=15,
    )
)
def test_nothing_passes_unarmed_and_whatever_passes_keeps_the_limits(steps: list[tuple]) -> None:
    core, now, played, sent = gate(), START_NS, 0, np.empty((0, 28))
    for passed_ms, said, kind, row, joint, value in steps:
        now += passed_ms * MS
        played = min(played + passed_ms, len(sent))
        robot = measured(now, at_rest=played >= len(sent), next_index=played, row=min(played, len(PATH) - 1))
        if played:
            robot = replace(robot, positions=sent[played - 1], commanded=sent[played - 1])
        offered = proposal(now, first=min(played + 50, len(sent)), rows=200) if kind != "none" else None
        if offered is not None and not len(offered.rows):
            offered = None
        if kind == "odd" and offered is not None:
            rows = offered.rows.copy()
            rows[row % len(rows), joint] = value
            offered = replace(offered, rows=rows)
        if kind == "late" and offered is not None:
            offered = replace(offered, captured_ns=now - 10**9)
        heard = {"arm": word(now), "disarm": word(now, armed=False), "old word": word(START_NS)}.get(said)
        before = core.state
        targets, state, _ = core.step(now, Inputs(robot, heard, offered))
        if before not in (State.ARMED,) and said != "arm":
            assert targets is None
            assert state is not State.ARMED
        if targets is not None:
            assert played <= targets.first_index <= len(sent)
            sent = np.concatenate([sent[: targets.first_index], targets.rows])
    whole = np.concatenate(
        [
            np.repeat(PATH[:1], 8, axis=0),
            sent,
            np.repeat((sent if len(sent) else PATH)[-1:] if len(sent) else PATH[:1], 8, axis=0),
        ]
    )
    assert np.isfinite(whole).all()
    assert (np.abs(np.diff(whole, axis=0)) <= LIMITS.velocity * 1e-3 * 1.01).all()
    assert (np.abs(whole[8:] - 2 * whole[4:-4] + whole[:-8]) <= LIMITS.stop_acceleration * 16e-6 * 1.01).all()
