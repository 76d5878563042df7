"""`paramove host`: the other computers of a run: trusted once, checked, and used by `paramove launch`."""

from __future__ import annotations

import socket
import subprocess
from typing import Annotated

import typer

from paramove.documents import InputError
from paramove.hosts import HostKeys
from paramove.supervision import Agent, HostSettings, release_of, ssh_command
from paramove.workspace import Workspace

app = typer.Typer(name="host", help="Trust and check the other computers of a run.", no_args_is_help=True)

HostArgument = Annotated[str, typer.Argument(metavar="HOST", help="its name for ssh")]
FolderOption = Annotated[str | None, typer.Option("--folder", help="where paramove is started there, if not at home")]
CommandOption = Annotated[str, typer.Option("--command", help="how paramove is started there")]
TIMEOUT_S = 60.0


@app.command()
def trust(host: HostArgument, folder: FolderOption = None, command: CommandOption = "paramove") -> None:
    """Exchange public keys with a host over ssh, and pin them on both sides; needed once.

    A key that differs from the pinned one is rejected.
    """
    keys, there = HostKeys(), HostSettings(ssh=host, folder=folder, command=command)
    new = keys.trust(host, _asked(there, "key").strip())
    _asked(there, "accept", "--", socket.gethostname(), keys.own().public)  # a key may begin with a hyphen
    typer.echo(f"{host} is {'now' if new else 'still'} trusted, and trusts this computer")


@app.command()
def check(host: HostArgument, folder: FolderOption = None, command: CommandOption = "paramove") -> None:
    """Check whether a host can take part in a run: ssh, installation, release and keys."""
    there = HostSettings(ssh=host, folder=folder, command=command)
    found, expected = _asked(there, "release").strip(), release_of(Workspace.here())
    if found != expected:
        raise InputError(f"{host} has {found}; this computer has {expected}. Install the same on both")
    typer.echo(f"ssh       {host} replies\nrelease   {found}")
    key, pinned = _asked(there, "key").strip(), HostKeys().trusted().get(host)
    if pinned is None:
        raise InputError(f"{host} is not trusted yet: paramove host trust {host}")
    if pinned != key:
        HostKeys().trust(host, key)  # raises with what to do
    typer.echo(f"key       {key}, as pinned")


@app.command()
def key() -> None:
    """Print the public key of this computer, which is made at the first use."""
    typer.echo(HostKeys().own().public)


@app.command()
def accept(name: Annotated[str, typer.Argument()], public: Annotated[str, typer.Argument(metavar="KEY")]) -> None:
    """Pin the public key of another computer on this one; `trust` does that over ssh."""
    HostKeys().trust(name, public)


@app.command()
def release() -> None:
    """Print what has to be the same on all computers of a run."""
    typer.echo(release_of(Workspace.here()))


@app.command(hidden=True)
def agent() -> None:
    """Run this computer's nodes of a run; started by the launcher over ssh, with which it exchanges lines of JSON."""
    raise typer.Exit(0 if Agent(Workspace.here()).run() else 1)


def _asked(host: HostSettings, *words: str) -> str:
    """Output of `paramove host` there; raises InputError with what ssh or it prints."""
    try:
        answer = subprocess.run(
            ssh_command(host, "host", *words),
            stdin=subprocess.DEVNULL,
            capture_output=True,
            text=True,
            timeout=TIMEOUT_S,
            check=False,
        )
    except subprocess.TimeoutExpired as error:
        raise InputError(f"{host.ssh} gives no answer within {TIMEOUT_S:g} s: check network and ssh") from error
    if answer.returncode:
        lines = [line.strip(" │") for line in answer.stderr.splitlines() if any(map(str.isalnum, line))]
        raise InputError(f"{host.ssh}: {lines[-1] if lines else f'exit code {answer.returncode}'}")
    return answer.stdout
