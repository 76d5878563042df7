"""`paramove recognize`: the action of a movement, its parameters and their uncertainty."""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import numpy as np
import typer
from rich.console import Console
from rich.progress import track

from paramove.cli import demos_import
from paramove.cli.movement_options import ModelsOption, PlotOption, classifier_of
from paramove.cli.output import JsonOption, ended, one_line, table_of
from paramove.demonstrations import DemonstrationError, Movement
from paramove.documents import exit_codes, printable

if TYPE_CHECKING:
    from paramove.demonstrations import Take
    from paramove.demonstrations.importing import ImportOptions
    from paramove.training import Recognition

MAX_GAP_S = 0.1

app = typer.Typer(add_completion=False)


@app.command()
def recognize(
    source: Annotated[
        Path, typer.Argument(metavar="FILE|SET", help="recording .mcap, C3D, BVH, CSV, NPZ, or a demonstration set")
    ],
    model: ModelsOption,
    unfinished: Annotated[
        bool, typer.Option("--unfinished", help="it is the beginning of a movement: predict the rest")
    ] = False,
    find: Annotated[
        str | None, typer.Option("--find", metavar="POINT", help="each movement of POINT, by its speed")
    ] = None,
    mapping: demos_import.MappingOption = None,
    unit: Annotated[str | None, typer.Option(help="m, cm or mm, if the file does not have it")] = None,
    axes: Annotated[str | None, typer.Option(help="as in `paramove demos import`")] = None,
    rate: Annotated[
        float | None, typer.Option(min=0.001, help="frames per second, if the file does not have it")
    ] = None,
    point: demos_import.PointsOption = None,
    plot: PlotOption = None,
    as_json: JsonOption = False,
) -> None:
    """Recognize the action of a movement and its parameters; of several models, the one that explains it best.

    Theta comes with the region that holds it in 95 % of the cases. A movement with a p-value below 1 % is rejected
    as none of the known actions.

    Exit codes: 0, also for an unknown action; 66 a file is missing; 78 a file or the movement cannot be used.
    """
    from paramove.training import Examiner

    if unit not in (None, "m", "cm", "mm"):
        raise typer.BadParameter(f"expected m, cm or mm, found {unit!r}", param_hint="--unit")
    with one_line():
        examiner = Examiner(classifier_of(model))
        options = demos_import.import_options(mapping, unit, axes, rate, point)
        movements = movements_of(source, options, find)
        console = Console(stderr=True, highlight=False, emoji=False)
        many = len(movements) > 20
        try:
            recognitions = [
                examiner.examine(movement, finished=not unfinished)
                for movement in track(movements, "movements", console=console, transient=True, disable=not many)
            ]
        except KeyboardInterrupt:
            raise ended("interrupted", exit_codes.CTRL_C) from None
        if plot is not None:
            from paramove.demonstrations import write_plot
            from paramove.training import plot_recognition

            write_plot(
                plot_recognition(examiner.models, recognitions), plot, f"{source.name}: {len(recognitions)} movements"
            )
    _print(recognitions, as_json)
    if plot is not None and not as_json:
        typer.echo(str(plot))


def _print(recognitions: list[Recognition], as_json: bool) -> None:
    from paramove.training import confusion

    facts = [one.facts() for one in recognitions]
    table = confusion(recognitions)
    if as_json:
        typer.echo(json.dumps({"movements": facts, "confusion": table or None}, indent=2, ensure_ascii=False))
    elif len(facts) == 1:
        for name, value in _lines(facts[0], recognitions[0]):
            typer.echo(f"{name + ':':<16}{printable(value)}")
    else:
        table_of([_row(number, one) for number, one in enumerate(facts)])
        _summary(recognitions, table)


def _lines(facts: dict[str, Any], recognition: Recognition) -> list[tuple[str, str]]:
    """One movement, in words."""
    from paramove.training import percent, with_unit

    others = sorted(facts["posterior"].items(), key=lambda item: -item[1])
    rows = [("movement", f"{facts['movement']} ({facts['seconds']:.3g} s)")]
    if recognition.known and len(others) == 1:
        rows.append(("action", f"{recognition.action}, the only one that was asked"))
    elif recognition.known:
        rows.append(("action", ", ".join(f"{name} {percent(probability)}" for name, probability in others[:4])))
    else:
        rows.append(("action", f"none of the known ones; the nearest is {recognition.action}"))
    rows += [
        (with_unit(name), f"{value:.4g} ± {facts['theta_region_95'][name]:.2g} (95 %)")
        for name, value in facts["theta"].items()
    ]
    if recognition.outside:
        rows.append(("beware", f"{', '.join(recognition.outside)} outside what the model was trained with"))
    rows += [("beware", remark) for remark in recognition.remarks]
    p_value = (
        "unknown: of this model, or of a single demonstration, there is none"
        if recognition.p_value is None
        else percent(recognition.p_value)
    )
    rows += [("p-value", p_value), ("log-likelihood", f"{facts['log_likelihood']:.1f}")]
    if "labelled_action" in facts:
        rows.append(("labelled", facts["labelled_action"]))
    if recognition.labelled is not None:
        label = ", ".join(f"{value:.4g}" for value in recognition.labelled)
        inside = "inside" if facts["labelled_theta_in_region"] else "outside"
        rows.append(("labelled theta", f"{label}: {inside} the region"))
    return rows


