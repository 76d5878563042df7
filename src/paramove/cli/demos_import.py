"""`paramove demos import`: files of motion capture become a demonstration set."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer

from paramove.cli.movement_options import (
    LabelActionOption,
    LabelSubjectOption,
    ParametersOption,
    ThetaOption,
    numbers,
    words,
)
from paramove.cli.output import ended, one_line
from paramove.documents import exit_codes, printable

if TYPE_CHECKING:
    from paramove.demonstrations import Label
    from paramove.demonstrations.importing import Imported, ImportOptions

PointsOption = Annotated[
    list[str] | None,
    typer.Option("--point", metavar="NAME=MARKER", help="index=RFIN or wrist=RWRA,RWRB (their mean); may be repeated"),
]
MappingOption = Annotated[
    Path | None, typer.Option(metavar="FILE", help="YAML with unit, axes, rate, points; other options come before it")
]
MANY_BYTES = 3_000_000
"""Are read within about a second, as text."""


def import_files(
    files: Annotated[list[Path], typer.Argument(metavar="FILE...", help="C3D, BVH, CSV or NPZ")],
    to: Annotated[Path, typer.Option(metavar="SET", help="folder of the demonstration set")],
    unit: Annotated[Literal["m", "cm", "mm"] | None, typer.Option(help="if the file does not have it")] = None,
    axes: Annotated[
        str | None, typer.Option(help="z_up, y_up, or directions of x, y, z such as right,up,forward")
    ] = None,
    rate: Annotated[
        float | None, typer.Option(min=0.001, help="frames per second, if the file does not have it")
    ] = None,
    point: PointsOption = None,
    mapping: MappingOption = None,
    zeros_are_places: Annotated[
        bool, typer.Option("--zeros-are-places", help="a point at exactly (0, 0, 0) was not lost")
    ] = False,
    repeats_are_places: Annotated[
        bool, typer.Option("--repeats-are-places", help="a point that repeats its position exactly was not lost")
    ] = False,
    action: LabelActionOption = None,
    theta: ThetaOption = "",
    parameters: ParametersOption = None,
    subject: LabelSubjectOption = "",
    repetition: Annotated[int | None, typer.Option(min=0, help="of the first file (default: counted on)")] = None,
    side: Annotated[Literal["right", "left"], typer.Option(help="which arm moves")] = "right",
    find: Annotated[
        str | None, typer.Option("--find", metavar="POINT", help="label each movement of POINT, by its speed")
    ] = None,
    max_gap: Annotated[
        float, typer.Option(min=0.0, max=1.0, help="s; movements with longer losses of a point are rejected")
    ] = 0.1,
    skip_refused: Annotated[bool, typer.Option("--skip-refused", help="import the rest")] = False,
    name: Annotated[str | None, typer.Option(help="of the recording (default: the file's)")] = None,
    add: Annotated[bool, typer.Option("--add", help="to a set that is there already")] = False,
) -> None:
    """Import files of motion capture into a demonstration set.

    Everything is brought to metres, x forward, y left, z up. Theta is given in the same. A file without labels is
    labelled with --action as a whole, or with --find movement by movement; without --action it stays unlabelled.

    Exit codes: 0; 2 wrong arguments; 66 a file is missing; 78 a file or a movement in it cannot be used.
    """
    from paramove.demonstrations import Label
    from paramove.demonstrations.importing import import_file

    values = numbers(theta, "--theta")
    given = words(parameters)
    label = None if action is None else Label(0, 0, action, values, subject, repetition or 0, side)
    if find is not None and label is None:
        raise typer.BadParameter("--find needs an --action", param_hint="--find")
    with one_line():
        options = replace(
            import_options(mapping, unit, axes, rate, point, zeros_are_places, repeats_are_places), subject=subject
        )
        results = []
        for file in files:
            _announce(f"reading {printable(str(file))}", file.stat().st_size if file.is_file() else 0)
            results.append(import_file(file, options, label, max_gap, name, find))
        _reject(results, skip_refused)
        names = given if given is not None else results[0].parameter_names or _names_of(values)
        _write(to, results, names, max_gap, repetition, add)


def _announce(doing: str, n_bytes: float) -> None:
    """Names a step that takes more than a moment."""
    if n_bytes > MANY_BYTES:
        typer.echo(f"{doing} ({1e-6 * n_bytes:.0f} MB) ...", err=True)


def _names_of(values: tuple[float, ...]) -> tuple[str, ...]:
    if len(values) == 3:
        return ("target_x", "target_y", "target_z")
    return tuple(f"parameter_{number}" for number in range(1, len(values) + 1))


def import_options(
    mapping: Path | None,
    unit: str | None,
    axes: str | None,
    rate: float | None,
    point: list[str] | None,
    zeros_are_places: bool = False,
    repeats_are_places: bool = False,
) -> ImportOptions:
    """The mapping file's options, overlaid with those of the command line."""
    from paramove.demonstrations.importing import ImportOptions, axes_matrix, read_mapping_file

    options = read_mapping_file(mapping) if mapping is not None else ImportOptions()
    points = dict(options.points or {})
    for text in point or ():
        name, equals, markers = text.partition("=")
        if not (equals and name.strip() and words(markers)):
            raise typer.BadParameter(f"expected such as index=RFIN, found {text!r}", param_hint="--point")
        points[name.strip()] = words(markers) or ()
    if axes is not None:
        axes_matrix(axes)
    return replace(
        options,
        unit=unit or options.unit,
        axes=axes or options.axes,
        rate_hz=rate or options.rate_hz,
        points=points or None,
        zeros_are_lost=options.zeros_are_lost and not zeros_are_places,
        repeats_are_lost=options.repeats_are_lost and not repeats_are_places,
    )


