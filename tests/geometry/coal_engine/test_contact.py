import coal
import numpy as np
import pytest

from borecheck.core.se3 import axis_rotation, transform
from borecheck.errors import GeometryError
from borecheck.geometry.coal_engine.contact import (
    GJK_TOLERANCE,
    CoalMesh,
    contacts,
    distance,
    first_contact,
)
from borecheck.geometry.mesh.triangle_mesh import TriangleMesh
from borecheck.geometry.triangles.exact import exact
from borecheck.geometry.triangles.narrowphase import all_contacts, narrowphase_code
from borecheck.geometry.triangles.placing import place_mesh

I4 = np.eye(4)
EXACT = narrowphase_code("exact")
ONE = [[0, 1, 2]]


def placement(rng: np.random.Generator, spread: float) -> np.ndarray:
    T = np.eye(4)
    axis = rng.normal(size=3)
    T[:3, :3] = axis_rotation(axis / np.linalg.norm(axis), rng.uniform(0, np.pi))
    T[:3, 3] = rng.uniform(-spread, spread, 3)
    return T


def soup(rng: np.random.Generator, n: int, size: float = 0.3) -> TriangleMesh:
    centers = rng.uniform(-1, 1, (n, 1, 3))
    corners = centers + rng.normal(size=(n, 3, 3)) * size
    return TriangleMesh("soup", corners.reshape(-1, 3), np.arange(3 * n).reshape(-1, 3))


def exact_pairs(a: TriangleMesh, T_a: np.ndarray, b: TriangleMesh, T_b: np.ndarray):
    placed = [place_mesh(T, m).corners.reshape(-1, 9) for T, m in ((T_a, a), (T_b, b))]
    return all_contacts(EXACT, *placed)


def triangle(*corners: tuple[float, float, float]) -> CoalMesh:
    return CoalMesh(TriangleMesh("t", np.array(corners), ONE))


FLAT = triangle((0, 0, 0), (1, 0, 0), (0, 1, 0))


def above(gap: float) -> CoalMesh:
    return triangle((0.2, 0.2, gap), (0.3, 0.2, 1), (0.2, 0.3, 1))


@pytest.mark.parametrize("placed", [False, True])
def test_pairs_are_those_of_the_exact_test(placed: bool) -> None:
    rng = np.random.default_rng(1)
    a, b = soup(rng, 60), soup(rng, 80)
    mesh_a, mesh_b = CoalMesh(a), CoalMesh(b)
    total = 0
    for _ in range(10):
        T_a, T_b = placement(rng, 0.5), placement(rng, 0.5)
        expected = exact_pairs(a, T_a, b, T_b)
        found = contacts(mesh_a, T_a, mesh_b, T_b, placed=placed)
        true_pairs = found.pairs[~found.within_tolerance]
        np.testing.assert_array_equal(true_pairs, expected)
        assert first_contact(mesh_a, T_a, mesh_b, T_b, placed=placed) == (
            len(found.pairs) > 0
        )
        total += len(expected)
    assert total > 300  # there was contact to find


def test_placed_gives_coal_the_vertices_that_all_checkers_see() -> None:
    rng = np.random.default_rng(2)
    mesh = soup(rng, 5)
    T = placement(rng, 1.0)
    coal_mesh = CoalMesh(mesh)
    model, transform_seen = coal_mesh.placed(T)
    with pytest.warns(DeprecationWarning, match="deprecated"):  # the only reader
        seen = np.array([model.vertices(k) for k in range(len(mesh.vertices))])
    np.testing.assert_array_equal(seen, place_mesh(T, mesh).vertices)
    assert transform_seen.isIdentity()
    assert coal_mesh.placed(T.copy())[0] is model  # kept, as long as nothing moves


def test_gaps_that_default_settings_call_contact() -> None:
    """Small triangles a fraction of a micrometre apart: Coal's default tolerance."""
    rng = np.random.default_rng(3)
    apart = default = ours = 0
    for _ in range(600):
        a, b = (TriangleMesh("t", v, ONE) for v in rng.normal(size=(2, 3, 3)) * 2e-5)
        if exact(a.corners, b.corners)[0]:
            continue
        apart += 1
        mesh_a, mesh_b = CoalMesh(a), CoalMesh(b)
        models = (*mesh_a.own_frame(I4), *mesh_b.own_frame(I4))
        request = coal.CollisionRequest()
        default += coal.collide(*models, request, coal.CollisionResult()) > 0
        ours += first_contact(mesh_a, I4, mesh_b, I4)
    told = f"{apart} pairs apart: contacts by default {default}, here {ours}"
    print(told)  # noqa: T201  (the measured number, shown by pytest -s)
    assert default > 10  # the settings matter
    assert ours == 0


