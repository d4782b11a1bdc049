"""Files of a user that are read whole, up to a size."""

from pathlib import Path

from borecheck.errors import InputError


def read_at_most(path: Path, most: int) -> bytes:
    """What a file holds; no more than so many bytes are ever read.

    Raises:
        InputError: It cannot be read, or is larger.
    """
    try:
        with path.open("rb") as file:
            content = file.read(most + 1)
    except OSError as error:
        raise InputError(path, f"cannot be read: {error.strerror}") from error
    if len(content) > most:
        raise InputError(path, f"is larger than {most} bytes")
    return content
