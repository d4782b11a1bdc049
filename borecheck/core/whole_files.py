"""Files that are written: whole or not at all, and never something else in their place.

A new file is written under another name first, then renamed, so that nobody reads half
of it. What stands under the name already stays what it is: a link is followed to what
it points to, a file keeps its permissions and its other names, a device or a pipe is
written to. What cannot be written that way is refused before the work begins.
"""

import errno
import os
import secrets
import stat
import sys
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path

from borecheck.errors import InputError

# Of a name, so much goes into the one that a file has until it is whole, [characters].
_NAME_KEPT = 60

_KINDS = {
    stat.S_IFCHR: "a device",
    stat.S_IFBLK: "a disk",
    stat.S_IFIFO: "a pipe",
    stat.S_IFSOCK: "a socket",
}


def check_writable(path: Path, *, stream: bool = True) -> None:
    """Refuses an output before the work is done, not after; nothing is changed.

    Args:
        path: Where the user wants it.
        stream: Whether a device or a pipe will do.

    Raises:
        InputError: It is a folder, its folder does not exist, there is no permission,
            or it is something that is not written to.
    """
    with telling(path):
        found = _status(path)
        problem = _why_not(path, found, stream)
    if problem is not None:
        raise InputError(path, f"cannot be written: {problem}")


def write_whole(path: Path, content: str | bytes) -> None:
    """Writes a file that appears whole or not at all; see the module.

    Raises:
        InputError: It cannot be written.
    """
    write_all({path: content})


def write_all(contents: Mapping[Path, str | bytes]) -> None:
    """Writes several files: all of them are on the disk before the first has its name.

    They get their names in the order given.

    Raises:
        InputError: One of them cannot be written. Unless that shows only when it is
            renamed or written in place, all files are as they were.
    """
    for path in contents:
        check_writable(path)
    begun: dict[Path, Path] = {}
    try:
        for path, content in contents.items():
            if _is_renamed(path):
                with telling(path):
                    begun[path] = written_beside(_real(path), _bytes(content))
        for path, content in contents.items():
            with telling(path):
                if path in begun:
                    begun[path].replace(_real(path))
                else:
                    _write_in_place(path, _bytes(content))
    finally:
        for temporary in begun.values():
            temporary.unlink(missing_ok=True)


def written_beside(target: Path, content: bytes) -> Path:
    """A new file with this content in the target's folder, whole on the disk.

    To be renamed to the target, or removed, by the caller. Its permissions are those
    of the target, or of any new file.

    Raises:
        OSError: It cannot be written; nothing is left of it.
    """
    name = f".{target.name[:_NAME_KEPT]}-{secrets.token_hex(4)}"
    temporary = target.absolute().parent / name
    handle = os.open(temporary, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o666)
    try:
        with os.fdopen(handle, "wb") as file:
            file.write(content)
            file.flush()
            os.fsync(file.fileno())
        if target.exists():
            temporary.chmod(stat.S_IMODE(target.stat().st_mode))
    except BaseException:
        temporary.unlink(missing_ok=True)
        raise
    return temporary


def same_file(first: Path, second: Path) -> bool:
    """Whether two outputs would be one file, which the second would lose.

    Links are followed, also hard ones: a file keeps its other names when it is written.
    """
    if _real(first) == _real(second):
        return not first.exists() or first.is_file()
    return first.is_file() and second.is_file() and first.samefile(second)


def remove(path: Path) -> None:
    """Takes away a file of an earlier run; of a link, what it points to."""
    _real(path).unlink(missing_ok=True)


@contextmanager
def telling(path: Path) -> Iterator[None]:
    """What the system says against writing a file, in one line.

    Raises:
        InputError: Instead of any OSError.
    """
    try:
        yield
    except OSError as error:
        problem = f"cannot be written: {error.strerror or error}"
        if error.errno == errno.ENXIO:
            problem = "cannot be written: nobody reads from it"
        raise InputError(path, problem) from error


def _bytes(content: str | bytes) -> bytes:
    return content.encode() if isinstance(content, str) else content


def _real(path: Path) -> Path:
    """Where a file is, all links followed; it need not be there yet."""
    return path.resolve()


def _status(path: Path) -> os.stat_result | None:
    """What is there, links followed, or None.

    Raises:
        OSError: It cannot be known: links in a circle, no permission.
    """
    try:
        return path.stat()
    except (FileNotFoundError, NotADirectoryError):
        return None


def _why_not(path: Path, found: os.stat_result | None, stream: bool) -> str | None:
    """Why a file (or a new one, where nothing is found) cannot be written."""
    if found is None:
        folder = _real(path).parent
        if not folder.is_dir():
            return f"no folder {folder}"
        return None if os.access(folder, os.W_OK | os.X_OK) else "Permission denied"
    kind = stat.S_IFMT(found.st_mode)
    if kind == stat.S_IFDIR:
        return "Is a directory"
    if kind != stat.S_IFREG and not (stream and kind in (stat.S_IFCHR, stat.S_IFIFO)):
        return f"it is {_KINDS.get(kind, 'something else')}, not a file"
    # root may write what nobody may, but whoever took all permission away meant it
    if not found.st_mode & 0o222 or not os.access(path, os.W_OK):
        return "Permission denied"
    return None


def _is_renamed(path: Path) -> bool:
    """Whether a file is put under this name; otherwise what is there is written to.

    That is what has no name of its own (a device, a pipe, what the shell opened for
    us), and a file that renaming would part from its owner or from its other names, or
    whose folder takes no new file.
    """
    with telling(path):
        found = _status(path)
        if found is None:
            return True
        real = _real(path)
    if not stat.S_ISREG(found.st_mode) or _stream(found) is not None:
        return False
    own = found.st_uid == os.geteuid() and found.st_nlink == 1
    return own and os.access(real.parent, os.W_OK | os.X_OK)


def _write_in_place(path: Path, content: bytes) -> None:
    found = path.stat()
    number = _stream(found)
    if number is not None:
        sys.stdout.flush()  # what was said before comes first
        handle = os.dup(number)
    else:
        # A pipe that nobody reads from would be waited for without an end.
        handle = os.open(path, os.O_WRONLY | os.O_NONBLOCK | os.O_NOCTTY)
        os.set_blocking(handle, True)
    with os.fdopen(handle, "wb") as stream:
        stream.write(content)
        stream.flush()
        if number is None and stat.S_ISREG(found.st_mode):
            stream.truncate()


def _stream(found: os.stat_result) -> int | None:
    """1 or 2, if that is our own standard output or error: `--out /dev/stdout`.

    Opened anew, a file behind it would be written from its beginning again.
    """
    for number in (1, 2):
        try:
            if os.path.samestat(found, os.fstat(number)):
                return number
        except OSError:  # it was closed
            continue
    return None
