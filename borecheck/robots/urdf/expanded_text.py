"""Expanded xacro files kept on disk, valid while no file they came from has changed."""

import json
import logging
from collections.abc import Mapping
from hashlib import sha256
from pathlib import Path

from borecheck.core import cache
from borecheck.core.private_folder import make_private
from borecheck.errors import UrdfError
from borecheck.robots.urdf.reach import ANYWHERE

_log = logging.getLogger(__name__)

_KIND = "expanded-2"  # 1 held texts of arguments that no file declares


def expanded_text(path: Path, arguments: Mapping[str, str]) -> str:
    """URDF text of an installed description's xacro file, which may read any file.

    A tenth of a second is saved where nothing changed; every file that was read is
    hashed again to know that. A stranger's file is expanded each time: what it may
    read depends on where it lies and on what the user allows.

    Args:
        path: The main file.
        arguments: All xacro arguments.

    Raises:
        UrdfError: The file cannot be expanded, or does not know an argument.
    """
    asked = json.dumps([str(path), dict(arguments)], sort_keys=True)
    file = cache.cache_folder() / f"{_KIND}-{sha256(asked.encode()).hexdigest()}.json"
    stored = _read(file)
    if stored is not None:
        return stored
    from borecheck.robots.urdf.xacro import expand  # fifteen modules, seldom needed

    expanded = expand(path, arguments, ANYWHERE)
    for name in expanded.unused:  # it would be believed to have an effect
        raise UrdfError(path, f"no <xacro:arg name={name!r}>", f"argument {name}")
    sources = (*expanded.files, *expanded.data_files)
    document = {
        "text": expanded.text,
        "files": {str(source): _hash(source) for source in sources},
    }
    _write(file, json.dumps(document))
    return expanded.text


def _read(file: Path) -> str | None:
    """The stored text, if every file it came from is as it was."""
    try:
        document = json.loads(file.read_text(encoding="utf-8"))
        text, files = document["text"], document["files"]
        if not files or any(_hash(Path(f)) != known for f, known in files.items()):
            return None
    except FileNotFoundError:
        return None
    except (OSError, ValueError, KeyError, TypeError, AttributeError) as error:
        _log.warning("%s: damaged cache file ignored (%s)", file, error)
        return None
    return str(text)


def _write(file: Path, text: str) -> None:
    try:
        make_private(file.parent)
        part = file.with_suffix(f".{sha256(text.encode()).hexdigest()[:8]}.tmp")
        part.write_text(text, encoding="utf-8")
        part.replace(file)
    except OSError as error:
        _log.warning("%s: not cached (%s)", file, error)


def _hash(file: Path) -> str:
    return sha256(file.read_bytes()).hexdigest()
