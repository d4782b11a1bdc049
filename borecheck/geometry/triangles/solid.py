"""Which side of a closed surface a point is on, and which solid holds another.

No triangle test sees a needle tip wholly inside a gantry's wall: their surfaces do not
meet. Here closed meshes are solids, and the winding number round a point is 0 outside.
The bore of a gantry is outside: a link in it is not in the solid.

The converse does not hold: two surfaces that cancel, a block drawn on both sides, wind
0 times round the matter between them. A point is outside only if, for each component of
the mesh that a ray from it crosses, another ray crosses nothing of that component, or
the component is embedded and does not wind round the point. Embedded components that do
and cancel, one well within the other and the outermost not inside out, are a cavity.
All else is undecided. Where every component is embedded and wound the same way, nothing
cancels, and 0 is enough.
"""

from dataclasses import dataclass
from enum import StrEnum

import numpy as np
from numpy.typing import ArrayLike, NDArray

from borecheck.errors import GeometryError
from borecheck.geometry.kernels.compile import kernel
from borecheck.geometry.mesh.triangle_mesh import TriangleMesh
from borecheck.geometry.triangles.topology import Topology, topology
from borecheck.geometry.triangles.winding import (
    ON_SURFACE,
    crossings,
    crossings_by_component,
    escapes,
)


class Side(StrEnum):
    """Where a point is in relation to a closed surface."""

    INSIDE = "inside"
    OUTSIDE = "outside"
    ON_SURFACE = "on surface"
    UNDECIDED = "undecided"


@dataclass(frozen=True)
class Enclosure:
    """Whether one mesh lies inside the other one's solid.

    Attributes:
        kind: "none", "a_in_b", "b_in_a" or "unknown".
        reason: One sentence for the reader.
        point: A point of the contained (or undecided) part, (3,) [m], or None.
    """

    kind: str
    reason: str
    point: NDArray[np.float64] | None = None


def is_inside(point: ArrayLike, mesh: TriangleMesh) -> Side:
    """Which side of a closed mesh a point is on; exact for the numbers given.

    Inside is where the surface winds round the point in sum (winding number not 0).
    So overlapping closed parts are one solid, an inner surface that points inward is a
    cavity, and it does not matter which way the normals of a lone surface point. Where
    surfaces cancel that might hide matter between them, the side is undecided.

    Args:
        point: Where, (3,) [m], in the mesh's frame.
        mesh: A closed mesh.

    Raises:
        GeometryError: The mesh is open, or the point is not three finite numbers.
    """
    known = topology(mesh)
    if not known.is_closed:
        raise GeometryError(f"mesh {mesh.name} is open: it has no inside")
    p = np.array(point, dtype=np.float64)
    if p.shape != (3,) or not np.isfinite(p).all():
        raise GeometryError(f"{point!r} is no point of three finite numbers")
    return side_of(p, mesh, known)


def contained(
    mesh_a: TriangleMesh,
    mesh_b: TriangleMesh,
    topology_a: Topology | None = None,
    topology_b: Topology | None = None,
) -> Enclosure:
    """Whether a part of one mesh lies inside the other mesh's solid.

    The surfaces must be known not to touch. Then every connected component lies wholly
    on one side of the other surface, and one corner of each tells which.

    Args:
        mesh_a: Placed mesh.
        mesh_b: Placed mesh, in the same frame.
        topology_a: Its topology, if known from before (it does not change by moving).
        topology_b: The same of mesh_b.

    Returns:
        "unknown" when an open mesh is asked what it holds and the bounding boxes do
        not answer for it; containment found on the other side comes first.
    """
    topology_a = topology_a or topology(mesh_a)
    topology_b = topology_b or topology(mesh_b)
    answers = (
        _held("a_in_b", mesh_a, topology_a, mesh_b, topology_b),
        _held("b_in_a", mesh_b, topology_b, mesh_a, topology_a),
    )
    for answer in answers:
        if answer.kind not in ("none", "unknown"):
            return answer
    return answers[0] if answers[0].kind == "unknown" else answers[1]


