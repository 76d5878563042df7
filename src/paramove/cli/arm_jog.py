"""`paramove arm jog`: one joint of a running arm moved by keys."""

from __future__ import annotations

import contextlib
import math
import os
import sys
import time
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from paramove.cli.arm_options import ended
from paramove.cli.bus_options import DomainOption, bus_folder
from paramove.cli.terminal_person import QuitError, TerminalPerson
from paramove.supervision import exit_codes
from paramove.supervision.processes import printable

if TYPE_CHECKING:
    from paramove.bus.publisher import Publisher
    from paramove.bus.subscriber import Subscriber

PERIOD_S, PATIENCE_S, STOP_S = 0.02, 3.0, 1.0
KEYS = "1-9 choose a joint, + and - move it, space stops, a arms, q ends"


def jog(
    step_deg: Annotated[float, typer.Option("--step", min=0.1, max=10.0, metavar="DEG", help="of one key")] = 2.0,
    domain: DomainOption = None,
) -> None:
    """Move one joint of a running arm by small steps, through its driver and safety gate.

    Keys: 1-9 choose a joint, + and - move it, space stops the arm, a arms it, q ends. Nothing else may say
    trajectories.

    Exit codes: 0 ended by q; 1 no bus; 69 no arm is heard; 75 another program says trajectories.
    """
    from paramove.bus.endpoint import TopicTakenError

    folder = bus_folder(domain)
    try:
        with _Link(folder, math.radians(step_deg)) as link, TerminalPerson().pressing() as pressed:
            link.wait_for_arm()
            typer.echo(KEYS)
            while True:
                link.press(pressed(PERIOD_S))
                link.exchange()
                link.show()
    except TopicTakenError as error:
        raise ended(f"{error}: stop that node first (`paramove node stop`)", exit_codes.TEMPORARY) from error
    except QuitError:
        return


class _Link:
    """The bus as jogging needs it, while it is a context."""

    def __init__(self, folder: Path, step: float) -> None:
        from paramove.bus import topics
        from paramove.bus.visitor import BusVisitor
        from paramove.robots.jogging import Jogging

        self.jogging = Jogging(f"jog-{os.getpid()}-{time.monotonic_ns()}", step)
        self._folder, self._topics = folder, topics
        self._state, self._shown = "", ""
        self._arms: Publisher | None = None
        self._bus = BusVisitor(folder, "jog")

    def __enter__(self) -> _Link:
        topics = self._topics
        with contextlib.ExitStack() as unfinished:
            unfinished.push(self._bus)
            self._says = self._bus.says(topics.ARM_TRAJECTORY)
            heard = (topics.ARM_JOINT_STATES, topics.ARM_TRAJECTORY_STATUS, topics.ARM_SAFETY)
            self._hears: list[Subscriber] = [self._bus.hears(topic) for topic in heard]
            unfinished.pop_all()
        return self

    def __exit__(self, *error: Any) -> None:
        self._bus.__exit__(*error)

    def wait_for_arm(self) -> None:
        """Ends the command if no driver says where the joints are, or none listens."""
        end_s = time.monotonic() + PATIENCE_S
        while not (self.jogging.angles and self._says.subscriptions):
            if time.monotonic() > end_s:
                raise ended(f"no arm is heard within {PATIENCE_S:g} s: is its driver running?", exit_codes.UNAVAILABLE)
            self._hears[0].socket.poll(int(1e3 * PERIOD_S))
            self.exchange()

    def press(self, key: str) -> None:
        """Does what a key stands for."""
        from paramove.bus.visitor import say_now
        from paramove.operator.terminal_arming import TERMINAL
        from paramove.operator.terminal_stop import stop_arm

        if key.isdecimal():
            self.jogging.choose(int(key) - 1)
        elif key in ("+", "-"):
            message = self.jogging.step(1 if key == "+" else -1, time.monotonic_ns())
            if message is not None:
                say_now(self._says, message)
        elif key == "a":
            self._arm()
        elif key == " ":
            answer = stop_arm(self._folder, TERMINAL, STOP_S)
            self.jogging.sentence = "stopped" if answer else "no answer: use the switch of the motors' power"

    def exchange(self) -> None:
        """Hears what has come in."""
        from paramove.msgs.safety_state_pb2 import SafetyState

        for publisher in (self._says, self._arms):
            if publisher is not None:
                publisher.serve()
        states, statuses, safety = self._hears
        for subscriber, hear in ((states, self.jogging.hear_states), (statuses, self.jogging.hear_status)):
            subscriber.revive()
            while (heard := subscriber.receive()) is not None:
                hear(heard.message)
        safety.revive()
        while (heard := safety.receive()) is not None:
            self._state = SafetyState.State.Name(heard.message.state).removeprefix("STATE_").lower()

    def show(self) -> None:
        """The chosen joint in one line, written anew at a terminal, else when it is another."""
        jogging = self.jogging
        angle = math.degrees(jogging.angles[jogging.joint])
        line = f"{self._state}  {jogging.chosen + 1} {jogging.joint} {angle:.1f} deg  {jogging.sentence}"
        what = f"{self._state} {jogging.joint} {jogging.sentence}"
        if sys.stdout.isatty():
            typer.echo(f"\r\x1b[2K{printable(line)}", nl=False)
        elif what != self._shown:
            typer.echo(printable(line))
        self._shown = what

    def _arm(self) -> None:
        from paramove.bus.endpoint import TopicTakenError
        from paramove.bus.visitor import say_now
        from paramove.msgs.safety_state_pb2 import ArmRequest
        from paramove.operator.terminal_arming import TERMINAL

        try:
            self._arms = self._arms or self._bus.says(self._topics.OPERATOR_ARM)
        except TopicTakenError as error:
            self.jogging.sentence = str(error)
            return
        say_now(self._arms, ArmRequest(source=TERMINAL, armed=True, reason="jogging"))
