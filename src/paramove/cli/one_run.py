"""One run for the terminal: checks, prints notes, runs, and turns every error into a line and an exit code."""

from __future__ import annotations

import contextlib
import json
import os
import shutil
import signal
import sys
import tempfile
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

from rich.console import Console

from paramove.cli.preparing import prepared
from paramove.cli.set_up_view import open_where_displayed
from paramove.dashboard import NAME, link_in
from paramove.documents import DocumentError, InputError, exit_codes
from paramove.supervision import (
    DomainError,
    DomainNameError,
    Environment,
    Launch,
    LimitError,
    LineView,
    Outcome,
    QueuedOutput,
    RunFolder,
    SupervisedNode,
    TableView,
    View,
    application,
    examined,
    load,
    missing_files,
    overlay_folders,
)
from paramove.workspace import Workspace

PAGE, OWN_PAGE = "view", "page"
"""Overlays with the page for any application, and with what an application changes of it."""


@dataclass(frozen=True)
class RunOptions:
    """Options of the command line; see `paramove launch --help`."""

    name: str
    overlays: Sequence[str] | None
    settings: Sequence[str]
    seed: int | None
    headless: bool
    runs: Path | None
    page: bool = False
    robot: str | None = None


def run(options: RunOptions, check_only: bool) -> int:
    """Runs an application, or only checks it; returns the exit code. Never waits for the terminal."""
    with QueuedOutput() as output:
        return _run(options, check_only, output)


def _run(options: RunOptions, check_only: bool, output: QueuedOutput) -> int:
    console = Console(highlight=False, markup=False, emoji=False)
    errors = Console(stderr=True, highlight=False, markup=False, emoji=False, soft_wrap=True)
    launch = None
    try:
        workspace = Workspace.here()
        environment = examined(os.environ, workspace.root)
        for note in environment.notes:
            errors.print(f"note: {note}")
        overlays, settings = options.overlays, list(options.settings)
        if options.page:
            overlays, title = with_page(workspace, options.name, overlays)
            settings.insert(0, title)
        launch = load(workspace, options.name, overlays, settings, options.seed, options.headless, options.robot)
        if check_only:
            application.check(launch, workspace)
            console.print("\n".join(_found(launch, environment, workspace)), soft_wrap=True)
            return exit_codes.OK
        with tempfile.TemporaryDirectory() as set_up:
            pages = Path(set_up)
            if code := prepared(launch, workspace, pages if options.page else None):
                return code

            def view(folder: RunFolder) -> View:
                with contextlib.suppress(FileNotFoundError):  # the page of this run follows that of the set-up
                    shutil.move(pages / NAME, folder.path / NAME)
                return _view(console, output, folder, environment, workspace, options.headless)

            outcome, folder = application.run(launch, workspace, view, options.runs)
    except InputError as error:
        errors.print(str(error))
        if isinstance(error, DocumentError) and launch is not None and (left_out := _left_out(launch)):
            errors.print(f"note: --with replaces the default overlays; to apply them too: --with {left_out}")
        return error.exit_code
    except DomainNameError as error:
        errors.print(str(error))
        return exit_codes.CONFIGURATION
    except DomainError as error:
        errors.print(str(error))
        return exit_codes.TEMPORARY
    except LimitError as error:
        errors.print(str(error))
        return exit_codes.PERMISSION
    except OSError as error:
        errors.print(_about_files(error, (options.runs or workspace.root / "runs").resolve(), environment))
        return exit_codes.PERMISSION if isinstance(error, PermissionError) else exit_codes.FAILURE
    if output.dropped:
        errors.print("note: the terminal blocked for a while, so lines are missing; `paramove logs` shows them")
    console.print(f"{_verdict(outcome)}{outcome.reason}. Run folder: {folder.path}", soft_wrap=True)
    return outcome.code


def _left_out(launch: Launch) -> str:
    """Overlays that the launch file has by default, if none of them was chosen."""
    default = launch.file.default_overlays
    return "" if set(default) & set(launch.overlays) else " --with ".join(default)


