"""The measured numbers of the pages: commands make them, docs/results/ stores them, a test compares both.

Usage:
    python docs/results.py                        compares; exit code 1 if a page differs
    python docs/results.py --write                brings the pages up to date with the files
    python docs/results.py --run imitation demo   runs the commands of these results (`all`: of every one), writes the
                                                  files and brings the pages up to date

In a page, NAME is a file of docs/results/, and the path behind it leads to a value of its `numbers`:
    4.9<!--=NAME.path-->             a number is rounded to as many decimals as stand there, a word is taken as it is
    <!--=NAME.path | row | of | {format} |-->   before a table: its rows, one for each element of a list or mapping
    <!--=NAME.path-->                before a fenced block: its lines
"""

from __future__ import annotations

import argparse
import json
import os
import platform
import re
import shlex
import statistics
import string
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from datetime import UTC, datetime
from importlib.metadata import version
from pathlib import Path
from typing import Any

ROOT = Path(__file__).parent.parent
sys.path.insert(0, str(ROOT))
FOLDER = ROOT / "docs" / "results"
PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md"))]
CODE = ("src", "studies", "sim", "nodes", "launch", "robot_description", "benchmarks")
NOT_MET = 3
"""Exit code of a study that measured everything and missed a goal."""
VALUE = re.compile(r"(?P<shown>[^\s|(]+)<!--=(?P<path>[^|\n]+?)-->")
BLOCK = re.compile(r"^<!--=(?P<path>[^|\n]+?) ?(?P<row>\|.*)?-->\n(?P<head>```\w*\n|\|.*\n\|[-:| ]+\|\n)", re.M)


class PathError(ValueError):
    """A page names a result that no file has."""


class Row(string.Formatter):
    """Formats one row of a table: what is not known is a dash, a per cent sign stands apart."""

    def get_value(self, key: int | str, args: Any, kwargs: Any) -> Any:
        """Of a name in braces; a list by its index: {0}."""
        return args[key] if isinstance(key, int) else kwargs[key]

    def format_field(self, value: Any, format_spec: str) -> str:
        """Of one value."""
        if value is None:
            return "–"
        text = format(value, format_spec)
        return text.removesuffix("%") + " %" if format_spec.endswith("%") else text


def value_at(path: str, files: Mapping[str, Any]) -> Any:
    """The value of a path; `files` alone leads to what made each of them. Raises PathError."""
    if path == "files":
        kinds = {True: "timing", False: ""}
        return [
            {"link": f"[{name}](../results/{name}.json)", "kind": kinds[one["made"]["timing"]], **one["made"]}
            for name, one in files.items()
        ]
    name, *keys = path.split(".")
    found = files.get(name, {}).get("numbers")
    for key in keys:
        inside = found if isinstance(found, dict) else dict(enumerate(found)) if isinstance(found, list) else {}
        found = inside.get(int(key) if isinstance(found, list) and key.isdigit() else key)
    if found is None:
        raise PathError(f"docs/results/ has no {path}; its files are {', '.join(sorted(files))}")
    return found


def shown_as(value: Any, shown: str) -> str:
    """A value in the form of what stands in the page: the same number of decimals, the same minus sign."""
    if not isinstance(value, int | float):
        return str(value)
    before, number, after = re.fullmatch(r"(\D*?)([-−]?\d[\d.]*|–)(.*)", shown).groups()  # type: ignore[union-attr]
    return f"{before}{value:.{len(number.partition('.')[2])}f}{after}".replace("-", "−")


def rows(value: Any, row: str) -> list[str]:
    """Rows of a table: of each element of a list, or of each entry of a mapping, whose name is {key}."""
    each = [{"key": key, **one} for key, one in value.items()] if isinstance(value, dict) else value
    return [
        Row().vformat(row, one if isinstance(one, list) else (), one if isinstance(one, dict) else {}) for one in each
    ]


