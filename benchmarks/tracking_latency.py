"""From an image on the bus to the estimate on the bus, in the running stack: all processes of `pointing`, in real time.

    python benchmarks/tracking_latency.py [--json FILE] [--targets N] [--particles N] [--keep FOLDER]
    python benchmarks/tracking_latency.py --real [DATA]     a real person's pictures at 15 Hz, with the pose network

A simulated person points (in lockstep, one camera of 320 x 240 px); the recorded images are then replayed at the pace
at which they were taken, through camera, tracker, recognizer and recorder. Measured in the replay's own recording:
from the publication of an image to that of the estimate made from it. Decoding, both transfers by the bus and
everything that the other processes take of the processors meanwhile are in it. Images that were replaced by later ones
before the tracker came to them have no estimate and are counted.
"""

import argparse
import json
import os
import platform
import statistics
import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT))

from paramove.action_space import Person, write_person  # noqa: E402
from paramove.bus import topics  # noqa: E402
from paramove.cameras import write_cameras  # noqa: E402
from paramove.recording import read  # noqa: E402
from studies.real_images import seated_person  # noqa: E402
from studies.real_images.experiment import recording_folder  # noqa: E402
from studies.real_images.seated_person import SIZES  # noqa: E402

GOAL_MS = 15.0
WITH_NETWORK_GOAL_MS = 70.0
SETTLED = 15
"""Images at the beginning that are not counted: processes are still starting."""
VOTING = 45
"""The same with the pose network, which decides at first how the pictures are turned."""
PICTURES, RATE_HZ = 300, 15
DOMAIN = "tracking_latency"


def launched(runs: Path, *arguments: str) -> Path:
    """The folder of a run of `pointing`. Its detected targets do not matter here."""
    command = [sys.executable, "-m", "paramove.cli.launch", "pointing", "--runs", str(runs), *arguments]
    environment = {**os.environ, "PARAMOVE_DOMAIN": DOMAIN}
    done = subprocess.run(command, cwd=ROOT, env=environment, capture_output=True, text=True, check=False)
    recordings = sorted(runs.glob("*/recording.mcap"))
    if not recordings:
        raise SystemExit(
            f"no recording in {runs}; {' '.join(command)} said:\n{done.stdout[-2000:]}{done.stderr[-2000:]}"
        )
    return recordings[-1].parent


def latencies_ms(folder: Path, settled: int = SETTLED) -> tuple[list[float], int]:
    """Of every estimate after the first ones; and how many images have none."""
    published_ns: dict[int, int] = {}
    latencies: list[float] = []
    image, estimate = topics.CAMERA_IMAGES[0].name, topics.ACTION_ESTIMATE.name
    for recorded in read(folder / "recording.mcap", (image, estimate)):
        if recorded.topic == image:
            published_ns[recorded.message.timestamp.ToNanoseconds()] = recorded.publish_ns
            continue
        published = published_ns.get(recorded.message.captured.ToNanoseconds())
        if published is not None:
            latencies.append(1e-6 * (recorded.publish_ns - published))
    return latencies[settled:], len(published_ns) - len(latencies)


def measured(folder: Path, targets: int, particles: int) -> dict[str, float]:
    """Runs the stack twice and reads what it recorded."""
    simulated = launched(folder / "simulated", "--set", f"simulator.targets={targets}", "--set", "simulator.views=[1]")
    load = os.getloadavg()[0]
    replayed = launched(
        folder / "replayed",
        *("--with", "replay"),
        *("--set", f"camera_1.source=recording:{simulated / 'recording.mcap'}#camera_1/image"),
        *("--set", "camera_1.width=320", "--set", "camera_1.height=240"),
        *("--set", f"action_tracker.cameras={simulated / 'cameras.yaml'}"),
        *("--set", f"action_tracker.person={simulated / 'person.yaml'}"),
        *("--set", f"action_tracker.particles={particles}"),
        *("--set", "pose_detector.networks=none"),
    )
    return summary(replayed, *latencies_ms(replayed), load)


def measured_on_a_person(folder: Path, data: Path | None, particles: int) -> dict[str, float]:
    """Replays real pictures through the stack with the pose network."""
    recording = recording_folder(data)
    write_cameras(folder / "cameras.yaml", [seated_person.camera(recording)])
    sizes = {"upper_arm": SIZES.upper_arm, "forearm": SIZES.forearm, "hand": SIZES.hand}
    write_person(folder / "person.yaml", Person(shoulder=(-2.33, 0.14, 0.92), **sizes))
    pictures = sorted((recording / "color").glob("*.jpg"))
    (folder / "pictures").mkdir()
    for number in range(PICTURES):
        (folder / "pictures" / f"{number:06d}.jpg").symlink_to(pictures[number % len(pictures)].resolve())
    load = os.getloadavg()[0]
    replayed = launched(
        folder / "replayed",
        *("--with", "replay"),
        *("--set", f"camera_1.source=folder:{folder / 'pictures'}@{RATE_HZ}"),
        *("--set", f"action_tracker.cameras={folder / 'cameras.yaml'}"),
        *("--set", f"action_tracker.person={folder / 'person.yaml'}"),
        *("--set", f"action_tracker.particles={particles}"),
    )
    return summary(replayed, *latencies_ms(replayed, VOTING), load)


def summary(replayed: Path, times: list[float], without: int, load: float) -> dict[str, float]:
    """Percentiles of latencies, ms. Ends the program if there are too few."""
    if len(times) < 20:
        raise SystemExit(f"{replayed}: {len(times)} estimates after the first {SETTLED}, at least 20 expected")
    ordered = sorted(times)
    return {
        "estimates": len(times),
        "images_without": without,
        "p50_ms": statistics.median(times),
        "p90_ms": ordered[int(0.9 * len(ordered))],
        "p99_ms": ordered[int(0.99 * len(ordered))],
        "worst_ms": ordered[-1],
        "load_before": load,
    }


def main() -> None:
    """Measure, print, and write JSON if requested."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--json", type=Path, help="write the results to this file")
    parser.add_argument("--targets", type=int, default=5, help="how often the person points: about 5 s each")
    parser.add_argument("--particles", type=int, default=400)
    parser.add_argument("--keep", type=Path, help="keep the runs in this folder")
    parser.add_argument("--real", nargs="?", const="", metavar="DATA", help="with the pose network, on real pictures")
    chosen = parser.parse_args()
    with tempfile.TemporaryDirectory() as scratch:
        folder = chosen.keep or Path(scratch)
        if chosen.real is None:
            result = measured(folder, chosen.targets, chosen.particles)
        else:
            result = measured_on_a_person(folder, Path(chosen.real) if chosen.real else None, chosen.particles)
    goal_ms = GOAL_MS if chosen.real is None else WITH_NETWORK_GOAL_MS
    sys.stdout.write(
        f"image in to estimate out, {chosen.particles} hypotheses, one view, {result['estimates']:.0f} estimates, "
        f"{os.cpu_count()} processors, load {result['load_before']:.1f} before:\n"
        f"  median {result['p50_ms']:.1f} ms (goal {goal_ms:.0f}), 90 % {result['p90_ms']:.1f}, 99 % "
        f"{result['p99_ms']:.1f}, worst {result['worst_ms']:.1f}; {result['images_without']:.0f} images had none\n"
    )
    if chosen.json is not None:
        machine = {"machine": platform.machine(), "python": platform.python_version(), "cores": os.cpu_count()}
        content = {"benchmark": "tracking_latency", "particles": chosen.particles, **machine, **result}
        chosen.json.write_text(json.dumps(content, indent=2) + "\n")


if __name__ == "__main__":
    main()
