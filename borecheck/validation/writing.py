"""Files that are written: whether they can be is known before the work begins."""

import os
import shutil
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager, suppress
from pathlib import Path

from borecheck.errors import InputError


def check_writable(path: Path) -> None:
    """Whether a file can be written there; nothing is changed.

    Raises:
        InputError: Its folder does not exist, or no permission.
    """
    folder = path.absolute().parent
    if path.is_dir():
        raise InputError(path, "cannot be written: Is a directory")
    if not folder.is_dir():
        raise InputError(path, f"cannot be written: no folder {folder}")
    place, mode = (path, os.W_OK) if path.exists() else (folder, os.W_OK | os.X_OK)
    if not os.access(place, mode):
        raise InputError(path, "cannot be written: Permission denied")


@contextmanager
def telling(path: Path) -> Iterator[None]:
    """What the system says against writing a file, in calm words."""
    try:
        yield
    except OSError as error:
        problem = f"cannot be written: {error.strerror or error}"
        raise InputError(path, problem) from error


def write_text(path: Path, text: str) -> None:
    """Writes a text; what stops it is told in one line."""
    with telling(path):
        path.write_text(text, encoding="utf-8")


def write_together(writers: Mapping[Path, Callable[[Path], object]]) -> None:
    """Writes several files, all of them or none.

    Args:
        writers: Functions that write a file's content where they are told to.

    Raises:
        InputError: One of them cannot be written; all files are as they were.
    """
    for path in writers:
        with telling(path):
            check_writable(path)
            _check_change(path)
    written: dict[Path, Path] = {}
    try:
        for path, write in writers.items():
            with telling(path):
                target = path.resolve()
                beside = target.with_name(f".{target.name}.{os.getpid()}.new")
                written[target] = beside
                write(beside)
                if target.exists():
                    shutil.copymode(target, beside)
        _replace(written)
    finally:
        _remove(written.values())


def _replace(written: Mapping[Path, Path]) -> None:
    made: list[Path] = []
    for target, beside in written.items():
        is_new = not target.exists()
        try:
            with telling(target):
                beside.replace(target)
        except InputError:
            _remove(made)
            raise
        if is_new:
            made.append(target)


def _check_change(path: Path) -> None:
    """A file that is read-only stays as it is, even where its folder is not."""
    if path.exists():
        with path.open("r+b"):
            pass


def _remove(paths: Iterable[Path]) -> None:
    for path in paths:
        with suppress(OSError):
            path.unlink(missing_ok=True)
