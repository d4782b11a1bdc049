"""Files that appear whole: written under another name first, then renamed."""

import os
import tempfile
from pathlib import Path

from borecheck.errors import BorecheckError


def written_beside(target: Path, content: bytes) -> Path:
    """A new file with this content in the target's folder, whole on the disk.

    To be renamed to the target, or removed, by the caller. Its permissions are those
    that any new file gets.

    Raises:
        OSError: It cannot be written; nothing is left of it.
    """
    folder = target.absolute().parent
    handle, name = tempfile.mkstemp(dir=folder, prefix=f".{target.name}-")
    try:
        with os.fdopen(handle, "wb") as stream:
            stream.write(content)
            stream.flush()
            os.fsync(stream.fileno())
        mask = os.umask(0)
        os.umask(mask)
        Path(name).chmod(0o666 & ~mask)
    except BaseException:
        Path(name).unlink(missing_ok=True)
        raise
    return Path(name)


def check_writable(path: Path) -> None:
    """Refuses an output file before the work is done, not after.

    Raises:
        BorecheckError: The folder does not exist or cannot be written to.
    """
    folder = path.absolute().parent
    if path.is_dir():
        raise BorecheckError(f"{path} is a directory, not a file to write")
    if not folder.is_dir():
        raise BorecheckError(f"{path}: there is no folder {folder}")
    if not os.access(folder, os.W_OK):
        raise BorecheckError(f"{path}: no permission to write in {folder}")


def write_whole(path: Path, text: str) -> None:
    """Writes a file that appears whole or not at all.

    Raises:
        BorecheckError: It cannot be written.
    """
    path = path.absolute()
    try:
        temporary = written_beside(path, text.encode())
        try:
            temporary.replace(path)
        finally:
            temporary.unlink(missing_ok=True)
    except OSError as error:
        raise BorecheckError(f"{path} cannot be written: {error.strerror}") from error