def _row(number: int, facts: dict[str, Any]) -> dict[str, Any]:
    """One of many movements, as a line of the table."""
    from paramove.training import percent

    row: dict[str, Any] = {"": number, "action": facts["action"] or "none"}
    if len(facts["posterior"]) > 1:
        row["posterior"] = percent(facts["posterior"][facts["most_probable_action"]])
    for name, value in facts["theta"].items():
        row[name] = f"{value:.3f} ± {facts['theta_region_95'][name]:.2g}"
    row["p-value"] = None if facts["p_value"] is None else percent(facts["p_value"])
    row["log-likelihood"] = facts["log_likelihood"]
    if "labelled_action" in facts:
        row["labelled"] = facts["labelled_action"]
    if "labelled_theta" in facts:
        row["theta"] = ", ".join(f"{value:.3f}" for value in facts["labelled_theta"])
    return row


def _summary(recognitions: list[Recognition], table: dict[str, dict[str, int]]) -> None:
    import numpy as np

    if table:
        taken = [*sorted({name for row in table.values() for name in row} - {"none"}), "none"]
        typer.echo("\nlabelled (row), taken for (column)")
        table_of([{"": name} | {other: row.get(other, 0) for other in taken} for name, row in sorted(table.items())])
        right = sum(row.get(name, 0) for name, row in table.items())
        typer.echo(f"{right} of {sum(sum(row.values()) for row in table.values())} right")
    labelled = [one for one in recognitions if one.labelled is not None and one.action == one.movement.action]
    if labelled:
        errors = np.stack([one.estimate.theta - one.labelled for one in labelled if one.labelled is not None])
        rms = np.sqrt((errors**2).mean(axis=0))
        inside = sum(bool(one.facts()["labelled_theta_in_region"]) for one in labelled)
        names = labelled[0].parameter_names
        rms_text = ", ".join(f"{name} {value:.3g}" for name, value in zip(names, rms, strict=True))
        typer.echo(f"error of theta, RMS: {rms_text}; {inside} of {len(labelled)} labels lie in the 95 % region")


def movements_of(path: Path, options: ImportOptions, find: str | None = None) -> list[Movement]:
    """All movements of a file or folder.

    Args:
        path: a demonstration set; a recording with its labels next to it; C3D, BVH, CSV or NPZ.
        options: what a file of motion capture does not contain.
        find: body point: every movement of it, by its speed. None: the labelled ones, else all frames as one.

    Raises DemonstrationError if nothing is there or it cannot be used.
    """
    from paramove.demonstrations import DemonstrationSet
    from paramove.demonstrations.importing import import_file

    if path.is_dir():
        return list(DemonstrationSet.load(path))
    if path.suffix in (".mcap", ".part"):
        return _recorded(path, find)
    takes = import_file(path, options, max_gap=MAX_GAP_S)
    if takes.rejected:
        raise DemonstrationError("; ".join(takes.rejected))
    return [movement for take in takes.takes for movement in _of_take(take, takes.parameter_names, path, find)]


def _recorded(path: Path, find: str | None) -> list[Movement]:
    from paramove.demonstrations import FILE_NAME, DemonstrationSet, Take, read_poses

    poses = read_poses(path)
    if find is None and (path.parent / FILE_NAME).is_file():
        labelled = [one for one in DemonstrationSet.load(path.parent) if one.recording == path.name]
        if labelled:
            return labelled
    take = Take(path.name, poses.time, poses.positions, poses.point_names, poses.frame)
    return list(_of_take(take, (), path, find))


def _of_take(take: Take, parameter_names: tuple[str, ...], path: Path, find: str | None) -> Iterator[Movement]:
    """Its labelled movements, those found by speed, or all of it."""
    from paramove.demonstrations import Label, fill_gaps, movements_by_speed

    if find is not None:
        spans = movements_by_speed(take.time, take.positions, take.point_names, find, MAX_GAP_S)
        if not spans:
            raise DemonstrationError(f"{path}: {find} never exceeds 15 cm/s: no movement found; check the unit")
        labels = [Label(first, end, "") for first, end in spans]
    else:
        labels = list(take.labels) or [Label(0, len(take.time), "")]
    filled, _, left = fill_gaps(take.time, take.positions, take.point_names, MAX_GAP_S)
    for label in labels:
        gaps = [gap for gap in left if gap.end > label.first and gap.first < label.end]
        if gaps:
            raise DemonstrationError(
                f"{path}: lost for longer than {MAX_GAP_S:g} s: {'; '.join(map(str, gaps[:4]))}; import it with "
                "`paramove demos import --max-gap`, or leave the point out with --point"
            )
        time = take.time[label.first : label.end]
        named = parameter_names if len(label.theta) == len(parameter_names) else ()
        yield Movement(
            time=time - time[:1],
            positions=filled[label.first : label.end],
            point_names=take.point_names,
            frame=take.frame,
            action=label.action,
            theta=np.array(label.theta if named else (), dtype=np.float64),
            parameter_names=named,
            subject=label.subject,
            side=label.side,
            recording=take.recording,
            source=f"{path}, {take.time[label.first]:.4g} to {take.time[label.end - 1]:.4g} s",
        )
