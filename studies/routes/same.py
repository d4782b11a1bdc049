"""The same ways from other processes, with one thread and with two.

Each process finds the ways to the same goals and prints a digest of their waypoints and
of the certificates written from them, byte for byte.
"""

import hashlib
import os
import subprocess
import sys
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from borecheck.errors import UsageError
from borecheck.motion.certify import write_path_certificate
from borecheck.planning.route import route
from borecheck.robots.robot import Robot
from borecheck.robots.scene import Scene
from studies.routes.goals import Array, drawn, progress, stands

GOALS = 10
# Every library here that may calculate in several threads.
THREADS = ("NUMBA_NUM_THREADS", "OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS")


def run(goals: int, seed: int) -> int:
    """Prints what each run has in common with the first; how many ways differ."""
    first: list[str] = []
    differ = 0
    for threads in (1, 1, 2, 2):
        lines = digests_of_a_process(goals, seed, threads)
        first = first or lines
        same = sum(a == b for a, b in zip(first, lines, strict=True))
        differ += len(lines) - same
        print(f"threads {threads}: {same} of {len(lines)} ways the same bytes")
    found = sum(not line.endswith("none") for line in first)
    print(f"{found} of {len(first)} are ways, the others none in 20,000 edges")
    return differ


def digests_of_a_process(goals: int, seed: int, threads: int) -> list[str]:
    """What `digests` says in a process with so many threads."""
    code = f"from studies.routes.same import digests; digests({goals}, {seed})"
    environment = {**os.environ, **dict.fromkeys(THREADS, str(threads))}
    done = subprocess.run(
        [sys.executable, "-c", code],
        env=environment,
        stdout=subprocess.PIPE,
        text=True,
        check=True,
    )
    return done.stdout.splitlines()


def digests(goals: int, seed: int) -> None:
    """Prints a line for each way: robot, number, edges asked for, digest."""
    for robot, scene in stands():
        rng = np.random.default_rng(seed)
        clear, _ = drawn(robot, scene, rng, goals)
        for k, goal in enumerate(clear):
            print(f"{robot.name} {k} {digest(robot, scene, goal, k)}", flush=True)
            progress(f"{robot.name} {k + 1}/{goals}")


def digest(robot: Robot, scene: Scene, goal: Array, seed: int) -> str:
    """Of the way from home and of its certificate, as the file has it."""
    found = route(robot, scene, np.array(robot.home), goal, seed=seed)
    if found.waypoints is None:
        return f"{found.edges} none"
    content = found.waypoints.tobytes()
    with TemporaryDirectory() as folder:
        file = Path(folder) / "way.json"
        try:
            write_path_certificate(robot, scene, found.waypoints, 0.0, file)
            content += file.read_bytes()
        except UsageError as too_near:  # clear, and of too many intervals to list
            content += str(too_near).encode()
    return f"{found.edges} {hashlib.sha256(content).hexdigest()}"
