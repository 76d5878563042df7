"""Movements and parameters that hardly fit the others of a set: other units, other bodies, wrong labels, angles.

Nothing here decides whether a movement is right; it names those at which a person should look.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np

from paramove.demonstrations.movement import POINTS_FIRST, Movement, at_times, position_in_theta
from paramove.documents import Floats

UNITS = {1000.0: "millimetres", 100.0: "centimetres", 10.0: "another unit"}
"""How many times as large numbers are in another unit than in metres."""
OTHER_UNIT = 7.0
"""A body that is so many times as large as the others is in another unit."""
OTHER_BODY, OTHER_BODY_M = 1.6, 0.05
"""Persons' limbs differ by a smaller factor, or by less."""
RIGID = 0.05
"""Of the mean distance: two points whose distance varies less in a movement are on one limb."""
FRACTIONS = np.array([0.0, 0.25, 0.5, 0.75, 1.0])
"""Of the time, at which paths are compared."""
FEWEST = 6
ODD, MISLABELLED = 10.0, 4.0
"""A path so many times as far from what theta predicts as the median is odd; a smaller deviation is, if it is that of
another label."""
ODD_M = 0.05
"""No smaller deviation is odd."""
BETTER = 0.4
"""Another label is proposed if the goal is at most so far from its, of the distance from that of its own."""
THETA_UNIT = 20.0
"""Numbers in theta so many times as large as those of the points are in another unit."""
LARGEST_M, SMALLEST_M = 10.0, 0.005
"""Extents of the path of a hand."""
ANGLE = re.compile(
    r"(?:.*[_ ])?(?:angle|yaw|roll|pitch|azimuth|heading|direction|dir|bearing|orientation|turn|rotation|rot|r[xyz]|"
    r"theta|alpha|beta|gamma|phi|psi|deg|rad)s?(?:[_ ].*)?",
    re.IGNORECASE,
)
OTHER_DURATION = 3.0
"""A movement that lasts so many times as long as the others, or that part of it, has another rate."""
FAR_RANGES = 3.0
"""A number in theta so many ranges of the others' away from them is a typing error."""
FOLLOWS, IGNORES = 0.9, 0.4
"""Correlations of a number in theta with the coordinate that it is, and with one that it is not."""
NUMBERED = re.compile(r"parameter_\d+")


class Oddity(NamedTuple):
    """Something that hardly fits.

    Attributes:
        message: For a person; names the movement or parameter, what was found, and what it may be.
        spoils: Whether a model that is trained with it is useless.
    """

    message: str
    spoils: bool = False


def oddities(movements: Sequence[Movement]) -> list[Oddity]:
    """What hardly fits in movements that have the same points and parameters."""
    about_unit = list(_unit_of_theta(movements))
    found = [*_sizes(movements), *about_unit, *_angles(movements)]
    for action in sorted({movement.action for movement in movements}):
        of_action = [movement for movement in movements if movement.action == action]
        found += _durations(of_action)
        if not about_unit:
            found += [*_far_in_theta(of_action), *_axes_of_theta(of_action)]
    if not any(oddity.spoils for oddity in found):
        found += _labels(movements)
    return found


def _hand(movements: Sequence[Movement]) -> int:
    """Number of the point whose path counts: the fingertip or the wrist, else the one that moves most."""
    names = movements[0].point_names
    for name in POINTS_FIRST:
        if name in names:
            return names.index(name)
    extents = [np.linalg.norm(np.ptp(movement.positions, axis=0), axis=1) for movement in movements]
    return int(np.argmax(np.median(extents, axis=0)))


# Sizes ------------------------------------------------------------------------------------------------------------


def _sizes(movements: Sequence[Movement]) -> Iterator[Oddity]:
    """Movements in another unit, or of another body, than the others."""
    if not movements:
        return
    hand = _hand(movements)
    extents = np.array([np.linalg.norm(np.ptp(movement.positions[:, hand], axis=0)) for movement in movements])
    sizes = _limbs(movements) if len(movements[0].point_names) > 1 else extents[:, None]
    for number, movement in enumerate(movements):
        others = np.delete(sizes, number, axis=0)
        ratio = _ratio(sizes[number], others)
        unit = _unit(ratio)
        if unit:
            yield Oddity(f"{movement.source}: {_times(ratio)} the others: is it in {unit}?", spoils=True)
        elif len(movements) > 2 and len(movement.point_names) > 1:
            yield from _limb(movement, sizes[number], others)
        if not unit and len(movements) < 3 and not SMALLEST_M <= extents[number] <= LARGEST_M:
            yield Oddity(
                f"{movement.source}: {movement.point_names[hand]} goes {extents[number]:.3g} m: is the unit right?"
            )


