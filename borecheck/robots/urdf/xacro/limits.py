"""Bounds on what an expansion may cost: memory, time, the length of a range.

A xacro file is a program; a line of it can fill a machine's memory or never end.
"""

import signal
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

MAX_MEMORY_BYTES = 500_000_000  # beyond what is in use; a large robot needs 50 MB
MAX_SECONDS = 20.0  # the largest public robots take two
MAX_RANGE = 1_000_000


class TimeUpError(BaseException):
    """The time is up; no `except Exception` in the xacro code may swallow it."""


@contextmanager
def bounded_memory() -> Iterator[None]:
    """MemoryError beyond `MAX_MEMORY_BYTES`, where the system can bound a process."""
    used = _address_space()
    if used is None:
        yield
        return
    import resource

    before = resource.getrlimit(resource.RLIMIT_AS)
    bounds = [used + MAX_MEMORY_BYTES]
    bounds += [bound for bound in before if bound != resource.RLIM_INFINITY]
    resource.setrlimit(resource.RLIMIT_AS, (min(bounds), before[1]))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_AS, before)


@contextmanager
def bounded_time() -> Iterator[None]:
    """TimeUpError after `MAX_SECONDS`: in the main thread, if no timer runs already."""
    is_main = threading.current_thread() is threading.main_thread()
    if not (is_main and hasattr(signal, "setitimer")):
        yield
        return
    if signal.getitimer(signal.ITIMER_REAL)[0] > 0.0:
        yield
        return

    def end(*_: object) -> None:
        raise TimeUpError

    before = signal.signal(signal.SIGALRM, end)
    signal.setitimer(signal.ITIMER_REAL, MAX_SECONDS)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0.0)
        signal.signal(signal.SIGALRM, before)


def limited_range(original: Callable[..., Any]) -> Callable[..., Any]:
    """A `range` that refuses a length which C code would count without a pause."""

    def checked(*bounds: Any) -> Any:
        try:
            is_long = len(range(*bounds)) > MAX_RANGE
        except OverflowError:
            is_long = True
        if is_long:
            written = ", ".join(map(str, bounds))
            raise ValueError(f"range({written}) is longer than {MAX_RANGE}")
        return original(*bounds)

    return checked


def _address_space() -> int | None:
    """Bytes of address space in use; None where it cannot be told."""
    try:
        import resource

        pages = int(Path("/proc/self/statm").read_text(encoding="ascii").split()[0])
        return pages * resource.getpagesize()
    except (ImportError, OSError, ValueError):
        return None
