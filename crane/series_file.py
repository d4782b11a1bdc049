"""A measured series of CRANE's encoders, as a CSV file."""

import math
from pathlib import Path

import numpy as np

from borecheck.core.units import PLAIN_NUMBER
from crane.encoders import Series
from crane.transmission import LARGEST

HEADER = ("m5", "m6", "m7", "m8", "q5", "q6", "q7", "q8")


def read_series(path: Path) -> Series:
    """A measured series: a header `m5,...,q8`, then a line of numbers a sample.

    Args:
        path: The file; motors and q5 to q7 in [rad], q8 in [m].

    Raises:
        ValueError: It cannot be read, has another header, or a line that is none.
    """
    try:
        lines = path.read_text(encoding="utf-8-sig").rstrip().splitlines()
    except OSError as error:
        raise ValueError(f"cannot be read: {error.strerror or error}") from error
    except UnicodeDecodeError as error:
        raise ValueError(f"cannot be read as text: {error}") from error
    header = tuple(word.strip() for word in lines[0].split(",")) if lines else ()
    if header != HEADER:
        raise ValueError(f"line 1: the header must be {','.join(HEADER)}")
    rows = [_row(n, line) for n, line in enumerate(lines[1:], start=2)]
    values = np.array(rows, dtype=np.float64).reshape(-1, len(HEADER))
    return Series(values[:, :4], values[:, 4:])


def _row(number: int, line: str) -> list[float]:
    """The numbers of a line, which its number is for.

    Raises:
        ValueError: A word that is no finite number, or too large for a reading.
    """
    words = [word.strip() for word in line.split(",")]
    if len(words) != len(HEADER):
        raise ValueError(f"line {number}: {len(words)} numbers, not {len(HEADER)}")
    row = []
    for name, word in zip(HEADER, words, strict=True):
        value = float(word) if PLAIN_NUMBER.fullmatch(word) else math.nan
        if not math.isfinite(value):
            raise ValueError(f"line {number}: {name} = {word!r} is no finite number")
        if abs(value) > LARGEST:
            raise ValueError(
                f"line {number}: {name} = {word}: readings are in rad, q8 in m"
            )
        row.append(value)
    return row
