"""Which of many placed solids may hold another, pose by pose, in one compiled call.

Surfaces are known not to meet, so that a component of one mesh is wholly inside the
other or wholly outside. It can be inside only if it is inside the other's box; then a
ray from its first corner tells. Where crossings of that ray cancel, or where a mesh is
open, the answer is a doubt that `triangles.solid` settles, or that stands.
"""

import numpy as np
from numpy.typing import NDArray

from borecheck.geometry.kernels.compile import INLINE, kernel
from borecheck.geometry.mesh.triangle_mesh import TriangleMesh
from borecheck.geometry.tree.addresses import DEPTH, SIDE, open_pairs, open_side
from borecheck.geometry.tree.boxes import copy_placement, is_identity, motion_of
from borecheck.geometry.tree.build import WIDTH
from borecheck.geometry.tree.rays import placed_crossings
from borecheck.geometry.tree.world_boxes import gap_between, world_boxes
from borecheck.geometry.triangles.placing import place_point
from borecheck.geometry.triangles.topology import Topology

# What is answered of a pair of meshes; the larger, the nearer to contact.
#   IN_BOX: an open mesh, in whose world box something is, not in its own
#   IN_DOUBT: crossings that cancel
#   MIGHT_HOLD: an open mesh, with something in its own box
NOTHING, IN_BOX, IN_DOUBT, MIGHT_HOLD, HELD = range(5)

# What is known of a mesh. ASKED and NOT_ASKED: whether winding numbers tell is wanted
# for a pair or was never wanted: for large meshes it takes long to find out.
OPEN, TELLS, CANCELS, NOT_ASKED, ASKED = range(5)

# Corners that tell whether a component can be in a box: the first, and extreme ones.
WITNESSES = 8
# What a mesh's own box grows by, as in `placing.placed_bounds`, [m].
_GROWN = 1e-9

Floats = NDArray[np.float64]
Ids = NDArray[np.int64]


class Solids:
    """What `holding` asks of some meshes besides their trees.

    Attributes:
        boxes: Bounds in their own frames, (k, 2, 3), [m].
        kinds: OPEN, TELLS, CANCELS, NOT_ASKED or ASKED, (k,).
        first: Where the components of each mesh begin, (k + 1,).
        corners: WITNESSES corners of every component, (c, 8, 3), [m].
    """

    def __init__(self, meshes: list[TriangleMesh], topologies: list[Topology]) -> None:
        self._topologies = topologies
        counts = [int(known.component.max()) + 1 for known in topologies]
        self.boxes = np.array([mesh.bounds for mesh in meshes]).reshape(-1, 2, 3)
        closed = [known.is_closed for known in topologies]
        self.kinds = np.where(np.array(closed, bool), NOT_ASKED, OPEN).astype(np.int64)
        self.first = np.concatenate([[0], np.cumsum(counts)]).astype(np.int64)
        corners = [witnesses(m, t) for m, t in zip(meshes, topologies, strict=True)]
        self.corners = np.concatenate([np.zeros((0, WITNESSES, 3)), *corners])

    @property
    def arrays(self) -> tuple[Floats, Ids, Ids, Floats]:
        """As kernels take them."""
        return self.boxes, self.kinds, self.first, self.corners

    def answer(self) -> bool:
        """Finds out what kernels asked for; whether anything was."""
        asked = np.flatnonzero(self.kinds == ASKED)
        for mesh in asked:
            tells = self._topologies[mesh].winding_tells
            self.kinds[mesh] = TELLS if tells else CANCELS
        return len(asked) > 0


def witnesses(mesh: TriangleMesh, known: Topology) -> NDArray[np.float64]:
    """First corner of every component and its extreme ones, (components, 8, 3)."""
    order = np.argsort(known.component, kind="stable")
    begins = np.flatnonzero(np.diff(known.component[order], prepend=-1))
    found = np.zeros((len(begins), WITNESSES, 3))
    for k, triangles in enumerate(np.split(order, begins[1:])):
        whole = len(begins) == 1  # a large mesh is not copied for it
        own = mesh.corners if whole else mesh.corners[triangles]
        x, y, z = columns = own.reshape(-1, 3).T
        far = ((x - x.mean()) ** 2 + (y - y.mean()) ** 2 + (z - z.mean()) ** 2).argmax()
        extreme = [c.argmin() for c in columns] + [c.argmax() for c in columns]
        found[k] = columns[:, [0, *extreme, far]].T
    return found


