"""Damaged and renamed mesh files: a reader gives all surfaces or refuses, at once.

    python -m studies.damaged_meshes [--each 2000] [--seed 1]

Three ways of damage, seeded: bytes changed in files of every format, pieces of files
cut out, doubled or moved, and elements of Collada renamed to any other element of
its schema. Counted is what comes of each: read, refused in one line, anything else
(an exception, a line that cannot be printed, more than 2 s of processor time). Of the
renamed Collada files it is known what stands in them, so that a surface lost in silence
is counted, too: all cubes are where they were, or the file is refused.
"""

import argparse
import time
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from lxml import etree

from borecheck.errors import MeshError
from borecheck.geometry.mesh_files.collada import parse_collada
from borecheck.geometry.mesh_files.reading import read_mesh
from tests.geometry.mesh_files.collada_text import NEAR, cube, cube_points, document
from tests.places import DATA

LONGEST_S = 2.0
GOOD = sorted((DATA / "meshes" / "good").iterdir())
# Every element of COLLADA 1.4.1 that may stand in a scene or a geometry.
_LIBRARIES = ("geometries", "nodes", "visual_scenes", "controllers", "animations",
              "cameras", "lights", "materials", "effects", "images", "physics_scenes",
              "physics_models", "force_fields")  # fmt: skip
_INSTANCES = ("geometry", "controller", "node", "camera", "light", "visual_scene",
              "physics_scene")  # fmt: skip
NAMES = (
    *(f"library_{kind}" for kind in _LIBRARIES),
    *(f"instance_{kind}" for kind in _INSTANCES),
    *("COLLADA", "asset", "scene", "extra", "technique", "technique_common"),
    *("geometry", "mesh", "convex_mesh", "spline", "source", "float_array"),
    *("int_array", "bool_array", "Name_array", "IDREF_array", "accessor", "param"),
    *("vertices", "input", "triangles", "polylist", "polygons", "trifans"),
    *("tristrips", "lines", "linestrips", "p", "ph", "h", "vcount", "node"),
    *("visual_scene", "evaluate_scene", "matrix", "rotate", "scale", "translate"),
    *("skew", "lookat", "skin", "morph", "controller", "animation", "channel"),
    *("sampler", "unit", "up_axis", "bind_material"),
)


def main() -> int:
    """Print the table; 1 if anything else than read or refused came of a file."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--each", type=int, default=2000, help="files of each kind")
    parser.add_argument("--seed", type=int, default=1)
    given = parser.parse_args()
    return 1 if count_wrong(given.each, given.seed) else 0


def count_wrong(each: int, seed: int) -> int:
    """Print the table, and how often something else than read or refused came."""
    rng = np.random.default_rng(seed)
    print(f"{'kind':28} {'read':>6} {'refused':>8} {'else':>5} {'slowest':>8}")
    wrong = 0
    with TemporaryDirectory() as folder:
        for suffix in (".stl", ".obj", ".ply", ".dae"):
            files = [path for path in GOOD if path.suffix == suffix]
            for kind, damage in (("bytes", _bytes), ("pieces", _pieces)):
                cases = (
                    damage(files[k % len(files)].read_bytes(), rng) for k in range(each)
                )
                target = Path(folder) / f"damaged{suffix}"
                wrong += _row(f"{suffix[1:]} {kind}", cases, target)
    return wrong + _renamed(each, rng)


def _row(kind: str, cases: Iterator[bytes], target: Path) -> int:
    outcomes: Counter[str] = Counter()
    slowest = 0.0
    for data in cases:
        target.write_bytes(data)
        start = time.process_time()
        outcomes[_outcome(target)] += 1
        slowest = max(slowest, time.process_time() - start)
    read, refused = outcomes.pop("read", 0), outcomes.pop("refused", 0)
    other = sum(outcomes.values()) + (slowest > LONGEST_S)
    print(f"{kind:28} {read:6} {refused:8} {other:5} {slowest:7.2f}s")
    for what, times in outcomes.items():
        print(f"    {times} x {what}")
    return other


def _outcome(path: Path) -> str:
    try:
        mesh = read_mesh(path)
    except MeshError as error:
        return "refused" if str(error).isprintable() else f"not printable: {error!r}"
    except Exception as error:  # noqa: BLE001  (what is looked for)
        return f"{type(error).__name__}: {error}"
    return "read" if np.isfinite(mesh.corners).all() else "not finite"


def _bytes(data: bytes, rng: np.random.Generator) -> bytes:
    """One to eight bytes changed."""
    found = np.frombuffer(data, dtype=np.uint8).copy()
    places = rng.integers(0, len(found), rng.integers(1, 9))
    found[places] = rng.integers(0, 256, len(places))
    return found.tobytes()


def _pieces(data: bytes, rng: np.random.Generator) -> bytes:
    """A piece cut out, doubled, moved, or filled with zeros or nines."""
    a, b, c = sorted(rng.integers(0, len(data) + 1, 3))
    return (
        data[:a] + data[b:],
        data[:b] + data[a:b] + data[b:],
        data[:a] + data[b:c] + data[a:b] + data[c:],
        data[:a] + bytes(int(b - a)) + data[b:],
        data[:a] + b"9" * int(b - a) + data[b:],
    )[rng.integers(5)]


def _renamed(each: int, rng: np.random.Generator) -> int:
    """Elements of a two-cube scene renamed: both cubes stay, or it is refused."""
    whole = document(
        '<node><translate>0.4 0 0</translate><instance_geometry url="#near"/></node>'
        '<node><instance_node url="#kept"/></node>',
        cube("near"),
        '<library_nodes><node id="kept"><matrix>1 0 0 7 0 1 0 0 0 0 1 0 0 0 0 1'
        '</matrix><instance_geometry url="#near"/></node></library_nodes>',
    )
    outcomes: Counter[str] = Counter()
    for _ in range(each):
        root = etree.fromstring(whole)
        elements = list(root.iter())
        element = elements[rng.integers(len(elements))]
        was = etree.QName(element)
        name = NAMES[rng.integers(len(NAMES))]
        element.tag = f"{{{was.namespace}}}{name}"
        try:
            raw = parse_collada(etree.tostring(root), "renamed.dae")
        except MeshError:
            outcomes["refused"] += 1
            continue
        corners = raw.vertices[raw.triangles].reshape(-1, 3)
        is_whole = len(raw.triangles) == 36 and all(
            (np.linalg.norm(corners - p, axis=1) < 1e-9).any()
            for x in (NEAR, 3.0, 7.0)
            for p in cube_points(x)
        )
        said = (
            "read" if is_whole or raw.warnings else f"lost: {was.localname} as {name}"
        )
        outcomes[said] += 1
    read, refused = outcomes.pop("read", 0), outcomes.pop("refused", 0)
    print(
        f"{'dae elements renamed':28} {read:6} {refused:8} {sum(outcomes.values()):5}"
    )
    for what, times in sorted(outcomes.items()):
        print(f"    {times} x {what}")
    return sum(outcomes.values())


if __name__ == "__main__":
    raise SystemExit(main())
