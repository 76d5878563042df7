"""One small logistic network per state, added to a polynomial: how state means depend on theta (thesis 3.3.2, (3.5)).

mu_i(theta) = Z_i phi(u) + W2_i sigma(W1_i u + b1_i). The polynomial, which includes b2, models the nearly linear
part, so that few hidden units learn the rest. For given hidden units the other weights follow from a linear
equation, so gradients are needed for W1 and b1 only: of the Q-function with the best Z and W2 inserted.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.special import expit

from paramove.documents import Floats
from paramove.phmm.storage import check_shapes

INNER_DEVIATION = 3.0
"""Standard deviation of the prior on W1 and b1, for theta scaled to [-1, 1]: steps as steep as a fifth of the range."""
MEMORY, MAX_HALVINGS = 10, 12


@dataclass(frozen=True)
class StateNetworks:
    """The networks of all states.

    Attributes:
        skip: Z, shape (N, D, F), in the unit of the sequences.
        outer: W2, shape (N, D, H), likewise.
        inner: W1 and, last, b1, shape (N, H, P + 1).
    """

    skip: Floats
    outer: Floats
    inner: Floats

    @classmethod
    def from_arrays(cls, arrays: dict[str, Floats], n_states: int, n_features: int, n_components: int) -> StateNetworks:
        """From a file's "skip", "outer" and "inner". Raises ValueError for shapes that do not fit together."""
        dim, hidden = arrays["skip"].shape[1], arrays["inner"].shape[1]
        expected = {"skip": (n_states, dim, n_features), "outer": (n_states, dim, hidden)}
        check_shapes(arrays, expected | {"inner": (n_states, hidden, n_components + 1)})
        return cls(arrays["skip"], arrays["outer"], arrays["inner"])

    def means(self, positions: Floats, features: Floats) -> Floats:
        """Means of all states at scaled theta (M, P) with monomials (M, F). Shape (M, N, D)."""
        hidden = hidden_units(self.inner, positions)
        result: Floats = np.einsum("ndf,mf->mnd", self.skip, features)
        result += np.einsum("ndh,mnh->mnd", self.outer, hidden)
        return result