def refreshed(text: str, files: Mapping[str, Any]) -> str:
    """A page with the numbers of the files. Raises PathError."""
    parts, at = [], 0
    for block in BLOCK.finditer(text):
        value, head = value_at(block["path"], files), block["head"]
        if head.startswith("```"):
            end, lines = text.index("\n```", block.end() - 1) + 1, list(value)
        else:
            body = re.compile(r"(?:\|.*\n)*").match(text, block.end())
            assert body is not None
            end, lines = body.end(), rows(value, block["row"] or "")
        parts += [text[at : block.end()], "".join(f"{line}\n" for line in lines)]
        at = end
    text = "".join(parts) + text[at:]
    return VALUE.sub(lambda one: f"{shown_as(value_at(one['path'], files), one['shown'])}<!--={one['path']}-->", text)


def results() -> dict[str, Any]:
    """All files of docs/results/, by name."""
    return {file.stem: json.loads(file.read_text(encoding="utf-8")) for file in sorted(FOLDER.glob("*.json"))}


def stale_pages(files: Mapping[str, Any], *, write: bool = False) -> list[Path]:
    """Pages that differ from the files; with `write` they are brought up to date. Raises PathError."""
    stale = []
    for page in PAGES:
        text = page.read_text(encoding="utf-8")
        fresh = refreshed(text, files)
        if fresh != text:
            stale.append(page)
            if write:
                page.write_text(fresh, encoding="utf-8")
    return stale


def load(file: Path) -> Any:
    """JSON of a command."""
    return json.loads(file.read_text(encoding="utf-8"))


def chapter2(out: Path) -> dict[str, Any]:
    """Verdicts of the figures with each seed, and when the means of 2.8 settle."""
    seeds = [load(out / f"{seed}.json")["figures"] for seed in range(3)]
    figures = [[one[0]["figure"], *(figure["as_in_the_thesis"] for figure in one)] for one in zip(*seeds, strict=True)]
    settled = [figure["settled_after"] for found in seeds for figure in found if figure["figure"] == "2.8"]
    return {"figures": figures, "settled_2_8": {"least": min(settled), "most": max(settled)}}


def chapter4(out: Path) -> dict[str, Any]:
    """All but what only the plots need."""
    from studies.chapter4.findings import THESIS_CLASSIFICATION

    found = load(out / "numbers.json")
    noise = [[name, *(row[cm][0] for cm in sorted(row, key=float))] for name, row in found["noise"].items()]
    return {
        "models": [
            {**row, "thesis": THESIS_CLASSIFICATION.get((row["states"], row["name"]))} for row in found["models"]
        ],
        "targets": [goal | {"met": "yes" if goal["met"] else "no"} for goal in found["targets"]],
        "noise": noise,
        **{name: found[name] for name in ("findings", "classification", "variation", "redirect")},
    }


def chapter6(out: Path) -> dict[str, Any]:
    """Cases by kind and views, goals of all clips and of the held-out third, errors of the models."""
    found = load(out / "numbers.json")
    nothing = dict.fromkeys(("target_median", "target_p90", "lost", "performances")) | {"hand_rms": [None] * 3}
    cases: dict[str, Any] = {}
    for row in found["cases"]:
        if row["likelihood"] == "matched" and row["views"] in ("four views", "single views"):
            of_kind = cases.setdefault(row["kind"], {"four": nothing, "one": nothing})
            of_kind["four" if row["views"] == "four views" else "one"] = row
    apart = {goal["what"]: goal["measured"] for goal in found["goals held out"]}
    met = {True: "yes", False: "no", None: "–"}
    goals = [{**one, "held_out": apart.get(one["what"], "–"), "met": met[one["met"]]} for one in found["goals"]]
    tracks = found["tracks"]
    counts = {"clips": len({one["clip"] for one in tracks}), "tracks": len(tracks)}
    return {"cases": cases, "goals": goals, "findings": found["findings"], "models": found["models"], **counts}


def table_6_1(out: Path) -> dict[str, Any]:
    """The thesis's table 6.1 and ours, in our axes."""
    from studies.chapter6.findings import TABLE_6_1

    ours = load(out / "numbers.json")["table 6.1"]
    names = (*TABLE_6_1, "refined: mean", "refined: RMS", "refined: max")
    return {"table_6_1": [[name, *ours[name], *TABLE_6_1.get(name, [None] * 3)] for name in names]}


