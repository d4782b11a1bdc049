import numpy as np
import pytest

from borecheck.core.se3 import axis_rotation
from borecheck.errors import GeometryError
from borecheck.geometry.coal_engine.broadphase import (
    _GROWTH,
    _LEFTOVER,
    PatchBroadphase,
)
from borecheck.geometry.coal_engine.contact import CoalMesh, distance
from borecheck.geometry.mesh.triangle_mesh import TriangleMesh
from borecheck.geometry.triangles.narrowphase import (
    all_contacts,
    contact_pairs,
    narrowphase_code,
)
from borecheck.geometry.triangles.placing import place_mesh

I4 = np.eye(4)
EXACT = narrowphase_code("exact")


def ring(n: int = 48, m: int = 12) -> TriangleMesh:
    """A tube bent to a ring: its own box is mostly hole, like a gantry's."""
    u, v = np.meshgrid(np.arange(n), np.arange(m), indexing="ij")
    a, b = 2 * np.pi * u / n, 2 * np.pi * v / m
    r = 0.5 + 0.1 * np.cos(b)
    points = np.stack([r * np.cos(a), r * np.sin(a), 0.3 * np.sin(b)], axis=-1)
    corner, right = u * m + v, ((u + 1) % n) * m + v
    up, both = u * m + (v + 1) % m, ((u + 1) % n) * m + (v + 1) % m
    first = np.stack([corner, right, both], axis=-1).reshape(-1, 3)
    second = np.stack([corner, both, up], axis=-1).reshape(-1, 3)
    triangles = np.concatenate([first, second])
    return TriangleMesh("ring", points.reshape(-1, 3), triangles)


def beam(length: float, width: float, cuts: int = 24) -> TriangleMesh:
    """A long thin four-sided beam along x."""
    x = np.linspace(-length / 2, length / 2, cuts + 1)
    yz = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]]) * width / 2
    points = np.concatenate(
        [np.insert(yz, 0, at, axis=1) for at in x]
    )  # (4 * (cuts + 1), 3)
    corner = (4 * np.arange(cuts)[:, None] + np.arange(4)).reshape(-1)
    beside = (4 * np.arange(cuts)[:, None] + (np.arange(4) + 1) % 4).reshape(-1)
    sides = np.concatenate(
        [
            np.stack([corner, corner + 4, beside], axis=1),
            np.stack([beside, corner + 4, beside + 4], axis=1),
        ]
    )
    last = 4 * cuts
    caps = [
        [0, 1, 2],
        [0, 2, 3],
        [last, last + 2, last + 1],
        [last, last + 3, last + 2],
    ]
    return TriangleMesh("beam", points, np.concatenate([sides, caps]))


def placement(rng: np.random.Generator, spread: float) -> np.ndarray:
    T = np.eye(4)
    axis = rng.normal(size=3)
    T[:3, :3] = axis_rotation(axis / np.linalg.norm(axis), rng.uniform(0, np.pi))
    T[:3, 3] = rng.uniform(-spread, spread, 3)
    return T


def grazing(rng: np.random.Generator, T: np.ndarray, a: CoalMesh, b: CoalMesh):
    """T moved until a just touches b: at most a micrometre apart or deep."""
    T = T.copy()
    for _ in range(20):
        gap = distance(a, T, b, I4)
        if gap.distance < 1e-9:
            break
        T[:3, 3] += (gap.point_b - gap.point_a) * (1.0 + 1e-12)
    T[:3, 3] += rng.normal(size=3) * rng.choice([0.0, 1e-12, 1e-9, 1e-6])
    return T


def rows(mesh: TriangleMesh, T: np.ndarray) -> np.ndarray:
    return place_mesh(T, mesh).corners.reshape(-1, 9)


