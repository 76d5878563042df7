"""Speed of tracking an arm in images: observation, and camera image to estimate, compared with the thesis's figures.

    python benchmarks/tracking.py [--json FILE] [--seconds S] [--only TEXT]

The images are those of a rendered person who points, 320 x 240 px with clutter and noise, drawn before the clock
starts; the hypotheses are those of the running tracker. Rows with one thread are bound to one processor and show
processor time, which other programs disturb less; rows with two show time by the clock. Printed are medians and the
shortest times.

The thesis's figures (6.5, 6.6.4): 1.24 ms for contour and matching of a hypothesis on one 2.4 GHz Core 2; 8 frames per
second for 400 hypotheses on one view with eight 2.53 GHz Xeon cores and a graphics card that drew the silhouettes.
"""

import argparse
import json
import os
import platform
import statistics
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import asdict, dataclass
from functools import partial
from pathlib import Path

os.environ.update(OMP_NUM_THREADS="1", OPENBLAS_NUM_THREADS="1", MKL_NUM_THREADS="1")
sys.path.insert(0, str(Path(__file__).resolve().parent.parent))

import cv2
import numpy as np

from paramove.action_space import ActionTracker, FilterOptions, Grammar, TrackerOptions, Vocabulary, table_action
from paramove.observation import ArmObserver, Likelihood, ObservationOptions
from sim.performances import Studio
from sim.persons.performances import kind_named, perform

THESIS_MATCH_MS = 1.24
THESIS_FPS = 8.0
FRAMES = 16
RATE_HZ = 8.0
VIEWS = (1, 2, 4)
CORES = sorted(os.sched_getaffinity(0))[:2]


@dataclass
class Result:
    """One row: median and shortest time of a piece of work, ms, and what follows from it."""

    group: str
    name: str
    threads: int
    median_ms: float
    best_ms: float
    runs: int
    note: str = ""


@dataclass(frozen=True)
class Footage:
    """What was filmed: frames by views by image, the studio's cameras and the person as measured."""

    frames: list[list[np.ndarray]]
    studio: Studio
    poses: np.ndarray


def filmed() -> Footage:
    """The first seconds of a performance, four views."""
    studio = Studio(perform(kind_named("pointing"), 0))
    rng = np.random.default_rng(0)
    times = np.arange(FRAMES) / RATE_HZ
    frames = []
    for time_s in times:
        noisy = [np.clip(image + rng.normal(0.0, 4.0, image.shape), 0, 255) for image in studio.film_all(time_s)]
        frames.append([image.astype(np.uint8) for image in noisy])
    poses = np.array([studio.at(time_s).pose for time_s in times])
    studio.close()
    return Footage(frames, studio, poses)


def timed(work: Callable[[], object], threads: int, seconds: float, minimum: int = 3) -> tuple[float, float, int]:
    """Median and shortest time of the work, ms, and how often it ran."""
    clock = time.process_time if threads == 1 else time.perf_counter
    work()
    times: list[float] = []
    end = time.perf_counter() + seconds
    while len(times) < minimum or (time.perf_counter() < end and len(times) < 500):
        began = clock()
        work()
        times.append(1e3 * (clock() - began))
    return statistics.median(times), min(times), len(times)