def imitation(out: Path) -> dict[str, Any]:
    """The rows of the command's table; medians by place; the ranges of targets at the edges of the table."""
    from studies.imitation.thesis import compared

    found, few = load(out / "imitation.json"), load(out / "10" / "imitation.json")
    rows = [
        {
            "words": one.row.words.replace("  ", "… "),
            "place": one.row.place.name,
            "thesis": one.row.thesis or "–",
            "median": one.median,
            "largest": one.largest,
            "goal": "" if one.met is None else f"≤ {one.row.goal:g}: {'met' if one.met else '**not met**'}",
        }
        for one in compared(found)
    ]
    places = {(one["place"].replace(" ", "_"), one["reference"]): one["mm"] for one in found["places"]}
    edges = [one["mm"] for one in found["places"] if one["coordinates"][0] in (0.0, 1.0) and one["reference"] == "own"]
    edge = {name: sorted(one[name]["median"] for one in edges) for name in ("gripper", "gripper_aligned")}
    return {
        "rows": rows,
        "few": {one["place"].replace(" ", "_"): one["mm"] for one in few["places"] if one["reference"] == "own"},
        "at": {place: places[place, "own"] for place in ("centre", "right_side")},
        "global": {place: places[place, "global"] for place in ("centre", "right_side")},
        "edges": {name: {"least": each[0], "most": each[-1]} for name, each in edge.items()},
    }


def real_images(out: Path) -> dict[str, Any]:
    """Means over the seeds of each replay."""
    found = load(out / "numbers.json")
    rows, order = [], ["outline and key points", "outline alone", "network alone", "sides exchanged in a quarter"]
    for name in sorted(found["cases"], key=lambda name: (name not in order, order.index(name) if name in order else 0)):
        runs = found["cases"][name]
        row: dict[str, Any] = {"name": name}
        ranges = {"short": "frames 6-9", "long": "frames 32-50", "swing": "frames 43-49", "all": "all frames"}
        for short, frames in ranges.items():
            for number, key in (
                ("median_px", "px"), ("far_frames", "far"), ("lost_frames", "lost"), ("hand_cm", "hand"),
                ("from_shoulder_cm", "relative"), ("direction_deg", "direction"),
            ):  # fmt: skip
                values = [run[frames][number] for run in runs]
                row[f"{short}_{key}"] = "–" if None in values else f"{sum(values) / len(values):.1f}"
        rows.append(row)
    goals = [{**goal, "met": "yes" if goal["met"] else "no"} for goal in found["goals"]]
    return {"rows": rows, "goals": goals}


def multicam(out: Path) -> dict[str, Any]:
    """By camera and by bone."""
    found = load(out / "numbers.json")
    cameras = [
        {"name": name, "offset": offset, "left_out": found["left_out_px"][name],
         "strange": found["exchanged_or_of_nothing"][name]}
        for name, offset in found["offsets_px"].items()
    ]  # fmt: skip
    bones = [
        {"name": name, "length": length, "deviation": found["deviation_of_lengths_cm"][name]}
        for name, length in found["lengths_cm"].items()
    ]
    keys = ("reprojection_px", "reprojection_without_offsets_px", "exchanges")
    return {"cameras": cameras, "bones": bones, **{key: found[key] for key in keys}}


def teaching(out: Path) -> dict[str, Any]:
    """Means over the simulated persons."""
    return {"rows": load(out / "numbers.json")["rows"]}


COMPARED_METHODS = {
    "quadratic": "paramove, quadratic PHMM",
    "linear": "paramove, linear PHMM",
    "cubic": "paramove, cubic PHMM",
    "ridge": "PCA + quadratic ridge, full covariance (tuned)",
    "promp": "ProMP, quadratic context, linear time (tuned)",
    "minirocket": "MiniRocket (default)",
}


