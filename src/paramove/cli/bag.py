"""`paramove bag`: what is in a recording, and a recording played on a bus."""

from __future__ import annotations

import itertools
import json
from pathlib import Path
from typing import Annotated

import typer

from paramove.bus import TopicTakenError, default_folder
from paramove.cli.bus_options import DomainOption, show
from paramove.cli.output import JsonOption, ended, one_line
from paramove.client import NoMessageError, Run, play
from paramove.documents import exit_codes
from paramove.recording import contents

app = typer.Typer(name="bag", help="Look into a recording, or play it on a bus.", no_args_is_help=True)


def _recording(path: Path) -> Path:
    """The recording in a run folder, or the file itself."""
    return path / "recording.mcap" if path.is_dir() else path


FileArgument = Annotated[Path, typer.Argument(help="run folder, or its recording.mcap", callback=_recording)]


@app.command()
def info(file: FileArgument, as_json: JsonOption = False) -> None:
    """List the topics of a recording: type, number of messages, rate and bytes; and how long it is.

    Exit codes: 0 done; 66 no such recording; 78 nothing in it can be read.
    """
    with one_line():
        recorded = contents(file)
    begin_ns = min(topic.first_ns for topic in recorded)
    rows = [
        {
            "topic": topic.name,
            "type": topic.type_name,
            "messages": topic.messages,
            "rate_hz": round(topic.rate_hz, 2),
            "first_s": round(1e-9 * (topic.first_ns - begin_ns), 3),
            "last_s": round(1e-9 * (topic.last_ns - begin_ns), 3),
            "bytes": topic.bytes_total,
        }
        for topic in recorded
    ]
    if as_json:
        typer.echo(json.dumps(rows, indent=2))
        return
    duration_s = 1e-9 * (max(topic.last_ns for topic in recorded) - begin_ns)
    typer.echo(f"{file}: {duration_s:.1f} s, {sum(topic.messages for topic in recorded)} messages")
    show(rows, as_json=False)


@app.command("play")
def play_file(
    file: FileArgument,
    topics: Annotated[str, typer.Option(metavar="A,B", help="only these; default: all but commands")] = "",
    rate: Annotated[float, typer.Option(min=0.01, max=100.0, help="2 is twice as fast")] = 1.0,
    start_s: Annotated[
        float, typer.Option("--start", min=0.0, metavar="SECONDS", help="from so long after its begin")
    ] = 0.0,
    loop: Annotated[bool, typer.Option("--loop", help="again and again, until Ctrl-C")] = False,
    wait_s: Annotated[
        float, typer.Option("--wait", min=0.0, metavar="SECONDS", help="for a subscriber of each topic")
    ] = 2.0,
    domain: DomainOption = None,
) -> None:
    """Publish what was recorded, at its distances in time; times in the messages become those of now.

    In a domain where nothing runs, or beside nodes that do not publish the same topics. What would move an arm (goals,
    trajectories) is played only where --topics names it. What nodes or persons alone publish never is: the clock,
    states of nodes, truth, stops and requests to arm.

    Exit codes: 0 played; 1 the simulated time is not known; 66 no such recording; 75 a node publishes one of the
    topics; 78 it has no such topic, or that is not played.
    """
    names = [name for name in topics.split(",") if name]
    folder = default_folder(domain)
    typer.echo(f"plays {file}; from another terminal: paramove topic hz --domain {folder.name}")
    try:
        with one_line(), Run(folder, "paramove bag play") as run:
            for number in itertools.count():
                count = play(run, file, names, rate, start_s, wait_s if number == 0 else 0.0)
                typer.echo(f"played {count} messages")
                if not loop:
                    break
    except KeyboardInterrupt:
        return
    except NoMessageError as error:  # of the clock
        raise ended(str(error), exit_codes.FAILURE) from error
    except TopicTakenError as error:
        message = f"{error}: name other topics by --topics, or leave that node out"
        raise ended(message, exit_codes.TEMPORARY) from error
