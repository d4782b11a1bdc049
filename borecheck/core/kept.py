"""What lies in the cache folder: listed, taken away, kept below a limit.

Each result is a file of its own (`KIND-KEY.npz`, `.json`), a set of meshes or kernels a
folder; all can be made again. Only names that borecheck gives are touched.
"""

import os
import re
import shutil
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from borecheck.core.units import parse_size
from borecheck.errors import UsageError

# A hundred arms with their trees stay below it, [bytes].
LIMIT = 2_000_000_000

_FILE = re.compile(r"(?P<kind>tree|topology|expanded|compiled)(-\d+)?-[\w.+-]+")
_FOLDERS = ("meshes", "kernels")


@dataclass(frozen=True)
class Entry:
    """One thing that is kept.

    Attributes:
        kind: tree, topology, expanded, compiled, meshes or kernels.
        path: The file, or the folder of a set.
        size: [bytes].
        used: When it was written, seconds since the epoch.
    """

    kind: str
    path: Path
    size: int
    used: float


def limit() -> int:
    """How much may be kept, [bytes]: `BORECHECK_CACHE_LIMIT` (`500MB`), or 2 GB.

    Raises:
        UsageError: The variable holds no size.
    """
    text = os.environ.get("BORECHECK_CACHE_LIMIT")
    if text is None:
        return LIMIT
    try:
        return parse_size(text)
    except UsageError as error:
        raise UsageError(f"BORECHECK_CACHE_LIMIT: {error}") from error


def entries(folder: Path) -> list[Entry]:
    """All that is kept in a cache folder, the oldest first."""
    return sorted(_entries(folder), key=lambda entry: entry.used)


def _entries(folder: Path) -> Iterator[Entry]:
    for path in sorted(folder.glob("*")):
        named = _FILE.fullmatch(path.name)
        if named and path.is_file() and not path.is_symlink():
            found = path.stat()
            yield Entry(named["kind"], path, found.st_size, found.st_mtime)
    for kind in _FOLDERS:
        for path in sorted((folder / kind).glob("*")):
            if path.is_dir() and not path.is_symlink():
                files = [f.stat() for f in path.rglob("*") if f.is_file()]
                size = sum(f.st_size for f in files)
                used = max((f.st_mtime for f in files), default=path.stat().st_mtime)
                yield Entry(kind, path, size, used)


def take_away(entry: Entry) -> None:
    """Deletes one thing; gone already is fine."""
    if entry.path.is_dir():
        shutil.rmtree(entry.path, ignore_errors=True)
    else:
        entry.path.unlink(missing_ok=True)


def trim(folder: Path, most: int) -> list[Entry]:
    """Takes the oldest away until no more than `most` bytes are kept; what it took."""
    kept = entries(folder)
    total = sum(entry.size for entry in kept)
    taken = []
    for entry in kept:
        if total <= most:
            break
        take_away(entry)
        total -= entry.size
        taken.append(entry)
    return taken
