"""Makes the coarse meshes that are shipped with robots and scanners.

Middle and fine levels are not shipped: `load_robot(..., level=)` makes them on first
use. With --check nothing is written: the shipped files are compared with fresh ones.
"""

import argparse
import sys
from collections.abc import Iterator

import numpy as np

from borecheck.geometry.mesh.triangle_mesh import TriangleMesh
from borecheck.geometry.mesh_files.reading import read_mesh, write_stl
from borecheck.robots.description import Description, hook, installed, installed_names

# STL holds float32: 1 m is rounded by 6e-8 m; libraries differ in the last bit of sin.
TOLERANCE = 1e-6


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("names", nargs="*", help="robots, scanners (default: all)")
    parser.add_argument("--check", action="store_true", help="compare, write nothing")
    options = parser.parse_args()
    problems = 0
    for description in descriptions(options.names):
        if options.check:
            for problem in differences(description):
                print(problem, file=sys.stderr)
                problems += 1
        else:
            write(description)
    return 1 if problems else 0


def descriptions(names: list[str]) -> Iterator[Description]:
    for group, kind in (("robots", "robot"), ("scanners", "scanner")):
        for name in installed_names(group):
            description = installed(group, kind, name)
            if description.meshes and (not names or name in names):
                yield description


def write(description: Description) -> None:
    description.shipped.mkdir(parents=True, exist_ok=True)
    meshes = coarse(description)
    for stem, mesh in meshes.items():
        write_stl(description.shipped / f"{stem}.stl", mesh)
    count = sum(len(mesh.triangles) for mesh in meshes.values())
    print(f"{description.name}: {len(meshes)} meshes, {count} triangles")


def differences(description: Description) -> Iterator[str]:
    """What is wrong with the shipped meshes, a line each."""
    meshes = coarse(description)
    for path in sorted(description.shipped.glob("*")):
        if path.stem not in meshes or path.suffix != ".stl":
            yield f"{path}: belongs to no part"
    for stem, mesh in meshes.items():
        path = description.shipped / f"{stem}.stl"
        if not path.is_file():
            yield f"{path}: is missing"
            continue
        shipped = read_mesh(path)
        if shipped.corners.shape != mesh.corners.shape:
            counts = len(shipped.triangles), len(mesh.triangles)
            yield f"{path}: {counts[0]} triangles, not {counts[1]}"
        elif np.abs(shipped.corners - mesh.corners).max() > TOLERANCE:
            yield f"{path}: vertices differ from the generator's"


def coarse(description: Description) -> dict[str, TriangleMesh]:
    defaults = {name: a.default for name, a in description.arguments.items()}
    meshes: dict[str, TriangleMesh] = hook(description.meshes)("coarse", defaults)
    return meshes


if __name__ == "__main__":
    sys.exit(main())
