"""`paramove arm jog`: one joint of a running arm moved by keys."""

from __future__ import annotations

import contextlib
import math
import os
import shutil
import sys
import time
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from paramove.cli.arm.terminal_person import QuitError, TerminalPerson
from paramove.cli.bus_options import DomainOption, NamespaceOption, arm_in, bus_folder
from paramove.cli.output import ended
from paramove.documents import exit_codes, printable
from paramove.supervision import QueuedOutput

if TYPE_CHECKING:
    from paramove.bus import BusVisitor, Publisher

PERIOD_S, TIMEOUT_S, STOP_S = 0.02, 3.0, 1.0
NO_DATA_S = 2.0
"""A driver publishes nothing while it checks its servos."""
KEYS = "1-9 choose a joint, + and - move it, space stops, a arms, q ends"


def jog(
    step_deg: Annotated[float, typer.Option("--step", min=0.1, max=10.0, metavar="DEG", help="of one key")] = 2.0,
    domain: DomainOption = None,
    namespace: NamespaceOption = None,
) -> None:
    """Move one joint of a running arm by small steps, through its driver and safety gate.

    Keys: 1-9 choose a joint, + and - move it, space stops the arm, a arms it, q ends. No other program may
    publish trajectories.

    Exit codes: 0 ended by q; 1 no bus; 69 no data from an arm; 75 another program publishes trajectories.
    """
    from paramove.bus import BusVisitor, TopicTakenError

    folder = bus_folder(domain)
    arm = arm_in(folder, namespace)
    try:
        person = TerminalPerson()
        with (
            QueuedOutput() as output,  # after Ctrl-S, keys must still stop the arm
            BusVisitor(folder, "jog") as bus,
            contextlib.closing(_Link(bus, folder, arm, math.radians(step_deg), person.is_at_terminal)) as link,
            person.pressing() as pressed,
        ):
            link.wait_for_arm()
            typer.echo(KEYS)
            while True:
                link.press(pressed(PERIOD_S))
                link.exchange()
                if not output.is_behind:
                    link.show()
    except TopicTakenError as error:
        raise ended(f"{error}: stop that node first (`paramove node stop`)", exit_codes.TEMPORARY) from error
    except QuitError:
        return


class _Link:
    """The bus as jogging needs it; by_person: a person presses the keys, and no program."""

    def __init__(self, bus: BusVisitor, folder: Path, namespace: str, step: float, by_person: bool) -> None:
        from paramove.bus import topics
        from paramove.operator import ArmingKey, Jogging

        self.jogging = Jogging(f"jog-{os.getpid()}-{time.monotonic_ns()}", step)
        self._bus, self._folder, self._by_person = bus, folder, by_person
        self._arming = ArmingKey()
        self._arming_message, self._displayed, self._printed_message = "", "", ""
        self._received_s = time.monotonic()
        self._arms: Publisher | None = None
        self._namespace = namespace
        self._trajectories = bus.publisher(topics.topic_in(namespace, topics.ARM_TRAJECTORY))
        received = (topics.ARM_JOINT_STATES, topics.ARM_TRAJECTORY_STATUS, topics.ARM_SAFETY)
        self._subscribers = [bus.subscriber(topics.topic_in(namespace, topic)) for topic in received]

    def close(self) -> None:
        """Ends the line that is rewritten."""
        if self._displayed and sys.stdout.isatty():
            typer.echo()  # so that the shell's prompt begins a new line

    def wait_for_arm(self) -> None:
        """Ends the command if no driver publishes joint angles, or none subscribes to trajectories."""
        end_s = time.monotonic() + TIMEOUT_S
        while not (self.jogging.angles and self._trajectories.subscriptions and self._arming.state):
            if time.monotonic() > end_s:
                raise ended(
                    f"no data from an arm within {TIMEOUT_S:g} s: is its driver running?", exit_codes.UNAVAILABLE
                )
            self._subscribers[0].socket.poll(int(1e3 * PERIOD_S))
            self.exchange()

    def press(self, key: str) -> None:
        """Handles a key."""
        from paramove.bus import publish_now
        from paramove.operator import TERMINAL, stop_arms

        if key.isdecimal():
            self.jogging.choose(int(key) - 1)
        elif key in ("+", "-"):
            message = self.jogging.step(1 if key == "+" else -1, time.monotonic_ns())
            if message is not None:
                publish_now(self._trajectories, message)
        elif key == "a":
            self._arming.press(time.monotonic())
            self._printed_message = ""  # the reason why it is not armed is printed again
        elif key == " ":
            self._arming.cancel()
            answer = stop_arms(self._folder, TERMINAL, STOP_S).get(self._namespace)
            if answer is not None:
                self._arming.stopped(answer)
            self.jogging.detail = "stopped" if answer else "no answer: use the switch of the motors' power"

    def exchange(self) -> None:
        """Receives messages, and publishes the arming request when it is due."""
        for publisher in (self._trajectories, self._arms):
            if publisher is not None:
                publisher.serve()
        states, statuses, safety = self._subscribers
        for subscriber, handle in ((states, self.jogging.handle_states), (statuses, self.jogging.handle_status)):
            subscriber.revive()
            while (received := subscriber.receive()) is not None:
                handle(received.message)
        safety.revive()
        now_s = time.monotonic()
        while (received := safety.receive()) is not None:
            self._arming.handle(received.message)
            self._received_s = now_s
        self.jogging.tick(time.monotonic_ns())
        if self._arming.tick(now_s):
            self._arm()
        if self._arming.detail != self._arming_message:
            self._arming_message = self.jogging.detail = self._arming.detail
        if self.has_no_data:
            self.jogging.detail = f"no data for {NO_DATA_S:g} s: is the arm's driver running?"

    @property
    def has_no_data(self) -> bool:
        """Whether the arm's driver has published nothing for a while."""
        return time.monotonic() - self._received_s > NO_DATA_S

    def show(self) -> None:
        """Prints the chosen joint in one line, rewritten at a terminal, otherwise when it changes.

        At a terminal, a message that is too long for that is printed in lines of its own, once.
        """
        jogging = self.jogging
        angle = math.degrees(jogging.angles[jogging.joint])
        state = "no data" if self.has_no_data else self._arming.state
        status, message = f"{state}  {jogging.chosen + 1} {jogging.joint} {angle:.1f} deg", jogging.detail
        what = f"{state} {jogging.joint} {message}"
        if sys.stdout.isatty():
            columns = shutil.get_terminal_size().columns
            is_long = len(status) + len(message) + 2 >= columns
            status = status[: max(columns - 3, 1)]  # a wrapped line could not be rewritten
            if is_long and message != self._printed_message:
                typer.echo(f"\r\x1b[2K{printable(message)}")
            self._printed_message = message
            typer.echo(f"\r\x1b[2K{printable(status)}  {'' if is_long else printable(message)}", nl=False)
        elif what != self._displayed:
            typer.echo(printable(f"{status}  {message}"))
        self._displayed = what

    def _arm(self) -> None:
        from paramove.bus import TopicTakenError, publish_now, topics
        from paramove.msgs.safety_state_pb2 import ArmRequest
        from paramove.operator import TERMINAL

        try:
            self._arms = self._arms or self._bus.publisher(topics.topic_in(self._namespace, topics.OPERATOR_ARM))
        except TopicTakenError as error:
            self._arming.reject(f"{error}, and only one program may arm an arm")
            return
        publish_now(self._arms, ArmRequest(source=TERMINAL, armed=True, reason="jogging", by_person=self._by_person))
