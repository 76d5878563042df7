"""Tracking in action space: an arm followed as action, parameters and progress (thesis 6.3 and 6.4)."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from paramove.action_space.estimates import (
    KERNEL_WIDTHS,
    ThetaEstimate,
    action_probabilities,
    best_pose,
    mean_pose,
    pose_covariance,
    refined_pose,
    tau_histogram,
    theta_estimate,
)
from paramove.action_space.grammar import Grammar
from paramove.action_space.particle_filter import FilterOptions, Measurement, ParticleFilter, effective_number
from paramove.action_space.person import PersonPlacement
from paramove.action_space.propagation import THESIS_RATE_HZ, Particles, Propagation, PropagationOptions, per_step
from paramove.action_space.target_detection import DetectedTarget, DetectionOptions, TargetDetector
from paramove.action_space.track_health import HealthOptions, TrackHealth
from paramove.action_space.vocabulary import PLACE_SIZE, ActionModel, Vocabulary
from paramove.documents import Floats, InputError, Ints
from paramove.observation import HAND, Presence

MIN_CONCENTRATION = 0.8
"""Length of the mean of the progress as a direction, 0 (scattered over all of the action) to 1."""
JUMP = 0.25
"""Of the progress, beyond what the time between two frames explains."""
Measure = Callable[[Floats], Floats | None]
CONTACT = 0.8
"""Fraction of the largest dependence of the hand on a target from which on the hand is at that target."""


@dataclass(frozen=True)
class ReachedTarget:
    """The target of the particles whose hand is at one.

    Attributes:
        contact: posterior probability of a progress at which the hand is at a target of its action.
        action: name of the most probable action among those.
        theta: coordinates (u, v) of the target. position: in the models' frame, m, (3,).
    """

    contact: float
    action: str
    theta: ThetaEstimate
    position: Floats


def reached_target(vocabulary: Vocabulary, action: Ints, particles: Particles) -> ReachedTarget | None:
    """The target at which the hand is, by all actions with the same target function; None if no particle is at one.

    When one action ends at a target and the next begins at_target (6.7.3), particles of both contribute.
    """
    at_target = np.zeros(len(particles), dtype=np.bool_)
    coordinates = np.empty((len(particles), PLACE_SIZE))
    for number, model in enumerate(vocabulary.actions):
        rows = np.flatnonzero(action == number)
        if len(rows):
            at_target[rows], coordinates[rows] = _at_target(model, particles.theta[rows], particles.tau[rows])
    mass = np.bincount(action[at_target], particles.weights[at_target], len(vocabulary))
    if not mass.sum() > 0.0:
        return None
    likeliest = vocabulary.actions[int(mass.argmax())]
    same_target = np.array([model.target is likeliest.target for model in vocabulary.actions])
    chosen = at_target & same_target[action]
    theta = theta_estimate(coordinates[chosen], particles.weights[chosen])
    return ReachedTarget(float(mass.sum()), likeliest.name, theta, likeliest.target(theta.mean))


def _at_target(model: ActionModel, theta: Floats, tau: Floats) -> tuple[NDArray[np.bool_], Floats]:
    """Whether each hand is at a target, and the coordinates of the target on which it depends most. (K,), (K, 2)."""
    dependence = np.stack([model.at_progress(table, tau) for table in model.place_dependence])
    which = dependence.argmax(axis=0)
    places = theta[:, : model.n_parameters].reshape(len(theta), -1, PLACE_SIZE)
    return dependence.max(axis=0) >= CONTACT, places[np.arange(len(theta)), which]


@dataclass(frozen=True)
class TrackerOptions:
    """All options of a tracker.

    Attributes:
        filter, propagation, detection, health: of these parts.
        histogram_bins: of the histogram over progress.
        longest_gap_s: after a longer time without a frame the arm may be anywhere.
        lost_retained: fraction of the particles that continue when the arm is lost, in case the loss is an error.
        lost_renewed: fraction of the particles that begin again in each frame (at 8 Hz) while the arm is lost.
        lost_anywhere: fraction of these that begin anywhere; the others begin in the base pose.
        explored: fraction of the particles that moves anywhere in each frame (at 8 Hz): a grammar may have led all of
            them to an action that is not performed.
    """

    filter: FilterOptions = field(default_factory=FilterOptions)
    propagation: PropagationOptions = field(default_factory=PropagationOptions)
    detection: DetectionOptions = field(default_factory=DetectionOptions)
    health: HealthOptions = field(default_factory=HealthOptions)
    histogram_bins: int = 20
    longest_gap_s: float = 1.5
    lost_retained: float = 0.25
    lost_renewed: float = 0.3
    lost_anywhere: float = 0.5
    explored: float = 0.05


@dataclass(frozen=True)
class TrackEstimate:
    """Estimates after a frame; positions in the world, m.

    Attributes:
        time_s: of the frame.
        actions: posterior probability of each action (6.8).
        theta: parameters of each action that has particles (6.10), (6.11).
        targets: target of the mean parameters of each action that has particles, (3,).
        tau_histogram: posterior over progress, all bins sum to 1; one row an action, in the order of `actions`.
        pose: refined (6.18), (D,). pose_best: (6.16), (D,).
        covariance: of the pose, m^2, (D, D).
        effective_sample_size: effective number of particles.
        temper: exponent of the likelihood; below 1 it was flattened.
        log_likelihood: of the best particle, nats; NaN without a usable view.
        contact: posterior probability that the hand is at a target of its action.
        lost: whether the arm is lost. degraded: whether there was no usable view.
        detail: what is wrong and what it costs; "" if nothing is.
        target: the latest target that the hand reached.
    """

    time_s: float
    actions: dict[str, float]
    theta: dict[str, ThetaEstimate]
    targets: dict[str, Floats]
    tau_histogram: Floats
    pose: Floats
    pose_best: Floats
    covariance: Floats
    effective_sample_size: float
    temper: float
    log_likelihood: float
    contact: float
    lost: bool = False
    degraded: bool = False
    detail: str = ""
    target: DetectedTarget | None = field(default=None)

    @property
    def action(self) -> str:
        """The most probable action."""
        return max(self.actions, key=lambda name: self.actions[name])


class ActionTracker:
    """Follows one arm. The same seed and the same measurements give the same estimates.

    Attributes:
        filter: the particles. health: whether the arm is lost. detector: of targets. progress_jumps: how often the
            estimated progress jumped. estimate: that after the latest frame; None before the first.
    """

    def __init__(
        self, vocabulary: Vocabulary, grammar: Grammar, placement: PersonPlacement | None = None,
        options: TrackerOptions | None = None, seed: int = 0
    ) -> None:  # fmt: skip
        self.vocabulary = vocabulary
        self.placement = placement if placement is not None else PersonPlacement()
        self.options = options if options is not None else TrackerOptions()
        propagation = Propagation(vocabulary, grammar, self.options.propagation)
        self.filter = ParticleFilter(propagation, self.options.filter, seed)
        self.health = TrackHealth(self.options.health)
        self.detector = TargetDetector(self.options.detection)
        self.progress_jumps = ProgressJumps()
        self.estimate: TrackEstimate | None = None
        self._blind_since_s: float | None = None
        self._just_lost = False

    def update(
        self, time_s: float, measure: Measure, presence: Callable[[Floats], Presence] | None = None
    ) -> TrackEstimate:
        """One frame.

        Args:
            time_s: of its capture. A frame that is not later than the one before is ignored.
            measure: log-likelihoods (M,), nats, of poses (M, D) in the world; None, values that are all equal or not
                finite: there was no usable view.
            presence: evidence that the images show an arm in a pose (D,) in the world.
        """
        last = self.estimate
        if last is not None and not time_s > last.time_s:
            return replace(last, detail=f"ignored a frame {last.time_s - time_s:.3f} s older than the latest")
        elapsed_s = 0.0 if last is None else time_s - last.time_s
        self._renew(elapsed_s)
        self.filter.resample()
        if elapsed_s > 0.0:
            if self._blind_since_s is None:
                self.filter.explore(per_step(self.options.explored, min(THESIS_RATE_HZ * elapsed_s, 1.0)))
            self.filter.predict(min(elapsed_s, self.options.longest_gap_s))
        likelihoods = self._usable(measure(self.placement.in_world(self.filter.particles.poses)))
        measured = (
            None
            if likelihoods is None
            else self.filter.measure(likelihoods, self.options.filter.independence(elapsed_s))
        )
        average = mean_pose(self.filter.particles.poses, self.filter.particles.weights)
        present = None if presence is None or measured is None else presence(self.placement.in_world(average))
        self._judge(time_s, elapsed_s, measured, present)
        self.estimate = self._estimated(time_s, measured, average)
        self._count_jumps(elapsed_s)
        return self.estimate

    def _renew(self, elapsed_s: float) -> None:
        """Moves particles to where the arm could be, if its pose is not known."""
        options = self.options
        if elapsed_s > options.longest_gap_s:
            self.filter.begin_again(options.lost_anywhere)
            self.detector.forget()
        elif self._just_lost:
            self.filter.begin_again(options.lost_anywhere, 1.0 - options.lost_retained)
        elif self.health.lost and self._blind_since_s is None:
            renewed = per_step(options.lost_renewed, min(THESIS_RATE_HZ * elapsed_s, 1.0))
            self.filter.begin_again(options.lost_anywhere, renewed)
        self._just_lost = False

    def _usable(self, log_likelihoods: Floats | None) -> Floats | None:
        """Log-likelihoods that differ between poses, else None. Raises InputError for a wrong number of them."""
        if log_likelihoods is None:
            return None
        values = np.asarray(log_likelihoods, dtype=np.float64)
        n_particles = len(self.filter.particles)
        if values.shape != (n_particles,):
            raise InputError(f"expected one log-likelihood for each of {n_particles} poses, found shape {values.shape}")
        values = np.where(np.isnan(values) | np.isposinf(values), -np.inf, values)
        finite = values[np.isfinite(values)]
        return None if len(finite) == 0 or (len(finite) == len(values) and np.ptp(finite) == 0.0) else values

    def _judge(self, time_s: float, elapsed_s: float, measured: Measurement | None, present: Presence | None) -> None:
        if measured is None:
            self._blind_since_s = time_s if self._blind_since_s is None else self._blind_since_s
            return
        self._blind_since_s = None
        was_lost = self.health.lost
        self.health.update(time_s, elapsed_s, measured.best, measured.temper, present)
        if self.health.lost and not was_lost:
            self._just_lost = True
            self.detector.forget()

    def _estimated(self, time_s: float, measured: Measurement | None, average: Floats) -> TrackEstimate:
        particles, placement = self.filter.particles, self.placement
        action = self.filter.propagation.actions[particles.step]
        probabilities = action_probabilities(action, particles.weights, len(self.vocabulary))
        theta, targets = self._theta(action)
        best = average if measured is None else best_pose(particles.poses, particles.weights)
        reached = reached_target(self.vocabulary, action, particles)
        widths = tuple(width / placement.scale for width in KERNEL_WIDTHS)
        estimate = TrackEstimate(
            time_s=time_s,
            actions=dict(zip(self.vocabulary.names, map(float, probabilities), strict=True)),
            theta=theta,
            targets=targets,
            tau_histogram=tau_histogram(
                action, particles.tau, particles.weights, len(self.vocabulary), self.options.histogram_bins
            ),
            pose=placement.in_world(refined_pose(particles.poses, particles.weights, best, widths)),
            pose_best=placement.in_world(best),
            covariance=placement.scale**2 * pose_covariance(particles.poses, particles.weights),
            effective_sample_size=effective_number(particles.weights),
            temper=1.0 if measured is None else measured.temper,
            log_likelihood=float("nan") if measured is None else measured.best,
            contact=0.0 if reached is None else reached.contact,
            lost=self.health.lost,
            degraded=measured is None,
            detail=self._detail(time_s),
        )
        return replace(estimate, target=self._target(estimate, reached))

    def _count_jumps(self, elapsed_s: float) -> None:
        if self.estimate is None or self.estimate.lost or self.estimate.degraded:
            return
        particles, name = self.filter.particles, self.estimate.action
        number = self.vocabulary.index(name)
        rows = self.filter.propagation.actions[particles.step] == number
        advance = elapsed_s / self.vocabulary.actions[number].duration_s
        self.progress_jumps.update(name, particles.tau[rows], particles.weights[rows], advance)

    def _theta(self, action: Ints) -> tuple[dict[str, ThetaEstimate], dict[str, Floats]]:
        """Parameters and targets of the actions that have particles."""
        particles, theta, targets = self.filter.particles, {}, {}
        for number, model in enumerate(self.vocabulary.actions):
            rows = (action == number) & (particles.weights > 0.0)
            if rows.any():
                estimate = theta_estimate(particles.theta[rows, : model.n_parameters], particles.weights[rows])
                theta[model.name] = estimate
                targets[model.name] = self.placement.in_world(model.target(estimate.mean))
        return theta, targets

    def _target(self, estimate: TrackEstimate, reached: ReachedTarget | None) -> DetectedTarget | None:
        if estimate.lost or estimate.degraded or self.health.absence:
            return self.detector.latest
        hand = estimate.pose[HAND]
        if reached is None:
            return self.detector.passed(estimate.time_s, hand)
        position = self.placement.in_world(reached.position)
        return self.detector.update(estimate.time_s, hand, reached.contact, reached.action, reached.theta, position)

    def _detail(self, time_s: float) -> str:
        if self._blind_since_s is not None:
            blind_s = time_s - self._blind_since_s
            return (
                f"no usable view for {blind_s:.1f} s: pose and progress are only predicted, their uncertainty grows, "
                "and no target is detected"
            )
        if self.health.lost_since_s is not None:
            shortfall, count = self.health.shortfall, len(self.filter.particles)
            cause = self.health.absence or f"the best of {count} hypotheses is {shortfall:.1f} nats below the usual"
            return (
                f"the arm has been lost for {time_s - self.health.lost_since_s:.1f} s, {cause}: pose and target are "
                "guesses, and no target is detected until the arm is found in its base pose or elsewhere"
            )
        return ""


class ProgressJumps:
    """Counts how often the estimated progress jumps: an arm that moves out looks like one that moves back.

    Attributes:
        count: jumps so far, between frames with the same action and a progress of which the filter was certain.
    """

    def __init__(self) -> None:
        self.count = 0
        self._last: tuple[str, float] | None = None

    def update(self, action: str, tau: Floats, weights: Floats, advance: float) -> None:
        """Takes progress (K,) and weights (K,) of the particles of the most probable action.

        `advance`: mean gain of the progress in the time since the frame before. Progress is cyclic: the end of an
        action is next to its beginning.
        """
        mean = weights @ np.exp(2j * np.pi * tau) / max(float(weights.sum()), 1e-300)
        if abs(mean) < MIN_CONCENTRATION:
            return
        now = float(np.angle(mean)) / (2.0 * np.pi)
        if self._last is not None and self._last[0] == action:
            gained = (now - self._last[1] - advance + 0.5) % 1.0 - 0.5
            self.count += abs(gained) > JUMP
        self._last = action, now
