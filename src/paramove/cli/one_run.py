"""One run for the terminal: checks, makes missing files, runs, and turns every error into a line and an exit code."""

from __future__ import annotations

import contextlib
import json
import os
import shutil
import signal
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path

import typer
from rich.console import Console

from paramove.cli.output import aligned
from paramove.cli.set_up_view import FOLDER_VARIABLE, open_where_displayed
from paramove.dashboard import NAME, link_in, process_in
from paramove.documents import DocumentError, InputError, exit_codes, printable
from paramove.supervision import (
    DomainError,
    DomainNameError,
    Environment,
    Launch,
    LimitError,
    LineView,
    MissingFile,
    Outcome,
    QueuedOutput,
    RunFolder,
    SupervisedNode,
    TableView,
    View,
    application,
    arguments,
    examined,
    load,
    missing_files,
    overlay_folders,
    read_interfaces,
)
from paramove.workspace import Workspace

PAGE, OWN_PAGE = "view", "page"
"""Overlays with the page for any application, and with what an application changes of it."""

LONGEST_SHOWN = 60
"""Characters of a value that `--show-args` shows, so that the table fits a terminal."""


def run(
    name: str,
    overlays: Sequence[str] | None,
    settings: Sequence[str],
    remaps: Sequence[str],
    *,
    seed: int | None,
    headless: bool,
    runs: Path | None,
    page: bool,
    robot: str | None,
    check_only: bool,
    show_arguments: bool,
) -> int:
    """Runs an application, or only checks or describes it; returns the exit code. Never waits for the terminal.

    Args:
        name: Of the launch file; this and all others as the options of `paramove launch`.
    """

    def loaded(workspace: Workspace) -> Launch:
        chosen, given = overlays, settings
        if page:
            chosen, title = with_page(workspace, name, overlays)
            given = [title, *settings]
        return load(workspace, name, chosen, given, seed, headless, robot, remaps)

    look = _checked if check_only else _arguments if show_arguments else None
    return run_loaded(loaded, headless=headless, runs=runs, page=page, look=look)


def run_loaded(
    loaded: Callable[[Workspace], Launch],
    *,
    headless: bool = True,
    runs: Path | None = None,
    page: bool = False,
    look: Callable[[Launch, Workspace, Environment], list[str]] | None = None,
) -> int:
    """As `run`, what a function reads or makes in the workspace.

    Args:
        loaded: The function.
        headless, runs, page: As the options of `paramove launch`.
        look: What is printed of the application, which is not run then.
    """
    with QueuedOutput() as output:
        console = Console(highlight=False, markup=False, emoji=False)
        errors = Console(stderr=True, highlight=False, markup=False, emoji=False, soft_wrap=True)
        launch = None
        try:
            workspace = Workspace.here()
            environment = examined(os.environ, workspace)
            for note in environment.notes:
                errors.print(f"note: {note}")
            launch = loaded(workspace)
            if look is not None:
                console.print("\n".join(look(launch, workspace, environment)), soft_wrap=True)
                return exit_codes.OK
            with tempfile.TemporaryDirectory() as set_up:
                pages = Path(set_up)
                if code := _prepared(launch, workspace, pages if page else None):
                    return code

                def view(folder: RunFolder) -> View:
                    with contextlib.suppress(FileNotFoundError):  # the page of this run follows that of the set-up
                        shutil.move(pages / NAME, folder.path / NAME)
                    return _view(console, output, folder, environment, workspace, headless)

                outcome, folder = application.run(launch, workspace, view, runs)
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
            errors.print(_about_files(error, (runs or workspace.root / "runs").resolve(), environment))
            return exit_codes.PERMISSION if isinstance(error, PermissionError) else exit_codes.FAILURE
        if output.dropped:
            errors.print("note: the terminal blocked for a while, so lines are missing; `paramove logs` shows them")
        console.print(f"{_verdict(outcome)}{outcome.reason}. Run folder: {folder.path}", soft_wrap=True)
        return outcome.code


