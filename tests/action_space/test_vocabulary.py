"""Tables of action models beside the models themselves."""

import numpy as np
import pytest

from paramove.action_space.vocabulary import ActionModel, Vocabulary
from paramove.demonstrations import table_place
from paramove.input_error import InputError
from tests.action_space.toy import toy_action


def draws(action, n=25, seed=0):
    rng = np.random.default_rng(seed)
    return (
        rng.uniform(-0.2, 1.2, (n, action.n_parameters)),
        rng.random(n),
        rng.standard_normal((n, action.n_deviations)),
    )


def test_mean_poses_are_those_of_the_model(pointing):
    theta, tau, _ = draws(pointing)
    np.testing.assert_allclose(pointing.poses(theta, tau), pointing.model.progress_mean(theta, tau), atol=1e-9)


@pytest.mark.parametrize("tau", [0.0, 1.0])
def test_ends_of_the_progress(pointing, tau):
    theta = draws(pointing)[0][:3]
    state = 0 if tau == 0.0 else -1
    np.testing.assert_allclose(pointing.poses(theta, tau), pointing.state_means(theta)[:, state], atol=1e-9)


def test_poses_are_drawn_from_the_density_of_the_model(pointing):
    """Covariance of drawn poses: (6.3) up to the share that is left out and the interpolation of roots."""
    rng = np.random.default_rng(0)
    n, tau = 40_000, 0.37
    deviation = rng.standard_normal((n, pointing.n_deviations))
    poses = pointing.poses(np.full((n, 2), 0.5), tau, deviation)
    exact = pointing.model.progress_covariance(np.full(2, 0.5), tau)
    scale = np.sqrt(np.diagonal(exact))
    np.testing.assert_allclose(np.cov(poses.T) / np.outer(scale, scale), exact / np.outer(scale, scale), atol=0.05)


def test_fewer_components_carry_most_of_the_variance(pointing):
    few = ActionModel("few", pointing.model, 3.0, kept_variance=0.8)
    assert 0 < few.n_deviations < pointing.n_deviations
    covariance = pointing.model.at(np.full(2, 0.5)).covariances_
    kept = np.einsum("ndr,ndr->", few.factors, few.factors) / np.trace(covariance, axis1=1, axis2=2).sum()
    assert 0.7 < kept < 1.0


def test_any_model_and_a_polynomial_one_give_the_same_poses(pointing):
    class Plain:
        state_means = staticmethod(pointing.model.state_means)
        at = staticmethod(pointing.model.at)

    theta, tau, deviation = draws(pointing)
    plain = ActionModel("plain", Plain(), 3.0)
    np.testing.assert_allclose(plain.poses(theta, tau, deviation), pointing.poses(theta, tau, deviation), atol=1e-12)


def test_actions_with_different_numbers_of_parameters_share_padded_particles():
    short, long = toy_action("short"), toy_action("long", n_parameters=4, seed=1)
    vocabulary = Vocabulary([short, long])
    assert vocabulary.n_parameters == 4
    rng = np.random.default_rng(0)
    action, theta, tau = rng.integers(0, 2, 30), rng.random((30, 4)), rng.random(30)
    deviation = np.zeros((30, vocabulary.n_deviations))
    poses = vocabulary.poses(action, theta, tau, deviation)
    for number, model in enumerate((short, long)):
        own = action == number
        np.testing.assert_allclose(poses[own], model.poses(theta[own, : model.n_parameters], tau[own]), atol=1e-12)


def test_way_back_mirrors_the_way_out(pointing):
    mirrored = pointing.mirrored
    assert (mirrored[:3] > 0.9).all(), "base pose and base pose"
    quarter = mirrored[len(mirrored) // 4]
    assert 0.6 < quarter < 0.9


def test_only_the_way_to_the_target_depends_on_the_target(pointing):
    (dependence,) = pointing.place_dependence
    assert dependence[0] < 0.15
    assert dependence[-1] < 0.15
    assert dependence[len(dependence) // 2] > 0.9


def test_targets_are_places_on_the_table(pointing):
    theta = np.array([[0.2, 0.4], [0.9, 0.1]])
    np.testing.assert_allclose(Vocabulary([pointing]).targets(np.zeros(2, dtype=np.int64), theta), table_place(theta))
    hand = pointing.poses(theta, 0.5)[:, 6:]
    assert np.linalg.norm(hand - table_place(theta), axis=1).max() < 0.04, "the models' hand goes there"


def test_what_is_no_action_is_refused(pointing):
    with pytest.raises(InputError, match="duration is positive"):
        ActionModel("a", pointing.model, 0.0)
    with pytest.raises(InputError, match="one or more places of 2 components"):
        ActionModel("a", pointing.model, 3.0, ("u", "v", "w"))
    with pytest.raises(InputError, match="different names"):
        Vocabulary([pointing, pointing])


def test_a_model_of_other_points_is_refused():
    class Whole:
        def state_means(self, theta):
            return np.zeros((len(theta), 5, 21))

    with pytest.raises(InputError, match=r"9 numbers a frame .* found 21"):
        ActionModel("a", Whole(), 3.0)
