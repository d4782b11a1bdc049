"""Results that are dear to compute, kept on disk under the hash of what they hold.

A cache file is never trusted: a damaged one is named in a warning and ignored, and
whoever asked builds the result again.
"""

import atexit
import logging
import os
import shutil
import tempfile
import zipfile
from functools import cache
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from borecheck.core.kept import limit, trim
from borecheck.core.private_folder import make_private, not_private

_log = logging.getLogger(__name__)

Arrays = dict[str, NDArray[np.generic]]


def cache_folder() -> Path:
    """Where cache files live (the folder need not exist yet).

    `BORECHECK_CACHE` if set, else `borecheck` in `XDG_CACHE_HOME`, else
    `~/.cache/borecheck`. A relative path in XDG_CACHE_HOME is ignored, as its
    specification asks. Where others could put files into it, or it is not ours (as
    with `sudo`), a new folder takes its place, for this process alone.
    """
    folder = _chosen_folder()
    problem = not_private(folder)
    if problem is None:
        return folder
    _warn_of_folder(folder, problem)
    return process_folder()


def _chosen_folder() -> Path:
    chosen = os.environ.get("BORECHECK_CACHE")
    if chosen:
        return Path(chosen).expanduser()
    base = os.environ.get("XDG_CACHE_HOME", "")
    if base and Path(base).is_absolute():
        return Path(base) / "borecheck"
    try:
        return Path("~/.cache/borecheck").expanduser()
    except RuntimeError:  # a user without a home
        return Path(tempfile.gettempdir()) / f"borecheck-{os.getuid()}"


@cache
def process_folder() -> Path:
    """A folder of this process alone, gone when it ends."""
    folder = tempfile.mkdtemp(prefix="borecheck-")
    atexit.register(shutil.rmtree, folder, ignore_errors=True)
    return Path(folder)


@cache
def _warn_of_folder(folder: Path, problem: str) -> None:
    _log.warning("%s: not used as a cache (%s)", folder, problem)


def cache_file(kind: str, key: str) -> Path:
    """The file of one result.

    Args:
        kind: What it is, with the version of its layout: "tree-1".
        key: Hash of everything the result depends on.
    """
    return cache_folder() / f"{kind}-{key}.npz"


def load(kind: str, key: str) -> Arrays | None:
    """The arrays stored under a key, or None if there are none that can be used."""
    file = cache_file(kind, key)
    try:
        with file.open("rb") as stream, np.load(stream, allow_pickle=False) as stored:
            return {name: stored[name] for name in stored.files}
    except FileNotFoundError:
        return None
    except (OSError, ValueError, KeyError, EOFError, zipfile.BadZipFile) as error:
        warn_damaged(kind, key, str(error))
        return None


def warn_damaged(kind: str, key: str, problem: str) -> None:
    """One warning line: the file, what is wrong, and that it is built again."""
    reason = " ".join(problem.split()) or "cannot be read"
    _log.warning(
        "%s: damaged cache file ignored and built again (%s)",
        cache_file(kind, key),
        reason,
    )


def store(kind: str, key: str, arrays: Arrays) -> None:
    """Keep arrays under a key; the file appears whole or not at all.

    A folder that cannot be written to costs a warning line, never the result.
    """
    file = cache_file(kind, key)
    try:
        make_private(file.parent)
        _write_whole(file, arrays)
        _trim_once(file.parent)
    except OSError as error:
        _log.warning("%s: result not cached (%s)", file, error)


@cache
def _trim_once(folder: Path) -> None:
    """Keeps a folder below its limit; once in a process, for looking costs time."""
    for entry in trim(folder, limit()):
        _log.info("%s: taken away, the cache is full", entry.path)


def _write_whole(file: Path, arrays: Arrays) -> None:
    # A rename within one folder is atomic: a reader sees the old file or the new.
    handle, name = tempfile.mkstemp(dir=file.parent, suffix=".tmp")
    temporary = Path(name)
    try:
        with os.fdopen(handle, "wb") as stream:
            np.savez(stream, **arrays)  # type: ignore[arg-type]
        temporary.replace(file)
    finally:
        temporary.unlink(missing_ok=True)