def _found(launch: Launch, environment: Environment, workspace: Workspace) -> list[str]:
    """What a run would use, line by line."""
    seeds = f", seed {launch.seed}" if launch.seed is not None else ""
    clock = f"{launch.file.bus.clock}{', lockstep' if launch.file.bus.lockstep else ''}"
    return [
        f"{launch.name}: {len(launch.file.nodes)} nodes fit together",
        f"  overlays  {', '.join(launch.overlays) or 'none'}{seeds}",
        f"  clock     {clock}",
        f"  workspace {workspace} ({workspace.digest})",
        f"  domain    {environment.domain}, sockets in {environment.sockets}",
        f"  python    {sys.executable}",
        *(f"  missing   {one.path.name}: {one.about}; {one.typed}" for one in missing_files(launch, workspace)),
    ]


def _about_files(error: OSError, runs: Path, environment: Environment) -> str:
    """The system's message with what to do: another folder for runs, or for sockets."""
    path = Path(os.fsdecode(error.filename)) if error.filename else Path()
    message = f"{path}: {error.strerror or error}"
    if path in (environment.sockets, *environment.sockets.parents[:2]):
        return f"{message}; sockets lie in {environment.sockets}. Set XDG_RUNTIME_DIR to a folder of yours"
    if path in (runs, *runs.parents) or path.is_relative_to(runs):
        other = Path(tempfile.gettempdir()) / "paramove_runs"
        return f"{message}; the folder of the run is made in {runs}. Choose another folder: --runs {other}"
    return message


def _verdict(outcome: Outcome) -> str:
    """What the last line begins with; a run that a person ended did not fail."""
    if outcome.code in exit_codes.INTERRUPTED:
        return ""
    return "done: " if outcome.code == exit_codes.OK else "FAILED: "


def _view(
    console: Console,
    output: QueuedOutput,
    folder: RunFolder,
    environment: Environment,
    workspace: Workspace,
    headless: bool,
) -> View:
    console.print(f"run folder {folder.path}", soft_wrap=True)
    console.print(f"workspace {workspace} ({workspace.digest})", soft_wrap=True)
    console.print(f"domain {environment.domain}, sockets in {environment.sockets}", soft_wrap=True)
    view = (TableView if console.is_terminal and not headless else LineView)(console, output)
    return AnnouncingView(view, folder.path)


def with_page(workspace: Workspace, name: str, overlays: Sequence[str] | None) -> tuple[list[str], str]:
    """The overlays of a launch file, its default ones if None, with the page's on top; and the setting of its title."""
    launch = load(workspace, name, overlays)
    title = (launch.file.description or launch.name.replace("_", " "))[:80]
    own = {OWN_PAGE} & set(workspace.names(overlay_folders(launch.name)[0]))
    return [*launch.overlays, PAGE, *own], f"dashboard.title={json.dumps(title)}"


class AnnouncingView:
    """Another view that also prints the page's link as soon as there is one, and opens it where there is a display.

    Args:
        view: Shows the run.
        run_folder: The page leaves its link there.
    """

    def __init__(self, view: View, run_folder: Path) -> None:
        self._view = view
        self._run_folder = run_folder
        self._link_printed = False

    @property
    def closed_by(self) -> signal.Signals | None:
        """As the other view."""
        return self._view.closed_by

    def changed(self, node: SupervisedNode) -> None:
        """As the other view."""
        self._view.changed(node)

    def story(self, text: str) -> None:
        """As the other view."""
        self._view.story(text)

    def problem(self, text: str) -> None:
        """As the other view."""
        self._view.problem(text)

    def refresh(self, nodes: Iterable[SupervisedNode]) -> None:
        """As the other view; looks for the link."""
        if not self._link_printed and (link := link_in(self._run_folder)):
            self._link_printed = True
            self._view.story(f"live page: {link}")
            open_where_displayed(link)
        self._view.refresh(nodes)

    def close(self) -> None:
        """As the other view."""
        self._view.close()