def movements(out: Path) -> dict[str, Any]:
    """Errors of synthesis and theta by task; coverage of the quadratic model and of its peers."""
    errors, sure = [], []
    for task, rows in load(out / "numbers.json").items():
        values = {name: {key: one["value"] for key, one in row["measures"].items()} for name, row in rows.items()}
        own = values.get(COMPARED_METHODS["quadratic"], {})
        theirs = [one for name, one in values.items() if not name.startswith("paramove")]
        if "theta" not in own:
            continue
        named = {key: values.get(name, {}) for key, name in COMPARED_METHODS.items()}
        errors.append({"task": task, **{key: [one.get("dtw"), one.get("theta")] for key, one in named.items()}})
        covered = [one["covered"] for one in theirs if "covered" in one]
        sure.append(
            {
                "task": task,
                **{key: own.get(key) for key in ("covered", "auroc_aborted", "auroc_stopped")},
                "peers_covered": [min(covered), max(covered)],
                "peers_stopped": max(one["auroc_stopped"] for one in theirs if "auroc_stopped" in one),
            }
        )
    return {"errors": errors, "sure": sure}


def regions(out: Path) -> dict[str, Any]:
    """What regions of theta and p-values of the quadratic model hold, by task, with errors as text with their unit."""
    found = []
    for name in ("few", "real"):
        for task, rows in load(out / f"{name}.json").items():
            measures = rows.get("paramove, quadratic PHMM", {}).get("measures", {})
            own, plain, ridge, moving, hand, last = (
                {key: one["value"] for key, one in rows.get(row, {}).get("measures", {}).items()}
                for row in (
                    "paramove, quadratic PHMM",
                    "paramove, quadratic PHMM as in the thesis",
                    "ridge from all frames",
                    "ridge from position and velocity",
                    "ridge from the fingertip's position and velocity",
                    "ridge from the fingertip's position",
                )
            )
            if "covered_50" not in own:
                continue
            factor, unit = (1.0, "°") if task.startswith("pointing") else (10.0, " mm")
            theta, by_ridge, at_end = (f"{factor * one['theta']:.2f}{unit}" for one in (own, ridge, last))
            after, moving_after, hand_after = (
                ", ".join(f"{factor * one[f'theta_{percent}']:.3g}" for percent in (25, 50, 75)) + unit
                for one in (own, moving, hand)
            )
            keys = ("covered_50", "covered_80", "covered", "covered_set", "below_1", "below_5", "below_20")
            keys += ("dtw", "auroc_aborted", "auroc_stopped")
            between = "–".join(f"{factor * measures['theta'][end]:.2f}" for end in ("low", "high"))
            found.append(
                {"task": task, "theta": theta, "theta_interval": between, "ridge": by_ridge}
                | {"independent": plain.get("covered")}
                | {
                    f"{what}_{percent}": f"{factor * one[f'theta_{percent}']:.3g}{unit}"
                    for percent in (50, 75)
                    for what, one in (("after", own), ("moving", moving))
                }
                | {"at_end": at_end, "after": after, "moving_after": moving_after, "hand_after": hand_after}
                | {key: own[key] for key in keys}
            )
    return {"tasks": found}


def pointing(out: Path) -> dict[str, Any]:
    """What the launch prints, and its numbers."""
    return {"lines": printed(out / "0.txt", "SUCCESS", "targets:"), **load(out / "0" / "latest" / "run.json")}


def relocation(out: Path) -> dict[str, Any]:
    """Over all places of all seeds: errors, at the robot's and at human scale."""
    runs = [load(file) for file in sorted(out.glob("*/latest/run.json"))]
    found = [one for run in runs for one in run["relocations"]]
    errors = sorted(one["error_mm"] for one in found)
    middle, scale = statistics.median(errors), runs[0]["scale"]
    return {
        "places": len(found),
        "good": sum(one["good"] for one in found),
        "goal_mm": runs[0]["goal_mm"],
        "least_mm": errors[0],
        "most_mm": errors[-1],
        "median_mm": middle,
        "least_cm_human": errors[0] / scale / 10,
        "most_cm_human": errors[-1] / scale / 10,
        "median_cm_human": middle / scale / 10,
        "within_10_8_mm": sum(error <= 10.8 for error in errors),
        "unwanted_contacts": sum(run["unwanted_contacts"] for run in runs),
        "placing_least_mm": min(one["placing_error_mm"] for one in found),
        "placing_most_mm": max(one["placing_error_mm"] for one in found),
    }


