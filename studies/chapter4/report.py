"""The report on thesis chapter 4: one HTML file that needs no other, and its numbers as JSON."""

from __future__ import annotations

import json
from functools import partial
from html import escape
from pathlib import Path
from typing import Any

import numpy as np

from paramove.documents import report_page, section
from studies.chapter4 import drawing
from studies.chapter4.experiments import LINE, MODELS, SURFACES
from studies.chapter4.findings import findings_of
from studies.chapter4.kinds import IPHMM_3, QPHMM_3
from studies.chapter4.line_movement import FIGURES
from studies.chapter4.summary import Interval, Results, of_group, summarised, surface
from studies.chapter4.tables import (
    findings_table,
    learning_table,
    models_table,
    redirect_table,
    rejection_table,
    targets_table,
    variation_table,
)
from studies.chapter4.targets import Target, targets_of

NOT_SHOWN = (
    "Figures 4.1, 4.7, 4.8, 4.10, 4.16 and 4.17 are photographs of a person and pictures of the motion capture; 4.9 "
    "shows Gaussians in space. They are not repeated."
)
DATA = (
    "The movements are those of the synthetic demonstrator, not of the thesis's person: 7 body points, 60 Hz, a region "
    "of 80 × 30 cm; trained on 3 × 3 targets 10 times, tested on 7 × 5 targets 4 times, both actions. In brackets the "
    "interval that holds the mean of all seeds with 95 % (Student's t)."
)
RESIDUALS = (
    "“Correlated” models learn how whole movements vary and weight a frame only by the new information in it; the "
    "others take frames for independent, as the thesis does. Rows “2×2” are trained on the four corners only."
)


def write_results(results: Results, folder: Path) -> tuple[dict[str, Any], list[Target]]:
    """Write `report.html` and `chapter4.json` into the folder. Returns the numbers and the targets."""
    folder.mkdir(parents=True, exist_ok=True)
    summary = summarised(results)
    targets = targets_of(summary)
    likeliest = of_group(results, SURFACES)[0]
    findings = findings_of(summary, _surfaces(results, "linear_pointing"), likeliest["estimates"])
    numbers = plain(summary) | {
        "targets": [target._asdict() for target in targets],
        "findings": [finding._asdict() for finding in findings],
    }
    text = json.dumps(numbers, indent=2, sort_keys=True, ensure_ascii=False) + "\n"
    (folder / "chapter4.json").write_text(text, encoding="utf-8")
    met = sum(target.met for target in targets)
    parts = [
        section("Goals", "The worst model and number of states counts.", targets_table(targets)),
        section("Compared with the thesis", DATA, findings_table(findings)),
        *_pictures(results, summary),
        *_questions(results, summary, likeliest),
        section("Natural variation", "Pointing, cm.", variation_table(summary["variation"])),
        f"<section class=why>{escape(NOT_SHOWN)}</section>",
    ]
    title = "Parametric HMMs of arm movements"
    text = report_page(
        title,
        f"{title}: {met} of {len(targets)} goals met",
        f"Chapter 4 of the thesis, repeated with {_seeds(results)}.",
        parts,
        good=met == len(targets),
    )
    (folder / "report.html").write_text(text, encoding="utf-8")
    return numbers, targets


def plain(value: Any) -> Any:
    """Intervals as [mean, low, high, number of seeds, minimum, maximum of single seeds]; NaN as null."""
    if isinstance(value, Interval):
        return [None if np.isnan(one) else one for one in value]
    if isinstance(value, dict):
        return {str(key): plain(one) for key, one in value.items()}
    return [plain(one) for one in value] if isinstance(value, list) else value


