"""Says so when the contact kernels are about to be compiled for the first time."""

import platform
from hashlib import sha256
from pathlib import Path

from borecheck.cache import cache_folder
from borecheck.progress import say


def announce_compilation() -> None:
    """One line on standard error before the first, slow run with these versions.

    numba keeps the compiled kernels by themselves; the mark left here only
    remembers that somebody has been told.
    """
    from importlib.metadata import version

    from borecheck import __version__

    here = sha256(str(Path(__file__).parent).encode()).hexdigest()[:8]
    parts = (__version__, version("numba"), version("numpy"), platform.machine(), here)
    mark = cache_folder() / f"compiled-{'-'.join(parts)}"
    if _exists(mark):
        return
    say(
        "borecheck: compiling the contact kernels, once for this installation; "
        "this takes a minute or two ..."
    )
    try:
        mark.parent.mkdir(parents=True, exist_ok=True)
        mark.touch()
    except OSError as error:
        say(f"borecheck: {mark.parent} cannot be written ({error.strerror})")


def _exists(mark: Path) -> bool:
    try:
        return mark.exists()
    except OSError:  # a folder that may not be looked into
        return False
