"""Whoever says whatever in whatever order: nobody arms the gate but a person, now, with all checks passed."""

from __future__ import annotations

import numpy as np
from hypothesis import settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, rule

from benchmarks.safety_steps import EPOCH, MECHANICAL, MS, Checker
from paramove.safety.core import SafetyCore
from paramove.safety.gate_io import ArmingRequest, Fault, Proposal, SafetySettings, State, Targets
from paramove.safety.stopping import straight_move
from tests.safety.small_arm import HOME, LIMITS, SmallArm

SETTINGS = SafetySettings(emergency_timeout_ms=500.0, words_per_s=None)
CHECKS = (Fault("voltage", "", "9.1 V, allowed 11 to 13 V"), Fault("model", "wrist", "XL430, allowed XM430"))
GOALS = (np.array([1.0, -0.8, 0.5]), np.array([-0.5, 0.2, 0.0]), HOME)


class ArmingMachine(RuleBasedStateMachine):
    """A gate, a robot, and people, programs and buttons around them; what is allowed is written down here again."""

    def __init__(self) -> None:
        super().__init__()
        self.arm = SmallArm(SETTINGS)
        self.judge = Checker(LIMITS, HOME)
        self.words: list[ArmingRequest] = []
        self.delivered: list[ArmingRequest] = []
        self.checks: tuple[Fault, ...] = ()
        self.checks_ms = 0
        self.plan: tuple[int, np.ndarray] | None = None
        self.pressed = self.heard_pressed = False
        self.source_speaks = True
        self.emulated, self.touched = False, False
        self.source_heard_ns = self.only_later_ns = self.arm.now

    @rule(times=st.integers(1, 12))
    def time_passes(self, times: int) -> None:
        for _ in range(times):
            self.step()

    @rule(
        age_ms=st.sampled_from([0, 0, 0, 0, 900, 1100, 3900, -1100]),
        source=st.sampled_from(["a person", "a person", ""]),
        checks_ms=st.sampled_from([0, 0, 200, 2950, 3100]),
        by_person=st.sampled_from([True, True, False]),
        emulated=st.booleans(),
    )
    def somebody_arms(self, age_ms: int, source: str, checks_ms: int, by_person: bool, emulated: bool) -> None:
        self.checks_ms, self.emulated = checks_ms, emulated
        self.publish(ArmingRequest(self.arm.now + (10 - age_ms) * MS, source, True, by_person))

    @rule()
    def somebody_disarms(self) -> None:
        self.publish(ArmingRequest(self.arm.now + 10 * MS, "a person", False, by_person=True))

    @rule(goal=st.sampled_from(range(len(GOALS))), steps=st.integers(0, 25))
    def all_is_well_and_the_arm_moves(self, goal: int, steps: int) -> None:
        """So that the rest happens to an arm that is armed, too."""
        self.pressed, self.source_speaks, self.checks = False, True, ()
        for _ in range(12):
            self.step(ms=50)
        self.publish(ArmingRequest(self.arm.now + 10 * MS, "a person", True, by_person=True))
        assert self.arm.core.state is State.ARMED
        self.a_movement_is_asked_for(goal)
        for _ in range(steps):
            self.step()

    @rule(by_button=st.booleans(), steps=st.integers(1, 40))
    def a_word_is_said_before_a_stop_and_heard_after_it(self, by_button: bool, steps: int) -> None:
        self.pressed, self.source_speaks, self.checks = False, True, ()
        self.words.append(ArmingRequest(self.arm.now + 10 * MS, "a person", True, by_person=True))
        self.step()
        if by_button:
            self.the_emergency_stop_is_pressed_or_released(True)
            self.the_emergency_stop_is_pressed_or_released(False)
        else:
            self.a_person_stops_the_arm()
        for _ in range(steps):
            self.step()
        self.step(word=self.words[-1])

    @rule(data=st.data())
    def an_earlier_word_comes_again(self, data: st.DataObject) -> None:
        if self.words:
            self.step(word=data.draw(st.sampled_from(self.words)))

    @rule(goal=st.sampled_from(range(len(GOALS))))
    def a_movement_is_asked_for(self, goal: int) -> None:
        """In whatever state: the proposals come all the same."""
        if self.plan is None and self.arm.at_rest:
            self.plan = (self.arm.played, straight_move(self.arm.stream[-1], GOALS[goal], LIMITS))
        self.step()

    @rule()
    def a_person_stops_the_arm(self) -> None:
        self.step(stop=Fault("person_stop", "", "stopped from the page by a person"))

    @rule(pressed=st.booleans())
    def the_emergency_stop_is_pressed_or_released(self, pressed: bool) -> None:
        self.pressed = pressed
        self.step()

    @rule(speaks=st.booleans())
    def its_source_ends_or_comes_back(self, speaks: bool) -> None:
        self.source_speaks = speaks
        self.step()

    @rule(failing=st.sampled_from([(), (), CHECKS[:1], CHECKS]))
    def checks_change(self, failing: tuple[Fault, ...]) -> None:
        self.checks = failing
        self.step()

    @rule()
    def the_robot_is_silent_for_long(self) -> None:
        self.step(ms=300, measured=None)
        self.step(ms=300, measured=None)
        self.step()

    @rule()
    def the_driver_restarts(self) -> None:
        """Its stream begins anew, and words of its earlier life do not count."""
        if not self.arm.at_rest:
            return
        self.arm.stream, self.arm.played = self.arm.stream[-1:], 0
        self.judge = Checker(LIMITS, self.arm.stream[-1])
        mechanical = (np.full(3, -MECHANICAL), np.full(3, MECHANICAL))
        self.arm.core = SafetyCore(LIMITS, mechanical, EPOCH, self.arm.now, SETTINGS)
        self.plan = None
        self.heard_pressed = self.touched = False
        self.source_heard_ns = self.only_later_ns = self.arm.now
        self.step()

    def publish(self, word: ArmingRequest) -> None:
        self.words.append(word)
        self.step(word=word)

    def proposal(self) -> Proposal | None:
        if self.plan is None:
            return None
        start, path = self.plan
        return self.arm.proposal(path, start) if self.arm.played - start < len(path) - 3 else None

    def step(self, word: ArmingRequest | None = None, ms: int = 10, **said: object) -> None:
        arm, before, rested = self.arm, self.arm.core.state, self.arm.at_rest
        emergency = self.pressed if self.source_speaks else None
        if self.source_speaks:
            self.heard_pressed, self.source_heard_ns = self.pressed, arm.now + ms * MS
        pressed = self.heard_pressed or arm.now + ms * MS - self.source_heard_ns > 500 * MS
        said |= {"word": word, "emergency": emergency, "arming_faults": self.checks, "proposal": self.proposal}
        said["checks_began_ns"] = arm.now + (ms - self.checks_ms) * MS if self.checks_ms else None
        said["no_program"] = "" if self.emulated else "it is real"
        targets, state, faults = arm.step(ms=ms, **said)
        assert (state is State.ESTOP) == pressed
        if state is State.ARMED and before is not State.ARMED:
            self.expect_a_person_now(word, before, rested)
        elif word is not None and word.armed and word.captured_ns > self.only_later_ns and not pressed:
            self.expect_reasons(word, before, faults)
        self.checks_ms = 0
        lost = state is State.DISCONNECTED and before is not State.DISCONNECTED
        self.touched |= lost or "stop" in said or state not in (State.DISCONNECTED, State.DISARMED)
        if targets is not None:
            self.expect_a_movement_that_may_be(targets, before, state)
        if state is not State.ARMED:
            self.plan = None
        self.delivered += [] if word is None else [word]
        if pressed or "stop" in said:
            self.only_later_ns = arm.now

    def expect_a_person_now(self, word: ArmingRequest | None, before: State, rested: bool) -> None:
        assert before in (State.DISARMED, State.HOLD, State.DISCONNECTED)  # connected in this very step
        assert word is not None
        assert word.armed
        assert word.source
        assert word.by_person or (self.emulated and not self.touched)
        assert self.of_time(word) == set()
        assert word.captured_ns > self.only_later_ns
        assert self.checks == ()
        assert rested
        assert self.arm.core.faults == ()

    def of_time(self, word: ArmingRequest) -> set[str]:
        """What its time alone makes wrong with a word."""
        age_ms = (self.arm.now - word.captured_ns) // MS
        if age_ms < 0:
            return {"arming_stale"} if age_ms < -1000 else set()
        stale, slow = age_ms - self.checks_ms > 1000, min(age_ms, self.checks_ms) > 3000
        return {name for name, wrong in (("arming_stale", stale), ("arming_slow", slow)) if wrong}

    def expect_reasons(self, word: ArmingRequest, before: State, faults: tuple[str, ...]) -> None:
        """Whoever may not arm is told every check that fails."""
        newer = any(one.captured_ns >= word.captured_ns for one in self.delivered)
        if before not in (State.DISARMED, State.HOLD) or newer or self.arm.core.state is State.DISCONNECTED:
            return
        failing = {fault.code for fault in self.checks}
        failing |= self.of_time(word)
        failing |= set() if word.source else {"arming_source"}
        failing |= set() if word.by_person or (self.emulated and not self.touched) else {"arming_program"}
        assert failing <= set(faults)
        assert faults
        assert all(fault.detail for fault in self.arm.core.faults)

    def expect_a_movement_that_may_be(self, targets: Targets, before: State, state: State) -> None:
        assert before is State.ARMED
        assert state is State.ARMED or targets.ramp_rows == len(targets.rows)
        self.judge.given(targets)


ArmingMachine.TestCase.settings = settings(deadline=None, max_examples=80, stateful_step_count=20, derandomize=True)


class TestArming(ArmingMachine.TestCase):
    """`python -m studies faults` names it."""
