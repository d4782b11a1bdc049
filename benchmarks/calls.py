"""What users call, a line each, against the goal that was set for it.

    python -m benchmarks.calls                      all of it (about ten minutes)
    python -m benchmarks.calls --only pose,edge     some of its rows, see ROWS

CPU seconds of this process, or of a child where a whole process is meant; threads by
the clock. A line ends with BELOW where its goal is missed: then the exit status is 1.
"""

import argparse
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

import borecheck as bc
from benchmarks.figure import Figure
from benchmarks.peers import Coal, coal_request
from benchmarks.poses import POSES, SCENES, BenchScene
from benchmarks.processes import size, start
from benchmarks.run import unit_of, where
from benchmarks.timing import REPEATS, paired
from borecheck.geometry.tree.mesh_tree import MeshTree

FINER = 1.5  # what middle and fine meshes may cost, of the coarse ones' goal
SAMPLE = 200  # poses of a mean
BATCH = 10_000
EDGES = 60
STILL = np.eye(4)
STEP = 1e-3  # of every joint, on a short edge [m or rad]


@dataclass(frozen=True, eq=False)
class Stand:
    """A robot in its scanner, and poses of it.

    Attributes:
        name: For the table.
        robot: As `bc.load_robot` gives it.
        scene: As `bc.load_scene` gives it.
        room: What its calls may cost, of the goal.
    """

    name: str
    robot: Any
    scene: Any
    room: float

    @classmethod
    def of(cls, robot: str, scanner: str, level: str = "coarse") -> "Stand":
        """Loads both at a level of detail."""
        return cls(
            f"{robot} {level}",
            bc.load_robot(robot, level=level),
            bc.load_scene(scanner, level=level),
            1.0 if level == "coarse" else FINER,
        )

    def check(self, qs: Sequence[Any]) -> float:
        """Mean CPU seconds of `bc.check`, each with its clearance."""
        one = _cpu(lambda: [bc.check(self.robot, self.scene, q) for q in qs])
        return one / len(qs)

    def contacts(self, qs: Any, threads: int = 1) -> Callable[[], object]:
        """A call of `first_contacts`, containment with it."""
        return lambda: bc.first_contacts(self.robot, self.scene, qs, threads=threads)

    def near(self, qs: Any) -> Callable[[], object]:
        """A call of `nearer_than` 20 mm."""
        asked = bc.queries(self.robot, self.scene)
        return lambda: asked.nearer_than(qs, 0.02)

    def path(self, ends: Any) -> Callable[[], object]:
        """A call of `check_path` without its least clearance: what planners ask."""
        return lambda: bc.check_path(self.robot, self.scene, ends, clearance=False)


def stands() -> Iterator[Stand]:
    """The three robots, Zerobot at three levels."""
    for level in ("coarse", "middle", "fine"):
        yield Stand.of("zerobot", "ct_gantry", level)
    yield Stand.of("mri_arm", "mri_open_magnet")
    yield Stand.of("crane", "ct_gantry")


def pose() -> Iterator[Figure]:
    """`bc.check` of one pose with its exact clearance, and `nearer_than`."""
    for stand in stands():
        qs = bc.random_configurations(stand.robot, SAMPLE, seed=1)
        clear = [q for q in qs if bc.check(stand.robot, stand.scene, q).clear]
        said = f"check {stand.name}"
        home = stand.check(["home"] * 20)
        yield Figure(f"{said}, home", home, 0.2e-3 * stand.room)
        yield Figure(f"{said}, random", stand.check(qs), 0.6e-3 * stand.room)
        if clear:
            yield Figure(f"{said}, clear", stand.check(clear), 0.4e-3 * stand.room)
            taken = _cpu(stand.near(np.array(clear))) / len(clear)
            yield Figure(f"nearer_than {stand.name}, an open pose", taken, 20e-6)


