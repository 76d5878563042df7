"""Local models for single targets, the references of thesis 5.2.7, and the movements made of them."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from paramove.demonstrations import POINT_NAMES, demonstrations_at, reaching_grid_demonstrations
from paramove.documents import Floats
from paramove.hmm import LeftRightHMM, Parameters, TrainingOptions, resample
from paramove.motion import ArmPoses, ArmPoseSolver, RelocationOptions, RobotMovement
from paramove.phmm import InterpolativePHMM, synchronised
from studies.imitation.errors import Movement, RobotArm

ReferenceKind = Literal["own", "global"]


@dataclass(frozen=True)
class References:
    """Trains local models for targets that the interpolative model was not trained on.

    Attributes:
        model: The interpolative model: numbers of states and frames, scale and shoulder come from it.
        seed: Demonstrations of the references are drawn with it, others than those of the training.
        repetitions: Demonstrations per target.
        everything: The global model of the training (3.4.1); None if no reference is aligned by it.
    """

    model: InterpolativePHMM
    seed: int
    repetitions: int
    everything: Parameters | None

    @classmethod
    def of(cls, model: InterpolativePHMM, seed: int, repetitions: int, training_repetitions: int = 10) -> References:
        """With the global model, trained again on the demonstrations that trained `model`."""
        demonstrations = reaching_grid_demonstrations(np.random.default_rng(seed), repetitions=training_repetitions)
        references = cls(model, seed, repetitions, None)
        frames = [references._resampled(sequence) for sequence in demonstrations.sequences]
        return cls(model, seed, repetitions, references._empty().fit(frames).parameters)

    def means(self, target: Floats, number: int, kind: ReferenceKind) -> Floats:
        """State means [N, 21], m, of a local model for one target [3], m, frame of the demonstrations.

        "own": an HMM with the same time restrictions, trained on this target alone, as in 4.2.4. "global": set up as
        the local models of the interpolative model are, its states aligned by the global model (3.4.1), (3.7).
        """
        rng = np.random.default_rng([self.seed, 1, number])
        demonstrations = demonstrations_at(target, rng, repetitions=self.repetitions)
        frames = [self._resampled(sequence) for sequence in demonstrations.sequences]
        if kind == "own":
            return self._empty().fit(frames).parameters.means
        if self.everything is None:
            raise ValueError("references of the kind 'global' need the global model: make them with References.of")
        return synchronised(self.everything, [frames], self._options(), 1)[0].means

    def _options(self) -> TrainingOptions:
        return self.model.options or TrainingOptions()

    def _empty(self) -> LeftRightHMM:
        model = self.model
        return LeftRightHMM(model.n_states, model.d_min_, model.d_max_, options=self._options())

    def _resampled(self, sequence: Floats) -> Floats:
        frames = self.model.resampled_frames_
        return sequence if frames is None else resample(sequence, frames)


def reference_movement(movement: RobotMovement, solver: ArmPoseSolver, means: Floats) -> Movement:
    """A local model's means converted like the interpolative model's (5.7), on the robot."""
    return on_robot(movement.converted(means, POINT_NAMES), solver)


def on_robot(poses: ArmPoses, solver: ArmPoseSolver, options: RelocationOptions | None = None) -> Movement:
    """What the robot's arm makes of arm poses: by the closed form alone, and within its joint limits."""
    keep_out = options or RelocationOptions()
    plain = solver.without_limits(poses)
    gripper = solver.moved_outward(poses.gripper, keep_out.reach_margin, keep_out.reach_width)
    limited = solver.solve(replace(poses, gripper=gripper))
    return Movement(
        poses,
        RobotArm(plain.elbow, poses.gripper, plain.elbow_turn),
        RobotArm(limited.elbow, gripper, limited.elbow_turn),
        solver.outside_limits(plain.angles),
    )
