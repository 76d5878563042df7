"""Output is taken at once, whatever reads it."""

import contextlib
import io
import os
import pty
import signal
import sys

import pytest

from paramove.supervision import queued_output
from paramove.supervision.queued_output import LONGEST_QUEUE, QueuedOutput


@pytest.fixture
def piped(monkeypatch):
    """Makes a pipe standard output and standard error; gives the end to read from."""
    with contextlib.ExitStack() as opened:

        def make():
            reader, writer = os.pipe()
            stream = opened.enter_context(os.fdopen(writer, "w", encoding="ascii"))
            monkeypatch.setattr(sys, "stdout", stream)
            monkeypatch.setattr(sys, "stderr", stream)
            return opened.enter_context(os.fdopen(reader, "rb"))

        yield make


def test_both_streams_come_out_in_order_and_are_as_before_at_the_end(piped):
    pipe = piped()
    before = sys.stdout
    with QueuedOutput() as output:
        sys.stdout.write("first ξ\n")
        sys.stderr.write("second\n")
        assert output.closed_by is None
    assert sys.stdout is before
    assert pipe.read1() == b"first \\u03be\nsecond\n"
    assert output.dropped == 0


def test_the_oldest_text_is_dropped_while_nobody_reads_and_the_end_does_not_wait(piped, monkeypatch):
    pipe = piped()
    monkeypatch.setattr(queued_output, "LAST_WAIT_S", 0.0)
    with QueuedOutput() as output:
        for number in range(512):
            sys.stdout.write(f"{number:08d}" * 1000)
        assert output.is_behind
        assert output.dropped > 512 - LONGEST_QUEUE - 100
    sys.stdout.write("what is printed after the end does not wait either")
    read = b""
    while not read.endswith(b"00000511"):  # whoever reads again gets the latest
        read += pipe.read1()
    assert b"00000123" not in read  # a number that no other one shows, repeated


def test_a_reader_that_is_gone_is_no_error_but_told(piped):
    pipe = piped()
    with QueuedOutput() as output:
        pipe.close()
        sys.stdout.write("nobody gets this\n")
        assert output.closed_by is signal.SIGPIPE


def test_a_closed_terminal_is_told_as_such(monkeypatch):
    master, end = pty.openpty()
    with os.fdopen(end, "w") as stream:
        monkeypatch.setattr(sys, "stdout", stream)
        with QueuedOutput() as output:
            assert sys.stdout.isatty()
            os.close(master)
            assert output.closed_by is signal.SIGHUP


def test_a_file_that_another_program_set_not_to_block_gets_all(piped):
    pipe = piped()
    os.set_blocking(sys.stdout.fileno(), False)
    with QueuedOutput() as output:
        sys.stdout.write("x" * 1_000_000)
        assert len(pipe.read(1_000_000)) == 1_000_000
    assert not output.is_behind


@pytest.mark.parametrize("stream", [None, io.StringIO()])
def test_what_is_no_file_of_the_system_is_left_alone(monkeypatch, stream):
    monkeypatch.setattr(sys, "stdout", stream)
    with QueuedOutput() as output:
        assert sys.stdout is stream
        assert output.closed_by is None
