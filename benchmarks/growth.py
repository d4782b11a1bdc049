"""How times grow with the number of triangles, memory per triangle, first calls."""

import json
import os
import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass

import numpy as np

from benchmarks import peers
from benchmarks.scenes import BENT, FOOT, arm_links, gantry_mesh, placements
from benchmarks.timing import paired
from borecheck.geometry.tree.many_links import MovingLinks
from borecheck.geometry.tree.mesh_tree import MeshTree
from borecheck.geometry.tree.packed import PackedTrees

# Triangles of the gantry; the arm has a fifth.
COUNTS = (1_000, 3_000, 10_000, 30_000, 100_000, 300_000, 600_000)
# The same pose for all sizes: a foot shift that is 40 mm deep in the finest mesh.
DEEP = np.array([0.0, 0.354, 0.0])


@dataclass(frozen=True)
class Growth:
    """Seconds and bytes at every size, and the slopes of log time over log size."""

    triangles: list[int]
    seconds: dict[str, list[float]]
    slopes: dict[str, float]
    bytes_per_triangle: list[float]
    build_seconds: list[float]


def measure(counts: tuple[int, ...] = COUNTS, repeats: int = 9) -> Growth:
    """Row 8: first contact, clear and all contacts over sqrt(n m)."""
    sizes: list[int] = []
    seconds: dict[str, list[float]] = {}
    memory, build = [], []
    for count in counts:
        links, gantry = arm_links(count // 5), gantry_mesh(count)
        start = time.process_time()
        tree = MeshTree.of(gantry, cached=False)
        build.append(time.process_time() - start)
        memory.append(bytes_of(tree) / len(gantry.triangles))
        moving = MovingLinks.against(
            PackedTrees([MeshTree.of(mesh, cached=False) for mesh in links]),
            PackedTrees([tree]),
        )
        arm = sum(len(mesh.triangles) for mesh in links)
        sizes.append(round(np.sqrt(arm * len(gantry.triangles))))
        for name, taken in _times(moving, repeats).items():
            seconds.setdefault(name, []).append(taken)
    slopes = {name: _slope(sizes, taken) for name, taken in seconds.items()}
    return Growth(sizes, seconds, slopes, memory, build)


def _times(moving: MovingLinks, repeats: int) -> dict[str, float]:
    """Many copies of one pose in one call: the Python call is not what grows."""
    clear = np.repeat(placements(BENT)[None], 64, axis=0)
    deep = np.repeat(placements(BENT, FOOT + DEEP)[None], 64, axis=0)
    if moving.first_contacts(clear[:1])[0] or not moving.first_contacts(deep[:1])[0]:
        raise RuntimeError("the poses are not clear and deep at this size")
    taken = paired(
        {
            "clear": lambda: moving.first_contacts(clear),
            "first contact": lambda: moving.first_contacts(deep),
            "all contacts": lambda: moving.contacts(deep[:1]),
        },
        repeats,
    )
    return {
        "clear": taken["clear"] / 64,
        "first contact": taken["first contact"] / 64,
        "all contacts": taken["all contacts"],
    }


def _slope(sizes: list[int], taken: list[float]) -> float:
    return float(np.polyfit(np.log(sizes), np.log(taken), 1)[0])


def bytes_of(tree: MeshTree) -> int:
    """What a tree holds in arrays."""
    return sum(
        value.nbytes for value in vars(tree).values() if isinstance(value, np.ndarray)
    )


def coal_bytes_per_triangle(count: int = 100_000) -> float:
    """Coal's own figure for its tree of oriented boxes."""
    model = peers.coal_model(gantry_mesh(count))
    return float(model.memUsage(False)) / count


_CHECK = ["check", "zerobot", "ct_gantry", "--q", "home", "--format", "json"]


def starts(level: str = "middle") -> dict[str, float]:
    """Row 9: seconds (wall clock) of starting up, with and without compiled caches."""
    command = [sys.executable, "-m", "borecheck", *_CHECK, "--level", level]
    imported = [sys.executable, "-c", "import borecheck"]
    found = {"import borecheck": _wall(imported, {})}
    with tempfile.TemporaryDirectory() as folder:
        cold = {"NUMBA_CACHE_DIR": folder, "XDG_CACHE_HOME": folder}
        found["first check, nothing cached"] = _wall(command, cold, 1)
        found["check again"] = _wall(command, cold)
    return found


def _wall(command: list[str], environment: dict[str, str], repeats: int = 5) -> float:
    taken = []
    for _ in range(repeats):
        start = time.perf_counter()
        subprocess.run(
            command, env={**os.environ, **environment}, check=True, capture_output=True
        )
        taken.append(time.perf_counter() - start)
    return float(np.median(taken))


if __name__ == "__main__":
    print(json.dumps(vars(measure()), indent=1))
