"""Tables of action models beside the models themselves."""

from dataclasses import replace

import numpy as np
import pytest

from paramove.action_space.training import train_action
from paramove.action_space.vocabulary import ActionModel, Vocabulary
from paramove.demonstrations import Demonstrations, table_place
from paramove.documents.input_error import InputError
from paramove.phmm import LinearPHMM
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
    expected = [pointing.model.progress_mean(one, at) for one, at in zip(theta, tau, strict=True)]
    np.testing.assert_allclose(pointing.poses(theta, tau), expected, atol=1e-9)


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
    few = ActionModel("few", pointing.model, 3.0, explained_variance=0.8)
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
    np.testing.assert_allclose(pointing.target(theta), table_place(theta))
    hand = pointing.poses(theta, 0.5)[:, 6:]
    assert np.linalg.norm(hand - table_place(theta), axis=1).max() < 0.04, "the models' hand goes there"


def test_what_is_no_action_is_refused(pointing):
    with pytest.raises(InputError, match=r"positive duration.* 0\.0 s"):
        ActionModel("a", pointing.model, 0.0)
    with pytest.raises(InputError, match="one or more targets of 2 parameters"):
        ActionModel("a", pointing.model, 3.0, ("u", "v", "w"))
    with pytest.raises(InputError, match="different names"):
        Vocabulary([pointing, pointing])


def test_a_model_of_other_points_is_refused():
    class Whole:
        def state_means(self, theta):
            return np.zeros((len(theta), 5, 21))

    with pytest.raises(InputError, match=r"9 numbers a frame .* found 21"):
        ActionModel("a", Whole(), 3.0)


def test_poses_may_tell_where_the_wrist_is():
    bent, straight = toy_action("bent", pose_size=12), toy_action("straight")
    theta, tau, deviation = draws(bent)
    poses = Vocabulary([bent]).poses(np.zeros(len(theta), np.int64), theta, tau, deviation)
    assert poses.shape == (len(theta), 12)
    np.testing.assert_allclose(poses, bent.poses(theta, tau, deviation), rtol=0.0, atol=0.0)
    with pytest.raises(
        InputError, match=r"same size for all actions, found {'bent': 12, 'straight': 9}: train all of them with"
    ):
        Vocabulary([bent, straight])


def test_an_action_with_the_wrist_is_trained_from_poses_with_the_wrist(pointing):
    poses = [pointing.poses(np.full((60, 2), share), np.linspace(0.0, 1.0, 60)) for share in np.linspace(0.0, 1.0, 6)]
    rng = np.random.default_rng(7)
    bent = [np.concatenate([one, 0.5 * (one[:, 3:6] + one[:, 6:9])], axis=1) for one in poses]
    bent = [one + 0.003 * rng.normal(size=one.shape) for one in bent]
    told = replace(pointing.model.description, point_names=("shoulder", "elbow", "hand", "wrist"))
    theta = np.repeat(np.linspace(0.0, 1.0, 6)[:, None], 2, axis=1)
    model = train_action(Demonstrations(bent, theta, told), n_states=10, kind=LinearPHMM)
    assert model.description.point_names == ("shoulder", "elbow", "hand", "wrist")
    assert ActionModel.from_file_model(model).pose_size == 12
    model.description = replace(model.description, point_names=("shoulder", "elbow", "wrist", "hand"))
    with pytest.raises(InputError, match="expected the points"):
        ActionModel.from_file_model(model)