def demo(out: Path) -> dict[str, Any]:
    """What a person reads of the run with seed 0, and which channels its recording has."""
    from mcap.reader import make_reader

    with (out / "0" / "latest" / "recording.mcap").open("rb") as file:
        summary = make_reader(file).get_summary()
    assert summary is not None
    types = [summary.schemas[channel.schema_id].name for channel in summary.channels.values()]
    table = printed(out / "0.txt", "SUCCESS", "messages lost")
    messages = re.findall(r"^ *[\d.]+ s +(robot: .*)$", (out / "0.txt").read_text(encoding="utf-8"), re.M)
    away = next(number for number, line in enumerate(messages) if "is put away" in line)
    rule = next(line for line in messages if "seen going in" in line)
    return {
        "story": [*messages[: away + 1], "...", messages[-1]],
        "table": table,
        "screen": [rule, "...", *messages[away - 1 : away + 1], "...", *table[:6], "..."],
        "channels": len(types),
        "foxglove_channels": sum(name.startswith("foxglove.") for name in types),
    }


def batch(out: Path) -> dict[str, Any]:
    """Totals of a batch of runs of the rule-learning demonstration."""
    return {re.sub(r"\W+", "_", name).strip("_"): value for name, value in load(out / "numbers.json")["totals"].items()}


def arm_speed(out: Path) -> dict[str, Any]:
    """As the benchmark writes it."""
    return {name.replace(" ", "_"): one for name, one in load(out / "numbers.json").items()}


def warping_speed(out: Path) -> dict[str, Any]:
    """Times in ms, and how many times as fast."""
    times = load(out / "numbers.json")["times"]
    return {name.removesuffix("_s"): one * (1000.0 if name.endswith("_s") else 1.0) for name, one in times.items()}


def hmm_speed(out: Path) -> dict[str, Any]:
    """For each group the times of paramove in ms, and how many times as long others take."""
    groups: dict[str, dict[str, float]] = {}
    for one in load(out / "numbers.json")["results"]:
        if one["seconds"] is not None:
            groups.setdefault(one["group"], {})[one["name"]] = 1000.0 * one["seconds"]
    ours = ("paramove, explicit durations", "paramove, plain chain with finish state")
    theirs = ("log", "scaling", "64 bits")
    rows = {}
    for name, start in (("chains", "EM iteration"), ("durations", "the same durations")):
        rows[name] = [
            {
                "group": group,
                "ours": [times[one] for one in ours if one in times],
                **{
                    other.replace(" ", "_"): [time / times[one] for one in ours if one in times]
                    for other in theirs
                    for row, time in times.items()
                    if row.endswith(other)
                },
            }
            for group, times in groups.items()
            if group.startswith(start)
        ]
    return rows


def observation_speed(out: Path) -> dict[str, Any]:
    """With one and with two threads: ms a view, us a hypothesis, view and core, images a second; ms to an estimate."""
    found: dict[str, list[float]] = {}
    for one in load(out / "numbers.json")["results"]:
        views, ms = int(re.search(r"(\d+) view", one["name"])[1]), one["median_ms"]  # type: ignore[index]
        if one["name"] == "1 view" and one["group"].startswith("preprocessing"):
            found.setdefault("preprocessing", []).append(ms)
        elif one["group"].startswith("likelihood"):
            each = 1000.0 * ms * one["threads"] / (400 * views)
            found.setdefault(f"{one['name'].split(',')[0]}_{views}", []).append(each)
        elif one["group"].startswith("camera image"):
            found.setdefault(f"fps_{views}", []).append(1000.0 / ms)
    latency = load(out / "latency.json")
    return {**found, "latency_p50_ms": latency["p50_ms"], "latency_p90_ms": latency["p90_ms"]}


def stop_button(out: Path) -> dict[str, Any]:
    """From a press to the gate, ms."""
    median, largest = re.findall(r"([\d.]+) ms", (out / "0.txt").read_text(encoding="utf-8"))[:2]
    return {"median_ms": float(median), "largest_ms": float(largest)}


