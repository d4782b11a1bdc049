"""Contact of two meshes as Coal sees it: its own tree and its own triangle test.

Settings, each for a measured reason:

- `gjk_tolerance` 1e-9: with Coal's default, 1e-6 (length units, whatever they are),
  pairs with a gap of up to a micrometre are reported as contacts.
- `break_distance` 0: the default opens boxes that are disjoint by less than 1 mm;
  without it the same contacts come up to four times faster.
- `enable_contact` off: it turns on penetration depths, which for meshes say nothing.

A contact is what `coal.collide` says: a distance of at most 1e-12 between two
triangles, found by an iteration that stops at `gjk_tolerance`. `coal.distance() <= 0`
is another question with another answer, and no contact test. A pair that Coal reports
although its triangles do not meet exactly is labelled `within_tolerance`.

What Coal misses with any settings: some contacts of zero-area triangles (6 of 2,311
touching coplanar pairs on a turned lattice, all with a zero-area triangle; `collide`
says no while `distance` says 0), and a mesh wholly inside another (`solid` answers
that). Coal is a second opinion; `exact` is the judge.

Two ways to place the meshes:

- own frame (default): the tree is built once in the mesh's frame, Coal moves it with
  its own product R v + t, which may differ from `placing.place_point` in the last bit;
- `placed=True`: the vertices are placed by `placing` and the tree is built from them,
  with identity transforms: Coal sees exactly the float64 vertices of the other
  checkers. Slow (36 ms for 10,000 triangles); the last placement is kept.

Results do not depend on the run: contacts are sorted, and Coal repeats bit for bit.
Coal holds the GIL, so threads do not help; use processes.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from borecheck.core.se3 import check_transform
from borecheck.errors import GeometryError
from borecheck.geometry.mesh.triangle_mesh import TriangleMesh
from borecheck.geometry.triangles.placing import place_mesh

Array = NDArray[np.float64]

GJK_TOLERANCE = 1e-9  # [m]
BREAK_DISTANCE = 0.0  # [m]
_FIRST_CAP = 100_000  # contacts; a larger cap is tried when it is reached


class CoalMesh:
    """A mesh with Coal's box tree over it, built once in the mesh's own frame.

    Attributes:
        mesh: The mesh as given.
    """

    def __init__(self, mesh: TriangleMesh) -> None:
        self.mesh = mesh
        self._own = _build(mesh)
        self._placed: tuple[bytes, Any] | None = None

    def own_frame(self, T_world_mesh: Array) -> tuple[Any, Any]:
        """Coal's model and its transform."""
        import coal

        T = check_transform(T_world_mesh)
        return self._own, coal.Transform3s(T[:3, :3].copy(), T[:3, 3].copy())

    def placed(self, T_world_mesh: Array) -> tuple[Any, Any]:
        """Coal's model of the vertices placed as every checker places them."""
        import coal

        T = check_transform(T_world_mesh)
        key = T.tobytes()
        if self._placed is None or self._placed[0] != key:
            self._placed = (key, _build(place_mesh(T, self.mesh)))
        return self._placed[1], coal.Transform3s.Identity()


@dataclass(frozen=True, eq=False)
class CoalContacts:
    """Every triangle pair that Coal reports.

    Attributes:
        pairs: Triangle numbers (of a, of b), sorted, (k, 2).
        within_tolerance: Whether the pair's triangles are in truth apart (further
            than the margin, if there is one), (k,).
    """

    pairs: NDArray[np.int64]
    within_tolerance: NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class CoalDistance:
    """Coal's distance of two surfaces; 0 when they cross, never a contact test.

    Attributes:
        distance: Smallest distance, [m].
        point_a: Closest point on a, world, (3,), [m].
        point_b: Closest point on b, world, (3,), [m].
        triangle_a: Number of the triangle of a.
        triangle_b: Number of the triangle of b.
    """

    distance: float
    point_a: Array
    point_b: Array
    triangle_a: int
    triangle_b: int


