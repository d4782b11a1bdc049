"""Progress on the terminal for what takes longer than a second."""

import sys
import time

from borecheck.core.text import printable


class Progress:
    """Counts on standard error, with the time left; silent when it is no terminal.

    Args:
        what: What is counted: "poses".
    """

    def __init__(self, what: str) -> None:
        self._what = printable(what)
        self._start = time.monotonic()
        self._shown = 0.0
        self._active = sys.stderr.isatty()
        self._printed = False

    def __call__(self, done: int, total: int) -> None:
        """Shows how far it is, at most five times a second."""
        now = time.monotonic()
        passed = now - self._start
        if not self._active or passed < 1.0:
            return
        if now - self._shown < 0.2 and done < total:
            return
        self._shown = now
        left = passed * (total - done) / max(done, 1)
        text = f"\r{done} of {total} {self._what}, {left:.0f} s left   "
        end = "\r" + " " * len(text) + "\r" if done >= total else ""
        print(text + end, end="", file=sys.stderr, flush=True)


def say(text: str) -> None:
    """One line for people, on standard error; it may hold names from files."""
    print(printable(text), file=sys.stderr, flush=True)
