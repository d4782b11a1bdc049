"""How long `borecheck validate` takes, start-up included: one robot, and a folder.

    python -m benchmarks.validate [--robots 300]

A chain of 60 links, each with a drawn mesh of 5,120 triangles and a collision mesh of
1,280 (assumed: fine for 6 cm); wall clock of whole processes, the median of five. Then
a folder of such robots with 10 links, in parallel, broken off half-way and resumed.
"""

import argparse
import os
import signal
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import trimesh

from borecheck.geometry.mesh.triangle_mesh import TriangleMesh
from borecheck.geometry.mesh_files.stl import write_stl

LINKS = 60
SMALL = 10  # links of each robot in the folder
REPEATS = 5
COMMAND = (sys.executable, "-m", "borecheck")
# As on any desk: compiled modules are kept from the first start.
PLAIN = {k: v for k, v in os.environ.items() if k != "PYTHONDONTWRITEBYTECODE"}


def main() -> int:
    """Prints the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--robots", type=int, default=300)
    count = parser.parse_args().robots
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        arm = chain(folder, LINKS)
        print(f"{LINKS} links, {triangles(folder):,} triangles in {2 * LINKS} files")
        for words, goal in (
            (("validate", str(arm)), 2.0),
            (("validate", str(arm), "--profile", "dynamics"), 2.0),
            (("validate", str(arm), "--no-meshes"), 0.3),
            (("--help",), 0.2),
        ):
            seconds = wall(words)
            shown = " ".join(words).replace(f"{folder}/", "")
            print(f"borecheck {shown:40}{seconds:8.2f} s   goal {goal:g} s")
        small = folder / "small"
        small.mkdir()
        many(small, chain(small, SMALL), count)
    return 0


def chain(folder: Path, links: int) -> Path:
    """A sound robot with meshes of its own for every link."""
    meshes = folder / "meshes"
    meshes.mkdir()
    parts = ['<robot name="chain">']
    for k in range(links):
        for kind, halvings in (("visual", 4), ("collision", 3)):
            mesh = ball(f"{kind}{k}", halvings, 0.03 + 1e-4 * k)
            write_stl(meshes / f"{kind}{k}.stl", mesh)
        parts.append(link(k))
        if k:
            parts.append(joint(k))
    path = folder / "chain.urdf"
    path.write_text("\n".join([*parts, "</robot>\n"]))
    return path


def ball(name: str, halvings: int, radius: float) -> TriangleMesh:
    """A ball of 20 triangles, each halved so many times along its edges."""
    made = trimesh.creation.icosphere(subdivisions=halvings, radius=radius)
    return TriangleMesh(name, made.vertices, made.faces)


def link(k: int) -> str:
    """A link of 0.3 kg with both meshes."""
    shapes = "".join(
        f'<{kind}><geometry><mesh filename="meshes/{kind}{k}.stl"/></geometry></{kind}>'
        for kind in ("visual", "collision")
    )
    inertia = 'ixx="1e-4" iyy="1e-4" izz="1e-4" ixy="0" ixz="0" iyz="0"'
    mass = f'<inertial><mass value="0.3"/><inertia {inertia}/></inertial>'
    return f'<link name="link{k}">{mass}{shapes}</link>'


def joint(k: int) -> str:
    """A turning joint from the link before."""
    axis = ("1 0 0", "0 1 0", "0 0 1")[k % 3]
    return (
        f'<joint name="joint{k}" type="revolute"><axis xyz="{axis}"/>'
        f'<parent link="link{k - 1}"/><child link="link{k}"/><origin xyz="0 0 0.08"/>'
        '<limit lower="-1" upper="1" effort="10" velocity="1"/></joint>'
    )


def triangles(folder: Path) -> int:
    """Triangles in all binary STL files of the folder."""
    sizes = [path.stat().st_size for path in (folder / "meshes").glob("*.stl")]
    return sum((size - 84) // 50 for size in sizes)


def wall(words: tuple[str, ...]) -> float:
    """The median wall clock of whole processes, [s]."""
    seconds = []
    for _ in range(1 + REPEATS):
        start = time.perf_counter()
        done = subprocess.run(
            [*COMMAND, *words], capture_output=True, check=False, env=PLAIN
        )
        seconds.append(time.perf_counter() - start)
        if done.returncode != 0:
            raise SystemExit(done.stdout.decode() + done.stderr.decode())
    return statistics.median(seconds[1:])


def many(folder: Path, arm: Path, count: int) -> None:
    """A folder of robots: one process a core, interrupted half-way, resumed."""
    home = folder / "robots"
    home.mkdir()
    text = arm.read_text().replace('filename="meshes', 'filename="../meshes')
    for k in range(count):
        name = f'name="chain{k}"'
        (home / f"robot{k:03}.urdf").write_text(text.replace('name="chain"', name))
    kept = folder / "kept.jsonl"
    words = [*COMMAND, "validate", str(home), "--resume", str(kept), "--brief"]
    start = time.perf_counter()
    process = subprocess.Popen(
        words,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        start_new_session=True,
        env=PLAIN,
    )
    while _lines(kept) < count // 2 and process.poll() is None:
        time.sleep(0.05)
    os.killpg(process.pid, signal.SIGINT)
    process.communicate()
    half, first = _lines(kept), time.perf_counter() - start
    print(f"{count} robots: interrupted after {half}, {first:.0f} s")
    start = time.perf_counter()
    done = subprocess.run(words, capture_output=True, text=True, check=False, env=PLAIN)
    rest = time.perf_counter() - start
    last = done.stdout.splitlines()[-1] if done.stdout else done.stderr
    print(f"resumed: {_lines(kept) - half} more in {rest:.0f} s: {last}")


def _lines(path: Path) -> int:
    return len(path.read_text().splitlines()) if path.exists() else 0


if __name__ == "__main__":
    sys.exit(main())
