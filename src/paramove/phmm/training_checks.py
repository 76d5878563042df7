"""Whether labelled movements can train a parametric HMM; what is wrong, which movement it is, and what would do."""

from collections.abc import Sequence

from paramove.documents.array_types import Floats
from paramove.hmm.sequences import SequenceLengthError, check_demonstrations, check_length


def check_training(
    recorded: Sequence[Floats], resampled: Sequence[Floats], theta: Floats, states: tuple[int, int, int], floor: float
) -> None:
    """Check movements as they were recorded and as they are trained on, (T_k, D) each, and theta (K, P).

    Args:
        states: n_states, d_min, d_max. floor: `floor_deviation` of the options.

    Raises:
        SequenceLengthError: for a length that the states do not allow, with the number of the sequence.
        ValueError: for sequences that no model can learn from, and for one theta alone.
    """
    check_demonstrations(recorded, floor)
    for index, sequence in enumerate(resampled):
        try:
            check_length(len(sequence), *states)
        except SequenceLengthError as error:
            raise SequenceLengthError(f"sequence {index}: {error}") from error
    if (theta == theta[0]).all():
        raise ValueError(
            f"theta is {theta[0].tolist()} for every sequence: nothing shows how the movement depends on it; give "
            "sequences with different theta, or train a LeftRightHMM, which has no parameters"
        )
