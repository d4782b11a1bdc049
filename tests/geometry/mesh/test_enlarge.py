from itertools import product

import numpy as np
import pytest
from scipy.optimize import linprog
from scipy.spatial import ConvexHull

from borecheck.core.se3 import rpy_matrix
from borecheck.errors import GeometryError
from borecheck.geometry.mesh.enlarge import Enlarged, enlarge
from borecheck.geometry.mesh.minkowski import SLIVER
from borecheck.geometry.mesh.triangle_mesh import TriangleMesh
from borecheck.geometry.triangles.narrowphase import all_contacts, narrowphase_code

CUBE = np.array(list(product((-1.0, 1.0), repeat=3)))
TURNED = rpy_matrix(0.3, -0.7, 1.1)
ROUNDING = 1e-13  # [m]; sums of a few numbers around 1
EXACT = narrowphase_code("exact")


def hull_mesh(points: np.ndarray) -> TriangleMesh:
    hull = ConvexHull(points)
    triangles = hull.simplices.copy()
    a, b, c = (points[triangles[:, k]] for k in range(3))
    inward = np.einsum("ij,ij->i", np.cross(b - a, c - a), hull.equations[:, :3]) < 0
    triangles[inward] = triangles[inward][:, ::-1]
    return TriangleMesh("hull", points, triangles)


def box(half: tuple[float, float, float], center=(0.0, 0.0, 0.0)) -> TriangleMesh:
    return hull_mesh(CUBE * half + center)


def together(*meshes: TriangleMesh) -> TriangleMesh:
    starts = np.cumsum([0] + [len(m.vertices) for m in meshes])
    triangles = [m.triangles + at for m, at in zip(meshes, starts, strict=False)]
    vertices = np.concatenate([m.vertices for m in meshes])
    return TriangleMesh("together", vertices, np.concatenate(triangles))


def corner_profile() -> TriangleMesh:
    """An L: closed, one part, not convex."""
    outline = np.array([[0, 0], [2, 0], [2, 1], [1, 1], [1, 2], [0, 2]]) * 0.1
    points = np.concatenate(
        [np.insert(outline, 2, 0.0, axis=1), np.insert(outline, 2, 0.3, axis=1)]
    )
    cap = [[0, 1, 2], [0, 2, 3], [0, 3, 4], [0, 4, 5]]
    bottom = [t[::-1] for t in cap]
    top = [[k + 6 for k in t] for t in cap]
    n = 6
    sides = [[k, (k + 1) % n, (k + 1) % n + n] for k in range(n)]
    sides += [[k, (k + 1) % n + n, k + n] for k in range(n)]
    return TriangleMesh("L", points, bottom + top + sides)


def sphere(radius: float, seed: int = 0, n: int = 60) -> TriangleMesh:
    points = np.random.default_rng(seed).normal(size=(n, 3))
    return hull_mesh(radius * points / np.linalg.norm(points, axis=1, keepdims=True))


def volume(mesh: TriangleMesh) -> float:
    return float(np.linalg.det(mesh.corners).sum() / 6.0)


def is_in_hull(point: np.ndarray, mesh: TriangleMesh) -> bool:
    a, b, c = (mesh.corners[:, k] for k in range(3))
    return bool((np.einsum("ij,ij->i", np.cross(b - a, c - a), point - a) <= 0).all())


def is_in_sum(point: np.ndarray, corners: np.ndarray, margin: float, axes) -> bool:
    """Whether a linear program finds hull point + cube point = point."""
    n = len(corners)
    equations = np.concatenate([corners.T, axes], axis=1)
    equations = np.concatenate([equations, [[1.0] * n + [0.0] * 3]])
    bounds = [(0, None)] * n + [(-margin, margin)] * 3
    found = linprog(np.zeros(n + 3), A_eq=equations, b_eq=[*point, 1], bounds=bounds)
    return bool(found.status == 0)


def hulls_of(enlarged: Enlarged) -> list[TriangleMesh]:
    solids = list(enlarged.solids())
    return solids[1:] if enlarged.part.min() < 0 else solids