def stop_under_flood(out: Path) -> dict[str, Any]:
    """By robot and number of hosts: stops, and ms until the first row of one, of the kind of flood that is worst."""
    found: dict[str, dict[str, float]] = {}
    for hosts in ("one_host", "two_hosts"):
        for row in load(out / f"{hosts}.json")["rows"]:
            worst = found.setdefault(f"{row['robot']}_{row['hosts']}", {})
            worst["stops"] = worst.get("stops", 0) + row["stops"]
            worst["left_out"] = worst.get("left_out", 0) + len(row["left_out"])
            for name in ("p50_ms", "p99_ms", "max_ms", "person_max_ms"):
                worst[name] = max(worst.get(name, 0.0), row[name])
    return found


def tutorial(out: Path) -> dict[str, Any]:
    """What training and recognition print, with the tutorial's paths and without the time that training takes."""
    texts = [(out / f"{n}.txt").read_text(encoding="utf-8").replace(f"{out}/", "") for n in range(6)]
    train, recognise, take = texts[2], texts[3], texts[5].splitlines()
    rows = [line.rstrip() for line in recognise.splitlines()]
    train = re.sub(r"(per frame), [\d.]+ s", r"\1, … s", train)
    return {
        "train": train.splitlines(),
        "recognise": [*rows[:7], "…", rows[-1]],
        "take": [one.rstrip() for one in take],
    }


def printed(file: Path, first: str, last: str) -> list[str]:
    """The printed lines from one that begins with `first` to one that begins with `last`."""
    lines = [line.rstrip() for line in file.read_text(encoding="utf-8").splitlines()]
    begin = next(number for number, line in enumerate(lines) if line.startswith(first))
    end = next(number for number, line in enumerate(lines) if number > begin and line.startswith(last))
    return lines[begin : end + 1]


@dataclass(frozen=True)
class Measurement:
    """How a result is made.

    Attributes:
        commands: {out} is a folder for what they write; what command number N prints goes to N.txt there.
        numbers: makes the numbers of the file from that folder.
        takes: on two cores.
        timing: times and speeds, which are those of a machine, and of worth only if nothing else runs on it.
    """

    commands: tuple[str, ...]
    numbers: Callable[[Path], dict[str, Any]]
    takes: str
    timing: bool = False


