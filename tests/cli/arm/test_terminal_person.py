"""The person at a terminal presses keys, another program writes lines; looking goes on meanwhile."""

import os
import pty
import select
import sys
import termios

import pytest

from paramove.cli.arm.terminal_person import QuitError, TerminalPerson


@pytest.fixture
def terminal():
    """Both ends of a terminal: what a person types into, and what the program reads."""
    ours, theirs = pty.openpty()
    with os.fdopen(theirs) as source:
        yield ours, source
    os.close(ours)


@pytest.fixture
def pipe():
    read, write = os.pipe()
    with os.fdopen(read) as source:
        yield write, source
    os.close(write)


def typing(descriptor, *keys):
    """A look that has the next key typed at each call."""
    left, looks = iter(keys), []

    def look():
        os.write(descriptor, next(left, "").encode())
        looks.append(len(looks))
        return [f"looked {len(looks)} times"]

    return look, looks


def test_enter_says_that_it_is_done(terminal, capsys, monkeypatch):
    descriptor, source = terminal
    before = termios.tcgetattr(descriptor)
    monkeypatch.setattr(sys.stdout, "isatty", lambda: True)
    look, looks = typing(descriptor, "x", "y", "\n")
    TerminalPerson(source).until_done("Move the arm.", look)
    assert len(looks) >= 3
    said = capsys.readouterr().out
    assert said.startswith("Move the arm. Enter when it is done, q to end.\n  looked 1 times\n\x1b[1A\x1b[2K  looked 2")
    assert termios.tcgetattr(descriptor) == before
    monkeypatch.setattr(sys.stdout, "isatty", lambda: False)
    TerminalPerson(source).until_done("Move the arm.", typing(descriptor, "\n")[0])
    assert "looked" not in capsys.readouterr().out


def test_a_key_that_is_pressed_once_the_request_is_seen_counts_and_an_earlier_one_does_not(terminal, monkeypatch):
    descriptor, source = terminal
    os.write(descriptor, b"q\n")
    assert select.select([source], [], [], 10.0)[0]
    monkeypatch.setattr("typer.echo", lambda text, nl=True: os.write(descriptor, b"\n"))
    TerminalPerson(source).until_done("Move the arm.", list)


def test_q_ends_and_the_terminal_is_as_before(terminal):
    descriptor, source = terminal
    before = termios.tcgetattr(descriptor)
    with pytest.raises(QuitError):
        TerminalPerson(source).until_done("Move the arm.", typing(descriptor, "q")[0])
    assert termios.tcgetattr(descriptor) == before


def test_lines_come_from_other_programs(pipe, capsys):
    write, source = pipe
    look, looks = typing(write, "", "l", "ook\n", "", "\n")
    TerminalPerson(source).until_done("Move the arm.", look)
    assert len(looks) >= 5
    assert "looked" in capsys.readouterr().out
    with pytest.raises(QuitError):
        TerminalPerson(source).until_done("Move the arm.", typing(write, "q\n")[0])


def test_several_lines_at_once_are_kept_apart(pipe):
    write, source = pipe
    os.write(write, b"\n\n")
    person = TerminalPerson(source)
    for _ in range(2):
        person.until_done("Move the arm.", list)


def test_the_end_of_the_input_ends_it():
    read, write = os.pipe()
    os.close(write)
    with os.fdopen(read) as source, pytest.raises(QuitError):
        TerminalPerson(source).until_done("Move the arm.", list)


def test_what_is_told_cannot_steer_the_terminal(terminal, capsys):
    TerminalPerson(terminal[1]).tell("servo \x1b[2J")
    assert capsys.readouterr().out == "servo \\x1b[2J\n"


def test_a_closed_standard_input_has_ended(monkeypatch):
    monkeypatch.setattr(sys, "stdin", None)
    with pytest.raises(QuitError):
        TerminalPerson().until_done("Hold the arm.", list)
    with pytest.raises(QuitError), TerminalPerson().pressing():
        pass
