"""Whether the motion that a certificate describes is clear: asked of the search.

The search shares no code with the verifier. A changed certificate may still be true of
another motion, of which nobody asked; it is false if what it describes is not clear.
"""

import copy
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from borecheck.geometry.mesh.triangle_mesh import TriangleMesh
from borecheck.motion.problem import Body, PathProblem
from borecheck.motion.search import search
from borecheck.robots.kinematics.chain import JointChain
from borecheck.robots.kinematics.forward import FIXED, SLIDES, TURNS
from borecheck.verify.binding import SAME

Array = NDArray[np.float64]
Document = Mapping[str, Any]
KINDS = {"fixed": FIXED, "turns": TURNS, "slides": SLIDES}
# What says nothing of the motion, and what only says how it is proven.
LABELS = ("versions", "about", "sha256")


def is_clear(document: Document, meshes: Mapping[str, tuple[Array, Any]]) -> bool:
    """Whether the search finds every instant clear of what a certificate describes.

    Args:
        document: One that was accepted.
        meshes: The surfaces by their hash.
    """
    chain = _chain(document["chain"])
    bodies = [_body(b, meshes, k < document["part_count"])
              for k, b in enumerate(document["bodies"])]  # fmt: skip
    parts = tuple(bodies[: document["part_count"]])
    obstacles = tuple(bodies[document["part_count"] :])
    pairs = _self_pairs(chain, parts)
    problem = PathProblem(chain, parts, obstacles, pairs, document["margin_m"])
    return search(problem, document["waypoints"]).verdict == "clear"


def is_same_motion(document: Document, other: Document) -> bool:
    """Whether two certificates describe one motion, and differ in labels and proof.

    Numbers as near as binding asks for count as the same.
    """
    return is_nearly_same(_motion(document), _motion(other))


def is_nearly_same(value: Any, other: Any) -> bool:
    """Whether plain values are the same but for what binding takes for rounding."""
    if isinstance(value, dict):
        return value.keys() == other.keys() and all(
            is_nearly_same(value[name], other[name]) for name in value
        )
    if isinstance(value, list):
        return len(value) == len(other) and all(map(is_nearly_same, value, other))
    if isinstance(value, float | int) and isinstance(other, float | int):
        return abs(value - other) <= SAME
    return bool(value == other)


def _motion(document: Document) -> Document:
    bare = copy.deepcopy({k: v for k, v in document.items() if k not in LABELS})
    for joint in bare["chain"]:
        if joint["kind"] == "fixed":
            for name in ("axis", "source", "factor", "offset"):
                del joint[name]
    pairs = sorted((r["moving"], r["standing"]) for r in bare.pop("pairs"))
    return {**bare, "pairs": pairs}


def _chain(records: list[dict[str, Any]]) -> JointChain:
    columns = {name: [r[name] for r in records] for name in records[0]}
    return JointChain(
        np.array(columns["parent"]),
        np.array([_rotated(T) for T in columns["origin"]]),
        np.array([KINDS[kind] for kind in columns["kind"]]),
        np.array(columns["axis"], dtype=float),
        np.array(columns["source"]),
        np.array(columns["factor"], dtype=float),
        np.array(columns["offset"], dtype=float),
    )


def _rotated(value: list[list[float]]) -> Array:
    """A placement with the rotation next to its own: the search takes no other."""
    T = np.array(value, dtype=float)
    u, _, v = np.linalg.svd(T[:3, :3])
    T[:3, :3] = u @ v
    return T


def _body(
    record: dict[str, Any], meshes: Mapping[str, tuple[Array, Any]], is_part: bool
) -> Body:
    mesh = TriangleMesh(record["name"], *meshes[record["mesh_sha256"]])
    T = np.array(record["T_frame_mesh"], dtype=float)
    if is_part:
        return Body(record["name"], mesh.moved(T), record["frame"])
    return Body(record["name"], mesh, T_frame_mesh=T)


def _self_pairs(
    chain: JointChain, parts: tuple[Body, ...]
) -> tuple[tuple[int, int], ...]:
    """As `robots.robot` says: no pairs of one rigid body, nor of neighbours."""
    top = {-1: -1}
    for frame in range(chain.frame_count):
        above = int(chain.parent[frame])
        top[frame] = top[above] if chain.kind[frame] == FIXED else frame
    own = [top[part.frame] for part in parts]
    neighbours = set()
    for body in own:
        above = top[int(chain.parent[body])] if body >= 0 else -2
        while above >= 0 and above not in own:
            above = top[int(chain.parent[above])]
        neighbours.add(frozenset((body, above)))
    return tuple(
        (i, j)
        for j in range(len(parts))
        for i in range(j)
        if own[i] != own[j] and frozenset((own[i], own[j])) not in neighbours
    )
