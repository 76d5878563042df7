"""`paramove arm estop`: stops the arm of the running application, from any terminal."""

from __future__ import annotations

import typer

from paramove.cli.bus_options import DomainOption
from paramove.cli.output import ended
from paramove.documents import exit_codes

TIMEOUT_S = 1.0
REAL_ONE = "use the switch of the motors' power: that one is the real emergency stop"


def estop(domain: DomainOption = None) -> None:
    """Stop the arm of the running application: controlled, and latched until a person arms it again.

    No safety function: the switch of the motors' power is the real emergency stop.

    Exit codes: 0 the safety gate has answered; 69 it has not within 1 s.
    """
    from paramove.bus import BusFolderError, TopicTakenError, default_folder
    from paramove.msgs.safety_state_pb2 import SafetyState
    from paramove.operator import stop_arm
    from paramove.safety import PERSON_STOP

    folder = default_folder(domain)
    if not folder.is_dir():
        raise ended(f"nothing is running in {folder}; {REAL_ONE}", exit_codes.UNAVAILABLE)
    try:
        answer = stop_arm(folder, "terminal", TIMEOUT_S)
    except (TopicTakenError, BusFolderError) as error:
        raise ended(f"{error}; {REAL_ONE}", exit_codes.UNAVAILABLE) from error
    if answer is None:
        raise ended(f"no safety gate has answered within {TIMEOUT_S:g} s; {REAL_ONE}", exit_codes.UNAVAILABLE)
    state = SafetyState.State.Name(answer.state).removeprefix("STATE_").lower()
    message = next(fault.detail for fault in answer.faults if fault.code == PERSON_STOP)
    typer.echo(f"the safety gate has received it: {state}, {message}")
