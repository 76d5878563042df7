"""Renamed parameters."""

import pytest
from pydantic import ConfigDict, ValidationError

from paramove.documents import OldNames, renamed_attribute


class Waiting(OldNames):
    model_config = ConfigDict(extra="forbid")
    old_names = (("patience_s", "timeout_s"), ("limits.patience_s", "limits.timeout_s"))

    timeout_s: float = 1.0
    limits: dict[str, float] = {}  # noqa: RUF012 - pydantic copies it


def test_the_old_name_is_taken_with_a_warning(caplog):
    assert Waiting.model_validate({"patience_s": 3.0}).timeout_s == 3.0
    assert "patience_s is called timeout_s" in caplog.text


def test_the_new_name_is_taken_silently(caplog):
    assert Waiting.model_validate({"timeout_s": 2.0}).timeout_s == 2.0
    assert caplog.text == ""


def test_an_old_name_within_a_field(caplog):
    assert Waiting.model_validate({"limits": {"patience_s": 3.0}}).limits == {"timeout_s": 3.0}
    assert "limits.patience_s is called limits.timeout_s" in caplog.text
    assert Waiting.model_validate({"limits": {}}).limits == {}


def test_an_attribute_is_read_by_its_old_name_with_a_warning():
    class Examined:
        p_value = 0.5
        typicality = renamed_attribute("typicality", "p_value")

    with pytest.warns(DeprecationWarning, match=r"Examined\.typicality is called p_value"):
        assert Examined().typicality == 0.5


def test_both_at_once_are_refused():
    with pytest.raises(ValidationError, match="patience_s"):
        Waiting.model_validate({"patience_s": 3.0, "timeout_s": 2.0})