CONVEX = {
    "box": box((0.3, 0.2, 0.1)),
    "box far away": box((0.3, 0.2, 0.1), (5.0, -3.0, 2.0)),
    "sphere": sphere(0.4),
    "turned box": TriangleMesh(
        "b", CUBE * (0.3, 0.1, 0.01) @ TURNED.T, box((0.3, 0.1, 0.01)).triangles
    ),
    "inside out": TriangleMesh(
        "i", box((0.3, 0.2, 0.1)).vertices, box((0.3, 0.2, 0.1)).triangles[:, ::-1]
    ),
    "soup": TriangleMesh(
        "s", sphere(0.4).corners.reshape(-1, 3), np.arange(3 * 116).reshape(-1, 3)
    ),
}


@pytest.mark.parametrize("axes", [np.eye(3), TURNED], ids=["body", "turned"])
@pytest.mark.parametrize("name", CONVEX)
def test_convex_part_is_the_exact_sum(name: str, axes: np.ndarray) -> None:
    mesh, margin = CONVEX[name], 0.02
    grown = enlarge(mesh, margin, axes)
    sums = (mesh.vertices[:, None] + margin * CUBE @ axes.T).reshape(-1, 3)
    directions = np.random.default_rng(1).normal(size=(200, 3))
    support = (grown.mesh.vertices @ directions.T).max(axis=0)
    np.testing.assert_allclose(support, (sums @ directions.T).max(axis=0), atol=1e-12)
    assert set(grown.part) == {0}
    assert grown.mesh.is_closed
    center = grown.mesh.vertices.mean(axis=0)
    moved = TriangleMesh("m", grown.mesh.vertices - center, grown.mesh.triangles)
    assert volume(moved) == pytest.approx(ConvexHull(sums).volume, rel=1e-12)


@pytest.mark.parametrize("axes", [np.eye(3), TURNED], ids=["body", "turned"])
@pytest.mark.parametrize(
    "mesh", [box((0.1, 0.1, 0.1)), corner_profile()], ids=lambda mesh: mesh.name
)
def test_random_points_against_a_linear_program(
    mesh: TriangleMesh, axes: np.ndarray
) -> None:
    """Nothing shared with the sweep: points are in the sum or not by another method."""
    margin = 0.05
    hulls = hulls_of(enlarge(mesh, margin, axes))
    rng = np.random.default_rng(2)
    low, high = mesh.bounds[0] - 0.12, mesh.bounds[1] + 0.12
    answers = []
    for point in rng.uniform(low, high, (60, 3)):
        near = any(is_in_sum(point, t, margin, axes) for t in mesh.corners)
        if len(hulls) == 1:
            near = is_in_sum(point, mesh.vertices, margin, axes)
        assert any(is_in_hull(point, hull) for hull in hulls) == near
        answers.append(near)
    assert 10 < sum(answers) < 50


def test_part_that_is_not_convex_keeps_its_surface() -> None:
    mesh = corner_profile()
    assert mesh.is_closed
    grown = enlarge(mesh, 0.01)
    kept = next(iter(grown.solids()))
    assert grown.part.min() == -1
    np.testing.assert_array_equal(
        grown.mesh.corners[grown.part == -1],
        mesh.corners[grown.source[grown.part == -1]],
    )
    assert kept.is_closed
    assert volume(kept) == pytest.approx(volume(mesh))
    assert len(hulls_of(grown)) == len(mesh.triangles)


def random_triangles(rng: np.random.Generator) -> np.ndarray:
    """General, flat along an axis, zero-area, point-like and needle-like triangles."""
    t = rng.normal(size=(80, 3, 3))
    t[10:20, :, rng.integers(3)] = 0.5
    t[20:30, 2] = 0.3 * t[20:30, 0] + 0.7 * t[20:30, 1]
    t[30:35] = t[30:35, :1]
    t[35:40, 1] = t[35:40, 0]
    t[40:50, 1] = t[40:50, 0] + 1e-7 * rng.normal(size=(10, 3))
    t[50:60] *= 1e-12
    t[60:70, :, :2] = t[60:70, :1, :2]  # on a line along z
    return t


