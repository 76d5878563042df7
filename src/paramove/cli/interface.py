"""`paramove interface`: message types and their fields."""

from __future__ import annotations

from typing import Annotated

import typer

from paramove.bus import message_types, topics, written_out
from paramove.cli.output import ended, one_line
from paramove.documents import exit_codes, nearest

app = typer.Typer(name="interface", help="Look at the types of messages.", no_args_is_help=True)


@app.command("list")
def list_types() -> None:
    """List the types of messages: those of this folder, of paramove, and of the libraries that it knows."""
    with one_line():
        typer.echo("\n".join(sorted(message_types())))


@app.command()
def show(
    name: Annotated[str, typer.Argument(help="type such as Gesture, or a topic such as gestures")],
) -> None:
    """Print the fields of a message, and of the messages in it, as in a `.proto` file, after the name of that file.

    Exit codes: 0 done; 2 there is no such type or topic; 78 a file of this folder is wrong.
    """
    with one_line():
        types = message_types()
        by_topic = {topic.name: topic.type for topic in topics.TOPICS}
    by_last_part = {full: kind for full, kind in types.items() if full.rpartition(".")[2] == name}
    if len(by_last_part) > 1:
        raise ended(f"which {name}? {', '.join(by_last_part)}", exit_codes.USAGE)
    kind = types.get(name) or by_topic.get(name.removeprefix("/")) or next(iter(by_last_part.values()), None)
    if kind is None:
        raise ended(f"there is no type or topic '{name}'; {nearest(name, [*types, *by_topic])}", exit_codes.USAGE)
    typer.echo(f"// {kind.DESCRIPTOR.file.name}\n{written_out(kind.DESCRIPTOR)}")
