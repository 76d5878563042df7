"""Renamed parameters."""

import pytest
from pydantic import ConfigDict, ValidationError

from paramove.documents import OldNames


class Waiting(OldNames):
    model_config = ConfigDict(extra="forbid")
    old_names = (("patience_s", "timeout_s"),)

    timeout_s: float = 1.0


def test_the_old_name_is_taken_with_a_warning(caplog):
    assert Waiting.model_validate({"patience_s": 3.0}).timeout_s == 3.0
    assert "patience_s is called timeout_s" in caplog.text


def test_the_new_name_is_taken_silently(caplog):
    assert Waiting.model_validate({"timeout_s": 2.0}).timeout_s == 2.0
    assert caplog.text == ""


def test_both_at_once_are_refused():
    with pytest.raises(ValidationError, match="patience_s"):
        Waiting.model_validate({"patience_s": 3.0, "timeout_s": 2.0})