def _limbs(movements: Sequence[Movement]) -> Floats:
    """Median distances between points, m; NaN between those not on one limb. Shape (K, P (P - 1) / 2)."""
    one, other = np.triu_indices(len(movements[0].point_names), 1)
    means = np.empty((len(movements), len(one)))
    varying = np.empty_like(means)
    for number, movement in enumerate(movements):
        distances = np.linalg.norm(movement.positions[:, one] - movement.positions[:, other], axis=2)
        means[number] = np.median(distances, axis=0)
        varying[number] = distances.std(axis=0) / np.maximum(means[number], 1e-12)
    rigid = np.median(varying, axis=0) < RIGID
    if rigid.any():
        means[:, ~rigid] = np.nan
    return means


def _ratio(sizes: Floats, others: Floats) -> float:
    """How many times as large as the others; 1 if that cannot be known."""
    if not len(others):
        return 1.0
    usual = np.median(others, axis=0)
    known = np.isfinite(sizes) & np.isfinite(usual) & (sizes > 0.0) & (usual > 0.0)
    return float(np.median(sizes[known] / usual[known])) if known.any() else 1.0


def _unit(ratio: float) -> str:
    """The unit of numbers that are so many times as large; "" for the same unit."""
    if 1.0 / OTHER_UNIT < ratio < OTHER_UNIT:
        return ""
    factor = max(ratio, 1.0 / ratio)
    nearest = min(UNITS, key=lambda unit: abs(np.log(unit / factor)))
    return UNITS[nearest] if ratio > 1.0 else "metres, and the others in " + UNITS[nearest]


def _times(ratio: float) -> str:
    return f"its points are {round(ratio)} times as far apart as those of" if ratio > 1.0 else (
        f"its points are {1.0 / ratio:.4g} times as close together as those of"
    )  # fmt: skip


def _limb(movement: Movement, sizes: Floats, others: Floats) -> Iterator[Oddity]:
    """The limb that differs most from that of the others, if it cannot be the same person's."""
    one, other = np.triu_indices(len(movement.point_names), 1)
    usual = np.median(others, axis=0)
    with np.errstate(divide="ignore", invalid="ignore"):
        ratios = np.abs(np.log(sizes / usual))
    ratios[~np.isfinite(ratios)] = 0.0
    worst = int(np.argmax(ratios))
    if ratios[worst] <= np.log(OTHER_BODY) or abs(sizes[worst] - usual[worst]) <= OTHER_BODY_M:
        return
    names = f"{movement.point_names[one[worst]]} and {movement.point_names[other[worst]]}"
    yield Oddity(
        f"{movement.source}: {names} are {sizes[worst]:.3g} m apart, in the other movements {usual[worst]:.3g} m: are "
        "its points named correctly, and in the right unit?"
    )


# Theta ------------------------------------------------------------------------------------------------------------


def _unit_of_theta(movements: Sequence[Movement]) -> Iterator[Oddity]:
    """Positions in theta whose numbers cannot be in the unit of the points."""
    place = position_in_theta(movements[0].parameter_names) if movements else None
    if place is None:
        return
    theta = np.array([movement.theta[place] for movement in movements])
    hand = _hand(movements)
    ends = np.array([movement.positions[-1, hand] for movement in movements])
    largest = np.abs(theta).max(axis=1)
    reach = np.array([np.abs(movement.positions).max() for movement in movements])
    ratio = float(np.median(largest) / max(float(np.median(reach)), 1e-12))
    names = movements[0].parameter_names[place]
    if ratio > THETA_UNIT or (0.0 < ratio < 1.0 / THETA_UNIT and len(movements) > 1):
        ranges = "; ".join(
            f"{name} is {low:.4g} ... {high:.4g}"
            for name, low, high in zip(names, theta.min(axis=0), theta.max(axis=0), strict=True)
        )
        unit = _unit(ratio)
        yield Oddity(
            f"{ranges}, but {movements[0].point_names[hand]} ends within {np.abs(ends).max():.2g} m: "
            f"{'millimetres' if not unit else unit.replace('metres, and the others', 'metres, and the points')}? "
            "Theta is in metres"
        )
        return
    for number, movement in enumerate(movements):
        others = np.delete(largest, number)
        if len(others) > 1 and largest[number] > THETA_UNIT * max(float(np.median(others)), float(reach[number])):
            yield Oddity(
                f"{movement.source}: its theta is {largest[number]:.4g}, that of others {np.median(others):.3g}: "
                f"{_unit(float(largest[number] / max(float(np.median(others)), 1e-12)))}? Theta is in metres",
                spoils=True,
            )


