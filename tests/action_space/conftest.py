"""Small action models, trained once a session."""

import pytest

from paramove.action_space.training import table_action_demonstrations, train_action
from paramove.action_space.vocabulary import ActionModel


@pytest.fixture(scope="session")
def pointing():
    shown = table_action_demonstrations("pointing", columns=3, rows=3, repetitions=2)
    return ActionModel.from_file_model(train_action(shown, n_states=30))


@pytest.fixture(scope="session")
def reaching():
    shown = table_action_demonstrations("reaching", columns=3, rows=3, repetitions=2)
    return ActionModel.from_file_model(train_action(shown, n_states=30))