@dataclass(frozen=True)
class StateTargets:
    """Targets of the networks: the part of the Q-function that depends on them.

    Q = -1/2 sum_k,i w_ki |y_ki - mu_i(theta_k)|^2_i - the prior, where |r|^2_i = sum_d precision_id (rotation_i r)_d^2
    and the prior regularises the rotated Z and W2 by `ridge` and W1, b1 by INNER_DEVIATION.

    Attributes:
        positions: scaled theta of each target, (K, P). features: monomials, (K, F).
        weights: w, (K, N). rotated: rotation_i y_ki, (K, N, D).
        rotation: shape (N, D, D). precision: shape (N, D).
        ridge: precision of each column of Z and W2, (F + H,).
    """

    positions: Floats
    features: Floats
    weights: Floats
    rotated: Floats
    rotation: Floats
    precision: Floats
    ridge: Floats

    def loss_and_gradient(self, inner: Floats) -> tuple[float, Floats]:
        """-Q with the best Z and W2, up to a constant, and its derivative in W1 and b1 (N, H, P + 1)."""
        design, hidden = self._design(inner)
        best = self._best(design)
        residuals = self.rotated - np.einsum("knq,ndq->knd", design, best)
        pulled = residuals * (self.weights[:, :, None] * self.precision[None])
        loss = 0.5 * float((pulled * residuals).sum() + (self.ridge * best**2).sum())
        loss += 0.5 * float((inner**2).sum()) / INNER_DEVIATION**2
        # The best Z and W2 move with the hidden units, but at the minimum that changes nothing (envelope theorem).
        outer = best[:, :, self.features.shape[1] :]
        bent = -np.einsum("knd,ndh->knh", pulled, outer) * hidden * (1.0 - hidden)
        gradient = np.einsum("knh,kp->nhp", bent, _with_one(self.positions)) + inner / INNER_DEVIATION**2
        return loss, gradient

    def networks(self, inner: Floats) -> StateNetworks:
        """The best networks with these hidden units."""
        best: Floats = np.linalg.solve(self.rotation, self._best(self._design(inner)[0])).astype(np.float64)
        n_features = self.features.shape[1]
        return StateNetworks(best[..., :n_features].copy(), best[..., n_features:].copy(), inner)

    def improved(self, inner: Floats, steps: int) -> Floats:
        """W1 and b1 after some steps of a quasi-Newton method, each of which raises Q (generalised EM)."""
        if inner.size == 0 or steps == 0:
            return inner

        best, loss, gradient = inner, *self.loss_and_gradient(inner)
        moves: list[tuple[Floats, Floats]] = []
        for _ in range(steps):
            direction = -_newton_like(gradient, moves)
            descent = float((direction * gradient).sum())
            if not descent < 0.0:
                break
            length = 1.0 if moves else min(1.0, 1.0 / float(np.abs(gradient).max()))
            for _ in range(MAX_HALVINGS):
                candidate = best + length * direction
                candidate_loss, slope = self.loss_and_gradient(candidate)
                if candidate_loss <= loss + 1e-4 * length * descent:
                    break
                length *= 0.5
            else:
                break
            gained = loss - candidate_loss
            if float(((candidate - best) * (slope - gradient)).sum()) > 0.0:
                moves = [*moves[1 - MEMORY :], (candidate - best, slope - gradient)]
            best, loss, gradient = candidate, candidate_loss, slope
            if gained < 1e-9 * max(1.0, abs(loss)):
                break
        return best

    def _design(self, inner: Floats) -> tuple[Floats, Floats]:
        hidden = hidden_units(inner, self.positions)
        skip = np.broadcast_to(self.features[:, None], (*hidden.shape[:2], self.features.shape[1]))
        return np.concatenate([skip, hidden], axis=2), hidden

    def _best(self, design: Floats) -> Floats:
        """Rotated Z and W2, (N, D, F + H)."""
        weighed = design * self.weights[:, :, None]
        squares = np.einsum("knp,knq->npq", weighed, design, optimize=True)
        products = np.einsum("knd,knq->ndq", self.rotated, weighed, optimize=True)
        penalty = np.diag(self.ridge + 1e-9)
        if (self.precision == self.precision[:1, :1]).all():
            shared = self.precision[0, 0] * squares + penalty
            solved = np.linalg.solve(shared, self.precision[0, 0] * np.swapaxes(products, 1, 2))
            return np.swapaxes(solved, 1, 2)
        each = self.precision[:, :, None, None] * squares[:, None] + penalty
        result: Floats = np.linalg.solve(each, (self.precision[:, :, None] * products)[..., None])[..., 0]
        return result


def _newton_like(gradient: Floats, moves: list[tuple[Floats, Floats]]) -> Floats:
    """The gradient times the inverse curvature estimated from the last moves (limited-memory BFGS).

    scipy's takes many times as long where its threads have to wait for processors.
    """
    result = gradient.copy()
    factors = []
    for moved, changed in reversed(moves):
        factor = float((moved * result).sum() / (moved * changed).sum())
        factors.append(factor)
        result -= factor * changed
    if moves:
        moved, changed = moves[-1]
        result *= float((moved * changed).sum() / (changed * changed).sum())
    for (moved, changed), factor in zip(moves, reversed(factors), strict=True):
        result += (factor - float((changed * result).sum() / (moved * changed).sum())) * moved
    return result


def hidden_units(inner: Floats, positions: Floats) -> Floats:
    """sigma(W1 u + b1) of all states. Shape (M, N, H)."""
    result: Floats = expit(np.einsum("nhp,mp->mnh", inner, _with_one(positions)))
    return result


def drawn_inner(n_states: int, n_hidden: int, n_components: int, rng: np.random.Generator) -> Floats:
    """A start: units whose steps lie within the range of theta, the same in all states so that these remain similar."""
    inner = rng.standard_normal((n_hidden, n_components + 1))
    inner[:, :-1] *= 3.0 / np.maximum(np.linalg.norm(inner[:, :-1], axis=1, keepdims=True), 1e-9)
    inner[:, -1] = 3.0 * rng.uniform(-0.8, 0.8, n_hidden)
    return np.broadcast_to(inner, (n_states, *inner.shape)).copy()


def _with_one(positions: Floats) -> Floats:
    return np.concatenate([positions, np.ones((len(positions), 1))], axis=1)
