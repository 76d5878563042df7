"""`paramove goal`: a goal for the robot of a running application."""

from __future__ import annotations

import json
from typing import Annotated

import typer

from paramove.bus import TopicTakenError, running_folder
from paramove.cli.bus_options import DomainOption, NamespaceOption, arm_in
from paramove.cli.output import JsonOption, ended, one_line
from paramove.cli.topic import readable
from paramove.client import NoMessageError, Run
from paramove.documents import exit_codes, printable
from paramove.msgs.relocation_pb2 import RelocationStatus

app = typer.Typer(name="goal", help="Send the robot a goal.", no_args_is_help=True)


@app.command()
def send(
    content: Annotated[
        str,
        typer.Argument(
            help="a paramove.msgs.RelocationGoal in YAML. For a servo arm '{kind: KIND_OFFER_HAND, frame: arm_base, "
            "from: {x: 0.2, y: 0.0, z: 0.1}}' reaches a position, '{kind: KIND_REST, frame: arm_base}' goes back"
        ),
    ],
    domain: DomainOption = None,
    namespace: NamespaceOption = None,
    as_json: JsonOption = False,
    wait_s: Annotated[float, typer.Option("--wait", min=0.1, metavar="SECONDS", help="for its last state")] = 60.0,
) -> None:
    """Send a goal, and wait until it has succeeded, failed or was rejected.

    The run has to leave its goals to others, as `paramove launch dynamixel_arm --with emulated --with external_goals`
    does: no node sends goals, and `external` names `relocation/goal`. The arm moves only while it is armed.

    Exit codes: 0 succeeded; 1 no last state in time; 2 several arms run, and none was named; 3 failed or rejected; 66
    nothing runs; 75 a node sends goals; 78 that is no goal.
    """
    try:
        with one_line():
            folder = running_folder(domain)
        with one_line(), Run(folder, "paramove goal", arm_in(folder, namespace)) as run:
            status = run.send_goal(content, wait_s)
    except NoMessageError as error:
        raise ended(str(error), exit_codes.FAILURE) from error
    except TopicTakenError as error:
        message = f"{error}; leave that node out, with `external: [relocation/goal]` in an overlay"
        raise ended(message, exit_codes.TEMPORARY) from error
    state = RelocationStatus.State.Name(status.state).removeprefix("STATE_").lower()
    typer.echo(json.dumps(readable(status)) if as_json else f"{state} {printable(status.reason)}".rstrip())
    if status.state != RelocationStatus.STATE_SUCCEEDED:
        raise typer.Exit(exit_codes.JUDGED_A_FAILURE)
