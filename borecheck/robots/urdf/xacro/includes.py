"""`<xacro:include>` with a pattern: `parts/*.xacro`, looked up within reach only."""

import os
import re
from collections.abc import Callable, Iterator
from fnmatch import fnmatchcase
from pathlib import Path
from typing import Any

from borecheck.robots.urdf.xacro.run import MAX_FILES, Run

_MAGIC = re.compile(r"[*?[]")


def included_files(
    run: Run, eval_text: Callable[[str, Any], Any]
) -> Callable[[str, Any], Iterator[str]]:
    """The replacement of `xacro.get_include_files`."""
    import xacro

    def get_include_files(filename_spec: str, symbols: Any) -> Iterator[str]:
        name = xacro.abs_filename_spec(str(eval_text(filename_spec, symbols)))
        if not _MAGIC.search(name):
            yield name
            return
        found = sorted(_matching(Path(os.path.normpath(name)), run))
        if not found:
            xacro.warning(xacro.include_no_matches_msg.format(name))
        yield from found

    return get_include_files


def _matching(pattern: Path, run: Run) -> list[str]:
    """The files that a pattern names; folders are looked into within reach only."""
    plain = [part for part in pattern.parents if not _MAGIC.search(str(part))]
    start = plain[0] if plain else Path()
    run.refuse_outside(start, f"xacro:include {str(pattern)!r}")
    found = [start]
    for part in pattern.relative_to(start).parts:
        found = [below for folder in found for below in _within(folder, part, run)]
        run.count("files", MAX_FILES, len(found))
    return [str(path) for path in found]


def _within(folder: Path, pattern: str, run: Run) -> list[Path]:
    """Entries of a folder; hidden ones only where the pattern says so."""
    if not _MAGIC.search(pattern):
        path = folder / pattern
        return [path] if run.reach.holds(path) and path.exists() else []
    if not (run.reach.holds(folder) and folder.is_dir()):
        return []
    shows_hidden = pattern.startswith(".")
    return [
        entry
        for entry in folder.iterdir()
        if fnmatchcase(entry.name, pattern)
        and (shows_hidden or not entry.name.startswith("."))
    ]
