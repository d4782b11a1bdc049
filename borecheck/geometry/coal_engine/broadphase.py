"""Which triangle pairs can touch at all: patches of two sides in Coal's dynamic trees.

Each patch is a Coal box in a dynamic AABB tree, built once per mesh in its own frame
and moved with it, never rebuilt. It is a strict pre-filter: every pair of triangles
in contact lies in some pair of overlapping boxes. It shows how much can be pruned,
not speed; `bvh` is the fast road.

How Coal's binding is used, and why: it takes no Python callbacks and hands out no pair
list, so the default callback collects one contact per pair of overlapping boxes, told
apart by `contact.o1.id()` (`is` and `==` compare something else). A margin is given by
growing the boxes: a `security_margin` under a manager does not grow the boxes in the
tree and loses pairs in silence.

Coal's own box test is not strict either. Its iteration ends within `gjk_tolerance` of
an overlap and hands out the distance left over; any above 1e-12 counts as no contact,
so boxes that overlap by millimetres are missed (one in ten when their faces are
parallel). The leftover is below the tolerance: `_LEFTOVER` accepts it, and no more, as
the boxes are already grown by more than that.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from borecheck.core.se3 import ROTATION_TOLERANCE, check_transform
from borecheck.errors import GeometryError
from borecheck.geometry.mesh.patches import Patches, cut
from borecheck.geometry.mesh.triangle_mesh import TriangleMesh

Array = NDArray[np.float64]
Ids = NDArray[np.int64]

# Boxes are compared by an iteration that stops at a tolerance of 1e-6 m (Coal's
# default), and moved with rounding far below that: growing each box by ten times the
# tolerance keeps every pair, at no visible loss in pruning. A rotation typed with six
# digits skews a box by its tolerance times the box's size: that is added.
_GROWTH = 1e-5  # [m]
_SKEW = 2.0 * ROTATION_TOLERANCE
_GJK_TOLERANCE = 1e-6  # [m]
_LEFTOVER = 2.0 * _GJK_TOLERANCE  # [m]; must stay below _GROWTH, see above


@dataclass(frozen=True, eq=False)
class Candidates:
    """Triangle pairs that a narrowphase has to examine.

    Attributes:
        pairs: (mesh of a, triangle of it, mesh of b, triangle of it), sorted, (k, 4).
        patch_pairs: Number of overlapping pairs of boxes.
        examined: Number of triangle pairs handed on, k.
        pruned: Number of triangle pairs ruled out; examined + pruned are all.
    """

    pairs: Ids
    patch_pairs: int
    examined: int
    pruned: int


class PatchSide:
    """The meshes of one side (robot links, or scanner parts) as boxes in one tree.

    Args:
        meshes: The meshes, each in its own frame; at least one.
        patch_size: Triangles per patch, at most.
    """

    def __init__(self, meshes: Sequence[TriangleMesh], patch_size: int = 16) -> None:
        import coal

        if not meshes:
            raise GeometryError("a side of the broadphase has no meshes")
        self.patches: tuple[Patches, ...] = tuple(cut(m, patch_size) for m in meshes)
        self.n_triangles = sum(len(m.triangles) for m in meshes)
        self.of_id: dict[int, tuple[int, int]] = {}
        self._objects: list[list[Any]] = []
        self._moved_by: list[bytes] = [b""] * len(meshes)
        self._inflate = 0.0
        self.manager = coal.DynamicAABBTreeCollisionManager()
        for m, patches in enumerate(self.patches):
            self._objects.append(
                [self._add(m, p, patches) for p in range(len(patches))]
            )
        self.manager.setup()

    def move(self, T_world_meshes: Array) -> None:
        """Place every mesh; boxes of meshes that stay are left alone.

        Args:
            T_world_meshes: One placement per mesh, (n, 4, 4).
        """
        T_all = np.asarray(T_world_meshes, dtype=np.float64)
        if T_all.shape != (len(self.patches), 4, 4):
            raise GeometryError(
                f"placements have shape {T_all.shape}, not ({len(self.patches)}, 4, 4)"
            )
        changed = False
        for m, given in enumerate(T_all):
            T = check_transform(given)
            if T.tobytes() != self._moved_by[m]:
                self._move_one(m, T)
                changed = True
        if changed:
            self.manager.update()

    def inflate(self, by: float) -> None:
        """Grow all boxes by a distance on every side, [m]; 0 is their true size."""
        if not (np.isfinite(by) and by >= 0.0):
            raise GeometryError(f"boxes cannot be grown by {by} m")
        if by == self._inflate:
            return
        for patches, objects in zip(self.patches, self._objects, strict=True):
            for half_sides, thing in zip(patches.half_sides, objects, strict=True):
                box = thing.collisionGeometry()
                box.halfSide = _grown(half_sides) + by
                box.computeLocalAABB()
                thing.computeAABB()
        self._inflate = by
        self.manager.update()

    def _add(self, mesh: int, patch: int, patches: Patches) -> Any:
        import coal

        box = coal.Box(2.0 * _grown(patches.half_sides[patch]))
        box.computeLocalAABB()
        # placed before it is registered: a tree of boxes that are all at the origin is
        # a list, and building it takes minutes
        own = coal.Transform3s(patches.axes[patch], patches.centers[patch])
        thing = coal.CollisionObject(box, own)
        self.of_id[thing.collisionGeometry().id()] = (mesh, patch)
        self.manager.registerObject(thing)
        return thing

    def _move_one(self, mesh: int, T: Array) -> None:
        import coal

        patches = self.patches[mesh]
        R, t = T[:3, :3], T[:3, 3]
        turned = R @ patches.axes
        moved = patches.centers @ R.T + t
        for k, thing in enumerate(self._objects[mesh]):
            thing.setTransform(coal.Transform3s(turned[k], moved[k]))
            thing.computeAABB()
        self._moved_by[mesh] = T.tobytes()


class PatchBroadphase:
    """Two sides and the question which of their triangles can touch.

    Args:
        meshes_a: Meshes of side a (the robot's links).
        meshes_b: Meshes of side b (the scanner's parts).
        patch_size: Triangles per patch, at most.
    """

    def __init__(
        self,
        meshes_a: Sequence[TriangleMesh],
        meshes_b: Sequence[TriangleMesh],
        patch_size: int = 16,
    ) -> None:
        self.a = PatchSide(meshes_a, patch_size)
        self.b = PatchSide(meshes_b, patch_size)

    def candidate_pairs(
        self, T_world_a: Array, T_world_b: Array, inflate: float = 0.0
    ) -> Candidates:
        """All triangle pairs of overlapping patches: a superset of those in contact.

        Args:
            T_world_a: Placements of the meshes of a, (n, 4, 4).
            T_world_b: Placements of the meshes of b, (m, 4, 4).
            inflate: Also pairs that are at most this far apart, [m].

        Raises:
            GeometryError: Wrong number of placements, not finite, or inflate < 0.
        """
        self.a.move(T_world_a)
        self.b.move(T_world_b)
        self.a.inflate(inflate)
        found = self.patch_pairs()
        blocks = [self._triangle_pairs(*pair) for pair in found]
        pairs = np.concatenate([np.zeros((0, 4), dtype=np.int64), *blocks])
        pairs = pairs[np.lexsort(pairs.T[::-1])]
        total = self.a.n_triangles * self.b.n_triangles
        return Candidates(pairs, len(found), len(pairs), total - len(pairs))

    def patch_pairs(self) -> list[tuple[int, int, int, int]]:
        """Overlapping boxes as (mesh of a, patch, mesh of b, patch), sorted."""
        import coal

        callback = coal.CollisionCallBackDefault()
        request = callback.data.request
        request.enable_contact = False
        request.gjk_tolerance = _GJK_TOLERANCE
        request.security_margin = _LEFTOVER
        # one more than there can be: the cap is never reached, no pair is lost
        request.num_max_contacts = len(self.a.of_id) * len(self.b.of_id) + 1
        callback.init()
        self.a.manager.collide(self.b.manager, callback)
        pairs = set()
        for contact in callback.data.result.getContacts():
            first, second = contact.o1.id(), contact.o2.id()
            if first not in self.a.of_id:
                first, second = second, first
            pairs.add((*self.a.of_id[first], *self.b.of_id[second]))
        return sorted(pairs)

    def _triangle_pairs(self, mesh_a: int, a: int, mesh_b: int, b: int) -> Ids:
        of_a = self.a.patches[mesh_a].triangles(a)
        of_b = self.b.patches[mesh_b].triangles(b)
        block = np.zeros((len(of_a) * len(of_b), 4), dtype=np.int64)
        block[:, 0], block[:, 2] = mesh_a, mesh_b
        block[:, 1] = np.repeat(of_a, len(of_b))
        block[:, 3] = np.tile(of_b, len(of_a))
        return block


def _grown(half_sides: Array) -> Array:
    return half_sides + (_GROWTH + _SKEW * np.linalg.norm(half_sides))
