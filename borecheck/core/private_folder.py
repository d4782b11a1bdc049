"""Folders that nobody but their owner can put something into.

What is read back from a cache is believed more than what a user names: compiled kernels
are run. So it comes from folders only that are ours, below folders that nobody else can
exchange. Root is believed, and so is the owner of `/` (in a container that may be one
without a name).
"""

import grp
import os
import pwd
import stat
from functools import lru_cache
from pathlib import Path

_OTHERS = 0o077


def distrust(folder: Path) -> str | None:
    """Why somebody else could put files into a folder, or None.

    The folder and all above it are looked at, those behind links too. One that is not
    there yet counts as ours if those above it are safe.
    """
    wanted = folder.absolute()
    try:
        behind = wanted.resolve()
    except RuntimeError:
        return f"{folder} is a link in a circle"
    seen: set[Path] = set()
    for path in (wanted, behind):
        for place in (path, *path.parents):
            if place not in seen:
                seen.add(place)
                problem = _problem(place)
                if problem is not None:
                    return f"{place} {problem}"
    return None


def make_private(folder: Path) -> None:
    """Makes a folder, and those above it that are missing, for us alone.

    Raises:
        OSError: It cannot be made.
    """
    missing = []
    for place in (folder, *folder.parents):
        if place.exists():
            break
        missing.append(place)
    for place in reversed(missing):
        place.mkdir(mode=0o700, exist_ok=True)
    if not folder.is_dir():
        raise NotADirectoryError(20, "Not a directory", str(folder))


def not_private(folder: Path) -> str | None:
    """Why a folder is not ours alone, or None.

    One that is ours and that others can read is closed to them; one that they could
    write may hold what they wrote, and stays as it is.
    """
    problem = distrust(folder)
    if problem is not None or not folder.is_dir():
        return problem
    found = folder.stat()
    if found.st_uid != os.geteuid():
        return f"{folder} belongs to {_user(found.st_uid)}"
    if found.st_mode & _OTHERS:
        folder.chmod(stat.S_IMODE(found.st_mode) & ~_OTHERS)
    return None


def foreign_file(folder: Path, pattern: str) -> Path | None:
    """A file in a folder that somebody else owns or could change, if there is one."""
    if not folder.is_dir() or not folder.stat().st_mode & _OTHERS:
        return None  # nobody else gets at the files
    for file in sorted(folder.glob(pattern)):
        found = file.lstat()
        ours = stat.S_ISREG(found.st_mode) and found.st_uid in _believed()
        if not ours or _others_write(found):
            return file
    return None


def _problem(place: Path) -> str | None:
    """Why a folder, or a link to one, could be exchanged, or filled, by others."""
    try:
        itself, behind = place.lstat(), place.stat()
    except OSError:  # not there, or not to be looked at: then nothing is read there
        return None
    for found in (itself, behind):
        if found.st_uid not in _believed():
            return f"belongs to {_user(found.st_uid)}"
    if _others_write(behind) and not behind.st_mode & stat.S_ISVTX:
        return "can be written by others"
    return None


def _others_write(found: os.stat_result) -> bool:
    if found.st_mode & stat.S_IWOTH:
        return True
    return bool(found.st_mode & stat.S_IWGRP) and not _is_ours_alone(found.st_gid)


@lru_cache(maxsize=1)
def _believed() -> frozenset[int]:
    return frozenset({0, os.geteuid(), Path("/").stat().st_uid})


@lru_cache(maxsize=64)
def _is_ours_alone(group: int) -> bool:
    """Whether a group has no other member: many systems give each user one."""
    if group == 0:
        return True
    try:
        user, found = pwd.getpwuid(os.geteuid()), grp.getgrgid(group)
    except KeyError:
        return False
    private = group == user.pw_gid and found.gr_name == user.pw_name
    return private and set(found.gr_mem) <= {user.pw_name}


def _user(number: int) -> str:
    try:
        return pwd.getpwuid(number).pw_name
    except KeyError:
        return f"user {number}"
