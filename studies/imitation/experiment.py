"""The experiment of thesis 5.2.7: targets, demonstrators, and the numbers that come out."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from paramove.demonstrations import train_reaching_model
from paramove.motion import ArmPoseSolver, RobotMovement
from paramove.robots import RobotDescription
from studies.imitation.errors import SIGNIFICANT, Errors, Movement, errors_of, largest, ranges
from studies.imitation.reference import ReferenceKind, References, on_robot, reference_movement


@dataclass(frozen=True)
class Target:
    """A target by its interpolation coordinates (u, v, w): forward, from right to left, up; all from 0 to 1."""

    name: str
    coordinates: tuple[float, float, float]


CENTRE = Target("centre", (0.5, 0.5, 0.0))
RIGHT_SIDE = Target("right side", (0.5, 0.0, 0.0))
THESIS_TARGETS = (CENTRE, RIGHT_SIDE)
"""t₁ and t₂ of 5.2.7. There v runs to the right, so that t₂ is (0.5, 1, 0)."""


def table_grid() -> tuple[Target, ...]:
    """Targets on the lower face of the cuboid between the demonstrated corners, 3 × 5 without the corners."""
    grid = [(u, v) for u in (0.0, 0.5, 1.0) for v in (0.0, 0.25, 0.5, 0.75, 1.0)]
    return tuple(Target(f"u {u:g}, v {v:g}", (u, v, 0.0)) for u, v in grid if not (u in (0.0, 1.0) and v in (0.0, 1.0)))


@dataclass(frozen=True)
class Setup:
    """What is compared.

    Attributes:
        robot_folder: Folder of the robot's description.
        seeds: Synthetic demonstrators' seeds, one experiment each.
        repetitions: Demonstrations per reference.
        with_grid: Also targets all over the table.
        cache: Folder for trained models.
    """

    robot_folder: Path
    seeds: tuple[int, ...] = (0, 1, 2, 3, 4)
    repetitions: int = 40
    with_grid: bool = True
    cache: Path | None = None


@dataclass(frozen=True)
class Comparison:
    """One target in one experiment.

    Attributes:
        seed: Of the demonstrator.
        target: What is reached for.
        reference: How the reference was trained.
        synthesised, linear, against: Movement of the interpolative model, the same with elbows interpolated as points
            (as the thesis does), and the reference.
        reach_state: State in which the target is reached, counted from 1.
    """

    seed: int
    target: Target
    reference: ReferenceKind
    synthesised: Movement
    linear: Movement
    against: Movement
    reach_state: int

    def errors(self, *, aligned: bool = False, executed: bool = False, linear: bool = False) -> Errors:
        """Errors of this target; arguments as for `errors_of`."""
        movement = self.linear if linear else self.synthesised
        return errors_of(movement, self.against, aligned=aligned, executed=executed)


@dataclass
class Experiment:
    """All comparisons, and the arm's and the person's proportions."""

    setup: Setup
    joints: tuple[str, ...]
    min_reach: float
    lengths: tuple[float, float]
    comparisons: list[Comparison] = field(default_factory=list)

    def of(self, target: Target, reference: ReferenceKind = "own") -> list[Comparison]:
        """The comparisons of one target, one per seed."""
        return [c for c in self.comparisons if c.target == target and c.reference == reference]


def run_experiment(setup: Setup, progress: Callable[[str], None] = lambda _: None) -> Experiment:
    """Train, convert and compare for every seed and target."""
    robot = RobotDescription.load(setup.robot_folder)
    arm = robot.arm("right")
    solver = ArmPoseSolver(robot, arm)
    along, aside, _ = arm.kinematics.gripper_from_elbow
    lengths = (arm.kinematics.upper_arm, float(np.hypot(along, aside)))
    experiment = Experiment(setup, tuple(arm.joints), solver.reach[0], lengths)
    for seed in setup.seeds:
        progress(f"demonstrator {seed}: training")
        cache = None if setup.cache is None else setup.cache / f"reaching_{seed}.npz"
        model = train_reaching_model(seed, cache=cache)
        movement = RobotMovement(model, solver.length)
        linear = RobotMovement(model, solver.length, elbow_interpolation="linear")
        references = References.of(model, seed, setup.repetitions)
        for number, (target, kind) in enumerate(_compared_targets(setup)):
            progress(f"demonstrator {seed}: {target.name}")
            parameter = movement.grid.theta(np.array(target.coordinates))
            position = model.grid_.theta(np.array(target.coordinates))
            means = references.means(position, number, kind)
            comparison = Comparison(
                seed,
                target,
                kind,
                on_robot(movement.poses(parameter), solver),
                on_robot(linear.poses(parameter), solver),
                reference_movement(movement, solver, means),
                movement.reach_state + 1,
            )
            experiment.comparisons.append(comparison)
    return experiment


def _compared_targets(setup: Setup) -> list[tuple[Target, ReferenceKind]]:
    compared: list[tuple[Target, ReferenceKind]] = [(target, "own") for target in THESIS_TARGETS]
    if setup.with_grid:
        known = {target.coordinates for target in THESIS_TARGETS}
        compared += [(target, "own") for target in table_grid() if target.coordinates not in known]
    return compared + [(target, "global") for target in THESIS_TARGETS]


def maxima(comparison: Comparison) -> dict[str, Any]:
    """The numbers of one comparison, mm, over the significant states."""
    plain, aligned = comparison.errors(), comparison.errors(aligned=True)
    executed, linear = comparison.errors(executed=True), comparison.errors(linear=True)
    at_target = plain.state == comparison.reach_state
    free = plain.significant & ~plain.limited
    return {
        "gripper": largest(plain.gripper, plain.significant),
        "gripper_aligned": largest(aligned.gripper, aligned.significant),
        "gripper_at_target": largest(plain.gripper, at_target),
        "elbow": largest(plain.elbow, plain.significant),
        "elbow_linear": largest(linear.elbow, linear.significant),
        "effective": largest(plain.effective, plain.significant),
        "effective_aligned": largest(aligned.effective, aligned.significant),
        "effective_free": largest(plain.effective, free),
        "effective_executed": largest(executed.effective, executed.significant),
        "effective_linear": largest(linear.effective, linear.significant),
        "effective_at_target": largest(plain.effective, at_target),
        "least_imitation": largest(plain.min_imitation, plain.significant),
        "imitation": largest(plain.imitation, plain.significant),
        "imitation_aligned": largest(aligned.imitation, aligned.significant),
        "imitation_free": largest(plain.imitation, free),
        "least_imitation_free": largest(plain.min_imitation, free),
        "imitation_executed": largest(executed.imitation, executed.significant),
        "imitation_at_target": largest(plain.imitation, at_target),
        "imitation_excess": largest(plain.imitation - plain.min_imitation, plain.significant),
        "limited_states": ranges(plain.state[plain.limited & plain.significant]),
    }


def over_seeds(values: Iterable[float | None]) -> dict[str, float | None]:
    """Median and largest over the demonstrators."""
    known = [value for value in values if value is not None]
    if not known:
        return {"median": None, "max": None}
    return {"median": float(np.median(known)), "max": float(np.max(known))}


def numbers_of(experiment: Experiment) -> dict[str, Any]:
    """Everything as plain numbers, for JSON."""
    rows: list[dict[str, Any]] = []
    for target, kind in _compared_targets(experiment.setup):
        comparisons = experiment.of(target, kind)
        each = [maxima(comparison) for comparison in comparisons]
        names = [name for name in each[0] if name != "limited_states"]
        rows.append(
            {
                "place": target.name,
                "coordinates": list(target.coordinates),
                "reference": kind,
                "mm": {name: over_seeds(one[name] for one in each) for name in names},
                "limited_states": [one["limited_states"] for one in each],
                "seeds": {str(c.seed): {k: one[k] for k in names} for c, one in zip(comparisons, each, strict=True)},
            }
        )
    return {
        "significant_states": list(SIGNIFICANT),
        "seeds": list(experiment.setup.seeds),
        "repetitions": experiment.setup.repetitions,
        "least_reach_mm": 1000.0 * experiment.min_reach,
        "places": rows,
    }