TAKE = """
import sys
from pathlib import Path
from paramove.demonstrations import DemonstrationSet
one = DemonstrationSet.load(Path(sys.argv[1], "sets", "table_test"))[7]
lines = [",".join(["time", *(point + "_" + axis for point in one.point_names for axis in "xyz")])]
lines += [",".join("%.4f" % value for value in [time, *(1000 * frame)]) for time, frame in zip(one.time, one.frames)]
Path(sys.argv[1], "new_take.csv").write_text("\\n".join(lines))
"""
"""As step 9 of the tutorial does."""
MEASUREMENTS = {
    "chapter2": Measurement(
        tuple(f"python -m studies chapter2 --seed {n} --out {{out}}/{n} --json {{out}}/{n}.json" for n in range(3)),
        chapter2,
        "a minute",
    ),
    "chapter4": Measurement(
        ("python -m studies chapter4 --seeds 0-4 --jobs 2 --out {out} --json {out}/numbers.json",),
        chapter4,
        "10 minutes",
    ),
    "chapter6": Measurement(
        ("python -m sim.performances", "python -m studies chapter6 --jobs 2 --out {out} --json {out}/numbers.json"),
        chapter6,
        "90 minutes",
    ),
    "chapter6_50fps": Measurement(
        (
            "python -m sim.performances --kind pointing_50fps",
            "python -m studies chapter6 --kind pointing_50fps --jobs 2 --out {out} --json {out}/numbers.json",
        ),
        table_6_1,
        "10 minutes",
    ),
    "imitation": Measurement(
        (
            "python -m studies imitation --report {out}",
            "python -m studies imitation --repetitions 10 --no-grid --report {out}/10",
        ),
        imitation,
        "a minute",
    ),
    "real_images": Measurement(
        ("python -m studies real-images --out {out} --json {out}/numbers.json",), real_images, "a minute"
    ),
    "multicam": Measurement(("python -m studies multicam --json {out}/numbers.json",), multicam, "2 minutes"),
    "teaching": Measurement(("python -m studies teaching --json {out}/numbers.json",), teaching, "a minute"),
    "movements": Measurement(
        (
            "python -m studies peers --on real --jobs 2 --task pointing/corners --task pointing/direction"
            " --task table/reach --task table/drink --out {out} --json {out}/numbers.json"
            + "".join(f" --method '{name}'" for name in COMPARED_METHODS.values()),
        ),
        movements,
        "10 minutes",
    ),
    "regions": Measurement(
        (
            "python -m studies peers --on few --jobs 2 --method 'quadratic PHMM' --method 'ridge from' --out {out}/1"
            " --json {out}/few.json",
            "python -m studies peers --on real --jobs 2 --method 'quadratic PHMM' --method 'ridge from' --task pointing"
            " --task table/reach --task table/drink --out {out}/2 --json {out}/real.json",
        ),
        regions,
        "10 minutes",
    ),
    "pointing": Measurement(("paramove launch pointing --headless --runs {out}/0",), pointing, "a minute"),
    "relocation": Measurement(
        tuple(f"paramove launch relocate_by_pointing --headless --seed {n} --runs {{out}}/{n}" for n in range(6, 14)),
        relocation,
        "30 minutes",
    ),
    "demo": Measurement(("paramove launch rule_learning --headless --seed 0 --runs {out}/0",), demo, "3 minutes"),
    "demo_people": Measurement(
        (
            "paramove evaluate rule_learning --seeds 0-19 --drop-recordings --runs {out}/runs --json {out}/numbers.json"
            " --set synthesizer.movement.model=table_reach",
        ),
        batch,
        "an hour",
    ),
    "demo_pointed": Measurement(
        (
            "paramove evaluate rule_learning --seeds 0-29 --drop-recordings --runs {out}/runs --json {out}/numbers.json"
            " --with sim --with action_space",
        ),
        batch,
        "3 hours",
    ),
    "tutorial": Measurement(
        (
            "paramove demos synthesize {out}/sets/table --columns 3 --rows 3 --repetitions 5",
            "paramove demos split {out}/sets/table --by theta --fraction 0.25 --seed 6",
            "paramove train {out}/sets/table_train --out {out}/models/reaching.npz --report {out}/training.html",
            "paramove recognize {out}/sets/table_test --model {out}/models/reaching.npz",
            f"python -c {shlex.quote(TAKE)} {{out}}",
            "paramove recognize {out}/new_take.csv --unit mm --model {out}/models/reaching.npz",
        ),
        tutorial,
        "a minute",
    ),
    "arm_speed": Measurement(
        ("python benchmarks/arm.py --trials 30 --json {out}/numbers.json",), arm_speed, "5 minutes", timing=True
    ),
    "hmm_speed": Measurement(
        ("python benchmarks/models.py --json {out}/numbers.json",), hmm_speed, "20 minutes", timing=True
    ),
    "observation_speed": Measurement(
        (
            "python benchmarks/tracking.py --json {out}/numbers.json",
            "python benchmarks/tracking_latency.py --json {out}/latency.json",
        ),
        observation_speed,
        "5 minutes",
        timing=True,
    ),
    "stop_button": Measurement(
        ("python benchmarks/stop_button.py --presses 10",), stop_button, "a minute", timing=True
    ),
    "stop_under_flood": Measurement(
        (
            "python benchmarks/stop_under_flood.py --busy 2 --kinds valid,invalid,large,many --hosts 1 "
            "--json {out}/one_host.json",
            "python benchmarks/stop_under_flood.py --busy 2 --kinds valid,invalid,large,many --hosts 2 --namespaces "
            "--json {out}/two_hosts.json",
        ),
        stop_under_flood,
        "an hour and a half, as root",
        timing=True,
    ),
    "warping_speed": Measurement(
        ("python benchmarks/dtw.py --json {out}/numbers.json",), warping_speed, "a minute", timing=True
    ),
}


