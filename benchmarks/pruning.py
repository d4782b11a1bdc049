"""What pruning saves: pairs of triangles examined and time, patch size by patch size.

    python -m benchmarks.pruning [SCENE] [--json]

Patches under Coal's dynamic tree against all pairs (by sign bits) and the project's own
tree: the same contacts from all three, or it says so and fails.
"""

import json
import sys
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchmarks.poses import POSES, SCENES, BenchScene, Pose
from benchmarks.timing import paired
from borecheck.geometry.coal_engine.broadphase import PatchBroadphase
from borecheck.geometry.tree.mesh_tree import MeshTree
from borecheck.geometry.triangles import all_pairs
from borecheck.geometry.triangles.narrowphase import contact_pairs
from borecheck.geometry.triangles.placing import place_mesh
from borecheck.geometry.triangles.published import NARROWPHASES

Array = NDArray[Any]

SIZES = (4, 16, 64, 256)
EXACT = NARROWPHASES["exact"]


def main(argv: Sequence[str] | None = None) -> int:
    """Prints a table a scene; `--json`: one JSON document a scene."""
    arguments = list(sys.argv[1:] if argv is None else argv)
    as_json = "--json" in arguments
    for name in [a for a in arguments if a != "--json"] or ["arm S"]:
        found = study(SCENES[name]())
        print(json.dumps(found, indent=1) if as_json else _table(found))
    return 0


def _table(found: dict[str, Any]) -> str:
    first, second = found["triangles"]
    lines = [f"{found['scene']}: {first} x {second} triangles"]
    lines.append(
        f"{'pose':16}{'pruning':10}{'patch':>6}{'pairs':>15}{'fewer':>12}  time"
    )
    for row in found["rows"]:
        share = row["share_of_all"]
        fewer = f"x {1.0 / share:,.0f}" if share else "all"
        patch = row["patch_size"] or "-"
        lines.append(
            f"{row['pose']:16}{row['pruning']:10}{patch:>6}"
            f"{row['pairs_examined']:>15,}{fewer:>13}  {1e3 * row['seconds']:.3g} ms"
        )
    return "\n".join(lines)


def study(scene: BenchScene) -> dict[str, object]:
    """Pairs examined and seconds of every pose and patch size."""
    rows = [row for name in POSES for row in _at(scene, name)]
    return {"scene": scene.name, "triangles": scene.counts, "rows": rows}


def _at(scene: BenchScene, name: str) -> list[dict[str, object]]:
    pose = scene.poses[name]
    alpha, beta = _placed(scene, pose), _rows(scene.obstacle.corners)
    expected = [all_pairs.all_contacts(EXACT, rows, beta) for rows in alpha]
    trees, tree = [MeshTree.of(m) for m in scene.links], MeshTree.of(scene.obstacle)
    counted = [
        t.contacts_counted(tree, T, np.eye(4))
        for t, T in zip(trees, pose.placements, strict=True)
    ]
    _same(expected, [ids for ids, _ in counted], f"{scene.name}, {name}, bvh")
    taken = paired(
        {
            "none": lambda: [
                all_pairs.all_contacts(EXACT, rows, beta) for rows in alpha
            ],
            "bvh": lambda: [
                t.contacts(tree, T, np.eye(4))
                for t, T in zip(trees, pose.placements, strict=True)
            ],
        }
    )
    every = scene.counts[0] * scene.counts[1]
    examined = sum(count for _, count in counted)
    return [
        _row(name, "none", None, every, every, taken["none"]),
        _row(name, "bvh", None, examined, every, taken["bvh"]),
        *(_with_patches(scene, name, size, alpha, beta, expected) for size in SIZES),
    ]


def _with_patches(
    scene: BenchScene,
    name: str,
    size: int,
    alpha: list[Array],
    beta: Array,
    expected: list[Array],
) -> dict[str, object]:
    pose = scene.poses[name]
    broadphase = PatchBroadphase(scene.links, [scene.obstacle], size)

    def contacts(placements: Array) -> tuple[list[Array], int]:
        found = broadphase.candidate_pairs(placements, np.eye(4)[None])
        by_link = []
        for k, rows in enumerate(alpha):
            ids = found.pairs[found.pairs[:, 0] == k][:, [1, 3]]
            by_link.append(ids[contact_pairs(EXACT, rows, beta, ids)])
        return by_link, found.examined

    by_link, examined = contacts(pose.placements)
    _same(expected, by_link, f"{scene.name}, {name}, patches of {size}")
    # Boxes of links that did not move are left alone: the last bits keep them moving.
    beside = pose.placements.copy()
    beside[:, :3, 3] += 1e-13
    places = [beside, pose.placements]

    def moving() -> tuple[list[Array], int]:
        places.reverse()
        return contacts(places[0])

    taken = paired({"coal": moving}, 5)["coal"]
    every = scene.counts[0] * scene.counts[1]
    return _row(name, "coal", size, examined, every, taken)


def _row(
    pose: str, pruning: str, size: int | None, pairs: int, every: int, seconds: float
) -> dict[str, object]:
    return {
        "pose": pose,
        "pruning": pruning,
        "patch_size": size,
        "pairs_examined": pairs,
        "share_of_all": pairs / every,
        "seconds": seconds,
    }


def _rows(corners: Array) -> Array:
    return np.ascontiguousarray(corners.reshape(-1, 9))


def _placed(scene: BenchScene, pose: Pose) -> list[Array]:
    return [
        _rows(place_mesh(T, mesh).corners)
        for T, mesh in zip(pose.placements, scene.links, strict=True)
    ]


def _same(expected: list[Array], found: list[Array], where: str) -> None:
    for a, b in zip(expected, found, strict=True):
        order = np.lexsort((b[:, 1], b[:, 0]))
        if not np.array_equal(a, b[order]):
            raise RuntimeError(f"{where}: not the contacts of all pairs")


if __name__ == "__main__":
    sys.exit(main())