def test_every_triangle_alone_is_the_exact_sum() -> None:
    rng = np.random.default_rng(3)
    corners, margin = random_triangles(rng), 0.1
    apart = corners + 100.0 * np.arange(len(corners))[:, None, None] * [1.0, 0, 0]
    soup = TriangleMesh("s", apart.reshape(-1, 3), np.arange(240).reshape(-1, 3))
    grown = enlarge(soup, margin)
    assert sorted(set(grown.source)) == list(range(len(corners)))
    hulls = hulls_of(grown)
    assert len(hulls) == len(corners)
    directions = rng.normal(size=(100, 3))
    for triangle, hull in zip(apart, hulls, strict=True):
        sums = (triangle[:, None] + margin * CUBE).reshape(-1, 3)
        excess = (
            hull.vertices @ directions.T - (sums @ directions.T).max(0, keepdims=True)
        ).max(0)
        size = np.abs(triangle).max() + 1.0
        bound = 8 * SLIVER * size  # a sliver's cube is grown, never shrunk
        assert (excess > -1e-12 * size).all()
        assert (excess < bound).all()
        assert hull.is_closed
        here = TriangleMesh("h", hull.vertices - triangle[0], hull.triangles)
        expected = ConvexHull(sums - triangle[0]).volume
        assert volume(here) == pytest.approx(expected, rel=100 * bound)


def test_flat_plate() -> None:
    """An open sheet has no inside; its sum with the cube has."""
    sheet = TriangleMesh(
        "sheet", [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], [[0, 1, 2], [0, 2, 3]]
    )
    hulls = hulls_of(enlarge(sheet, 0.02))
    assert len(hulls) == 2
    for point, inside in (
        ((0.5, 0.5, 0.019), True),
        ((-0.019, 0.5, -0.019), True),
        ((0.5, 0.5, 0.021), False),
        ((1.021, 0.5, 0.0), False),
    ):
        assert any(is_in_hull(np.array(point), hull) for hull in hulls) == inside


def test_parts_are_grown_for_themselves() -> None:
    mesh = together(box((0.1, 0.1, 0.1)), corner_profile(), sphere(0.1, seed=4))
    far = mesh.vertices + np.repeat([[5.0, 0, 0], [0, 0, 0], [0, 5, 0]], [8, 12, 60], 0)
    grown = enlarge(TriangleMesh("m", far, mesh.triangles), 0.02)
    n_first, n_second = 12, 20
    numbers = np.unique(grown.part)
    assert len(numbers) == 1 + 2 + n_second  # kept surface, two convex sums, hulls
    for number in numbers:
        sources = np.unique(grown.source[grown.part == number])
        kinds = {
            ("L" if n_first <= s < n_first + n_second else "convex") for s in sources
        }
        assert len(kinds) == 1


def test_hollow_body_stays_hollow() -> None:
    outer, inner = box((0.5, 0.5, 0.5)), box((0.4, 0.4, 0.4))
    cavity = TriangleMesh("c", inner.vertices, inner.triangles[:, ::-1])
    grown = enlarge(together(outer, cavity), 0.02)
    assert not any(is_in_hull(np.zeros(3), hull) for hull in hulls_of(grown))
    kept = next(iter(grown.solids()))
    assert volume(kept) == pytest.approx(1.0 - 0.8**3)
    wall = np.array([0.39, 0.0, 0.0])  # within 20 mm of the inner wall
    assert any(is_in_hull(wall, hull) for hull in hulls_of(grown))


def test_rounding_to_float32_leaves_a_body_convex() -> None:
    angle = np.linspace(0, 2 * np.pi, 48, endpoint=False)
    ring = np.stack([0.05 * np.cos(angle), 0.05 * np.sin(angle)], axis=1)
    heights = np.linspace(0, 0.5, 6)
    points = np.concatenate([np.insert(ring, 2, h, axis=1) for h in heights])
    k = np.arange(48)
    sides = []
    for level in range(5):
        a, b = 48 * level + k, 48 * level + (k + 1) % 48
        sides += [np.stack([a, b, b + 48], 1), np.stack([a, b + 48, a + 48], 1)]
    caps = [[0, i + 1, i] for i in range(1, 47)]
    caps += [[240, 240 + i, 241 + i] for i in range(1, 47)]
    turned = (points @ TURNED.T + [0.3, -0.8, 0.5]).astype(np.float32)
    cylinder = TriangleMesh("c", turned, np.concatenate([*sides, caps]))
    assert cylinder.is_closed
    grown = enlarge(cylinder, 0.02)
    assert set(grown.part) == {0}
    assert len(grown.mesh.triangles) < 2 * len(cylinder.triangles)
    dented = turned.astype(np.float64)
    dented[100] = dented[100] * 0.999 + dented.mean(axis=0) * 0.001  # 50 um deep
    dent = enlarge(TriangleMesh("d", dented, cylinder.triangles), 0.02)
    assert dent.part.min() == -1