def test_strict_pre_filter_over_random_and_grazing_poses() -> None:
    """Candidates tested exactly give the very pairs that all pairs give."""
    rng = np.random.default_rng(7)
    robot, gantry = beam(0.7, 0.03), ring()
    broadphase = PatchBroadphase([robot], [gantry], patch_size=8)
    coal_robot, coal_gantry = CoalMesh(robot), CoalMesh(gantry)
    poses = [placement(rng, 0.4) for _ in range(60)]
    outside = [placement(rng, 1.5) for _ in range(60)]
    poses += [grazing(rng, T, coal_robot, coal_gantry) for T in outside]
    with_pairs = pairs = examined = 0
    for T in poses:
        found = broadphase.candidate_pairs(T[None], I4[None])
        a, b = rows(robot, T), rows(gantry, I4)
        candidates = found.pairs[:, [1, 3]]
        kept = candidates[contact_pairs(EXACT, a, b, candidates)]
        expected = all_contacts(EXACT, a, b)
        np.testing.assert_array_equal(kept, expected)
        assert found.examined == len(found.pairs)
        assert found.examined + found.pruned == len(a) * len(b)
        with_pairs += len(expected) > 0
        pairs += len(expected)
        examined += found.examined
    share = examined / (len(poses) * len(a) * len(b))
    told = (
        f"{with_pairs} of {len(poses)} poses with {pairs} pairs, {share:.2%} examined"
    )
    print(told)  # noqa: T201  (the count that the test stands on, shown by pytest -s)
    assert with_pairs >= len(poses) / 2
    assert share < 0.05


def test_touching_coplanar_faces_are_candidates() -> None:
    """Boxes whose faces coincide exactly, and at the last bit of a turned placement."""
    rng = np.random.default_rng(8)
    block = beam(0.4, 0.2, 4)
    broadphase = PatchBroadphase([block], [block], patch_size=2)
    touching = 0
    for _ in range(30):
        T = placement(rng, 1.0)
        beside = T.copy()
        beside[:3, 3] += T[:3, 1] * 0.2
        found = broadphase.candidate_pairs(beside[None], T[None]).pairs[:, [1, 3]]
        expected = all_contacts(EXACT, rows(block, beside), rows(block, T))
        touching += len(expected) > 0
        assert {tuple(p) for p in expected.tolist()} <= {
            tuple(p) for p in found.tolist()
        }
    assert touching > 15


def test_several_meshes_on_each_side() -> None:
    rng = np.random.default_rng(9)
    robot = [beam(0.7, 0.03), beam(0.3, 0.05, 6)]
    scanner = [ring(24, 8), beam(1.0, 0.2, 10)]
    broadphase = PatchBroadphase(robot, scanner, patch_size=8)
    total = 0
    for _ in range(20):
        T_a = np.stack([placement(rng, 0.4) for _ in robot])
        T_b = np.stack([placement(rng, 0.4) for _ in scanner])
        found = {tuple(p) for p in broadphase.candidate_pairs(T_a, T_b).pairs.tolist()}
        for i, mesh_a in enumerate(robot):
            for j, mesh_b in enumerate(scanner):
                expected = all_contacts(
                    EXACT, rows(mesh_a, T_a[i]), rows(mesh_b, T_b[j])
                )
                assert {(i, a, j, b) for a, b in expected.tolist()} <= found
                total += len(expected)
    assert total > 100


def test_inflated_boxes_keep_every_pair_within_the_distance() -> None:
    rng = np.random.default_rng(10)
    robot, gantry = beam(0.7, 0.03), ring()
    broadphase = PatchBroadphase([robot], [gantry], patch_size=8)
    a, b = CoalMesh(robot), CoalMesh(gantry)
    near = 0
    for _ in range(60):
        T = placement(rng, 1.0)
        gap = distance(a, T, b, I4)
        if gap.distance == 0.0:
            continue
        wide = broadphase.candidate_pairs(T[None], I4[None], gap.distance * (1 + 1e-9))
        closest = [0, gap.triangle_a, 0, gap.triangle_b]
        assert (wide.pairs == closest).all(axis=1).any()
        narrow = broadphase.candidate_pairs(T[None], I4[None])
        assert narrow.examined <= wide.examined
        near += 1
    assert near > 20


