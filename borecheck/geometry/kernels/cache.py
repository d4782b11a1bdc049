"""Where compiled kernels are kept, and how a stale one is told from a good one.

numba keeps machine code under the text of the one file that a kernel stands in. What
it inlined or froze from other files (kernels called, constants) may change without
that file: after an upgrade the old code would go on answering. Here every kernel of
the project is kept under a stamp of its own file *and* of every file of the project
that this one imports, directly or not: one character changed, and it is compiled anew.

Compiled code lies beside the sources if they can be written to, by us and nobody else,
else in the user's cache folder; if neither will do, it lives as long as the process.
"""

import re
import tempfile
from functools import cache
from hashlib import sha256
from pathlib import Path
from typing import Any

import numpy as np
from numba.core import caching as _caching
from numba.core import config as _config

from borecheck.core.cache import cache_folder, process_folder
from borecheck.core.private_folder import distrust, foreign_file, make_private

caching: Any = _caching  # carry no types
config: Any = _config

_PACKAGE = Path(__file__).parents[2]  # borecheck/
# "import borecheck.x", "from borecheck.x import" and "from borecheck import x, y".
# What only looks like an import costs nothing: a stamp of more files is safe.
_NAMED = re.compile(r"\bborecheck((?:\.\w+)+)")
_LISTED = re.compile(r"from borecheck((?:\.\w+)*) import (\([^)]*\)|[^\n]*)")


class KernelLocator(caching._CacheLocator):  # type: ignore[misc]
    """What numba asks where a kernel is kept and whether that is fresh."""

    def __init__(self, line: int, file: Path) -> None:
        self._line = line
        self._file = file
        # What numba prints when it cannot keep a kernel (as with NUMBA_OPT=0).
        self._lineno, self._py_file = line, str(file)
        self._folder = _folder(file) if file.is_file() else process_folder()

    def get_cache_path(self) -> str:
        """The folder."""
        return str(self._folder)

    def get_source_stamp(self) -> str:
        """Changes with everything that the compiled code may depend on."""
        return stamp(self._file)

    def get_disambiguator(self) -> str:
        """Tells functions of one name apart."""
        return str(self._line)

    @classmethod
    def from_function(cls, py_func: Any, py_file: str) -> "KernelLocator | None":
        """For functions of this package only; numba asks others for all others."""
        file = Path(py_file)
        if _PACKAGE not in file.parents:
            return None
        return cls(py_func.__code__.co_firstlineno, file)


@cache
def stamp(file: Path) -> str:
    """Hash of a file and of all files of the package that it imports."""
    digest = sha256(f"kernels-3 numpy-{np.__version__}".encode())
    for source in sources(file):
        digest.update(f"\n{source.name} {_read(source)[0]}".encode())
    return digest.hexdigest()


@cache
def sources(file: Path) -> tuple[Path, ...]:
    """The files of the package that a file imports, directly or not, and itself."""
    found: set[Path] = set()
    waiting = {file}
    while waiting:
        found |= waiting
        waiting = {n for source in waiting for n in _read(source)[1]} - found
    return tuple(sorted(found))


@cache
def _read(file: Path) -> tuple[str, frozenset[Path]]:
    """Hash of a source, and the files of the package that it may import."""
    data = file.read_bytes()
    text = data.decode("utf-8")
    dotted = {name.strip(".") for name in _NAMED.findall(text)}
    for home, listed in _LISTED.findall(text):
        dotted |= {f"{home}.{n}".strip(".") for n in re.findall(r"\w+", listed)}
    package = next(p for p in file.parents if p.name == _PACKAGE.name)
    paths = {package.joinpath(*name.split(".")).with_suffix(".py") for name in dotted}
    return sha256(data).hexdigest(), frozenset(p for p in paths if p.is_file())


@cache
def _folder(file: Path) -> Path:
    """The first of the folders for this file's kernels that can be used."""
    below = caching._CacheLocator.get_suitable_cache_subpath(str(file))
    folders = [file.parent / "__pycache__", cache_folder() / "kernels" / below]
    if config.CACHE_DIR:
        folders = [Path(config.CACHE_DIR) / below]
    usable = (f for f in folders if _writable(f) and _is_ours(f))
    return next(usable, None) or process_folder()


@cache
def _writable(folder: Path) -> bool:
    try:
        if cache_folder() in folder.parents:
            make_private(folder)
        folder.mkdir(parents=True, exist_ok=True)
        tempfile.TemporaryFile(dir=folder).close()
    except OSError:
        return False
    return True


@cache
def _is_ours(folder: Path) -> bool:
    """Whether nobody else could have put kernels there: numba runs what it finds."""
    return distrust(folder) is None and foreign_file(folder, "*.nb[ic]") is None


def use_for_this_package() -> None:
    """Makes numba ask `KernelLocator` first, from the next kernel on."""
    chosen = f"{__name__}.{KernelLocator.__name__}"
    classes = caching.CompileResultCacheImpl._locator_classes
    if KernelLocator not in classes:
        classes.insert(0, KernelLocator)
    # The environment may have named classes, which numba then takes instead.
    named = getattr(config, "CACHE_LOCATOR_CLASSES", "")
    if named and chosen not in named:
        config.CACHE_LOCATOR_CLASSES = f"{chosen},{named}"
