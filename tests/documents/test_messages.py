"""Messages that claim more than a reader may spend on them, and texts that are no texts for people."""

from __future__ import annotations

import time
import tracemalloc

import pytest
from pydantic import Field

from paramove.documents import Message, MessageError, MessageReader, Text
from paramove.documents.messages import LONGEST_TEXT, MAX_DEPTH

MOST_S = 1.0
MOST_BYTES = 50_000_000


class Row(Message):
    first: int
    second: int
    third: int


class Rows(Message):
    text: Text = ""
    rows: list[Row] = Field(default_factory=list)
    other: list[list[int]] = Field(default_factory=list)


READER = MessageReader(Rows, max_bytes=4_000_000)


@pytest.mark.parametrize(
    "content",
    [
        b'{"rows": [' + b"{}," * 200_000 + b"0]}",
        b'{"rows": [' + b"0," * 300_000 + b"0]}",
        b'{"other": [' + b"[]," * 1_000_000 + b"0]}",
        b"{" + b"".join(b'"a%d":0,' % number for number in range(200_000)) + b'"b":0}',
        b'"[' * 1_900_000,
        b'"",' * 1_300_000,
        b'{"text": "' + b"\x7f" * 3_900_000 + b'"}',
        b'{"' + b"\x7f" * 3_900_000 + b'": 0}',
    ],
)
def test_a_message_costs_little_whatever_is_in_it(content):
    """Each wrong part of a message is an error in pydantic, of 1 kB, and all of them are listed."""
    tracemalloc.start()
    begun_s = time.process_time()
    try:
        text = READER.read(content).text
    except MessageError as error:
        text = str(error)
    seconds = time.process_time() - begun_s
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert len(text) <= LONGEST_TEXT
    assert text.isprintable()
    assert seconds < MOST_S
    assert peak < MOST_BYTES


def test_brackets_and_commas_in_a_text_are_no_parts():
    text = "[{,:" * 100_000
    assert READER.read(b'{"text": "%s"}' % text.encode()).text == text[:LONGEST_TEXT]


def test_a_message_may_have_many_rows_and_is_nested_no_deeper_than_allowed():
    rows = ",".join(['{"first": 1, "second": 2, "third": 3}'] * 1000)
    assert len(READER.read(f'{{"rows": [{rows}]}}'.encode()).rows) == 1000
    with pytest.raises(MessageError, match=str(MAX_DEPTH)):
        READER.read(b'{"other": ' + b"[" * MAX_DEPTH + b"]" * MAX_DEPTH + b"}")