def _reject(results: list[Imported], skip_refused: bool) -> None:
    """Ends the command, with all remarks, if a movement was rejected, unless the rest is to be imported."""
    rejected = [line for result in results for line in result.rejected]
    if rejected and not skip_refused:
        _print_remarks(results, err=True)
        hint = "nothing was imported; --skip-refused imports the rest, --max-gap fills longer losses"
        raise ended("\n".join([*rejected, hint]), exit_codes.CONFIGURATION)
    for line in rejected:
        typer.echo(f"left out: {line}", err=True)


def _print_remarks(results: list[Imported], *, err: bool = False) -> None:
    for result in results:
        for remark in result.remarks:
            typer.echo(printable(remark), err=err)


def _write(
    to: Path, results: list[Imported], names: tuple[str, ...], max_gap: float, repetition: int | None, add: bool
) -> None:
    from paramove.demonstrations import FILE_NAME, load_labels, write_set

    there: dict[tuple[object, ...], int] = {}
    if add and repetition is None and (to / FILE_NAME).exists():
        for segment in load_labels(to / FILE_NAME).file.segments:
            key: tuple[object, ...] = (segment.action, tuple(segment.theta), segment.subject, segment.side)
            there[key] = max(there.get(key, -1), segment.repetition)
    takes = []
    for result in results:
        for take in result.takes:
            labels = take.labels if result.parameter_names else _counted(take.labels, there)
            takes.append(replace(take, labels=labels))
    _announce(f"writing {to}", sum(take.positions.nbytes for take in takes))
    write_set(to, takes, names, max_gap=max_gap, add=add)
    _print_remarks(results)
    _print_oddities(to)
    count = sum(len(take.labels) for take in takes)
    recordings = len({take.recording for take in takes})
    typer.echo(f"{to}: {count} movements in {recordings} recording{'' if recordings == 1 else 's'}")
    if not count:
        typer.echo(f"nothing is labelled yet: paramove demos label {to} --recording {takes[0].recording} --help")


def _print_oddities(to: Path) -> None:
    """Names what hardly fits in the set as it is now; a set that cannot be read is reported by those who read it."""
    from paramove.demonstrations import DemonstrationError, DemonstrationSet, oddities

    try:
        movements = DemonstrationSet.load(to)
    except DemonstrationError:
        return
    for oddity in oddities(movements):
        typer.echo(f"warning: {printable(oddity.message)}", err=True)


def _counted(labels: tuple[Label, ...], there: dict[tuple[object, ...], int]) -> tuple[Label, ...]:
    """Labels whose repetitions continue the existing ones; `there` is updated."""
    result = []
    for label in labels:
        key = (label.action, label.theta, label.subject, label.side)
        there[key] = there.get(key, label.repetition - 1) + 1
        result.append(replace(label, repetition=there[key]))
    return tuple(result)
