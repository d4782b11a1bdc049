"""Runs calls under an audit hook: what they open, import, run or connect to is told.

A hook cannot be taken off again (`sys.addaudithook`), so it is set once a process and
listens only while `watching` says so.
"""

import os
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

# What starts a program or a connection, by the names of PEP 578.
RUNS = ("subprocess.", "os.system", "os.exec", "os.posix_spawn", "os.spawn", "os.fork")
RUNS += (
    "os.startfile",
    "pty.",
    "socket.",
    "urllib.",
    "http.",
    "ftplib.",
    "webbrowser.",
)
# What brings code in: modules do, and kernels that numba kept.
LOADS = ("import", "exec", "marshal.loads", "pickle.", "ctypes.", "code.__new__")
LOADS += ("function.__new__",)
TOUCHES = ("open", "os.listdir", "os.scandir", "os.remove", "os.rename", "os.mkdir")
TOUCHES += ("os.rmdir", "os.symlink", "os.link", "os.chmod", "os.chown", "os.truncate")
TOUCHES += ("shutil.", "glob.", "os.chdir", "os.mkfifo")


@dataclass
class Watch:
    """What is allowed, and what was seen beyond it.

    Attributes:
        folders: Below these files may be opened.
        allow_code: Whether modules and kernels may be loaded (commands do, on demand).
        seen: What happened beyond that, a line each.
    """

    folders: tuple[str, ...]
    allow_code: bool = False
    seen: list[str] = field(default_factory=list)

    def hears(self, event: str, args: tuple[Any, ...]) -> None:
        """One event of the interpreter."""
        if event.startswith(RUNS) or (event.startswith(LOADS) and not self.allow_code):
            self.seen.append(f"{event} {args!r:.200}")
        elif event.startswith(TOUCHES):
            self._touch(event, args)

    def _touch(self, event: str, args: tuple[Any, ...]) -> None:
        path = args[0] if args else None
        if not isinstance(path, str | bytes | os.PathLike):
            return  # a file descriptor: it was opened before
        real = os.path.realpath(os.fsdecode(path))
        if not any(real == f or real.startswith(f + os.sep) for f in self.folders):
            self.seen.append(f"{event} {real}")


_listener: list[Watch] = []
_is_set: list[bool] = []


def _hook(event: str, args: tuple[Any, ...]) -> None:
    if _listener:
        watch = _listener.pop()  # what the watch itself does is not heard
        try:
            watch.hears(event, args)
        finally:
            _listener.append(watch)


@contextmanager
def watching(watch: Watch) -> Iterator[Watch]:
    """Listens while the block runs."""
    if not _is_set:
        sys.addaudithook(_hook)
        _is_set.append(True)
    _listener.append(watch)
    try:
        yield watch
    finally:
        _listener.clear()


@dataclass
class Tally:
    """The sum over many inputs.

    Attributes:
        counts: How many ended how.
        seconds: The longest, in processor time.
        slowest: What took it.
        problems: What must not happen, a line each.
    """

    counts: dict[str, int] = field(default_factory=dict)
    seconds: float = 0.0
    slowest: str = ""
    problems: list[str] = field(default_factory=list)

    def add(self, outcome: str, seconds: float, what: str) -> None:
        """One input."""
        self.counts[outcome] = self.counts.get(outcome, 0) + 1
        if seconds > self.seconds:
            self.seconds, self.slowest = seconds, what[:200]

    def joined(self, other: "Tally") -> "Tally":
        """The sum of two."""
        names = [*self.counts, *other.counts]
        slower = max(self, other, key=lambda tally: tally.seconds)
        return Tally(
            {n: self.counts.get(n, 0) + other.counts.get(n, 0) for n in names},
            slower.seconds,
            slower.slowest,
            [*self.problems, *other.problems],
        )


def timed(call: Callable[[], str]) -> tuple[str, float]:
    """What a call gives, and the processor time it took, [s]."""
    start = time.process_time()
    outcome = call()
    return outcome, time.process_time() - start


def peak_bytes() -> int:
    """The largest memory of this process so far."""
    import resource

    unit = 1 if sys.platform == "darwin" else 1024
    return unit * resource.getrusage(resource.RUSAGE_SELF).ru_maxrss


def python_folders() -> tuple[str, ...]:
    """Where Python and its packages lie."""
    found = {sys.prefix, sys.base_prefix, str(Path(os.__file__).parent), *sys.path}
    return tuple(os.path.realpath(folder) for folder in found if folder)