def contacts(
    a: CoalMesh,
    T_world_a: Array,
    b: CoalMesh,
    T_world_b: Array,
    security_margin: float = 0.0,
    *,
    placed: bool = False,
) -> CoalContacts:
    """All triangle pairs of a and b that Coal finds in contact, or within a margin.

    Args:
        a: First mesh.
        T_world_a: Its placement, (4, 4).
        b: Second mesh.
        T_world_b: Its placement, (4, 4).
        security_margin: Distance that counts as contact, [m].
        placed: Give Coal the very vertices that the other checkers see.

    Raises:
        GeometryError: A placement that is no rigid transform, or a negative margin.
    """
    models = _models(a, T_world_a, b, T_world_b, placed)
    found = _collide_all(models, a, b, security_margin)
    rows = sorted((c.b1, c.b2, c.penetration_depth) for c in found)
    pairs = np.array([row[:2] for row in rows], dtype=np.int64).reshape(-1, 2)
    if security_margin > 0.0:
        distances = np.array([row[2] for row in rows], dtype=np.float64)
        return CoalContacts(pairs, distances > security_margin)
    return CoalContacts(pairs, _apart(pairs, a, T_world_a, b, T_world_b))


def first_contact(
    a: CoalMesh,
    T_world_a: Array,
    b: CoalMesh,
    T_world_b: Array,
    security_margin: float = 0.0,
    *,
    placed: bool = False,
) -> bool:
    """Whether Coal finds any contact; stops at the first. Arguments as `contacts`."""
    models = _models(a, T_world_a, b, T_world_b, placed)
    return len(_collide(models, security_margin, cap=1)) > 0


def distance(
    a: CoalMesh,
    T_world_a: Array,
    b: CoalMesh,
    T_world_b: Array,
    *,
    placed: bool = False,
) -> CoalDistance:
    """Coal's smallest distance of the two surfaces and where it is."""
    import coal

    request = coal.DistanceRequest()
    request.gjk_tolerance = GJK_TOLERANCE
    result = coal.DistanceResult()
    coal.distance(*_models(a, T_world_a, b, T_world_b, placed), request, result)
    return CoalDistance(
        distance=max(float(result.min_distance), 0.0),
        point_a=np.array(result.getNearestPoint1(), dtype=np.float64),
        point_b=np.array(result.getNearestPoint2(), dtype=np.float64),
        triangle_a=int(result.b1),
        triangle_b=int(result.b2),
    )


def _build(mesh: TriangleMesh) -> Any:
    import coal

    model = coal.BVHModelOBBRSS()
    codes = [
        model.beginModel(len(mesh.triangles), len(mesh.vertices)),
        model.addVertices(mesh.vertices),
        model.addTriangles(mesh.triangles),
        model.endModel(),
    ]
    if any(codes):
        raise GeometryError(f"mesh {mesh.name}: Coal builds no tree (codes {codes})")
    model.computeLocalAABB()
    return model


def _models(
    a: CoalMesh, T_world_a: Array, b: CoalMesh, T_world_b: Array, placed: bool
) -> tuple[Any, Any, Any, Any]:
    if placed:
        return (*a.placed(T_world_a), *b.placed(T_world_b))
    return (*a.own_frame(T_world_a), *b.own_frame(T_world_b))


def _collide_all(
    models: tuple[Any, Any, Any, Any], a: CoalMesh, b: CoalMesh, margin: float
) -> list[Any]:
    """All contacts: Coal stops at the cap without a word, so a full list is retried."""
    most = len(a.mesh.triangles) * len(b.mesh.triangles)
    cap = _FIRST_CAP
    while True:
        found = _collide(models, margin, cap)
        if len(found) < cap or cap > most:
            return found
        cap *= 16


def _collide(models: tuple[Any, Any, Any, Any], margin: float, cap: int) -> list[Any]:
    import coal

    if not (np.isfinite(margin) and margin >= 0.0):
        raise GeometryError(f"security margin {margin} m is not zero or more")
    request = coal.CollisionRequest()
    request.enable_contact = False
    request.num_max_contacts = cap
    request.gjk_tolerance = GJK_TOLERANCE
    request.break_distance = BREAK_DISTANCE
    request.security_margin = margin
    result = coal.CollisionResult()
    coal.collide(*models, request, result)
    return list(result.getContacts())


def _apart(
    pairs: NDArray[np.int64],
    a: CoalMesh,
    T_world_a: Array,
    b: CoalMesh,
    T_world_b: Array,
) -> NDArray[np.bool_]:
    """Which pairs do not meet, by exact signs on the commonly placed vertices."""
    from borecheck.geometry.triangles.exact import exact

    if len(pairs) == 0:
        return np.zeros(0, dtype=np.bool_)
    placed_a = place_mesh(T_world_a, a.mesh).corners[pairs[:, 0]]
    placed_b = place_mesh(T_world_b, b.mesh).corners[pairs[:, 1]]
    return ~np.asarray(exact(placed_a, placed_b), dtype=np.bool_)
