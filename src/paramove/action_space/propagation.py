"""How particles move from one frame to the next (thesis 6.4.4, corrected), the same at any frame rate."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from paramove.action_space.grammar import BASE, Grammar
from paramove.action_space.vocabulary import PLACE_SIZE, Vocabulary
from paramove.documents import Floats, InputError, Ints

THESIS_RATE_HZ = 8.0
"""The diffusions of 6.4.4 are given per frame at this rate. Here their variances grow with time, so that they are the
same per second at any rate, and at 8 Hz exactly the thesis's."""
LONGEST_STEP_S = 0.25
AT_TARGET = 0.8
"""The arm is at its target where the hand depends on it by more than this fraction of the maximum."""


@dataclass(frozen=True)
class PropagationOptions:
    """Diffusions as standard deviations per frame at 8 Hz, and additions to the thesis.

    `PropagationOptions.thesis()` gives 6.4.4 alone.

    Attributes:
        pace: relative deviation of the progress, x ~ N(0, pace^2).
        theta: deviation of theta at tau = 0; sigma(tau) = theta exp(-theta_decay tau).
        theta_decay: 2 ln 4 in the thesis (the printed sign grows).
        theta_share: if positive, no diffusion of theta is larger than this fraction of its deviation in the posterior,
            so that a target that is known stays known. 0 leaves this out.
        theta_floor: but no smaller than this fraction of sigma(tau): a posterior may be narrow around a wrong target.
        theta_min: deviation of components that the grammar hands over, and the minimum of all others.
        deviation_memory_s: time in which the deviation of an execution from the mean changes; 0 draws it anew in every
            frame, as the thesis does.
        deviation_renewed: fraction of particles whose deviation is drawn anew in addition.
        mirrored: fraction of particles that change to the progress of a similar pose in the opposite direction.
        from_base: fraction of particles that begin again from the base pose.
        from_prior: fraction of particles whose theta is drawn anew while theta is not known yet.
        known_theta: deviation (6.15) below which theta is known.
        retargeted: fraction of the particles at their target whose last target moves by a larger step while the
            progress stays, for a stretched arm that slides on to another target; 0 leaves this out.
        retarget: deviation of such a step of theta.
    """

    pace: float = 0.7
    theta: float = 0.4
    theta_decay: float = 2.0 * float(np.log(4.0))
    theta_share: float = 0.5
    theta_floor: float = 0.2
    theta_min: float = 0.01
    deviation_memory_s: float = 0.8
    deviation_renewed: float = 0.1
    mirrored: float = 0.02
    from_base: float = 0.01
    from_prior: float = 0.05
    known_theta: float = 0.1
    retargeted: float = 0.0
    retarget: float = 0.15

    def __post_init__(self) -> None:
        """Raises InputError for values out of range."""
        for name, value in vars(self).items():
            if not 0.0 <= value < np.inf:
                raise InputError(f"{name} is finite and not negative, found {value}")
        for name in ("deviation_renewed", "mirrored", "from_base", "from_prior", "retargeted"):
            if getattr(self, name) > 0.5:
                raise InputError(f"{name} is a fraction of at most 0.5, found {getattr(self, name)}")

    @classmethod
    def thesis(cls) -> PropagationOptions:
        """Propagation as in 6.4.4, with a fresh deviation in every frame and nothing added."""
        return cls(
            theta_share=0.0,
            theta_min=0.0,
            deviation_memory_s=0.0,
            deviation_renewed=0.0,
            mirrored=0.0,
            from_base=0.0,
            from_prior=0.0,
        )


@dataclass(frozen=True)
class Particles:
    """Weighted samples of omega = (a, theta, tau) and their poses.

    Attributes:
        step: number of the grammar's step, which has the action, shape (M,).
        origin: number of the step before, BASE for those that began from the base pose, shape (M,).
        theta: parameters, padded behind to the longest, shape (M, P).
        tau: progress in [0, 1], shape (M,).
        deviation: standardised deviation of this execution from the mean, shape (M, R).
        poses: drawn poses x^n, m, in the frame of the models, shape (M, 9).
        weights: pi^n, sum 1, shape (M,).
    """

    step: Ints
    origin: Ints
    theta: Floats
    tau: Floats
    deviation: Floats
    poses: Floats
    weights: Floats

    def __len__(self) -> int:
        return len(self.tau)

    def taken(self, rows: Ints) -> Particles:
        """Those rows, with equal weights."""
        return Particles(
            self.step[rows], self.origin[rows], self.theta[rows], self.tau[rows], self.deviation[rows],
            self.poses[rows], np.full(len(rows), 1.0 / len(rows)),
        )  # fmt: skip


