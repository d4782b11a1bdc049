"""CPU time of things that do the same job, in turns so that noise hits all alike."""

import time
from collections.abc import Callable, Mapping

import numpy as np

REPEATS = 9
LEAST = 2e-3  # CPU seconds of one measurement: shorter jobs are repeated inside it


def paired(
    jobs: Mapping[str, Callable[[], object]],
    repeats: int = REPEATS,
    least: float = LEAST,
) -> dict[str, float]:
    """Median CPU seconds of one call of every job, measured in turns.

    Args:
        jobs: What to time, by name.
        repeats: Measurements of each; the median is returned.
        least: CPU seconds that a measurement takes at least.
    """
    loops = {name: _loops(job, least) for name, job in jobs.items()}
    taken: dict[str, list[float]] = {name: [] for name in jobs}
    for _ in range(repeats):
        for name, job in jobs.items():
            taken[name].append(_time(job, loops[name]))
    return {name: float(np.median(times)) for name, times in taken.items()}


def _loops(job: Callable[[], object], least: float) -> int:
    """How many calls fill one measurement; the first call may compile."""
    job()
    once = _time(job, 1)
    return max(1, int(least / max(once, 1e-7)))


def _time(job: Callable[[], object], loops: int) -> float:
    start = time.process_time()
    for _ in range(loops):
        job()
    return (time.process_time() - start) / loops