def test_contact_within_tolerance_is_labelled() -> None:
    gap = 1e-13  # below Coal's collision threshold of 1e-12
    assert gap < GJK_TOLERANCE
    found = contacts(FLAT, I4, above(gap), I4)
    assert found.pairs.tolist() == [[0, 0]]
    assert found.within_tolerance.tolist() == [True]
    touching = contacts(FLAT, I4, above(0.0), I4)
    assert touching.pairs.tolist() == [[0, 0]]
    assert touching.within_tolerance.tolist() == [False]
    assert len(contacts(FLAT, I4, above(1e-8), I4).pairs) == 0


def test_security_margin_is_a_distance() -> None:
    assert first_contact(FLAT, I4, above(0.009), I4, security_margin=0.01)
    assert not first_contact(FLAT, I4, above(0.011), I4, security_margin=0.01)
    found = contacts(FLAT, I4, above(0.009), I4, security_margin=0.01)
    assert found.pairs.tolist() == [[0, 0]]
    assert found.within_tolerance.tolist() == [False]


def test_security_margin_against_distance_on_meshes() -> None:
    """coal#755 reported lost contacts; with this tree there are none."""
    rng = np.random.default_rng(4)
    a, b = CoalMesh(soup(rng, 20)), CoalMesh(soup(rng, 20))
    answers = []
    for _ in range(60):
        T = placement(rng, 3.0)
        d = distance(a, T, b, I4).distance
        margin = rng.uniform(0.0, 1.0)
        if abs(d - margin) > 1e-6:  # GJK_TOLERANCE, with room
            answers.append(first_contact(a, T, b, I4, margin))
            assert answers[-1] == (d < margin)
    assert 10 < sum(answers) < len(answers) - 10


def test_distance_and_its_points() -> None:
    found = distance(
        FLAT, I4, above(0.25), transform(np.array([0.0, 0, 1]), np.zeros(3))
    )
    assert found.distance == pytest.approx(1.25, abs=1e-8)
    np.testing.assert_allclose(found.point_a, [0.2, 0.2, 0.0], atol=1e-7)
    np.testing.assert_allclose(found.point_b, [0.2, 0.2, 1.25], atol=1e-7)
    assert (found.triangle_a, found.triangle_b) == (0, 0)
    assert distance(FLAT, I4, above(-0.1), I4).distance == 0.0


def test_more_contacts_than_the_first_cap(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("borecheck.geometry.coal_engine.contact._FIRST_CAP", 3)
    rng = np.random.default_rng(5)
    a, b = soup(rng, 40, 1.0), soup(rng, 40, 1.0)
    found = contacts(CoalMesh(a), I4, CoalMesh(b), I4)
    expected = exact_pairs(a, I4, b, I4)
    assert len(expected) > 100
    np.testing.assert_array_equal(found.pairs[~found.within_tolerance], expected)


def test_every_pair_in_contact_at_the_cap(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("borecheck.geometry.coal_engine.contact._FIRST_CAP", 4)
    flat = TriangleMesh("f", FLAT.mesh.vertices, [[0, 1, 2]] * 2)
    found = contacts(CoalMesh(flat), I4, CoalMesh(flat), I4)
    assert found.pairs.tolist() == [[0, 0], [0, 1], [1, 0], [1, 1]]


def test_results_repeat_bit_for_bit() -> None:
    rng = np.random.default_rng(6)
    a, b, T = soup(rng, 50), soup(rng, 50), placement(rng, 0.5)
    first = contacts(CoalMesh(a), T, CoalMesh(b), I4)
    again = contacts(CoalMesh(a), T, CoalMesh(b), I4)
    assert len(first.pairs) > 0
    np.testing.assert_array_equal(first.pairs, again.pairs)


def test_zero_area_triangles_count() -> None:
    segment = triangle((0.2, 0.2, -1), (0.2, 0.2, 0), (0.2, 0.2, 1))
    assert first_contact(segment, I4, FLAT, I4)
    point = triangle((0.2, 0.2, 0), (0.2, 0.2, 0), (0.2, 0.2, 0))
    assert first_contact(point, I4, FLAT, I4)


def test_nonsense_is_refused() -> None:
    broken = np.eye(4)
    broken[0, 3] = np.nan
    with pytest.raises(GeometryError, match="finite"):
        first_contact(FLAT, broken, FLAT, I4)
    with pytest.raises(GeometryError, match="rigid"):
        contacts(FLAT, np.diag([2.0, 1, 1, 1]), FLAT, I4, placed=True)
    for margin in (-0.1, float("nan")):
        with pytest.raises(GeometryError, match="margin"):
            contacts(FLAT, I4, FLAT, I4, security_margin=margin)