class Propagation:
    """The propagation density p(omega_t | omega_{t-1}) for one vocabulary and grammar."""

    def __init__(self, vocabulary: Vocabulary, grammar: Grammar, options: PropagationOptions | None = None) -> None:
        grammar.check(vocabulary)
        self.vocabulary, self.grammar = vocabulary, grammar
        self.options = options if options is not None else PropagationOptions()
        self.actions = grammar.actions(vocabulary)
        models = [vocabulary.actions[action] for action in self.actions]
        self._durations = np.array([model.duration_s for model in models])
        self._bounds = np.array([model.bounds for model in models])
        self._free = grammar.free_components(vocabulary.n_parameters)

    def at_base(self, n_particles: int, rng: np.random.Generator) -> Particles:
        """Particles in the base pose, theta from the prior, tau = 0 (6.4.4)."""
        step, theta = self.grammar.beginning(n_particles, self.vocabulary.n_parameters, rng)
        return self._posed(step, theta, np.zeros(n_particles), rng)

    def anywhere(self, n_particles: int, rng: np.random.Generator) -> Particles:
        """Particles in any step at any progress, theta from the prior: for an arm in an unknown pose."""
        step = rng.integers(len(self.actions), size=n_particles)
        theta = rng.random((n_particles, self.vocabulary.n_parameters))
        return self._posed(step, theta, rng.random(n_particles), rng)

    def predicted(self, particles: Particles, elapsed_s: float, rng: np.random.Generator) -> Particles:
        """Particles `elapsed_s` later, in several steps if that is long; weights stay."""
        n_steps = max(1, int(np.ceil(elapsed_s / LONGEST_STEP_S - 1e-9)))
        known = self._theta_deviations(particles)
        for _ in range(n_steps):
            particles = self._step(particles, elapsed_s / n_steps, known, rng)
        poses = self.vocabulary.poses(self.actions[particles.step], particles.theta, particles.tau, particles.deviation)
        return replace(particles, poses=poses)

    def _step(self, particles: Particles, elapsed_s: float, known: Floats, rng: np.random.Generator) -> Particles:
        frames = elapsed_s * THESIS_RATE_HZ
        step, origin, theta = particles.step.copy(), particles.origin.copy(), particles.theta.copy()
        tau = self._progressed(particles, frames, rng)
        self.grammar.advance(step, origin, theta, tau, rng)
        self.grammar.switch(step, origin, theta, tau, per_step(self.grammar.switching.share, frames), rng)
        self._diffuse(step, theta, tau, frames, known, rng)
        self._retarget(step, theta, tau, frames, rng)
        self._jump(step, origin, theta, tau, frames, known, rng)
        deviation = self._remembered(particles.deviation, elapsed_s, rng)
        return replace(particles, step=step, origin=origin, theta=theta, tau=tau, deviation=deviation)

    def _progressed(self, particles: Particles, frames: float, rng: np.random.Generator) -> Floats:
        """tau + (1 + x) / (f T_a), not below 0; the variance of the progress grows with time."""
        per_frame = 1.0 / (THESIS_RATE_HZ * self._durations[particles.step])
        noise = self.options.pace * np.sqrt(frames) * rng.standard_normal(len(particles))
        return np.asarray(np.maximum(particles.tau + per_frame * (frames + noise), 0.0))

    def _diffuse(
        self, step: Ints, theta: Floats, tau: Floats, frames: float, known: Floats, rng: np.random.Generator
    ) -> None:
        """Adds N(0, sigma(tau)^2) to unknown components (figure 6.9), reflected at the bounds."""
        options = self.options
        sigma = np.broadcast_to((options.theta * np.exp(-options.theta_decay * tau))[:, None], theta.shape)
        if options.theta_share > 0.0:
            capped = np.minimum(sigma, options.theta_share * known[self.actions[step]])
            sigma = np.maximum(capped, options.theta_floor * sigma)
        sigma = np.where(self._free[step], np.maximum(sigma, options.theta_min), options.theta_min)
        theta += np.sqrt(frames) * sigma * rng.standard_normal(theta.shape)
        low, high = self._bounds[step].T
        theta[:] = reflected(theta, low[:, None], high[:, None])

    def _retarget(self, step: Ints, theta: Floats, tau: Floats, frames: float, rng: np.random.Generator) -> None:
        """Moves the target of some particles that have reached it; the progress stays."""
        fraction = per_step(self.options.retargeted, frames)
        if fraction == 0.0:
            return
        chosen = rng.random(len(tau)) < fraction
        steps = self.options.retarget * rng.standard_normal((len(tau), PLACE_SIZE))
        for number in np.unique(step[chosen]):
            action = self.vocabulary.actions[self.actions[number]]
            last = np.arange(action.n_parameters - PLACE_SIZE, action.n_parameters)
            rows = np.flatnonzero(chosen & (step == number))
            rows = rows[action.at_progress(action.place_dependence[-1], tau[rows]) > AT_TARGET]
            moved = theta[np.ix_(rows, last)] + np.where(self._free[number, last], steps[rows], 0.0)
            theta[np.ix_(rows, last)] = reflected(moved, *self._bounds[number])

    def _jump(
        self,
        step: Ints,
        origin: Ints,
        theta: Floats,
        tau: Floats,
        frames: float,
        known: Floats,
        rng: np.random.Generator,
    ) -> None:
        """Keeps alternative hypotheses alive that images hardly distinguish."""
        options, draws = self.options, rng.random(len(tau))
        mirrored, base = per_step(options.mirrored, frames), per_step(options.from_base, frames)
        for number in np.unique(step) if options.mirrored > 0.0 else ():
            table = self.vocabulary.actions[self.actions[number]].mirrored
            rows = np.flatnonzero((step == number) & (draws < mirrored))
            mirror_tau = table[np.rint(np.clip(tau[rows], 0.0, 1.0) * (len(table) - 1)).astype(np.int64)]
            tau[rows] = np.where(mirror_tau >= 0.0, mirror_tau, tau[rows])
        rows = np.flatnonzero((draws >= mirrored) & (draws < mirrored + base))
        if len(rows):
            step[rows], theta[rows] = self.grammar.beginning(len(rows), theta.shape[1], rng)
            tau[rows], origin[rows] = 0.0, BASE
        unknown = known[self.actions[step]].max(axis=1) > options.known_theta
        chosen = (rng.random(len(tau)) < per_step(options.from_prior, frames)) & unknown
        theta[:] = np.where(chosen[:, None] & self._free[step], rng.random(theta.shape), theta)

    def _remembered(self, deviation: Floats, elapsed_s: float, rng: np.random.Generator) -> Floats:
        """First-order autoregression whose stationary distribution is the standard normal."""
        memory = self.options.deviation_memory_s
        retained = np.exp(-elapsed_s / memory) if memory > 0.0 else 0.0
        renewed = per_step(self.options.deviation_renewed, elapsed_s * THESIS_RATE_HZ)
        factor = np.where(rng.random(len(deviation)) < renewed, 0.0, retained)[:, None]
        return np.asarray(factor * deviation + np.sqrt(1.0 - factor**2) * rng.standard_normal(deviation.shape))

    def _theta_deviations(self, particles: Particles) -> Floats:
        """Standard deviation of each component of theta for each action, shape (A, P)."""
        action, n_actions = self.actions[particles.step], len(self.vocabulary)
        mass = np.bincount(action, particles.weights, n_actions)[:, None] + 1e-300
        columns = range(particles.theta.shape[1])
        first = np.stack(
            [np.bincount(action, particles.weights * particles.theta[:, p], n_actions) for p in columns], 1
        )
        centred = particles.theta - (first / mass)[action]
        second = np.stack([np.bincount(action, particles.weights * centred[:, p] ** 2, n_actions) for p in columns], 1)
        return np.asarray(np.where(mass > 1e-3, np.sqrt(second / mass), np.inf))

    def _posed(self, step: Ints, theta: Floats, tau: Floats, rng: np.random.Generator) -> Particles:
        deviation = rng.standard_normal((len(step), self.vocabulary.n_deviations))
        poses = self.vocabulary.poses(self.actions[step], theta, tau, deviation)
        origin = np.full(len(step), BASE)
        return Particles(step, origin, theta, tau, deviation, poses, np.full(len(step), 1.0 / len(step)))


def per_step(fraction: float, frames: float) -> float:
    """Fraction in a step of `frames` frames (of 8 Hz) that corresponds to `fraction` in each frame."""
    return float(1.0 - (1.0 - fraction) ** frames)


def reflected(values: Floats, low: Floats, high: Floats) -> Floats:
    """Values folded into [low, high]: values beyond a bound are reflected at it."""
    width = high - low
    folded = np.mod(values - low, 2.0 * width)
    return np.asarray(low + np.where(folded > width, 2.0 * width - folded, folded))
