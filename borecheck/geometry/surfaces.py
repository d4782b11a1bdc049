"""Triangles of two placed surfaces that meet: any checker behind any pruning.

Search structures are built once per mesh, on first use, and moved, never rebuilt.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from borecheck.core.once import once_per_pair, once_per_record, twin
from borecheck.errors import GeometryError, UnknownNameError, UsageError
from borecheck.geometry.coal_engine.broadphase import PatchBroadphase
from borecheck.geometry.coal_engine.contact import CoalMesh
from borecheck.geometry.coal_engine.contact import contacts as coal_contacts
from borecheck.geometry.mesh.triangle_mesh import TriangleMesh
from borecheck.geometry.tree.boxes import LARGEST_COORDINATE
from borecheck.geometry.tree.mesh_tree import MeshTree
from borecheck.geometry.triangles.placing import place_mesh
from borecheck.geometry.triangles.topology import Topology, cached_topology

Array = NDArray[np.float64]
Pairs = NDArray[np.int64]

NARROWPHASES = ("paper:robot", "paper:scanner", "two-sided", "exact")
CHECKERS = (*NARROWPHASES, "coal")
PRUNINGS = ("none", "coal", "bvh")
# `paper` alone is the reading that the project takes as the published one.
ALIASES = {"paper": "paper:robot"}


@dataclass(frozen=True)
class Found:
    """Contacts of one pair of surfaces.

    Attributes:
        pairs: Triangle numbers (k, 2), sorted.
        within_tolerance: Which of them only Coal's tolerance calls contact, (k,).
        examined: Triangle pairs the narrowphase looked at.
    """

    pairs: Pairs
    within_tolerance: NDArray[np.bool_]
    examined: int


@dataclass(frozen=True)
class Surface:
    """A mesh in its own frame with the search structures that were asked for.

    They are built on first use, are kept by the mesh and die with it: surfaces of one
    mesh are the same, whoever makes them.
    """

    mesh: TriangleMesh

    @property
    def tree(self) -> MeshTree:
        """Bounding-volume tree."""
        return _tree(self.mesh)

    @property
    def topology(self) -> Topology:
        """Closedness and components, which no motion changes."""
        return _topology(self.mesh)

    @property
    def representatives(self) -> Array:
        """One corner of every connected component, (k, 3), in the mesh's frame."""
        return _representatives(self.mesh)

    @property
    def coal(self) -> CoalMesh:
        """Coal's own model."""
        return _coal(self.mesh)

    @property
    def count(self) -> int:
        """Number of triangles."""
        return len(self.mesh.triangles)


def surface(mesh: TriangleMesh) -> Surface:
    """The surface of a mesh record; the same record gives the same structures."""
    return Surface(mesh)


@once_per_record
def _tree(mesh: TriangleMesh) -> MeshTree:
    return MeshTree.of(mesh)


@once_per_record
def _topology(mesh: TriangleMesh) -> Topology:
    _ = mesh.corners  # found once for both records
    return cached_topology(twin(mesh))


@once_per_record
def _representatives(mesh: TriangleMesh) -> Array:
    _, first = np.unique(_topology(mesh).component, return_index=True)
    return mesh.vertices[mesh.triangles[first, 0]]


@once_per_record
def _coal(mesh: TriangleMesh) -> CoalMesh:
    return CoalMesh(twin(mesh))


def checker_name(name: str) -> str:
    """The full name of a checker (`paper` is `paper:robot`).

    Raises:
        UnknownNameError: No such checker.
    """
    full = ALIASES.get(name, name)
    if full not in CHECKERS:
        raise UnknownNameError("checker", name, (*ALIASES, *CHECKERS))
    return full


def check_pruning(pruning: str) -> str:
    """The name of a pruning, if it is one."""
    if pruning not in PRUNINGS:
        raise UnknownNameError("pruning", pruning, PRUNINGS)
    return pruning


def contacts(
    a: Surface,
    T_a: Array,
    b: Surface,
    T_b: Array,
    checker: str = "exact",
    pruning: str = "bvh",
    security_margin: float = 0.0,
    *,
    same_vertices: bool = False,
) -> Found:
    """All triangles of a and b that meet, by one checker behind one pruning.

    Args:
        a: The robot's surface; `paper:robot` makes its triangles alpha.
        T_a: Placement of a, (4, 4).
        b: The other surface.
        T_b: Placement of b, (4, 4).
        checker: One of CHECKERS.
        pruning: One of PRUNINGS; Coal's checker has its own tree.
        security_margin: Coal's, [m]; 0 for the other checkers.
        same_vertices: Give Coal the placed float64 vertices of the other checkers
            instead of letting it move its own; slower.

    Raises:
        UnknownNameError: No such checker or pruning.
    """
    check_pruning(pruning)
    for side, T in ((a, T_a), (b, T_b)):
        _refuse_huge(side.mesh, T)
    if checker == "coal":
        found = coal_contacts(
            a.coal, T_a, b.coal, T_b, security_margin, placed=same_vertices
        )
        return Found(found.pairs, found.within_tolerance, len(found.pairs))
    if security_margin != 0.0:
        raise UsageError(f"checker {checker} has no security margin, only coal has")
    if pruning == "bvh":
        pairs, examined = a.tree.contacts_counted(b.tree, T_a, T_b, checker)
    elif pruning == "coal":
        pairs, examined = _behind_patches(a, T_a, b, T_b, checker)
    else:
        pairs, examined = _all_pairs(a, T_a, b, T_b, checker)
    return Found(pairs, np.zeros(len(pairs), dtype=bool), examined)


def _refuse_huge(mesh: TriangleMesh, T: Array) -> None:
    """Overflow would answer at random; the trees refuse the same."""
    far = max(float(np.abs(mesh.bounds).max()), float(np.abs(T[:3, 3]).max()))
    if not far <= LARGEST_COORDINATE:
        raise GeometryError(
            f"{mesh.name} reaches {far:.3g} m, beyond {LARGEST_COORDINATE:g} m"
        )


def _rows(T: Array, mesh: TriangleMesh) -> Array:
    """Placed corners as (m, 9) rows: what every narrowphase sees."""
    return place_mesh(T, mesh).corners.reshape(-1, 9)


def _all_pairs(
    a: Surface, T_a: Array, b: Surface, T_b: Array, checker: str
) -> tuple[Pairs, int]:
    from borecheck.geometry.triangles.all_pairs import all_contacts
    from borecheck.geometry.triangles.narrowphase import narrowphase_code

    rows_a, rows_b = _rows(T_a, a.mesh), _rows(T_b, b.mesh)
    pairs = all_contacts(narrowphase_code(checker), rows_a, rows_b)
    return pairs, a.count * b.count


@once_per_pair
def _patches(a: TriangleMesh, b: TriangleMesh) -> PatchBroadphase:
    return PatchBroadphase([a], [b])


def _behind_patches(
    a: Surface, T_a: Array, b: Surface, T_b: Array, checker: str
) -> tuple[Pairs, int]:
    from borecheck.geometry.triangles.narrowphase import contact_pairs, narrowphase_code

    found = _patches(a.mesh, b.mesh).candidate_pairs(T_a[None], T_b[None])
    candidates = np.ascontiguousarray(found.pairs[:, [1, 3]])
    code = narrowphase_code(checker)
    meet = contact_pairs(code, _rows(T_a, a.mesh), _rows(T_b, b.mesh), candidates)
    pairs = candidates[meet]
    return pairs[np.lexsort((pairs[:, 1], pairs[:, 0]))], found.examined