def batch() -> Iterator[Figure]:
    """`first_contacts` with containment: one pose, many, two threads."""
    for stand in stands():
        qs = bc.random_configurations(stand.robot, BATCH, seed=2)
        said = f"first_contacts {stand.name}"
        yield Figure(f"{said}, one pose", _cpu(stand.contacts(qs[:1])), 20e-6)
        yield Figure(f"{said}, batch, a pose", _cpu(stand.contacts(qs)) / BATCH, 8e-6)
    stand = Stand.of("zerobot", "ct_gantry")
    qs = bc.random_configurations(stand.robot, 6 * BATCH, seed=3)
    one, two = (_wall(stand.contacts(qs, threads)) for threads in (1, 2))
    yield Figure("first_contacts, two threads", one / two, 1.8, "times")


def pair() -> Iterator[Figure]:
    """One pair of meshes against Coal with objects and result reused."""
    for name in ("arm S", "arm M", "zerobot coarse"):
        yield from _pairs_of(SCENES[name]())


def _pairs_of(scene: BenchScene) -> Iterator[Figure]:
    coal, tree = Coal(scene), MeshTree.of(scene.obstacle)
    pairs = [bc.Pair(MeshTree.of(mesh), tree) for mesh in scene.links]
    request = coal_request()
    for at in POSES:
        placed = scene.poses[at].placements
        gaps = [one.clearance(T, STILL) for one, T in zip(pairs, placed, strict=True)]
        k = int(np.argmin(gaps))  # the link that is nearest
        times = paired(
            {
                "ours": _ours(pairs[k], placed[k]),
                "coal": coal.one(k, coal.transforms(scene.poses[at])[k], request),
            }
        )
        goal = 15.0 if "parallel" in at else 4.0 if "deep" in at else 1.0
        said = f"one pair, {scene.name}, {at} ({unit_of(times['ours'])})"
        yield Figure(said, times["coal"] / times["ours"], goal, "times")


def _ours(asked: Any, placed: Any) -> Callable[[], object]:
    return lambda: asked.first_contact(placed, STILL)


def edge() -> Iterator[Figure]:
    """`bc.check_path` of a short clear edge, and of random ones."""
    stand = Stand.of("zerobot", "ct_gantry")
    short = np.array([stand.robot.home, stand.robot.home + STEP])
    said = "check_path zerobot"
    yield Figure(f"{said}, a short clear edge", _cpu(stand.path(short)), 2e-3)
    ends = bc.random_configurations(stand.robot, 2 * EDGES, seed=4)
    each = [_cpu(stand.path(two), 1) for two in ends.reshape(EDGES, 2, -1)]
    yield Figure(f"{said}, random edges, median", float(np.median(each)), 12e-3)


ROWS = {f.__name__: f for f in (pose, batch, pair, edge, start, size)}


def main(argv: Sequence[str] | None = None) -> int:
    """Prints a line a figure; 0 when every goal was reached."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.calls")
    parser.add_argument("--only", default=",".join(ROWS), help="rows, with commas")
    names = parser.parse_args(argv).only.split(",")
    unknown = [name for name in names if name not in ROWS]
    if unknown:
        parser.error(f"no row {unknown[0]!r}; there are {', '.join(ROWS)}")
    place = where()
    print(f"{place['processor']}, Python {place['python']}")
    missed = 0
    for name in names:
        for figure in ROWS[name]():
            print(figure, flush=True)
            missed += not figure.reached
    print(f"{missed} below their goal" if missed else "every goal reached")
    return int(missed > 0)


def _cpu(job: Callable[[], object], repeats: int = REPEATS) -> float:
    """Median CPU seconds of one call."""
    return paired({"": job}, repeats)[""]


def _wall(job: Callable[[], object], repeats: int = 5) -> float:
    """Least seconds by the clock of one call."""
    taken = []
    for _ in range(repeats):
        begun = time.perf_counter()
        job()
        taken.append(time.perf_counter() - begun)
    return min(taken)


if __name__ == "__main__":
    sys.exit(main())
