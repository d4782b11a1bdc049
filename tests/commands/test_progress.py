"""What people see of long work, and that it is gone in the end."""

import io
import sys

import pytest

from borecheck.commands import progress
from borecheck.commands.progress import Progress

HIDE, SHOW = "\x1b[?25l", "\x1b[?25h"


class Terminal(io.StringIO):
    def isatty(self) -> bool:
        return True


@pytest.fixture
def clock(monkeypatch):
    now = [100.0]
    monkeypatch.setattr(progress.time, "monotonic", lambda: now[0])
    return now


@pytest.fixture
def screen(monkeypatch):
    """Gives a terminal; the test's own stderr is there only once it runs."""
    monkeypatch.setenv("TERM", "xterm")
    monkeypatch.delenv("NO_COLOR", raising=False)

    def make() -> Terminal:
        found = Terminal()
        monkeypatch.setattr(sys, "stderr", found)
        return found

    return make


def test_short_work_is_silent(clock, screen):
    shown_on = screen()
    counter = Progress("poses")
    for k in range(10):
        clock[0] += 0.09
        counter(k + 1, 10)
    assert shown_on.getvalue() == ""


def test_long_work_is_counted_and_the_bar_goes(clock, screen):
    shown_on = screen()
    counter = Progress("poses of plan [left]\x1b[2J")
    for k in range(10):
        clock[0] += 0.5
        counter(k + 1, 10)
    shown = shown_on.getvalue()
    assert "poses of plan [left]\\x1b[2J" in shown
    assert " 4/10" in shown
    assert "\x1b[2J" not in shown
    assert shown.count(HIDE) == 1
    assert shown.rindex(SHOW) > shown.rindex("10/10")


def test_work_that_ends_early_gives_the_cursor_back(clock, screen):
    shown_on = screen()

    def interrupted():
        counter = Progress("poses")
        clock[0] += 2.0
        counter(1, 10)
        assert HIDE in shown_on.getvalue()
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt) as caught:
        interrupted()
    del caught
    assert SHOW in shown_on.getvalue()


def test_a_pipe_sees_nothing(clock, monkeypatch):
    pipe = io.StringIO()
    monkeypatch.setattr(sys, "stderr", pipe)
    counter = Progress("poses")
    clock[0] += 60.0
    counter(1, 2)
    assert pipe.getvalue() == ""
