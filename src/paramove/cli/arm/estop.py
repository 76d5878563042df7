"""`paramove arm estop`: stops the arms of the running application, from any terminal."""

from __future__ import annotations

import typer

from paramove.cli.bus_options import DomainOption
from paramove.cli.output import ended
from paramove.documents import exit_codes

TIMEOUT_S = 1.0
REAL_ONE = "use the switch of the motors' power: that one is the real emergency stop"


def estop(domain: DomainOption = None) -> None:
    """Stop the arm of the running application, or all its arms: controlled, and latched until a person arms it again.

    No safety function: the switch of the motors' power is the real emergency stop.

    Exit codes: 0 every safety gate has answered; 69 one has not within 1 s.
    """
    from paramove.bus import BusFolderError, TopicTakenError, default_folder, inspection
    from paramove.msgs.safety_state_pb2 import SafetyState
    from paramove.operator import stop_arms
    from paramove.safety import PERSON_STOP

    folder = default_folder(domain)
    if not folder.is_dir():
        raise ended(f"nothing is running in {folder}; {REAL_ONE}", exit_codes.UNAVAILABLE)
    try:
        answers = stop_arms(folder, "terminal", TIMEOUT_S)
    except (TopicTakenError, BusFolderError) as error:
        raise ended(f"{error}; {REAL_ONE}", exit_codes.UNAVAILABLE) from error
    silent = []
    for namespace, answer in answers.items():
        gate = f"the safety gate of {namespace}" if namespace else "the safety gate"
        if answer is None:
            silent.append(gate if namespace else "no safety gate")
            continue
        state = SafetyState.State.Name(answer.state).removeprefix("STATE_").lower()
        message = next(fault.detail for fault in answer.faults if fault.code == PERSON_STOP)
        typer.echo(f"{gate} has received it: {state}, {message}")
    if silent:
        has = "has answered" if silent == ["no safety gate"] else "has not answered"
        nobody = "" if inspection.gates(folder) else ", and no driver of an arm runs here (any more)"
        raise ended(f"{', '.join(silent)} {has} within {TIMEOUT_S:g} s{nobody}; {REAL_ONE}", exit_codes.UNAVAILABLE)