@pytest.mark.parametrize("axes", [np.eye(3), TURNED], ids=["body", "turned"])
def test_source_is_the_triangle_from_which_it_grew(axes: np.ndarray) -> None:
    mesh, margin = together(sphere(0.3), corner_profile()), 0.02
    grown = enlarge(mesh, margin, axes)
    grown_rows = grown.part >= 0
    corners = grown.mesh.corners[grown_rows] @ axes
    origin = mesh.corners[grown.source[grown_rows]] @ axes
    away = np.abs(corners[:, :, None] - origin[:, None]).max(axis=3)  # (m, 3, 3)
    assert np.abs(away.min(axis=2) - margin).max() < ROUNDING


def test_margin_counts_along_the_axes_as_the_paper_has_it() -> None:
    """A corner 19 mm off on every axis is 33 mm away and still within 20 mm."""
    part = enlarge(box((0.1, 0.1, 0.1)), 0.02).mesh.corners.reshape(-1, 9)
    for offset, hit in (
        ((0.019, 0.0, 0.0), True),
        ((0.021, 0.0, 0.0), False),
        ((0.019, 0.019, 0.019), True),
        ((0.019, 0.019, 0.021), False),
    ):
        obstacle = box((0.1, 0.1, 0.1), tuple(0.2 * (o > 0) + o for o in offset))
        pairs = all_contacts(EXACT, part, obstacle.corners.reshape(-1, 9))
        assert (len(pairs) > 0) == hit


def test_axes_typed_with_few_digits() -> None:
    """A rotation rounded in a file is still one, and the sum is exact in its frame."""
    R_world_mesh = np.round(TURNED, 7)
    mesh = sphere(0.4)
    grown = enlarge(mesh, 0.02, R_world_mesh.T).mesh.vertices @ R_world_mesh.T
    placed = mesh.vertices @ R_world_mesh.T
    for axis in range(3):
        assert np.ptp(grown[:, axis]) == pytest.approx(
            np.ptp(placed[:, axis]) + 0.04, abs=ROUNDING
        )


@pytest.mark.parametrize(
    "mesh", [box((0.1, 0.1, 0.1)), corner_profile()], ids=lambda mesh: mesh.name
)
def test_small_obstacle_between_part_and_sum_is_seen_by_containment(
    mesh: TriangleMesh,
) -> None:
    """A screw 10 mm above the part: no triangle of its 20 mm sum meets the screw."""
    from borecheck.geometry.triangles.solid import contained

    center = [mesh.bounds[0][0] + 0.05, mesh.bounds[0][1] + 0.05, mesh.bounds[1][2]]
    screw = box((0.001, 0.001, 0.001), tuple(np.add(center, [0.011, -0.007, 0.010])))
    grown = enlarge(mesh, 0.02)
    hulls = grown.mesh.corners[grown.part >= 0].reshape(-1, 9)
    meets = len(all_contacts(EXACT, hulls, screw.corners.reshape(-1, 9))) > 0
    if mesh.name == "hull":  # convex: one surface, 9 mm away from the screw
        assert not meets
    assert contained(mesh, screw).kind == "none"
    near = list(grown.solids(screw.bounds))
    assert 0 < len(near) <= len(list(grown.solids()))
    inside = [contained(solid, screw).kind == "b_in_a" for solid in near]
    assert any(inside) or meets


def test_nonsense_is_refused() -> None:
    mesh = box((0.1, 0.1, 0.1))
    for margin in (0.0, -0.01, float("nan"), float("inf")):
        with pytest.raises(GeometryError, match="margin"):
            enlarge(mesh, margin)
    with pytest.raises(GeometryError, match="orthonormal"):
        enlarge(mesh, 0.02, 2 * np.eye(3))
    with pytest.raises(GeometryError, match="finite"):
        enlarge(mesh, 0.02, np.full((3, 3), np.nan))
