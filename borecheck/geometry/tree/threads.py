"""Poses shared out among threads: kernels let others run."""

from collections.abc import Callable
from itertools import pairwise

import numpy as np

from borecheck.errors import GeometryError


def in_threads(run: Callable[[int, int], None], count: int, threads: int) -> None:
    """Calls run(begin, end) for consecutive stretches of poses, one to a thread."""
    if threads < 1:
        raise GeometryError(f"threads is {threads}, not a number of threads")
    if threads == 1 or count < 2:
        run(0, count)
        return
    from concurrent.futures import ThreadPoolExecutor  # most questions are of one pose

    borders = np.linspace(0, count, min(threads, count) + 1).astype(int).tolist()
    with ThreadPoolExecutor(threads) as pool:
        jobs = [pool.submit(run, begin, end) for begin, end in pairwise(borders)]
        for job in jobs:
            job.result()