def made(measurement: Measurement, minutes: float) -> dict[str, Any]:
    """Where the numbers come from: what was run, on what, when."""
    changed = _git("status", "--porcelain", "--", *CODE)
    models = re.findall(r"^model name\s*: (.*)$", Path("/proc/cpuinfo").read_text(encoding="utf-8"), re.M)
    libraries = ", ".join(
        f"{name} {version(name)}" for name in ("numpy", "scipy", "numba", "mujoco", "opencv-contrib-python-headless")
    )
    return {
        "commands": [command.replace("{out}", "OUT") for command in measurement.commands],
        "commit": _git("rev-parse", "--short", "HEAD") + (" with changes" if changed else ""),
        "date": f"{datetime.now(UTC):%Y-%m-%d}",
        "machine": f"{len(os.sched_getaffinity(0))} cores of {models[0] if models else platform.machine()}",
        "software": f"Python {platform.python_version()}, {libraries}",
        "minutes": round(minutes, 1),
        "timing": measurement.timing,
        "note": "",
    }


def _git(*words: str) -> str:
    return subprocess.run(["git", *words], cwd=ROOT, capture_output=True, text=True, check=True).stdout.strip()


def shortened(value: Any) -> Any:
    """Six digits, which are more than any page shows."""
    if isinstance(value, dict):
        return {key: shortened(one) for key, one in value.items()}
    if isinstance(value, list | tuple):
        return [shortened(one) for one in value]
    return float(f"{value:.6g}") if isinstance(value, float) else value


def run(name: str) -> None:
    """Runs the commands of a result and writes its file; ends the program if one fails."""
    measurement, began = MEASUREMENTS[name], time.monotonic()
    environment = os.environ | {"PATH": f"{Path(sys.executable).parent}:{os.environ['PATH']}", "COLUMNS": "130"}
    with tempfile.TemporaryDirectory(prefix="paramove-results-") as folder:
        for number, command in enumerate(measurement.commands):
            sys.stdout.write(f"{name}: {command.format(out=folder)}\n")
            sys.stdout.flush()
            with (Path(folder) / f"{number}.txt").open("w", encoding="utf-8") as output:
                ended = subprocess.run(
                    shlex.split(command.format(out=folder)),
                    cwd=ROOT,
                    env=environment,
                    stdout=output,
                    stderr=subprocess.STDOUT,
                    check=False,
                )
            if ended.returncode not in (0, NOT_MET):
                end = (Path(folder) / f"{number}.txt").read_text(encoding="utf-8")[-2000:]
                sys.exit(f"{command} ended with {ended.returncode}; nothing is written. Its last words:\n{end}")
        write(name, Path(folder), made(measurement, (time.monotonic() - began) / 60.0))


def write(name: str, folder: Path, origin: dict[str, Any]) -> None:
    """Writes the file of a result from what its commands left in a folder."""
    content = {"made": origin, "numbers": shortened(MEASUREMENTS[name].numbers(folder))}
    text = json.dumps(content, indent=1, ensure_ascii=False)
    text = re.sub(r"\[[^][{}]*\]", lambda flat: re.sub(r"\s*\n\s*", " ", flat[0]), text)
    (FOLDER / f"{name}.json").write_text(text + "\n", encoding="utf-8")


def main() -> None:
    """Command line."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--write", action="store_true", help="bring the pages up to date with the files")
    parser.add_argument(
        "--run",
        nargs="+",
        metavar="NAME",
        default=[],
        choices=["all", *MEASUREMENTS],
        help="; ".join(f"{name}: {one.takes}" for name, one in MEASUREMENTS.items()),
    )
    chosen = parser.parse_args()
    for name in MEASUREMENTS if "all" in chosen.run else chosen.run:
        run(name)
    written = chosen.write or bool(chosen.run)
    stale = stale_pages(results(), write=written)
    for page in stale:
        sys.stdout.write(f"{page.relative_to(ROOT)} {'is brought up to date' if written else 'is stale'}\n")
    sys.exit(1 if stale and not written else 0)


if __name__ == "__main__":
    main()