def test_nothing_is_rebuilt_and_the_order_of_questions_does_not_matter() -> None:
    rng = np.random.default_rng(11)
    broadphase = PatchBroadphase([beam(0.7, 0.03)], [ring()], patch_size=8)
    ids = dict(broadphase.a.of_id)
    poses = [placement(rng, 0.4) for _ in range(8)]
    first = [broadphase.candidate_pairs(T[None], I4[None]).pairs for T in poses]
    broadphase.candidate_pairs(poses[3][None], I4[None], inflate=0.5)
    for T, before in zip(reversed(poses), reversed(first), strict=True):
        again = broadphase.candidate_pairs(T[None], I4[None]).pairs
        np.testing.assert_array_equal(again, before)
    assert broadphase.a.of_id == ids
    assert sum(len(pairs) for pairs in first) > 0


def test_all_pairs_are_pruned_when_far() -> None:
    broadphase = PatchBroadphase([beam(0.7, 0.03)], [ring()])
    away = np.eye(4)
    away[0, 3] = 10.0
    found = broadphase.candidate_pairs(away[None], I4[None])
    assert (found.examined, found.patch_pairs, found.pairs.shape) == (0, 0, (0, 4))
    inside = broadphase.candidate_pairs(I4[None], I4[None])  # spans the bore
    assert 0 < inside.examined < 0.1 * inside.pruned


def test_nonsense_is_refused() -> None:
    broadphase = PatchBroadphase([beam(0.7, 0.03)], [ring()])
    with pytest.raises(GeometryError, match="placements"):
        broadphase.candidate_pairs(I4, I4[None])
    with pytest.raises(GeometryError, match="finite"):
        broadphase.candidate_pairs(np.full((1, 4, 4), np.nan), I4[None])
    for inflate in (-1.0, float("nan")):
        with pytest.raises(GeometryError, match="grown"):
            broadphase.candidate_pairs(I4[None], I4[None], inflate)
    with pytest.raises(GeometryError, match="no meshes"):
        PatchBroadphase([], [ring()])


def separation(T_a: np.ndarray, T_b: np.ndarray, half_a, half_b) -> float:
    """Separating-axis test of two boxes: below 0 they overlap by that depth."""
    axes = [*T_a[:3, :3].T, *T_b[:3, :3].T]
    crosses = [np.cross(u, v) for u in T_a[:3, :3].T for v in T_b[:3, :3].T]
    axes += [w / np.linalg.norm(w) for w in crosses if np.linalg.norm(w) > 1e-8]
    along = np.array(axes)
    reach_a = np.abs(along @ T_a[:3, :3]) @ half_a
    reach_b = np.abs(along @ T_b[:3, :3]) @ half_b
    apart = np.abs(along @ (T_b[:3, 3] - T_a[:3, 3]))
    return float((apart - reach_a - reach_b).max())


def test_overlapping_boxes_with_parallel_faces_are_never_missed() -> None:
    """The case that Coal's box test misses by default (asserted), never here."""
    import coal

    rng = np.random.default_rng(12)
    overlapping = missed_by_default = 0
    for _ in range(1500):
        half_a, half_b = rng.choice([0.01, 0.05, 0.1], (2, 3))
        T_a = placement(rng, 1.0)
        T_b = T_a.copy()
        steps = rng.choice([0.0, 1.0, -1.0, 0.999, 0.5, 0.3], 3)
        T_b[:3, 3] += T_a[:3, :3] @ (steps * (half_a + half_b) * 0.99)
        if separation(T_a, T_b, half_a, half_b) > -1e-6:
            continue
        overlapping += 1
        boxes = [
            coal.CollisionObject(coal.Box(2 * h), coal.Transform3s(T[:3, :3], T[:3, 3]))
            for h, T in ((half_a, T_a), (half_b, T_b))
        ]
        result = coal.CollisionResult()
        request = coal.CollisionRequest()
        request.enable_contact = False
        missed_by_default += coal.collide(*boxes, request, result) == 0
        request.security_margin = _LEFTOVER
        assert coal.collide(*boxes, request, result) > 0
    told = f"{missed_by_default} of {overlapping} overlapping boxes missed by default"
    print(told)  # noqa: T201  (the reason for the setting, shown by pytest -s)
    assert overlapping > 1000
    assert missed_by_default > 20
    assert _LEFTOVER < _GROWTH
