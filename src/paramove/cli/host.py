"""`paramove host`: the other computers of a run: trusted once, checked, and used by `paramove launch`."""

from __future__ import annotations

import socket
from typing import Annotated

import typer

from paramove.documents import InputError
from paramove.hosts import HostKeys
from paramove.supervision import About, Agent, HostSettings, ask_host, release_of
from paramove.workspace import Workspace

app = typer.Typer(name="host", help="Trust and check the other computers of a run.", no_args_is_help=True)

HostArgument = Annotated[str, typer.Argument(metavar="HOST", help="its name for ssh")]
FolderOption = Annotated[str | None, typer.Option("--folder", help="where paramove is started there, if not at home")]
CommandOption = Annotated[str, typer.Option("--command", help="how paramove is started there")]


@app.command()
def trust(host: HostArgument, folder: FolderOption = None, command: CommandOption = "paramove") -> None:
    """Exchange public keys with a host over ssh, and pin them on both sides; needed once.

    A key that differs from the pinned one is rejected.
    """
    keys, there = HostKeys(), HostSettings(ssh=host, folder=folder, command=command)
    new = keys.trust(host, ask_host(there, "about").key)
    ask_host(there, "accept", "--", socket.gethostname(), keys.own().public)  # a key may begin with a hyphen
    typer.echo(f"{host} is {'now' if new else 'still'} trusted, and trusts this computer")


@app.command()
def check(host: HostArgument, folder: FolderOption = None, command: CommandOption = "paramove") -> None:
    """Check whether a host can take part in a run: ssh, installation, release and keys."""
    found = ask_host(HostSettings(ssh=host, folder=folder, command=command), "about")
    expected = release_of(Workspace.here())
    if found.release != expected:
        raise InputError(f"{host} has {found.release}; this computer has {expected}. Install the same on both")
    typer.echo(f"ssh       {host} replies\nrelease   {found.release}")
    pinned = HostKeys().trusted().get(host)
    if pinned is None:
        raise InputError(f"{host} is not trusted yet: paramove host trust {host}")
    if pinned != found.key:
        HostKeys().trust(host, found.key)  # raises with what to do
    typer.echo(f"key       {found.key}, as pinned")


@app.command()
def key() -> None:
    """Print the public key of this computer, which is made at the first use."""
    typer.echo(HostKeys().own().public)


@app.command()
def accept(name: Annotated[str, typer.Argument()], public: Annotated[str, typer.Argument(metavar="KEY")]) -> None:
    """Pin the public key of another computer on this one; `trust` does that over ssh."""
    HostKeys().trust(name, public)
    about()


@app.command()
def release() -> None:
    """Print what has to be the same on all computers of a run."""
    typer.echo(release_of(Workspace.here()))


@app.command(hidden=True)
def about() -> None:
    """Print release and public key of this computer for the command on another one, which skips all other lines."""
    line = About(release=release_of(Workspace.here()), key=HostKeys().own().public).line()
    typer.echo(f"\n{line.decode()}")


@app.command(hidden=True)
def agent() -> None:
    """Run this computer's nodes of a run; started by the launcher over ssh, with which it exchanges messages."""
    raise typer.Exit(0 if Agent(Workspace.here()).run() else 1)
