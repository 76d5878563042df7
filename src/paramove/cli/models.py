"""`paramove models`: movement models listed, shown, drawn and compared."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from paramove.cli.movement_options import (
    ModelArgument,
    PointOption,
    SetArgument,
    SubjectOption,
    files_below,
    loaded,
    model_files,
)
from paramove.cli.output import JsonOption, ended, list_of, one_line, table_of
from paramove.documents import InputError, exit_codes, printable

if TYPE_CHECKING:
    from paramove.phmm import ParametricHMM

app = typer.Typer(name="models", help="List, show, plot and compare movement models.", no_args_is_help=True)


@app.command("list")
def list_models(
    folder: Annotated[Path, typer.Argument(help="where to look, three levels deep")] = Path(),
    as_json: JsonOption = False,
) -> None:
    """List the movement models in a folder.

    Exit codes: 0; 66 there is none; 78 one is damaged, which is reported.
    """
    from paramove.phmm import INDEX_FILE

    files = [file for file in files_below(folder, "*.npz") if file.name != INDEX_FILE and _is_model(file)]
    if not files:
        raise ended(f"no movement model in {folder}; `paramove train` makes one", exit_codes.INPUT_MISSING)
    list_of(files, _row, as_json)


def _is_model(file: Path) -> bool:
    """Whether an .npz calls itself a model; others, such as recordings, are ignored."""
    from paramove.documents import read_arrays

    names = {"format_version", "header"}
    try:
        return names == read_arrays(file, only=names).keys()
    except InputError:
        return True  # damaged: to be reported


def _row(file: Path) -> dict[str, Any]:
    from paramove.phmm import ParametricHMM
    from paramove.training import kind_of, parameter_names

    model = ParametricHMM.load(file)
    about = model.description
    return {
        "file": str(file),
        "action": about.action if about else "",
        "model": kind_of(model),
        "parameters": list(parameter_names(model)),
        "points": len(about.point_names) if about else 0,
        "states": model.n_states,
        "sequences": model.training_.n_sequences if model.training_ else None,
    }


@app.command()
def show(file: ModelArgument, as_json: JsonOption = False) -> None:
    """Show what a model file holds, and how it was trained.

    Exit codes: 0; 66 there is no such file; 78 it is damaged or no model.
    """
    with one_line():
        facts = _facts(file, loaded(file))
    if as_json:
        typer.echo(json.dumps(facts, indent=2, ensure_ascii=False))
        return
    for name, value in _lines(facts):
        typer.echo(f"{name + ':':<23}{printable(value)}")


def _facts(file: Path, model: ParametricHMM) -> dict[str, Any]:
    from paramove.phmm import MovementDescription
    from paramove.training import bounds, checksum, dimension, kind_of, parameter_names, state_seconds, training_facts

    about = model.description or MovementDescription()
    low_high = bounds(model)
    seconds, _, unit = state_seconds(model, low_high.mean(axis=0))
    if file.is_dir():
        file = model_files(file)[0]
    summary = model.training_
    return {
        "file": str(file),
        "sha256": checksum(file),
        "model": kind_of(model),
        "action": about.action,
        "points": list(about.point_names),
        "components": dimension(model),
        "unit": about.unit,
        "frame": about.frame,
        "parameters": {
            name: [float(low), float(high)]
            for name, low, high in zip(parameter_names(model), *low_high, strict=True)
        },
        "states": model.n_states,
        "frames_per_state": [model.d_min_, model.d_max_],
        "resampled_frames": model.resampled_frames_,
        "state_durations": seconds.tolist(),
        "state_durations_unit": unit,
        "duration_s": about.duration or None,
        "rate_hz": about.rate_hz or None,
        "source": about.source or None,
        "training": None if summary is None else {
            "sequences": summary.n_sequences,
            "frames": summary.n_frames,
            "iterations": len(summary.log_likelihoods),
            "converged": summary.converged,
            "log_likelihood_per_frame": summary.log_likelihoods[-1] / summary.n_frames,
        },
        "left_out": (training_facts(file) or {}).get("left_out"),
    }  # fmt: skip


def _lines(facts: dict[str, Any]) -> list[tuple[str, str]]:
    from paramove.training import cross_validation_rows, with_unit

    low_high = [f"{with_unit(name)}: {low:.4g} to {high:.4g}" for name, (low, high) in facts["parameters"].items()]
    minimum, maximum = facts["frames_per_state"]
    frames = facts["resampled_frames"]
    times = facts["state_durations"]
    rows = [
        ("file", facts["file"]),
        ("sha256", facts["sha256"]),
        ("model", facts["model"]),
        ("action", facts["action"]),
        ("points", ", ".join(facts["points"]) or f"not named; {facts['components']} components"),
        ("unit, frame", f"{facts['unit']}, {facts['frame']}"),
        ("parameters", "; ".join(low_high)),
        ("states", f"{facts['states']} of {minimum} to {maximum} frames"
         + (f"; every movement is brought to {frames} frames" if frames else "")),
        ("time in a state", f"{min(times):.3g} to {max(times):.3g} {facts['state_durations_unit']}"),
    ]  # fmt: skip
    if facts["duration_s"]:
        rate = f", recorded at {facts['rate_hz']:g} Hz" if facts["rate_hz"] else ""
        rows.append(("movements last", f"{facts['duration_s']:.3g} s{rate}"))
    rows.append(("source", facts["source"] or "–"))
    training = facts["training"]
    if training:
        how = "converged" if training["converged"] else "not yet converged"
        rows.append((
            "training",
            f"{training['sequences']} sequences, {training['iterations']} iterations, {how}, log-likelihood "
            f"{training['log_likelihood_per_frame']:.2f} per frame",
        ))  # fmt: skip
    return rows + (cross_validation_rows(facts["left_out"]) if facts["left_out"] else [])


@app.command()
def plot(
    file: ModelArgument,
    output: Annotated[Path, typer.Option(metavar="FILE", help="a .png, .svg, .pdf or .html")] = Path("model.png"),
    point: PointOption = None,
) -> None:
    """Draw what a model knows: its movements for a grid of theta, their scatter, durations, where theta is visible.

    Exit codes: 0; 66 there is no such file; 78 it is damaged, or has no such point.
    """
    from paramove.demonstrations import write_plot
    from paramove.training import plot_model, title_of

    with one_line():
        model = loaded(file)
        write_plot(plot_model(model, point), output, title_of(model))
    typer.echo(str(output))


@app.command()
def adapt(
    file: ModelArgument,
    folder: SetArgument,
    out: Annotated[Path, typer.Option(metavar="FILE", help="file of the person's model, .npz")],
    subject: SubjectOption = None,
    labels: Annotated[
        bool, typer.Option(help="use the theta of the set; without, only what is synthesized adapts")
    ] = True,
) -> None:
    """Adapt a model of other persons to a person: about three movements of the model's action suffice.

    Exit codes: 0; 66 a file or the set is missing; 78 one is damaged, or movements, persons or theta do not fit.
    """
    from paramove.demonstrations import DemonstrationError, DemonstrationSet
    from paramove.phmm import MovementClassifier
    from paramove.training import Examiner, parameter_names

    with one_line():
        model = loaded(file)
        action = model.description.action if model.description else None
        chosen = DemonstrationSet.load(folder).select(action, subject)
        if len(chosen.subjects) > 1:
            raise DemonstrationError(
                f"a model is adapted to one person; {folder} has {', '.join(chosen.subjects)}: --subject chooses one"
            )
        examiner = Examiner(MovementClassifier.from_models({action or file.stem: model}))
        recognitions = [examiner.examine(movement) for movement in chosen]
        theta = [one.labelled for one in recognitions if one.labelled is not None] if labels else None
        if theta is not None and len(theta) < len(recognitions):
            raise DemonstrationError(
                f"{folder}: the model has the parameters {', '.join(parameter_names(model))}, the set has "
                f"{', '.join(chosen.parameter_names) or 'none'}; --no-labels adapts what is synthesized alone"
            )
        model.adapt([one.movement.frames for one in recognitions], theta).save(out)
    typer.echo(f"{out}: adapted to {chosen.subjects[0] or 'a person'} by {len(recognitions)} movements")


@app.command()
def compare(
    files: Annotated[list[Path], typer.Argument(metavar="FILE FILE...", help="files of movement models")],
    on: Annotated[
        Path | None, typer.Option("--on", metavar="SET", help="which explains these demonstrations better")
    ] = None,
    as_json: JsonOption = False,
) -> None:
    """Compare models: their training, how far apart their movements are, and how well they explain a set.

    Exit codes: 0; 2 fewer than two; 66 a file is missing; 78 one is damaged, or they have other points or parameters.
    """
    from paramove.demonstrations import DemonstrationSet
    from paramove.training import on_set, table_of_distances

    if len(files) < 2:
        raise typer.BadParameter("give at least two files", param_hint="FILE FILE...")
    with one_line():
        models = [loaded(file) for file in files]
        facts = [_facts(file, model) for file, model in zip(files, models, strict=True)]
        distances = table_of_distances(models)
        demonstrations = None if on is None else DemonstrationSet.load(on)
        explained = None if demonstrations is None else [on_set(model, demonstrations) for model in models]
    if as_json:
        text = {"models": facts, "distances": distances, "on": explained}
        typer.echo(json.dumps(text, indent=2, ensure_ascii=False))
        return
    _tell(files, facts, distances, explained)


def _tell(
    files: list[Path],
    facts: list[dict[str, Any]],
    distances: list[list[dict[str, float]]],
    explained: list[dict[str, Any]] | None,
) -> None:
    letters = [chr(ord("A") + number) if number < 26 else str(number) for number in range(len(files))]
    lines = [dict(_lines(one)) for one in facts]
    names = [name for name in lines[0] if name not in ("sha256", "file") and all(name in line for line in lines)]
    for letter, file in zip(letters, files, strict=True):
        typer.echo(f"{letter}: {file}")
    typer.echo()
    same = [name for name in names if len({line[name] for line in lines}) == 1]
    for name in names:
        for letter, line in zip(["same"] if name in same else letters, lines, strict=False):
            typer.echo(f"{name:<22}{letter:<6}{printable(line[name])}")
    typer.echo("\ndistance of their movements over the theta of both: root mean square (largest), cm")
    table_of([
        {"": letter} | {
            other: "–" if one is two else f"{100 * cell['rms_m']:.2f} ({100 * cell['greatest_m']:.1f})"
            for two, (other, cell) in enumerate(zip(letters, row, strict=True))
        }
        for one, (letter, row) in enumerate(zip(letters, distances, strict=True))
    ])  # fmt: skip
    if explained is not None:
        typer.echo("\non the set")
        table_of([
            {"": letter, "movements": one["movements"], "log-likelihood per frame": one["log_likelihood_per_frame"]}
            | {f"{name}, RMS error": value for name, value in one["theta_rms"].items()}
            | {"regions that hold the label, %": 100 * one["theta_covered"],
               "synthesis, cm": 100 * one["synthesis_median_m"]}
            for letter, one in zip(letters, explained, strict=True)
        ])  # fmt: skip
