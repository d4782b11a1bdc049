"""Figures of whole processes: from nothing compiled, warm, and of large scenes."""

import os
import resource
import subprocess
import sys
import tempfile
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np

import borecheck as bc
from benchmarks.figure import Figure
from benchmarks.growth import bytes_of
from benchmarks.scenes import gantry_mesh
from borecheck.geometry.mesh.triangle_mesh import TriangleMesh
from borecheck.geometry.tree.mesh_tree import MeshTree

CHECK = ("check", "zerobot", "ct_gantry")
LINKS = 200
HUGE = 5_000_000  # triangles
TODAY_HUGE = 40.0  # CPU seconds of the commit before, see docs/benchmarks.md


def start() -> Iterator[Figure]:
    """Nothing compiled: the first check, the first plan; then a warm check."""
    with tempfile.TemporaryDirectory() as folder:
        cold = {"NUMBA_CACHE_DIR": folder, "BORECHECK_CACHE": folder}
        home = ["-m", "borecheck", *CHECK, "--q", "home"]
        yield Figure("first check, nothing compiled", _cpu(home, cold), 18.0)
        _run(["-m", "borecheck", "examples", folder], cold)
        plans = ["-m", "borecheck", *CHECK, "--plan", f"{folder}/plans.csv"]
        first, again = _cpu(plans, cold), _cpu(plans, cold)
        yield Figure("then the first plans, more than again", first - again, 8.0)
        warm = float(np.median([_cpu(home, cold) for _ in range(9)]))
        yield Figure("check, a warm process", warm, 0.75)


def size() -> Iterator[Figure]:
    """Memory a triangle; five million triangles; an arm of 200 links."""
    mesh = gantry_mesh(300_000)
    taken = bytes_of(MeshTree.of(mesh, cached=False)) / len(mesh.triangles)
    yield Figure("memory a triangle", taken, 160.0, "bytes")
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        write_stl(gantry_mesh(HUGE), folder / "gantry.stl")
        seconds, peak = _measured(f"huge({str(folder / 'gantry.stl')!r})")
        said = "five million triangles"
        yield Figure(f"{said}, loaded and checked: peak", peak, 2e9, "bytes")
        yield Figure(f"{said}, loaded and checked", seconds, TODAY_HUGE / 2)
        (folder / "arm.urdf").write_text(long_arm(LINKS))
        seconds, _ = _measured(f"long({str(folder / 'arm.urdf')!r})")
        yield Figure(f"{LINKS} links, loaded and checked", seconds, 10.0)


def huge(file: str) -> None:
    """A child's work: the large scanner, read and asked once."""
    robot, scene = bc.load_robot("zerobot"), bc.load_scene(f"{file}:m")
    bc.check(robot, scene, "home")


def long(file: str) -> None:
    """A child's work: the long arm beside the gantry."""
    robot, scene = bc.load_robot(file), bc.load_scene("ct_gantry")
    bc.check(robot, scene, np.zeros(len(robot.home)))


def long_arm(links: int) -> str:
    """URDF of a chain of boxes, every joint turning."""
    boxes = [
        f'<link name="l{k}"><collision><origin xyz="0 0 0.01"/><geometry>'
        '<box size="0.01 0.01 0.015"/></geometry></collision></link>'
        for k in range(links)
    ]
    joints = [
        f'<joint name="j{k}" type="revolute"><parent link="l{k - 1}"/>'
        f'<child link="l{k}"/><origin xyz="0 0 0.02"/><axis xyz="1 0 0"/>'
        '<limit lower="-1" upper="1" effort="1" velocity="1"/></joint>'
        for k in range(1, links)
    ]
    return f'<robot name="long">{"".join(boxes)}{"".join(joints)}</robot>'


def write_stl(mesh: TriangleMesh, file: Path) -> None:
    """A binary STL in metres."""
    rows = np.zeros(
        len(mesh.triangles),
        dtype=[("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("none", "<u2")],
    )
    rows["corners"] = np.asarray(mesh.vertices)[mesh.triangles]
    head = bytes(80) + np.uint32(len(rows)).tobytes()
    file.write_bytes(head + rows.tobytes())


def _measured(call: str) -> tuple[float, float]:
    """CPU seconds and peak bytes of a call of this module in a process of its own."""
    code = (
        "import resource, time; from benchmarks import processes\n"
        f"begun = time.process_time(); processes.{call}\n"
        "peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024\n"
        "print(time.process_time() - begun, peak)"
    )
    seconds, peak = _run(["-c", code], {}).split()[-2:]
    return float(seconds), float(peak)


def _cpu(words: Sequence[str], environment: dict[str, str]) -> float:
    """CPU seconds of a child."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    _run(words, environment)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    user = after.ru_utime - before.ru_utime
    return user + after.ru_stime - before.ru_stime


def _run(words: Sequence[str], environment: dict[str, str]) -> str:
    """What a child of this Python printed; a touching plan is exit 1 and no failure."""
    done: Any = subprocess.run(
        [sys.executable, *words],
        env={**os.environ, **environment},
        capture_output=True,
        text=True,
        check=False,
    )
    if done.returncode not in (0, 1) or "Traceback" in done.stderr:
        raise RuntimeError(f"{' '.join(words)}: {done.stderr[-500:]}")
    return str(done.stdout)