@kernel
def holding(  # type: ignore[no-untyped-def]
    book, solids_a, solids_b, placements_a, placements_b, b_moves,
    count, every, settled, codes,
):  # fmt: skip
    """Fills codes (n, pairs), zero before.

    Returns whether something is asked of `Solids.answer`; then ask again after it.

    Args:
        book: Trees and pairs, as `query.search` takes them.
        solids_a: `Solids.arrays` of the first meshes.
        solids_b: Of the others.
        placements_a: (n, a, 4, 4), rigid.
        placements_b: (n, b, 4, 4), or (1, b, 4, 4) if they stand still.
        b_moves: Whether they do not.
        count: How many corners of a component must be in the other's box: WITNESSES,
            or 1 where surfaces may meet unseen, by a checker that has blind spots.
        every: Whether all pairs are asked; else a pose ends with its first HELD.
        settled: Poses to leave out, (n,).
        codes: int8.
    """
    nodes_a, children_a, corners_a, _, frames_a = open_side(book, 0)
    nodes_b, children_b, corners_b, _, frames_b = open_side(book, SIDE)
    trees_a = (nodes_a, children_a, corners_a, frames_a)
    trees_b = (nodes_b, children_b, corners_b, frames_b)
    pairs = open_pairs(book)
    stack = np.empty(WIDTH * (max(book[DEPTH], book[SIDE + DEPTH]) + 2), np.int64)
    reach_a = np.empty((len(solids_a[0]), 2, 3))
    reach_b = np.empty((len(solids_b[0]), 2, 3))
    T_a, T_b = np.empty((3, 4)), np.empty((3, 4))
    asks = False
    if not b_moves:
        world_boxes(nodes_b, frames_b, placements_b, 0, reach_b)
    for i in range(len(placements_a)):
        if settled[i]:
            continue
        world_boxes(nodes_a, frames_a, placements_a, i, reach_a)
        if b_moves:
            world_boxes(nodes_b, frames_b, placements_b, i, reach_b)
        for k in range(len(pairs)):
            a, b = pairs[k, 0], pairs[k, 1]
            if gap_between(reach_a, a, reach_b, b) > 0.0:
                continue
            copy_placement(placements_a, i, a, T_a)
            copy_placement(placements_b, i if b_moves else 0, b, T_b)
            code = _one_way(
                solids_a, a, T_a, solids_b, b, T_b, reach_b, trees_b, count, stack
            )
            if code < HELD:
                back = _one_way(
                    solids_b, b, T_b, solids_a, a, T_a, reach_a, trees_a, count, stack
                )
                code = max(code, back)
            codes[i, k] = code
            if code == HELD and not every:
                break
            if code == IN_DOUBT:
                asks |= (solids_a[1][a] == ASKED) | (solids_b[1][b] == ASKED)
    return asks


@kernel
def _one_way(  # type: ignore[no-untyped-def]
    inner_solids, inner, T_inner, outer_solids, outer, T_outer,
    reach, trees, count, stack,
):  # fmt: skip
    """Whether mesh `outer` holds a component of mesh `inner`: one of the codes."""
    _, _, first, corners = inner_solids
    boxes, kinds, _, _ = outer_solids
    nodes, children, triangles, frames = trees
    M = motion_of(T_outer)
    code = NOTHING
    for k in range(first[inner], first[inner + 1]):
        within = 0
        needed = 1 if kinds[outer] == OPEN else count
        while within < needed and _in_reach(T_inner, corners, k, within, reach, outer):
            within += 1
        if within < needed:
            continue
        p = place_point(T_inner, corners[k, 0, 0], corners[k, 0, 1], corners[k, 0, 2])
        if kinds[outer] == OPEN:
            code = max(code, MIGHT_HOLD if _in_own(M, p, boxes, outer) else IN_BOX)
            continue
        winding, crossed = placed_crossings(
            p, nodes, children, triangles, frames,
            outer, T_outer, M, is_identity(M), stack,
        )  # fmt: skip
        if winding != 0:
            return HELD
        if crossed > 0 and kinds[outer] != TELLS:
            code = max(code, IN_DOUBT)
            if kinds[outer] == NOT_ASKED:
                kinds[outer] = ASKED
    return code


@kernel(**INLINE)
def _in_reach(T, corners, k, witness, reach, outer):  # type: ignore[no-untyped-def]
    x, y, z = corners[k, witness, 0], corners[k, witness, 1], corners[k, witness, 2]
    x, y, z = place_point(T, x, y, z)
    low = (
        (x >= reach[outer, 0, 0])
        & (y >= reach[outer, 0, 1])
        & (z >= reach[outer, 0, 2])
    )
    high = (
        (x <= reach[outer, 1, 0])
        & (y <= reach[outer, 1, 1])
        & (z <= reach[outer, 1, 2])
    )
    return low & high


@kernel(**INLINE)
def _in_own(M, p, boxes, outer):  # type: ignore[no-untyped-def]
    """Whether a point of the world is in a mesh's own box, a little grown.

    The way back by the transpose: rotations are checked to 1e-6.
    """
    x, y, z = p[0] - M[9], p[1] - M[10], p[2] - M[11]
    grown = _GROWN + 4e-6 * (abs(x) + abs(y) + abs(z))
    inside = True
    for c in range(3):
        at = M[c] * x + M[3 + c] * y + M[6 + c] * z
        inside &= (at >= boxes[outer, 0, c] - grown) & (
            at <= boxes[outer, 1, c] + grown
        )
    return inside
