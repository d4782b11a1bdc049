"""Says when kernels are compiled, and how far it is: once for an installation."""

import time
from functools import cache
from typing import Any

from numba.core import event as _event

from borecheck.commands.progress import say

event: Any = _event  # carries no types

# A line at most so often, [s]: a check compiles for half a minute, a first plan longer.
EVERY_S = 5.0


class _Telling(event.Listener):  # type: ignore[misc]
    """Hears of every function that numba compiles, and not of what it loads."""

    def __init__(self) -> None:
        self._depth = 0
        self._done = 0
        self._start = self._told = 0.0

    def on_start(self, event: Any) -> None:
        if not self._start:
            self._start = self._told = time.monotonic()
            say(
                "borecheck: compiling its kernels, once for this installation; "
                "about half a minute for a check, as long again for a first path ..."
            )
        self._depth += 1

    def on_end(self, event: Any) -> None:
        self._depth -= 1
        self._done += 1
        now = time.monotonic()
        if now - self._told >= EVERY_S:
            self._told = now
            say(f"borecheck: {self._done} kernels, {now - self._start:.0f} s ...")


@cache
def tell_of_compiling() -> None:
    """From now on lines on standard error tell of kernels that are compiled."""
    event.register("numba:compile", _Telling())