def _held(
    kind: str,
    inner: TriangleMesh,
    inner_topology: Topology,
    outer: TriangleMesh,
    outer_topology: Topology,
) -> Enclosure:
    """Whether a component of inner lies inside outer."""
    found = Enclosure("none", f"{inner.name} and {outer.name} hold nothing of another")
    for k in _inside_box(inner, inner_topology.component, outer.bounds):
        point = inner.vertices[inner.triangles[k, 0]].copy()
        if not outer_topology.is_closed:
            reason = f"{outer.name} is open: what it holds cannot be told"
            return Enclosure("unknown", reason, point)
        side = side_of(point, outer, outer_topology)
        if side is Side.UNDECIDED:
            part = inner.corners[
                inner_topology.component == inner_topology.component[k]
            ]
            side = _side_of_joined(part.reshape(-1, 3), outer, outer_topology)
        if side is Side.INSIDE:
            return Enclosure(kind, f"{inner.name} is inside {outer.name}", point)
        if side is Side.ON_SURFACE:
            reason = f"{inner.name} touches {outer.name}: ask for contact first"
            found = Enclosure("unknown", reason, point)
        elif side is Side.UNDECIDED:
            found = Enclosure("unknown", undecided(inner.name, outer.name), point)
    return found


def _side_of_joined(
    points: NDArray[np.float64], mesh: TriangleMesh, known: Topology
) -> Side:
    """Side of points (k, 3) of one component, as soon as one of them leaves no doubt.

    Where one is, all are. Those that reach farthest along each axis are asked.
    """
    farthest = np.concatenate([points.argmin(axis=0), points.argmax(axis=0)])
    for point in points[farthest]:
        side = side_of(point, mesh, known)
        if side is not Side.UNDECIDED:
            return side
    return Side.UNDECIDED


def undecided(inner: str, outer: str) -> str:
    """What to say where surfaces of `outer` that cancel surround `inner`."""
    return (
        f"{inner} may be inside {outer}, whose surfaces cancel there: drawn twice, "
        "crossing or wound against each other"
    )


def _inside_box(
    mesh: TriangleMesh, component: NDArray[np.int64], box: NDArray[np.float64]
) -> NDArray[np.int64]:
    """One triangle of every component that lies wholly within a box."""
    low, high = mesh.bounds
    if (high < box[0]).any() or (low > box[1]).any():
        return np.zeros(0, dtype=np.int64)
    count = int(component.max()) + 1
    return _parts_within(mesh.vertices, mesh.triangles, component, count, box)


@kernel
def _parts_within(
    vertices: NDArray[np.float64],
    triangles: NDArray[np.int64],
    component: NDArray[np.int64],
    count: int,
    box: NDArray[np.float64],
) -> NDArray[np.int64]:
    """First triangle of every component without a corner outside the box."""
    first = np.full(count, -1, dtype=np.int64)
    outside = np.zeros(count, dtype=np.bool_)
    left = count
    for t in range(len(triangles)):
        part = component[t]
        if outside[part]:
            continue
        if first[part] < 0:
            first[part] = t
        for c in range(3):
            for k in range(3):
                x = vertices[triangles[t, c], k]
                if x < box[0, k] or x > box[1, k]:
                    outside[part] = True
        if outside[part]:
            left -= 1
            if left == 0:
                break
    return first[~outside]


def side_of(point: NDArray[np.float64], mesh: TriangleMesh, known: Topology) -> Side:
    """As `is_inside`, of a placed mesh that is known to be closed, and its topology."""
    if (point < mesh.bounds[0]).any() or (point > mesh.bounds[1]).any():
        return Side.OUTSIDE
    x, y, z = point.tolist()
    winding, crossed = crossings((x, y, z), mesh.corners.reshape(-1, 9))
    if winding == ON_SURFACE:
        return Side.ON_SURFACE
    if winding != 0:
        return Side.INSIDE
    if crossed == 0 or known.winding_tells or _is_free(point, mesh, known):
        return Side.OUTSIDE
    return Side.UNDECIDED


def _is_free(point: NDArray[np.float64], mesh: TriangleMesh, known: Topology) -> bool:
    """Whether surely no matter is round a point, although surfaces that cancel are."""
    x, y, z = point.tolist()
    winding, crossed = crossings_by_component(
        (x, y, z), mesh.corners.reshape(-1, 9), known.component
    )
    around = []
    for part in np.flatnonzero(crossed).tolist():
        if escapes(point, mesh.corners[known.component == part]):
            continue
        if not known.is_embedded(part):
            return False
        if winding[part] != 0:
            around.append(part)
    if not known.are_nested(tuple(around)):
        return False
    around.sort(key=lambda part: np.ptp(known.corners_of(part), axis=(0, 1)).sum())
    # From the outermost inwards. Below 0 is no matter: a whole file inside out, or a
    # block in another that is; in that one the point would be in matter.
    return bool((np.cumsum(winding[around[::-1]]) >= 0).all())