def _prepared(launch: Launch, workspace: Workspace, pages: Path | None) -> int:
    """Makes the files that are missing, by commands that lead a person through it; the exit code.

    Each is made when the person presses Enter. Without a terminal it names the first one with its command, and makes
    none.

    Args:
        launch: What shall run. workspace: where the files lie, and the commands run.
        pages: Folder of the page in the browser that follows the commands; None without one.

    Raises DocumentError for a wrong entry, or a command that does not write its file.
    """
    for missing in missing_files(launch, workspace):
        attended, name = sys.stdin.isatty(), missing.path.name
        typer.echo(printable(f"{name} is missing: {missing.about}"), err=not attended)
        typer.echo(printable(f"  {missing.typed}"), err=not attended)
        if not attended or not _agreed():
            return exit_codes.INPUT_MISSING
        if code := _made(missing, workspace, pages):
            typer.echo(f"{name} is still missing; the same command goes on from here", err=True)
            return code
        if not missing.path.exists():
            raise launch.error(("needs",), f"`{missing.typed}` did not write {missing.path}")
    return exit_codes.OK


def _made(missing: MissingFile, workspace: Workspace, pages: Path | None) -> int:
    """Runs the command that makes the file; its exit code."""
    shared = {} if pages is None else {FOLDER_VARIABLE: str(pages)}
    try:
        return subprocess.run(
            [sys.executable, "-P", "-m", "paramove.cli.main", *missing.command],
            cwd=workspace.root,
            env={**os.environ, **shared},
            check=False,
        ).returncode
    except KeyboardInterrupt:
        return exit_codes.CTRL_C


def _agreed() -> bool:
    """Whether a person presses Enter; Ctrl-C and the terminal's end are a no."""
    typer.echo("press Enter to begin, Ctrl-C to leave it")
    try:
        return bool(sys.stdin.readline())
    except KeyboardInterrupt:
        return False


def _left_out(launch: Launch) -> str:
    """Overlays that the launch file has by default, if none of them was chosen."""
    default = launch.file.default_overlays
    return "" if set(default) & set(launch.overlays) else " --with ".join(default)


def _check_robots(launch: Launch) -> None:
    """Compares the robots that the nodes drive or simulate with their models, and rehearses the grip of emulated ones.

    Raises DescriptionError.
    """
    from paramove.motion import check_grip, check_model
    from paramove.robots import RobotDescription

    folders = {node.parameters["robot"] for node in launch.file.nodes.values() if "robot" in node.parameters}
    for folder in sorted(folders):
        check_model(RobotDescription.load(folder))
    for node in launch.file.nodes.values():
        scene = node.parameters.get("scene", "scene.xml")
        if node.module == "sim.dynamixel_emulator" and "robot" in node.parameters:
            robot = RobotDescription.load(node.parameters["robot"])
            check_grip(robot, robot.model_path.parent / scene)


def _arguments(launch: Launch, workspace: Workspace, environment: Environment) -> list[str]:
    """The parameters that `--set` can change: name, value, type."""
    found = arguments(launch, read_interfaces(launch, workspace), workspace)
    return aligned([(one.name, _cut(printable(one.value)) or "(needed)", one.kind) for one in found])


def _cut(text: str) -> str:
    return text if len(text) <= LONGEST_SHOWN else f"{text[: LONGEST_SHOWN - 1]}…"


def _checked(launch: Launch, workspace: Workspace, environment: Environment) -> list[str]:
    """Checks all that can be checked before a start: what a run would use, line by line."""
    application.check(launch, workspace)
    _check_robots(launch)
    seeds = f", seed {launch.seed}" if launch.seed is not None else ""
    clock = f"{launch.file.bus.clock}{', lockstep' if launch.file.bus.lockstep else ''}"
    return [
        f"{launch.name}: {len(launch.file.nodes)} nodes fit together",
        f"  overlays  {', '.join(launch.overlays) or 'none'}{seeds}",
        f"  clock     {clock}",
        f"  workspace {workspace} ({workspace.digest})",
        *(f"  replaced  {printable(name)}" for name in workspace.replaced()),
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
    if replaced := workspace.replaced():
        console.print(f"replaced there: {', '.join(map(printable, replaced))}", soft_wrap=True)
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

    The link of a page that was restarted is printed, too: earlier ones have ended with its process.

    Args:
        view: Shows the run.
        run_folder: The page leaves its link there.
    """

    def __init__(self, view: View, run_folder: Path) -> None:
        self._view = view
        self._run_folder = run_folder
        self._printed_of = 0

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
        process = process_in(self._run_folder)
        if process not in (0, self._printed_of):
            link = link_in(self._run_folder)
            self._view.story(f"live page: {link}")
            if not self._printed_of:  # an open page reconnects by itself
                open_where_displayed(link)
            self._printed_of = process
        self._view.refresh(nodes)

    def close(self) -> None:
        """As the other view."""
        self._view.close()