def _durations(movements: Sequence[Movement]) -> Iterator[Oddity]:
    """Movements of one action that last far longer, or shorter, than the others."""
    durations = np.array([movement.duration for movement in movements])
    for number, movement in enumerate(movements if len(movements) > 2 else ()):
        usual = float(np.median(np.delete(durations, number)))
        if not usual / OTHER_DURATION < durations[number] < usual * OTHER_DURATION:
            yield Oddity(
                f"{movement.source}: it lasts {durations[number]:.3g} s, the others {usual:.3g} s: is its rate right?"
            )


def _far_in_theta(movements: Sequence[Movement]) -> Iterator[Oddity]:
    """Numbers in theta of one action that are far from those of all others."""
    theta = np.array([movement.theta for movement in movements]).reshape(len(movements), -1)
    for number, movement in enumerate(movements if len(movements) > FEWEST - 2 else ()):
        others = np.delete(theta, number, axis=0)
        low, high = others.min(axis=0), others.max(axis=0)
        away = np.maximum(theta[number] - high, low - theta[number])
        for column in np.flatnonzero((away > FAR_RANGES * (high - low)) & (high > low)).tolist():
            yield Oddity(
                f"{movement.source}: its {movement.parameter_names[column]} is {theta[number, column]:.4g}, that of "
                f"the others {low[column]:.4g} ... {high[column]:.4g}: is it typed correctly?"
            )


def _axes_of_theta(movements: Sequence[Movement]) -> Iterator[Oddity]:
    """Positions in theta of one action that the hand follows along another axis, or backwards."""
    names = movements[0].parameter_names
    place = position_in_theta(names)
    if place is None or len(movements) < FEWEST:
        return
    theta = np.array([movement.theta[place] for movement in movements])
    hand = _hand(movements)
    goals = np.stack([_farthest(movement.positions[:, hand]) for movement in movements])
    for axis, name in enumerate(names[place]):
        if len(np.unique(theta[:, axis])) < 3:
            continue
        follows = np.array([_correlation(theta[:, axis], goals[:, other]) for other in range(goals.shape[1])])
        other = int(np.argmax(np.abs(follows)))
        if follows[axis] < -FOLLOWS:
            yield Oddity(f"{name} grows where the hand's {'xyz'[axis]} falls: is theta in the axes of the points?")
        elif abs(follows[other]) > FOLLOWS and abs(follows[axis]) < IGNORES:
            yield Oddity(
                f"the hand goes along {'xyz'[other]} where {name} changes, not along {'xyz'[axis]}: is theta in the "
                "axes of the points?"
            )


def _correlation(one: Floats, other: Floats) -> float:
    """Pearson's; 0 for values that are all equal."""
    spread = float(one.std() * other.std())
    return float(((one - one.mean()) * (other - other.mean())).mean()) / spread if spread > 0.0 else 0.0


def _angles(movements: Sequence[Movement]) -> Iterator[Oddity]:
    """Angles in theta that jump where they go on."""
    for column, name in enumerate(movements[0].parameter_names if movements else ()):
        values = np.unique([movement.theta[column] for movement in movements])
        named = ANGLE.fullmatch(name) is not None
        if len(values) < 2 or not (named or NUMBERED.fullmatch(name)):
            continue
        turn = 2.0 * np.pi if np.abs(values).max() <= 2.0 * np.pi + 0.01 else 360.0
        gaps = np.diff(values)
        across = turn - (values[-1] - values[0])
        both_ends = values[0] < -turn / 3.0 and values[-1] > turn / 3.0 and np.abs(values).min() > turn / 6.0
        if 0.0 <= across < gaps.max() and values[-1] - values[0] > turn / 2.0 and (named or both_ends):
            border = f"{'±180°' if values[0] < 0.0 else '0° and 360°'}"
            split = float(values[int(np.argmax(gaps))] + gaps.max() / 2.0)
            yield Oddity(
                f"{name} goes from {values[0]:.4g} to {values[-1]:.4g} and crosses {border}, where it jumps while "
                f"movements go on: add {turn:.4g} to those below {split:.4g}, or use its sine and cosine"
            )


def _labels(movements: Sequence[Movement]) -> Iterator[Oddity]:
    """Movements whose path is far from what their theta predicts, by what the others of the action show."""
    for action in sorted({movement.action for movement in movements}):
        yield from _labels_of([movement for movement in movements if movement.action == action])


