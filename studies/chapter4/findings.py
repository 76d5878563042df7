"""What the thesis observed in chapter 4, what is observed here, and whether they agree."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, Literal, NamedTuple

import numpy as np

from paramove.documents import Floats
from studies.chapter4.kinds import IPHMM_2, IPHMM_3, LPHMM_2, LPHMM_3
from studies.chapter4.line_movement import THESIS_TRAINING_S

Verdict = Literal["yes", "in part", "no"]

THESIS_CLASSIFICATION = {
    (20, IPHMM_2): 0.9286,
    (20, LPHMM_2): 0.9000,
    (20, IPHMM_3): 0.9786,
    (20, LPHMM_3): 0.8821,
    (40, IPHMM_2): 0.9429,
    (40, LPHMM_2): 0.8929,
    (40, IPHMM_3): 0.9821,
    (40, LPHMM_3): 0.8643,
}
"""Table 4.1."""
THESIS_VARIATION = {
    "pairs at the centre": 2.3,
    "their deviation": 0.4,
    "pairs at the worst corner": 3.5,
    "deviation there": 1.3,
    "miss at the centre": 0.8,
}
"""Sections 4.2.4 and 4.2.5, cm."""
NOISE_CM = "15"


class Finding(NamedTuple):
    """Where, what the thesis reports, what is observed here, and whether they agree."""

    where: str
    thesis: str
    seen: str
    verdict: Verdict


def findings_of(
    summary: Mapping[str, Any], surfaces: Mapping[str, Floats], likeliest: Mapping[str, Any]
) -> list[Finding]:
    """All findings.

    Args:
        summary: of `summarised`. surfaces: synthesis errors by path "linear" of models with the fewest states, (7, 5).
        likeliest: theta of figure 4.15, by name.
    """
    states = min(row["states"] for row in summary["models"])
    rows = {row["name"]: row for row in summary["models"] if row["states"] == states}
    return [
        *_line(summary["line"]),
        _fit(summary["fit to averages"]),
        *_synthesis(surfaces),
        _recognition(rows),
        _one_maximum(likeliest),
        _noise(summary["noise"]),
        _classification(summary),
        _variation(summary["variation"]),
        _redirect(summary["redirect"]),
    ]


def _verdict(*held: bool) -> Verdict:
    return "yes" if all(held) else "in part" if any(held) else "no"


def _line(line: Mapping[str, Any]) -> list[Finding]:
    off = {number: 100.0 * line[f"distance_{number}"].mean for number in ("4.3", "4.4", "4.5", "4.6")}
    seconds = line["training, s"].mean
    return [
        Finding(
            "figures 4.3, 4.4",
            "21 states: very similar to the true movement; 6 states: only coarsely",
            f"farthest from the true curve: {off['4.3']:.0f} % of the bound with 21 states, {off['4.4']:.0f} % with 6",
            _verdict(off["4.3"] < 10.0, off["4.4"] > 2.0 * off["4.3"]),
        ),
        Finding(
            "figures 4.5, 4.6",
            "30 states: slightly distorted by the different progression rates, not where these are equal",
            f"{off['4.5']:.0f} % of the bound with different rates, {off['4.6']:.0f} % with equal ones",
            _verdict(off["4.5"] > 1.2 * off["4.6"]),
        ),
        Finding(
            "training time, 4.1.1 (a timing)",
            f"21 states, 10 sequences, 10 iterations: {THESIS_TRAINING_S:.0f} s on a 2.4 GHz Core 2",
            f"{1000.0 * seconds:.0f} ms, {THESIS_TRAINING_S / seconds:.0f} times faster",
            _verdict(seconds < THESIS_TRAINING_S),
        ),
    ]


def _fit(errors: Mapping[str, Any]) -> Finding:
    linear, quadratic = errors["LPHMM"].mean, errors["QPHMM"].mean
    return Finding(
        "figure 4.11",
        "trained on the 35 averages, a QPHMM misses them by about 1 cm everywhere, an LPHMM by more almost everywhere",
        f"QPHMM {quadratic:.2f} cm, LPHMM {linear:.2f} cm",
        _verdict(quadratic < 1.2, linear > 1.2 * quadratic),
    )


def _synthesis(surfaces: Mapping[str, Floats]) -> list[Finding]:
    inner = {name: float(np.nanmean(values[1:-1, 1:-1])) for name, values in surfaces.items()}
    three = surfaces[IPHMM_3]
    corners = three[[0, 0, -1, -1], [0, -1, 0, -1]]
    findings = [
        Finding(
            "figure 4.14 b",
            "synthesis of the 3×3 IPHMM: 1.1 cm at the centre, 1.5 to 2.5 cm at the corners",
            f"{three[3, 2]:.1f} cm at the centre, {corners.min():.1f} to {corners.max():.1f} cm at the corners",
            _verdict(abs(three[3, 2] - 1.1) < 0.4, bool(corners.min() > 1.0 and corners.max() < 3.0)),
        )
    ]
    if LPHMM_3 in inner and IPHMM_2 in inner:
        order = inner[IPHMM_3] < inner[LPHMM_3] < inner[IPHMM_2]
        findings.append(
            Finding(
                "figure 4.14 a, d",
                "within the region: 2×2 IPHMM up to 3.5 cm, 3×3 LPHMM about 2.5 cm, 3×3 IPHMM best",
                f"mean within: {inner[IPHMM_2]:.1f}, {inner[LPHMM_3]:.1f} and {inner[IPHMM_3]:.1f} cm",
                _verdict(order, abs(inner[LPHMM_3] - 2.5) < 0.7, inner[IPHMM_2] < 3.5),
            )
        )
    return findings


def _recognition(rows: Mapping[str, Any]) -> Finding:
    three, linear, two = (rows[name]["theta_pointing"].mean for name in (IPHMM_3, LPHMM_3, IPHMM_2))
    detail = f"means {three:.1f}, {linear:.1f} and {two:.1f} cm"
    if two < 2.0:
        detail += ": even the one that has seen only the corners is no worse than the thesis's best"
    return Finding(
        "figure 4.14 e–h",
        "error of θ: 3×3 IPHMM and LPHMM not above 2 cm, 2×2 IPHMM 3.5 cm at the centre, up to 4.4 cm",
        detail,
        _verdict(max(three, linear) < 2.0, two > 3.0),
    )


def _one_maximum(likeliest: Mapping[str, Any]) -> Finding:
    off = {name: float(np.linalg.norm((np.array(theta) - 0.5) * (80.0, 30.0))) for name, theta in likeliest.items()}
    detail = ", ".join(f"{name} {value:.1f} cm" for name, value in off.items())
    return Finding(
        "figure 4.15",
        "the likelihood has one maximum, close to the true place",
        f"its maximum is off by: {detail}",
        _verdict(max(off.values()) < 3.0),
    )


def _noise(errors: Mapping[str, Any]) -> Finding:
    growth = {name: values[NOISE_CM].mean - values["0"].mean for name, values in errors.items()}
    detail = "; ".join(
        f"{name} {values['0'].mean:.1f} → {values[NOISE_CM].mean:.1f} cm" for name, values in errors.items()
    )
    return Finding(
        "noise, 4.2.5",
        "no significant influence on θ of independent noise below σ = 15 cm",
        f"with σ = {NOISE_CM} cm: {detail}",
        _verdict(*(value < 1.0 for value in growth.values())),
    )


def _classification(summary: Mapping[str, Any]) -> Finding:
    rates = {(row["states"], row["name"]): row["correct"].mean for row in summary["models"]}
    common = [key for key in THESIS_CLASSIFICATION if key in rates] or list(rates)
    difference = max(rates[key] for key in common) - min(rates[key] for key in common)
    plain, peer = summary["classification"]["plain HMM"], summary["classification"]["hmmlearn"]
    detail = f"all between {min(rates.values()):.3f} and {max(rates.values()):.3f}"
    if difference < 0.02:
        detail += ": the thesis's order of models does not appear"
    if plain is not None:
        detail += f". One HMM per action with full covariances and no parameter: {plain.mean:.3f}"
    if peer is not None:
        detail += f"; hmmlearn's with diagonal ones: {peer.mean:.3f}"
    if plain is not None and plain.mean > max(rates.values()) - 0.02:
        detail += ". The full covariances of the hand's points decide, not the parameter"
    return Finding(
        "table 4.1",
        "right of 280: IPHMM up to 0.982 (3×3), LPHMM 0.864 to 0.900",
        detail,
        _verdict(max(rates.values()) >= 0.95, difference > 0.05),
    )


def _variation(variation: Mapping[str, Any]) -> Finding:
    close = [abs(variation[name].mean - value) < 0.5 for name, value in THESIS_VARIATION.items()]
    detail = ", ".join(f"{name} {variation[name].mean:.1f} cm ({value:g})" for name, value in THESIS_VARIATION.items())
    return Finding("natural variation", "in brackets, 4.2.4 and 4.2.5", detail, _verdict(*close))


def _redirect(rows: Sequence[Mapping[str, Any]]) -> Finding:
    linear = [row for row in rows if row["model"] == "linear"]
    best = next((row for row in linear if row["training"].startswith("16 corner pairs, from")), linear[0])
    misses = max(best["start_miss"].mean, best["end_miss"].mean)
    return Finding(
        "redirect action, 4.3",
        "a linear PHMM of movements blended from a model reaches both places (one picture)",
        f"{best['model']}, {best['training']}: misses the places by {misses:.1f} cm, error {best['error'].mean:.1f} cm",
        _verdict(misses < 1.0),
    )
