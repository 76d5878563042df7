"""`paramove launch`: runs an application."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from paramove.cli import completions
from paramove.terminal_size import drop_unusable_sizes

app = typer.Typer(add_completion=False)


def _print_schema(kind: str | None) -> None:
    if kind is None:
        return
    from paramove.supervision import FILES, editor_schema, schema_as_text

    if kind not in FILES:
        raise typer.BadParameter(f"there are schemas of: {', '.join(FILES)}")
    typer.echo(schema_as_text(editor_schema(kind)), nl=False)
    raise typer.Exit


@app.command()
def launch(
    name: Annotated[
        str,
        typer.Argument(
            help="launch file in launch/, such as rule_learning, or a path to a *.yaml",
            autocompletion=completions.launch_files,
        ),
    ],
    overlays: Annotated[
        list[str] | None,
        typer.Option(
            "--with",
            metavar="OVERLAY",
            help="overlay it with launch/overlays/OVERLAY.yaml",
            autocompletion=completions.overlays,
        ),
    ] = None,
    settings: Annotated[
        list[str] | None,
        typer.Option(
            "--set",
            metavar="NODE.PARAM=VALUE",
            help="change one parameter; may be repeated",
            autocompletion=completions.parameters,
        ),
    ] = None,
    remaps: Annotated[
        list[str] | None,
        typer.Option(
            "--remap",
            metavar="NODE:TOPIC=TOPIC",
            help="let a node use another topic in the place of one; may be repeated",
        ),
    ] = None,
    seed: Annotated[int | None, typer.Option(help="seed of the world", min=0)] = None,
    robot: completions.RobotOption = None,
    headless: Annotated[bool, typer.Option("--headless", help="lines instead of the live table, and no video")] = False,
    page: Annotated[
        bool, typer.Option("--view", help="show the run on a page in the browser, on this machine, with a stop button")
    ] = False,
    runs: Annotated[Path | None, typer.Option(help="where the run folder is made (default: runs/)")] = None,
    check: Annotated[bool, typer.Option("--check", help="check the launch file and its nodes, start nothing")] = False,
    show_arguments: Annotated[
        bool, typer.Option("--show-args", help="show the parameters that --set can change, start nothing")
    ] = False,
    schema: Annotated[
        str | None,
        typer.Option(
            metavar="KIND",
            help="print the JSON Schema of a `launch` file or an `overlay`, for editors",
            is_eager=True,
            callback=_print_schema,
            autocompletion=completions.schemas,
        ),
    ] = None,
) -> None:
    """Run an application: start its nodes, restart failed ones, end them in order, judge the run.

    Exit codes: 0 success; 1 failed, or judged a failure; 2 usage; 66 no such launch file; 75 another run is going on;
    78 the launch file is wrong; 124 time limit; 129, 130, 143 ended by a closed terminal, Ctrl-C, SIGTERM;
    141 the program that read the output has ended.
    Ctrl-C once ends the run in order, twice at once. Ctrl-Z does nothing.
    """
    from paramove.cli.one_run import run  # heavy, and not needed to complete a line or to print help

    code = run(
        name, overlays, settings or [], remaps or [],
        seed=seed, headless=headless, runs=runs, page=page, robot=robot, check_only=check,
        show_arguments=show_arguments,
    )  # fmt: skip
    raise typer.Exit(code)


if __name__ == "__main__":
    drop_unusable_sizes()
    app()