class Bench:
    """Runs the rows and prints them."""

    def __init__(self, seconds: float) -> None:
        self.seconds = seconds
        self.results: list[Result] = []
        self.footage = filmed()
        self.vocabulary = Vocabulary([table_action("pointing")])

    def observer(self, views: int, threads: int, likelihood: Likelihood = "matched") -> ArmObserver:
        """An observer of the first views, on as many processors as it has threads."""
        os.sched_setaffinity(0, set(CORES if threads > 1 else CORES[-1:]))
        cv2.setNumThreads(1)
        person = self.footage.studio.performance.person
        cameras = self.footage.studio.calibrated[:views]
        return ArmObserver(person.measured, cameras, ObservationOptions(likelihood=likelihood), threads=threads)

    def tracker(self, particles: int) -> ActionTracker:
        """A tracker of the one action."""
        placement = self.footage.studio.performance.person.placement
        options = TrackerOptions(filter=FilterOptions(n_particles=particles))
        return ActionTracker(self.vocabulary, Grammar.loop("pointing"), placement, options)

    def hypotheses(self, count: int) -> np.ndarray:
        """Poses of the tracker in the middle of the movement, (count, 9)."""
        tracker, observer = self.tracker(count), self.observer(1, 1)
        for number, images in enumerate(self.footage.frames[: FRAMES // 2]):
            observer.look(images[:1])
            tracker.update(number / RATE_HZ, observer.log_likelihoods)
        return np.ascontiguousarray(tracker.placement.in_world(tracker.filter.particles.poses))

    def row(
        self, group: str, name: str, threads: int, work: Callable[[], object], note: Callable[[float], str]
    ) -> None:
        """Time and print one row; `note` explains the median."""
        times = timed(work, threads, self.seconds)
        result = Result(group, name, threads, *times, note(times[0]))
        if not self.results or self.results[-1].group != group:
            sys.stdout.write(f"\n{group}\n")
        self.results.append(result)
        sys.stdout.write(
            f"  {name:34s} {threads} thread{'s' if threads > 1 else ' '} {result.median_ms:9.3f} ms"
            f"  best {result.best_ms:9.3f}  {result.note}\n"
        )
        sys.stdout.flush()


def preprocessing(bench: Bench) -> None:
    """Images to edge images: lens, smoothing, gradients, ten directions, ten distance images."""
    images = bench.footage.frames[FRAMES // 2]
    for threads in (1, 2):
        for views in VIEWS:
            observer = bench.observer(views, threads)
            bench.row(
                "preprocessing of 320 x 240 px", f"{views} view{'s' if views > 1 else ''}", threads,
                partial(observer.look, images[:views]),
                partial(per_view, views=views),
            )  # fmt: skip
    large = [cv2.resize(images[0], (640, 480))]
    observer = ArmObserver(
        bench.observer(1, 1).sizes, [bench.footage.studio.calibrated[0].resized(640, 480)], threads=1
    )
    bench.row("preprocessing of 320 x 240 px", "1 view, camera of 640 x 480 px", 1, lambda: observer.look(large),
              lambda ms: "")  # fmt: skip


def hypotheses(bench: Bench) -> None:
    """Silhouette, contour, matching and likelihood of 400 hypotheses of the running tracker."""
    poses, images = bench.hypotheses(400), bench.footage.frames[FRAMES // 2]
    for likelihood in ("matched", "simple"):
        for threads in (1, 2):
            for views in VIEWS if likelihood == "matched" else (1,):
                observer = bench.observer(views, threads, likelihood=likelihood)
                observer.look(images[:views])
                points = np.mean([len(observer.outline(pose, 0)) for pose in poses[::20]])
                bench.row(
                    f"likelihood of 400 hypotheses (contour of {points:.0f} px in the first view)",
                    f"{likelihood}, {views} view{'s' if views > 1 else ''}", threads,
                    partial(observer.log_likelihoods, poses),
                    partial(per_hypothesis, count=400 * views, threads=threads),
                )  # fmt: skip


def per_view(median_ms: float, views: int) -> str:
    """Cost of one view."""
    return f"{median_ms / views:.2f} ms a view"


def per_pair(median_ms: float, count: int) -> str:
    """Cost of one hypothesis in one view."""
    return f"{1e3 * median_ms / count:6.2f} us a hypothesis and view"


def frames_per_second(median_ms: float, views: int) -> str:
    """The rate, and how many times the thesis's it is."""
    compared = f"; {1e3 / median_ms / THESIS_FPS:.0f} x the thesis's 8 fps on 8 cores" if views == 1 else ""
    return f"{1e3 / median_ms:5.0f} fps{compared}"


def per_hypothesis(median_ms: float, count: int, threads: int) -> str:
    """Cost of one hypothesis in one view on one core, and the thesis's for the same (without drawing)."""
    one = median_ms * threads / count
    return f"{1e3 * one:6.1f} us a hypothesis, view and core; {THESIS_MATCH_MS / one:.0f} x faster than 1.24 ms"


def growth(bench: Bench) -> None:
    """Linear growth: 100 to 6400 hypotheses, one and four views."""
    cloud, images = bench.hypotheses(400), bench.footage.frames[FRAMES // 2]
    rng = np.random.default_rng(0)
    for views in (1, 4):
        observer = bench.observer(views, 2)
        observer.look(images[:views])
        for count in (100, 400, 1600, 6400):
            poses = cloud[rng.integers(0, len(cloud), count)] + rng.normal(0.0, 0.003, (count, 9))
            bench.row(
                "growth with hypotheses and views", f"{count} hypotheses, {views} view{'s' if views > 1 else ''}", 2,
                partial(observer.log_likelihoods, poses),
                partial(per_pair, count=count * views),
            )  # fmt: skip


def end_to_end(bench: Bench) -> None:
    """Camera image to estimate: preprocessing, selection, prediction, likelihood, estimates."""
    for threads in (1, 2):
        for views in VIEWS:
            observer, tracker = bench.observer(views, threads), bench.tracker(400)
            numbers = iter(range(10**9))

            def frame(
                observer: ArmObserver = observer,
                tracker: ActionTracker = tracker,
                views: int = views,
                numbers: Iterator[int] = numbers,
            ) -> None:
                number = next(numbers)
                index = number % (2 * FRAMES - 2)  # there and back, so that the arm never jumps
                index = index if index < FRAMES else 2 * FRAMES - 2 - index
                observer.look(bench.footage.frames[index][:views])
                tracker.update(number / RATE_HZ, observer.log_likelihoods)

            bench.row(
                "camera image to estimate, 400 hypotheses", f"{views} view{'s' if views > 1 else ''}", threads, frame,
                partial(frames_per_second, views=views),
            )  # fmt: skip


GROUPS: dict[str, Callable[[Bench], None]] = {
    "preprocessing": preprocessing,
    "likelihood": hypotheses,
    "growth": growth,
    "estimate": end_to_end,
}


def main(arguments: Sequence[str] | None = None) -> None:
    """Measure, print, and write JSON if requested."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--json", type=Path, help="write the results to this file")
    parser.add_argument("--seconds", type=float, default=1.0, help="time for each row")
    parser.add_argument("--only", default="", help=f"groups whose name contains this text: {', '.join(GROUPS)}")
    chosen = parser.parse_args(arguments)
    sys.stdout.write(f"other programs: load {os.getloadavg()[0]:.1f} on {os.cpu_count()} processors\n")
    bench = Bench(chosen.seconds)
    for name, group in GROUPS.items():
        if chosen.only in name:
            group(bench)
    if chosen.json is not None:
        machine = {"machine": platform.machine(), "python": platform.python_version(), "cores": os.cpu_count()}
        load = os.getloadavg()[0]
        content = {
            "benchmark": "tracking",
            **machine,
            "load": load,
            "results": [asdict(result) for result in bench.results],
        }
        chosen.json.write_text(json.dumps(content, indent=2) + "\n")


if __name__ == "__main__":
    main()
