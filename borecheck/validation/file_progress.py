"""How many files are done: a counter in a terminal, seldom lines in a log."""

import time
from typing import TextIO

EVERY_S = 10.0  # at most one line in so long, where the lines stay


class FileProgress:
    """Counts on a stream.

    Args:
        stream: Where to; a terminal gets one line that changes.
        total: How many files there are.
    """

    def __init__(self, stream: TextIO, total: int) -> None:
        self._stream = stream
        self._total = total
        self._is_terminal = stream.isatty()
        self._last_shown = time.monotonic()

    def __call__(self, done: int) -> None:
        """Tells how far it is."""
        if self._is_terminal:
            end = "\n" if done == self._total else ""
            self._write(f"\r{done}/{self._total} files{end}")
        elif time.monotonic() - self._last_shown >= EVERY_S:
            self._last_shown = time.monotonic()
            self._write(f"{done}/{self._total} files\n")

    def _write(self, text: str) -> None:
        self._stream.write(text)
        self._stream.flush()
