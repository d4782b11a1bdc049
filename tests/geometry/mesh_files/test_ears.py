from pathlib import Path

import numpy as np
import pytest

from borecheck.core.se3 import rpy_matrix
from borecheck.geometry.mesh_files.ears import cut_ears
from borecheck.geometry.mesh_files.reading import read_mesh

TURNED = rpy_matrix(0.4, 1.0, -2.0)


def star(rng: np.random.Generator, n: int) -> np.ndarray:
    """A jagged polygon around the origin, anticlockwise, most of its corners reflex."""
    angle = np.sort(rng.uniform(0, 2 * np.pi, n))
    angle = np.linspace(0, 2 * np.pi, n, endpoint=False) + 0.2 * angle / n
    radius = rng.uniform(0.2, 1.0, n)
    return np.stack([radius * np.cos(angle), radius * np.sin(angle)], axis=1)


def area(flat: np.ndarray) -> float:
    x, y = flat.T
    return float((x * np.roll(y, -1) - np.roll(x, -1) * y).sum() / 2)


@pytest.mark.parametrize("n", [4, 5, 8, 37])
def test_triangles_cover_the_polygon_exactly(n: int) -> None:
    """All wound as the polygon, their areas add up to it: no overlap and no gap."""
    rng = np.random.default_rng(n)
    for _ in range(20):
        flat = star(rng, n)
        points = np.insert(flat, 2, 0.3, axis=1) @ TURNED.T
        triangles = cut_ears(points)
        assert triangles is not None
        assert len(triangles) == n - 2
        areas = [area(flat[list(triangle)]) for triangle in triangles]
        assert min(areas) >= 0.0
        assert sum(areas) == pytest.approx(area(flat), rel=1e-12)
        assert {k for triangle in triangles for k in triangle} == set(range(n))


def test_outline_that_crosses_itself_has_no_ears() -> None:
    bow_tie = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [1.0, 1, 0]])
    assert cut_ears(bow_tie) is None
    assert cut_ears(np.full((5, 3), np.nan)) is None
    assert cut_ears(np.zeros((300, 3))) is None


def test_arrow_in_a_file_is_cut_along_its_inner_diagonal(tmp_path: Path) -> None:
    path = tmp_path / "arrow.obj"
    path.write_text("v 0 0 0\nv 2 1 0\nv 0 2 0\nv .5 1 0\nf 1 2 3 4\nf 2 3 4 1\n")
    mesh = read_mesh(path)
    normals = np.cross(
        mesh.corners[:, 1] - mesh.corners[:, 0], mesh.corners[:, 2] - mesh.corners[:, 0]
    )
    assert (normals[:, 2] > 0.0).all()
    assert normals[:2, 2].sum() == normals[2:, 2].sum() == 3.0
