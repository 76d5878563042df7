"""What does not fit in a YAML file is told key by key, never as the file's whole content."""

import pytest
from pydantic import BaseModel, ConfigDict, ValidationError

from paramove.documents.wording import findings


class Part(BaseModel):
    model_config = ConfigDict(extra="forbid")

    size: float


class Top(BaseModel):
    name: str
    parts: list[Part]


@pytest.mark.parametrize(
    ("value", "told"),
    [
        ({"parts": []}, "name is missing"),
        ({"name": "a", "parts": [{}]}, "parts.0.size is missing"),
        ({"name": "a", "parts": [{"size": None}]}, "parts.0.size: input should be a valid number, found nothing"),
        ({"name": "a", "parts": [7]}, "parts.0: expected lines of `name: value`, found 7"),
        ([1, 2], "the file: expected lines of `name: value`, found [1, 2]"),
        (None, "the file: expected lines of `name: value`, found nothing"),
    ],
)
def test_each_finding_says_where_what_was_expected_and_what_was_found(value, told):
    with pytest.raises(ValidationError) as caught:
        Top.model_validate(value)
    assert findings(caught.value) == told


def test_of_many_the_first_are_told_and_how_many_more():
    with pytest.raises(ValidationError) as caught:
        Top.model_validate({"name": "a", "parts": [{}] * 8})
    told = findings(caught.value).split("; ")
    assert told == [*(f"parts.{place}.size is missing" for place in range(5)), "and 3 more"]
