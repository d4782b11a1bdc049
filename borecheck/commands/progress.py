"""Progress on the terminal for what takes longer than a second."""

import sys
import time
import weakref
from typing import Any

from borecheck.core.text import printable

# Nothing is shown of what is done within so long, and then at most every so often, [s].
SILENT_S, EVERY_S = 1.0, 0.2


class Progress:
    """A bar on standard error, with the time left; silent when it is no terminal.

    It is gone when all is done, and when the work ends early.

    Args:
        what: What is counted: "poses".
    """

    def __init__(self, what: str) -> None:
        self._what = printable(what)
        self._start = time.monotonic()
        self._shown = self._start + SILENT_S - EVERY_S
        self._active = sys.stderr.isatty()
        self._bar: Any = None

    def __call__(self, done: int, total: int) -> None:
        """Shows how far it is."""
        now = time.monotonic()
        if self._active and (now - self._shown >= EVERY_S):
            self._shown = now
            if self._bar is None:
                self._bar = _bar(self._what, total, now - self._start)
                weakref.finalize(self, self._bar.stop)  # gives the cursor back
            self._bar.update(0, completed=done, total=total, refresh=True)
        if self._bar is not None and done >= total:
            self._bar.stop()


def _bar(what: str, total: int, passed: float) -> Any:
    """A bar that began before it was shown, so that the time left is right."""
    from rich import progress
    from rich.console import Console

    bar = progress.Progress(
        progress.TextColumn("{task.description}", markup=False),
        progress.BarColumn(),
        progress.MofNCompleteColumn(),
        progress.TimeRemainingColumn(elapsed_when_finished=True),
        console=Console(stderr=True),
        auto_refresh=False,
        transient=True,
        redirect_stdout=False,
        redirect_stderr=False,
    )
    bar.add_task(what, total=total)
    bar.tasks[0].start_time = bar.get_time() - passed
    bar.start()
    return bar


def say(text: str) -> None:
    """One line for people, on standard error; it may hold names from files."""
    print(printable(text), file=sys.stderr, flush=True)
