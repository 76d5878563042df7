"""What each figure of thesis 2.3 shows here, with the numbers of this run, and whether the thesis reports the same."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

from studies.chapter2.experiment import (
    Experiment,
    branches,
    drift,
    in_the_middle,
    per_frame,
    unevenness,
)
from studies.chapter2.figures import (
    ERGODIC_10,
    ERGODIC_20,
    PLAIN_5,
    PLAIN_7,
    PLAIN_7_NARROW,
    PLAIN_20_NARROW,
    RESULT,
    SKIPS_20,
    TIMED_5,
    TIMED_10,
    TIMED_20,
    Setting,
)
from studies.chapter2.training import Trained

Verdict = Literal["yes", "in part", "no"]

ON_AXIS = 0.2
"""Means are on the x-axis if none is further from it than this fraction of the bound."""


@dataclass(frozen=True)
class Finding:
    """What is observed, and how far the thesis agrees."""

    verdict: Verdict
    text: str


def _verdict(agrees: bool, *others: bool) -> Verdict:
    """Yes if all hold, in part if some do."""
    held = [agrees, *others]
    return "yes" if all(held) else "in part" if any(held) else "no"


def finding(number: str, experiment: Experiment) -> Finding:
    """What figure `number` shows here. Raises KeyError for a figure that is none of 2.8 to 2.24."""
    return _FINDINGS[number](experiment)


def _branching(setting: Setting, minimum: int) -> Callable[[Experiment], Finding]:
    def observed(experiment: Experiment) -> Finding:
        plain, random = experiment.trained[setting], experiment.branched[setting]
        from_segments, from_random = (branches(one.snapshots[-1], setting.bound) for one in (plain, random))
        text = (
            f"From equal segments: {_counted(from_segments)} and a log-likelihood of {per_frame(plain, RESULT):.2f} "
            f"per frame after {len(plain.snapshots) - 1} iterations; {_settled(plain)}. "
            f"The likeliest of eight random starts, on the right, has {_counted(from_random)} and "
            f"{per_frame(random, RESULT):.2f} per frame."
        )
        return Finding(_verdict(from_segments >= minimum, from_random >= minimum), text)

    return observed


def _ergodic_20(experiment: Experiment) -> Finding:
    first = _branching(ERGODIC_20, 3)(experiment)
    drawn = experiment.sampled
    text = (
        f" Sequences drawn from the Gaussians along its branches are {drawn['drawn_roughness']:.2f} rough (mean second "
        f"difference; training {drawn['training_roughness']:.3f}), a zig-zag, and nearly as likely as the training "
        f"sequences: {drawn['drawn_log_likelihood']:.2f} against {drawn['training_log_likelihood']:.2f} per frame."
    )
    rough = drawn["drawn_roughness"] > 5.0 * drawn["training_roughness"]
    near = drawn["drawn_log_likelihood"] > drawn["training_log_likelihood"] - 1.0
    return Finding(_verdict(first.verdict == "yes", rough and near), first.text + text)


def _start(setting: Setting) -> Callable[[Experiment], Finding]:
    def observed(experiment: Experiment) -> Finding:
        off = drift(experiment.trained[setting].snapshots[0], setting)
        return Finding(
            _verdict(off <= ON_AXIS), f"No mean is further from the x-axis than {_percent(off)} of the bound."
        )

    return observed


def _twenty_iterations(experiment: Experiment) -> Finding:
    training = experiment.trained[ERGODIC_10]
    likelihoods = [per_frame(training, k) for k in (0, 20, RESULT)]
    text = (
        f"After 20 iterations {likelihoods[1]:.2f} per frame, of {likelihoods[0]:.2f} at the start and "
        f"{likelihoods[2]:.2f} in the end; the means are up to {training.distances()[20]:.3f} from the result; "
        f"{_settled(training)}."
    )
    return Finding(_verdict(training.settled() > 40, bool(training.distances()[20] > 0.1)), text)


def _five(experiment: Experiment) -> Finding:
    off = drift(experiment.trained[PLAIN_5].snapshots[-1], PLAIN_5)
    return Finding(_verdict(off > ON_AXIS), f"The furthest mean is {_percent(off)} of the bound from the x-axis.")


def _seven(experiment: Experiment) -> Finding:
    off = drift(experiment.trained[PLAIN_7].snapshots[-1], PLAIN_7)
    five = drift(experiment.trained[PLAIN_5].snapshots[-1], PLAIN_5)
    trials = (experiment.transitions_first, experiment.random_plain)
    offs = [drift(one.snapshots[-1], PLAIN_7) for one in trials]
    text = (
        f"The furthest mean is {_percent(off)} of the bound from the x-axis; with 5 states {_percent(five)}. With the "
        f"transitions trained first: {_percent(offs[0])}; the likeliest of eight random starts: {_percent(offs[1])}."
    )
    return Finding(_verdict(min(off, *offs) > ON_AXIS, off > five), text)


def _narrow(experiment: Experiment) -> Finding:
    off = drift(experiment.trained[PLAIN_7_NARROW].snapshots[-1], PLAIN_7_NARROW)
    text = (
        f"The furthest mean is {_percent(off)} of the bound from the x-axis; with twice the variation "
        f"{_percent(drift(experiment.trained[PLAIN_7].snapshots[-1], PLAIN_7))}. Noise and floor apart, half the "
        "variation is another scale of y, and training with full covariances does not depend on scales."
    )
    return Finding(_verdict(off <= ON_AXIS), text)


def _twenty_narrow(iterations: int) -> Callable[[Experiment], Finding]:
    def observed(experiment: Experiment) -> Finding:
        snapshot = experiment.trained[PLAIN_20_NARROW].snapshots[iterations]
        off, middle = drift(snapshot, PLAIN_20_NARROW), in_the_middle(snapshot)
        text = (
            f"{_percent(middle)} of the means have x in [0.8, 1.2], 20 % would be uniform; the furthest is "
            f"{_percent(off)} of the bound from the x-axis."
        )
        return Finding(_verdict(middle >= 0.4, off > ON_AXIS), text)

    return observed


def _timed(setting: Setting) -> Callable[[Experiment], Finding]:
    def observed(experiment: Experiment) -> Finding:
        training = experiment.trained[setting]
        off, uneven = drift(training.snapshots[-1], setting), unevenness(training.snapshots[-1])
        text = (
            f"The furthest mean is {_percent(off)} of the bound from the x-axis, the longest step between means "
            f"{uneven:.2f} of the mean step. From iteration {training.settled(0.02)} on the means stay within "
            "0.02 of their last places."
        )
        return Finding(_verdict(off <= ON_AXIS, uneven < 1.5), text)

    return observed


def _random_start(experiment: Experiment) -> Finding:
    off = drift(experiment.starts["random"].snapshots[0], TIMED_10)
    return Finding(_verdict(off > ON_AXIS), f"The furthest mean is {_percent(off)} of the bound from the x-axis.")


def _five_iterations(setting: Setting) -> Callable[[Experiment], Finding]:
    def observed(experiment: Experiment) -> Finding:
        left = float(experiment.trained[setting].distances()[5])
        text = f"The means are at most {left:.3f} from the result."
        held = [left < 0.05]
        if setting == TIMED_10:
            there = experiment.trained[setting].snapshots[5].means
            gaps = {k: float(abs(one.snapshots[5].means - there).max()) for k, one in experiment.starts.items()}
            text += (
                f" From the random start they are then {gaps['random']:.3f} from these, from the simple start "
                f"{gaps['simple']:.3f}; the movement is 2 long."
            )
            held += [gap < 0.1 for gap in gaps.values()]
        return Finding(_verdict(*held), text)

    return observed


def _settled(training: Trained) -> str:
    settled, last = training.settled(), len(training.snapshots) - 1
    if settled > 0.9 * last:
        return f"the means still move after {last}"
    return f"from iteration {settled} on the means stay within 0.01"


def _counted(number: int) -> str:
    return "one branch" if number == 1 else f"{number} branches"


def _percent(fraction: float) -> str:
    return f"{100.0 * fraction:.0f} %"


_FINDINGS: dict[str, Callable[[Experiment], Finding]] = {
    "2.8": _branching(ERGODIC_10, 2),
    "2.9": _start(ERGODIC_10),
    "2.10": _twenty_iterations,
    "2.11": _ergodic_20,
    "2.12": _branching(SKIPS_20, 2),
    "2.13": _five,
    "2.14": _start(PLAIN_7),
    "2.15": _seven,
    "2.16": _narrow,
    "2.17": _twenty_narrow(10),
    "2.18": _twenty_narrow(RESULT),
    "2.19": _timed(TIMED_5),
    "2.20": _timed(TIMED_10),
    "2.21": _timed(TIMED_20),
    "2.22": _random_start,
    "2.23": _five_iterations(TIMED_10),
    "2.24": _five_iterations(TIMED_20),
}
