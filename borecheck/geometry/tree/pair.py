"""Two meshes that are asked about often: all that does not change is laid out once.

A call writes both placements into a block of memory and hands its address, one number,
to the kernel: what numba and numpy ask of arrays costs more than a clear pair.
"""

from threading import get_ident

import numpy as np
from numba.np.numpy_support import carray
from numpy.typing import ArrayLike, NDArray

from borecheck.errors import UsageError
from borecheck.geometry.kernels.compile import kernel
from borecheck.geometry.mesh.triangle_mesh import TriangleMesh
from borecheck.geometry.tree.addresses import PairBook
from borecheck.geometry.tree.mesh_tree import (
    MeshTree,
    NearestPoints,
    Within,
    placement,
    reject_placement,
)
from borecheck.geometry.tree.query import FIRST, search
from borecheck.geometry.tree.simd import array_at
from borecheck.geometry.triangles.narrowphase import narrowphase_code

# Entries of the book; both placements follow, eight bytes a number.
_BOOK = 18
_T_A, _T_B, _END = 8 * _BOOK, 8 * (_BOOK + 16), 8 * (_BOOK + 32)
_FLOAT, _SHAPE = np.dtype(np.float64), (4, 4)
_ONE_PAIR = np.zeros((1, 2), np.int64)
_EXACT = narrowphase_code("exact")


@kernel
def _first_contact_at(address, code):  # type: ignore[no-untyped-def]
    """1 if the meshes of a block meet, 0 if not, -1 if a placement is not rigid."""
    book = carray(array_at(address), (_BOOK,), np.int64)
    T_a = carray(array_at(address + _T_A), (1, 1, 4, 4), np.float64)
    T_b = carray(array_at(address + _T_B), (1, 1, 4, 4), np.float64)
    hits = carray(array_at(address), (0,), np.int64)
    touches = carray(array_at(address), (0,), np.bool_)
    found = carray(array_at(address), (0, 4), np.int64)
    count, _, bad, _ = search(
        book, T_a, T_b, False, 0, 1, code, FIRST, 0.0, hits, touches, found
    )
    return -1 if bad >= 0 else count


def _tree(given: object, name: str) -> MeshTree:
    """The tree of a mesh, or what is one.

    Raises:
        UsageError: It is neither.
    """
    if isinstance(given, MeshTree):
        return given
    if isinstance(given, TriangleMesh):
        return MeshTree.of(given)
    kind = type(given).__name__
    raise UsageError(
        f"{name} of a Pair is a {kind}: give a MeshTree(vertices, triangles) or a "
        "mesh, such as robot.parts[0].mesh"
    )


class Pair:
    """Two meshes ready for many calls; the answers are those of `MeshTree`.

    `a` is the robot's mesh. One thread is quick, the one that made the pair; others
    get the same answers from `MeshTree`.

    Args:
        a: A mesh or its tree.
        b: The other.

    Attributes:
        a: Tree of the first mesh.
        b: Tree of the other.
    """

    __slots__ = ("_address", "_block", "_book", "_thread", "a", "b")

    def __init__(self, a: MeshTree | TriangleMesh, b: MeshTree | TriangleMesh) -> None:
        self.a, self.b = _tree(a, "a"), _tree(b, "b")
        self._book = PairBook(self.a.book, self.b.book, _ONE_PAIR)
        self._block = bytearray(_END)
        numbers = np.frombuffer(self._block, np.int64)
        numbers[:_BOOK] = self._book.entries
        self._address = int(numbers.__array_interface__["data"][0])
        self._thread = get_ident()

    def __repr__(self) -> str:
        return f"<Pair {self.a!r}, {self.b!r}>"

    def __reduce__(self) -> tuple[type["Pair"], tuple[MeshTree, MeshTree]]:
        """A copy is made anew: the address is that of this pair's own block."""
        return Pair, (self.a, self.b)

    def first_contact(
        self, T_a: ArrayLike, T_b: ArrayLike, narrowphase: str = "exact"
    ) -> bool:
        """Whether any triangle of a meets any of b; see `MeshTree.first_contact`.

        Args:
            T_a: T_world_a, (4, 4).
            T_b: T_world_b, (4, 4).
            narrowphase: exact, two-sided, paper:robot or paper:scanner.
        """
        code = _EXACT if narrowphase == "exact" else narrowphase_code(narrowphase)
        if (
            isinstance(T_a, np.ndarray)
            and isinstance(T_b, np.ndarray)
            and T_a.dtype is _FLOAT
            and T_b.dtype is _FLOAT
            and T_a.shape == _SHAPE
            and T_b.shape == _SHAPE
            and get_ident() == self._thread
        ):
            block = self._block
            block[_T_A:_T_B] = T_a.tobytes()
            block[_T_B:_END] = T_b.tobytes()
            found: int = _first_contact_at(self._address, code)
            if found >= 0:
                return found > 0
        # Anything but the usual is told apart, and refused, where there is time.
        return self.a.first_contact(self.b, T_a, T_b, narrowphase)

    def place(self, T_a: ArrayLike, T_b: ArrayLike) -> None:
        """Puts both meshes where `meets` will find them.

        Args:
            T_a: T_world_a, (4, 4).
            T_b: T_world_b, (4, 4).

        Raises:
            GeometryError: A placement that is no rigid transform.
            UsageError: Another thread made the pair.
        """
        self._refuse_other_threads()
        both = placement(T_a, "T_a"), placement(T_b, "T_b")
        for T, name in zip(both, ("T_a", "T_b"), strict=True):
            reject_placement(T[0, 0], name)
        self._block[_T_A:_END] = both[0].tobytes() + both[1].tobytes()

    def meets(self) -> bool:
        """Whether the meshes meet where they were last placed, by the exact test.

        Raises:
            UsageError: They were never placed, or another thread made the pair.
        """
        self._refuse_other_threads()
        found: int = _first_contact_at(self._address, _EXACT)
        if found < 0:
            raise UsageError("a Pair meets() only after place(T_a, T_b)")
        return found > 0

    def _refuse_other_threads(self) -> None:
        if get_ident() != self._thread:
            raise UsageError("a Pair is placed by the thread that made it, no other")

    def contacts(
        self, T_a: ArrayLike, T_b: ArrayLike, narrowphase: str = "exact"
    ) -> NDArray[np.int64]:
        """All pairs of triangles that meet, (k, 2); see `MeshTree.contacts`."""
        return self.a.contacts(self.b, T_a, T_b, narrowphase)

    def clearance(
        self, T_a: ArrayLike, T_b: ArrayLike, relative_tolerance: float = 0.0
    ) -> tuple[float, float]:
        """Certified bounds of the distance, [m]; see `MeshTree.clearance`."""
        return self.a.clearance(self.b, T_a, T_b, relative_tolerance)

    def closest(self, T_a: ArrayLike, T_b: ArrayLike) -> NearestPoints:
        """Two nearest points; see `MeshTree.closest`."""
        return self.a.closest(self.b, T_a, T_b)

    def within(self, T_a: ArrayLike, T_b: ArrayLike, margin: float) -> Within:
        """Whether the surfaces come as near as a margin [m]; see `MeshTree.within`."""
        return self.a.within(self.b, T_a, T_b, margin)