def _pictures(results: Results, summary: dict[str, Any]) -> list[str]:
    line = of_group(results, LINE)[0]
    titles = {one.number: f"{one.states} states" for one in FIGURES}
    synthesis, theta = _surfaces(results, "synthesis_pointing"), _surfaces(results, "theta_pointing")
    maximum = max(float(np.nanmax(values)) for values in synthesis.values())
    rows = -(-len(synthesis) // 4)
    return [
        section(
            "A linear PHMM of the line movement (figures 4.2 to 4.6)",
            "Out along a line of slope p and back, ten sequences, 10 iterations. Grey: the true movements for "
            "p = 0.25, 0 and −0.25. 4.6: sequences with the same progression rate.",
            drawing.drawn(partial(drawing.line_states, states=line["states"]), (8.0, 3.2))
            + drawing.drawn(partial(drawing.line_curves, curves=line["curves"], titles=titles), (11.0, 2.6)),
        ),
        section("All models", RESIDUALS, models_table(summary)),
        section(
            "Synthesis error over the region (figure 4.14 a–d)",
            "Pointing, (4.3), cm, mean of all seeds; paths smooth. Below: near the person.",
            drawing.drawn(
                partial(drawing.surfaces, errors=synthesis, columns=4, maximum=maximum), (11.0, 1.9 * rows + 0.4)
            ),
        ),
        section(
            "Error of the recognised target (figure 4.14 e–h)",
            "Pointing, cm, mean of four tests and all seeds.",
            drawing.drawn(
                partial(drawing.surfaces, errors=theta, columns=4, maximum=maximum), (11.0, 1.9 * rows + 0.4)
            ),
        ),
    ]


def _questions(results: Results, summary: dict[str, Any], likeliest: dict[str, Any]) -> list[str]:
    return [
        section(
            "Expected frames per state (figures 4.12, 4.13)",
            "IPHMM 3×3 of reaching: they do not change much.",
            drawing.drawn(partial(drawing.durations, expected=_durations(results)), (11.0, 2.8)),
        ),
        section(
            "The likelihood of a target (figure 4.15)",
            f"A movement to the cross, {likeliest['states']} states; the ring is the maximum.",
            drawing.drawn(
                partial(drawing.likelihoods, values=likeliest["values"], estimates=likeliest["estimates"]), (10.0, 3.0)
            ),
        ),
        section(
            "Noise (4.2.5)",
            "Error of θ of pointing when independent noise is added to every coordinate of every frame.",
            drawing.drawn(partial(drawing.noise, errors=summary["noise"]), (9.0, 3.4)),
        ),
        section(
            "Unknown movements, and regions of θ",
            "AUROC: probability that a genuine movement fits the model better than another one. Aborted: half of the "
            "fingertip's path out, back along the same path, then at rest. Stopped: held there. "
            "Redirect: to two targets.",
            rejection_table(summary),
        ),
        section(
            "How many demonstrations",
            "Pointing; “3×3” in a name stands for the grid of the axis.",
            drawing.drawn(partial(drawing.learning, rows=summary["learning"]), (11.0, 5.6))
            + f"<details><summary>numbers</summary>{learning_table(summary['learning'])}</details>",
        ),
        section(
            "The redirect action (4.3)",
            "Tests: pairs of targets over the whole region. Jerk: of the synthesised movements, as a multiple of "
            "that of the training movements.",
            redirect_table(summary["redirect"]),
        ),
    ]


def _surfaces(results: Results, measure: str) -> dict[str, Any]:
    models = of_group(results, MODELS)
    states = min(one["states"] for one in models)
    names = dict.fromkeys(one["name"] for one in models if one["states"] == states)
    order = sorted(names, key=lambda name: (not name.startswith("IPHMM"), list(names).index(name)))
    return {name: surface(results, name, states, measure) for name in order}


def _durations(results: Results) -> dict[int, Any]:
    models = [one for one in of_group(results, MODELS) if one["name"] == IPHMM_3]
    return {states: next(one["durations"] for one in models if one["states"] == states) for states in _states(models)}


def _states(results: Results) -> list[int]:
    return sorted({one["states"] for one in results})


def _seeds(results: Results) -> str:
    seeds = sorted({one["seed"] for one in of_group(results, MODELS, name=QPHMM_3)})
    return f"seed {seeds[0]}" if len(seeds) == 1 else f"seeds {seeds[0]} to {seeds[-1]}"
