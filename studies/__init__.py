"""Large, seeded runs whose figures stand in the docs: `python -m studies.NAME`.

Each says at once, on standard error, what it does, and when kernels are compiled.
"""

import sys
from importlib.util import find_spec
from pathlib import Path


def first_line(name: str) -> str:
    """What a study does: the first line of its docstring, which is read, not run."""
    spec = find_spec(name)
    if spec is not None and spec.submodule_search_locations:
        spec = find_spec(f"{name}.__main__")
    if spec is None or spec.origin is None:
        return ""
    text = Path(spec.origin).read_text(encoding="utf-8")
    return text.removeprefix('"""').partition("\n")[0].removesuffix('"""')


def _begin() -> None:
    """Tells of the study that `python -m studies.NAME` is about to run."""
    words = sys.orig_argv
    at = words.index("-m") + 1 if "-m" in words[:-1] else len(words)
    name = words[at] if at < len(words) else ""
    if not name.startswith("studies.") or {"-h", "--help"}.intersection(words):
        return
    from borecheck.commands.compiling import tell_of_compiling
    from borecheck.commands.progress import say

    say(f"{name}: {first_line(name)}")
    tell_of_compiling()


_begin()
