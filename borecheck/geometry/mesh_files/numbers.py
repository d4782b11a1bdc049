"""Numbers in text mesh files, read strictly and reported by their line."""

from os import PathLike

from borecheck.errors import MeshError

_SHOWN = 40  # characters of a wrong word that a message repeats


def number(word: bytes, file: str | PathLike[str], line: int) -> float:
    """A decimal number; decimal commas and underscores are refused, not guessed.

    Raises:
        MeshError: The word is no number.
    """
    try:
        if b"_" not in word:
            return float(word)
    except ValueError:
        pass
    raise MeshError(file, f"{shown(word)} is no number", f"line {line}")


def integer(word: bytes, file: str | PathLike[str], line: int) -> int:
    """A whole number that fits an index.

    Raises:
        MeshError: The word is no whole number, or far too long for one.
    """
    try:
        if b"_" not in word and len(word) <= 18:
            return int(word)
    except ValueError:
        pass
    raise MeshError(file, f"{shown(word)} is no whole number", f"line {line}")


def shown(word: bytes) -> str:
    """A word from a file as a message may print it: short, quoted, no control bytes."""
    return repr(word[:_SHOWN].decode("ascii", "backslashreplace"))
