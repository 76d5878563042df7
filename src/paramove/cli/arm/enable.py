"""`paramove arm enable` and `disable`: a person arms or disarms the arm of the running application."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from paramove.cli.arm.terminal_person import TerminalPerson
from paramove.cli.bus_options import DomainOption, NamespaceOption, arm_in
from paramove.cli.output import ended
from paramove.documents import exit_codes

TIMEOUT_S = 5.0
QUESTION = "Is everybody out of the arm's reach, and the switch of the motors' power in yours?"


def enable(
    yes: Annotated[bool, typer.Option("--yes", help="do not ask whether everybody is out of reach")] = False,
    domain: DomainOption = None,
    namespace: NamespaceOption = None,
) -> None:
    """Arm the arm of the running application: from then on it may move, whenever the application requests it.

    It asks a person at a terminal for confirmation; without a terminal, as in a background script, it arms nothing.

    Exit codes: 0 armed; 1 you said no, or there is no terminal; 2 several arms run, and none was named; 3 the safety
    gate rejects, with every reason; 69 no answer; 75 another program arms this arm.
    """
    if not TerminalPerson().is_at_terminal:
        raise ended("not armed: only a person at a terminal arms; over ssh, use `ssh -t`", exit_codes.FAILURE)
    folder, arm = _running_arm(domain, namespace)
    if not yes and not typer.confirm(f"{arm}: {QUESTION}" if arm else QUESTION):
        raise ended("not armed", exit_codes.FAILURE)
    _request(True, folder, arm)
    which = f"the arm {arm}" if arm else "the arm"
    typer.echo(f"ARMED: {which} may move; `paramove arm disable` or `paramove arm estop` ends that")


def disable(domain: DomainOption = None, namespace: NamespaceOption = None) -> None:
    """Disarm the arm of the running application: it comes to rest, and nothing moves it until a person arms it again.

    Exit codes: 0 disarmed; 2 several arms run, and none was named; 3 it is not, with every reason; 69 no answer; 75
    another program arms this arm.
    """
    _request(False, *_running_arm(domain, namespace))
    typer.echo("DISARMED")


def _running_arm(domain: str | None, namespace: str | None) -> tuple[Path, str]:
    """Folder of the run's bus and namespace of the arm; ends the command if there is none, or none was named."""
    from paramove.bus import default_folder

    folder = default_folder(domain)
    if not folder.is_dir():
        raise ended(f"nothing is running in {folder}", exit_codes.UNAVAILABLE)
    return folder, arm_in(folder, namespace)


def _request(armed: bool, folder: Path, arm: str) -> None:
    """Arms or disarms; ends the command with the reasons if the safety gate does not."""
    from paramove.bus import BusFolderError, TopicTakenError
    from paramove.msgs.safety_state_pb2 import SafetyState
    from paramove.operator import obeyed, request_arming

    try:
        answer = request_arming(folder, armed, TIMEOUT_S, arm)
    except TopicTakenError as error:
        remedy = "stop that one first; `paramove arm estop` stops the arm in any case"
        raise ended(f"{error}: only one program may arm an arm; {remedy}", exit_codes.TEMPORARY) from error
    except BusFolderError as error:
        raise ended(str(error), exit_codes.UNAVAILABLE) from error
    if answer is None:
        raise ended(
            f"no data from a safety gate within {TIMEOUT_S:g} s: is the arm's driver running?", exit_codes.UNAVAILABLE
        )
    if obeyed(answer, armed):
        return
    state = SafetyState.State.Name(answer.state).removeprefix("STATE_").lower()
    if armed and not answer.faults:
        raise ended(f"{state}, not armed: the arm's driver does not answer", exit_codes.UNAVAILABLE)
    reasons = "; ".join(fault.detail for fault in answer.faults) or "without a reason"
    raise ended(f"{state}, not {'armed' if armed else 'disarmed'}: {reasons}", exit_codes.JUDGED_A_FAILURE)
