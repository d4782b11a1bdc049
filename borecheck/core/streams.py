"""The standard streams of our own process: closed, broken, or written to by others."""

import io
import logging
import os
import sys
from contextlib import suppress
from typing import TextIO

from borecheck.core.text import one_line


def prepare_streams() -> None:
    """Standard streams that can be written to, whatever the shell did to them.

    Where `>&-` left none, what is written goes nowhere: else the first file that is
    opened would take its place. What a terminal's encoding lacks is escaped.
    """
    for number, name in enumerate(("stdin", "stdout", "stderr")):
        try:
            os.fstat(number)
        except OSError:
            os.open(os.devnull, os.O_RDWR)  # takes the lowest free number
        if getattr(sys, name) is None:
            stream = os.fdopen(number, "r" if number == 0 else "w", closefd=False)
            setattr(sys, name, stream)
    for output in (sys.stdout, sys.stderr):
        if isinstance(output, io.TextIOWrapper):
            output.reconfigure(errors="backslashreplace")


def finish(stream: TextIO) -> None:
    """Flushes; what cannot be written is dropped now, not told when Python ends."""
    try:
        stream.flush()
    except (OSError, ValueError):
        with suppress(OSError, ValueError):
            os.dup2(os.open(os.devnull, os.O_WRONLY), stream.fileno())


class LogLines(logging.Handler):
    """What modules and libraries log, each record as one line on standard error.

    Records hold names from files.
    """

    def emit(self, record: logging.LogRecord) -> None:
        """Writes the line, if anybody can read it."""
        with suppress(OSError):
            sys.stderr.write(f"{one_line(record.getMessage())}\n")


def log_in_lines() -> None:
    """Warnings of modules, of libraries and of Python itself come as such lines."""
    logging.basicConfig(handlers=[LogLines(logging.WARNING)])
    logging.captureWarnings(True)
