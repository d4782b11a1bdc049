"""Makes the meshes that `borecheck examples` writes: a gantry and a torso, in mm.

With --check nothing is written: the shipped files are compared with fresh ones.
"""

import argparse
import sys
from collections.abc import Iterator
from itertools import pairwise
from math import cos, pi, sin
from pathlib import Path

import numpy as np

from borecheck.geometry.mesh.triangle_mesh import TriangleMesh
from borecheck.geometry.mesh_files.reading import read_mesh, write_stl

FOLDER = Path(__file__).parents[1] / "borecheck" / "examples"

# All lengths in [mm], all assumed: a bore of 780 mm, 400 mm deep; a slim torso.
BORE, OUTSIDE, DEPTH = 390.0, 850.0, 400.0
WIDTH, THICKNESS, LENGTH = 340.0, 200.0, 600.0
AROUND = 64
TOLERANCE_MM = 1e-3  # STL holds float32


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--check", action="store_true", help="compare, write nothing")
    options = parser.parse_args()
    problems = 0
    for name, mesh in meshes():
        file = FOLDER / f"{name}.stl"
        if not options.check:
            write_stl(file, mesh)
        elif not same(file, mesh):
            print(f"{file} is not as {__file__} makes it", file=sys.stderr)
            problems += 1
    return 1 if problems else 0


def meshes() -> Iterator[tuple[str, TriangleMesh]]:
    """Both, about the origin, the patient's axis and the bore's along x."""
    half = DEPTH / 2.0
    profile = [(-half, BORE), (half, BORE), (half, OUTSIDE), (-half, OUTSIDE)]
    # corners on the true circle: a bore between them is narrower than said
    yield "gantry", turned("gantry", [*profile, profile[0]], 1.0, 1.0)
    end = LENGTH / 2.0
    outline = [(end, 0.0), (end, 0.7), (0.85 * end, 1.0), (-0.85 * end, 1.0)]
    outline += [(-end, 0.7), (-end, 0.0)]
    yield "torso", turned("torso", outline, WIDTH / 2.0, THICKNESS / 2.0)


def turned(
    name: str, profile: list[tuple[float, float]], width: float, height: float
) -> TriangleMesh:
    """A profile (x, radius) turned about x, scaled across to an ellipse."""
    angles = [2.0 * pi * k / AROUND for k in range(AROUND)]
    rings = [
        [(x, r * width * cos(a), r * height * sin(a)) for a in angles]
        for x, r in profile
    ]
    found = []
    for near, far in pairwise(rings):
        for k in range(AROUND):
            j = (k + 1) % AROUND
            for corners in ((near[k], far[k], far[j]), (near[k], far[j], near[j])):
                if len(set(corners)) == 3:
                    found.append(corners)
    triangles = np.array(found)
    vertices, indices = np.unique(triangles.reshape(-1, 3), axis=0, return_inverse=True)
    return TriangleMesh(name, vertices, indices.reshape(-1, 3))


def same(file: Path, mesh: TriangleMesh) -> bool:
    shipped = read_mesh(file)
    if shipped.triangles.shape != mesh.triangles.shape:
        return False
    corners = [m.vertices[m.triangles] for m in (shipped, mesh)]
    return bool(np.allclose(*corners, atol=TOLERANCE_MM))


if __name__ == "__main__":
    sys.exit(main())