def _labels_of(movements: Sequence[Movement]) -> Iterator[Oddity]:
    theta = np.array([movement.theta for movement in movements]).reshape(len(movements), -1)
    varying = np.flatnonzero(np.ptp(theta, axis=0) > 0.0) if len(movements) else np.zeros(0, dtype=int)
    cells = np.unique(theta, axis=0)
    if len(movements) < FEWEST or not varying.size or len(cells) < 3:
        return
    low, width = theta[:, varying].min(axis=0), np.ptp(theta[:, varying], axis=0)
    hand = _hand(movements)
    paths = np.stack([_path(movement, hand) for movement in movements])
    subjects = [movement.subject for movement in movements]
    persons = _persons(subjects, len(varying))

    def features(values: Floats) -> Floats:
        scaled = (values[:, varying] - low) / width - 0.5
        columns = [np.ones((len(scaled), 1)), scaled]
        one, other = np.triu_indices(len(varying))
        if 2 * len(cells) >= 3 * (1 + len(varying) + len(one)):
            columns.append(scaled[:, one] * scaled[:, other])
        return np.concatenate(columns, axis=1)

    design = np.concatenate([features(theta), persons], axis=1)
    if len(movements) < 2 * design.shape[1]:
        return
    goals = np.stack([_farthest(movement.positions[:, hand]) for movement in movements])
    fits = [_robust_fit(design, which) for which in (paths, goals)]
    scores = np.max(
        [distances / max(ODD_M / MISLABELLED, float(np.median(distances))) for _, distances in fits], axis=0
    )
    coefficients, distances = fits[1]
    for number in np.flatnonzero(scores > MISLABELLED).tolist():
        own = np.repeat(persons[number : number + 1], len(cells), axis=0)
        candidates = np.concatenate([features(cells), own], axis=1)
        of_cells = _distances(candidates @ coefficients - goals[number])
        best = int(np.argmin(of_cells))
        proposal = ""
        if of_cells[best] < BETTER * distances[number]:
            proposal = f" It goes where theta {_listed(cells[best])} does ({100 * of_cells[best]:.2g} cm)."
        if not proposal and scores[number] < ODD:
            continue
        odd = movements[number]
        away_cm = 100.0 * distances[number]
        usual_cm = 100.0 * float(np.median(distances))
        yield Oddity(
            f"{odd.source}: {odd.point_names[hand]} gets {away_cm:.2g} cm away from where the others go for its theta "
            f"({_listed(odd.theta)}; they scatter by {usual_cm:.2g} cm), and its path or goal differs "
            f"{scores[number]:.0f} times as much as theirs: is it labelled correctly, and complete?{proposal}"
        )


def _listed(theta: Floats) -> str:
    return ", ".join(f"{value:.4g}" for value in theta)


def _farthest(path: Floats) -> Floats:
    """The position that is farthest from the first, where a movement that goes somewhere and back has been. (3,), m."""
    result: Floats = path[int(np.argmax(np.linalg.norm(path - path[0], axis=1)))]
    return result


def _path(movement: Movement, hand: int) -> Floats:
    """Positions of the hand at fractions of the time, stacked. Shape (3 F,), m."""
    return at_times(FRACTIONS * movement.duration, movement.time, movement.positions[:, hand]).ravel()


def _persons(subjects: Sequence[str], n_parameters: int) -> Floats:
    """A column for each person but the first, if each has enough movements. Shape (K, persons - 1)."""
    names = sorted(set(subjects))
    if min(subjects.count(name) for name in names) < n_parameters + 2:
        names = names[:1]
    return np.array([[float(subject == name) for name in names[1:]] for subject in subjects]).reshape(len(subjects), -1)


def _distances(differences: Floats) -> Floats:
    """Root mean square distance of points, of stacked differences (K, 3 F). Shape (K,), m."""
    squared = (differences.reshape(len(differences), -1, 3) ** 2).sum(axis=2)
    result: Floats = np.sqrt(squared.mean(axis=1))
    return result


def _robust_fit(design: Floats, paths: Floats) -> tuple[Floats, Floats]:
    """Coefficients of the paths with the smallest sum of distances, not of squares; and leave-one-out distances.

    By iteratively reweighted least squares. A distance is divided by what the movement itself pulled the fit to it.
    """
    weights = np.ones(len(design))
    for _ in range(30):
        root = np.sqrt(weights)[:, None]
        coefficients: Floats = np.linalg.lstsq(root * design, root * paths, rcond=None)[0].astype(np.float64)
        distances = _distances(design @ coefficients - paths)
        weights = 1.0 / np.maximum(distances, 0.1 * float(np.median(distances)) + 1e-9)
    root = np.sqrt(weights)[:, None]
    own = np.einsum("ij,ji->i", root * design, np.linalg.pinv(root * design))
    left_out: Floats = distances / np.maximum(1.0 - own, 0.2)
    return coefficients, left_out
