import numpy as np
import pytest

from borecheck.errors import GeometryError
from borecheck.geometry.mesh.patches import cut
from borecheck.geometry.mesh.triangle_mesh import TriangleMesh


def torus(n: int = 40, m: int = 16, twist: float = 0.3) -> TriangleMesh:
    """A curved surface with a hole, whose own box is mostly empty."""
    u, v = np.meshgrid(np.arange(n), np.arange(m), indexing="ij")
    a, b = 2 * np.pi * u / n, 2 * np.pi * v / m + twist
    r = 1.0 + 0.2 * np.cos(b)
    points = np.stack([r * np.cos(a), r * np.sin(a), 0.2 * np.sin(b)], axis=-1)
    corner = (u % n) * m + (v % m)
    right = ((u + 1) % n) * m + v
    up = u * m + (v + 1) % m
    both = ((u + 1) % n) * m + (v + 1) % m
    first = np.stack([corner, right, both], axis=-1).reshape(-1, 3)
    second = np.stack([corner, both, up], axis=-1).reshape(-1, 3)
    return TriangleMesh("t", points.reshape(-1, 3), np.concatenate([first, second]))


@pytest.mark.parametrize("size", [1, 7, 32, 10_000])
def test_every_triangle_is_in_exactly_one_patch_of_the_size(size: int) -> None:
    mesh = torus()
    patches = cut(mesh, size)
    order = patches.triangle_order
    assert np.array_equal(np.sort(order), np.arange(len(mesh.triangles)))
    lengths = np.diff(patches.offsets)
    assert lengths.min() >= 1
    assert lengths.max() <= size
    assert len(patches) == -(-len(mesh.triangles) // size)  # none wasted
    held = [patches.triangles(p) for p in range(len(patches))]
    assert np.array_equal(np.concatenate(held), order)


@pytest.mark.parametrize("shift", [0.0, 1e6])
def test_boxes_contain_their_patches_without_any_tolerance(shift: float) -> None:
    from fractions import Fraction

    mesh = torus(12, 6)
    mesh = TriangleMesh("far", mesh.vertices + shift, mesh.triangles)
    patches = cut(mesh, 5)
    for p in range(len(patches)):
        corners = mesh.corners[patches.triangles(p)].reshape(-1, 3)
        for corner in corners:
            for axis, half in zip(
                patches.axes[p].T, patches.half_sides[p], strict=True
            ):
                away = [
                    Fraction(float(c)) - Fraction(float(m))
                    for c, m in zip(corner, patches.centers[p], strict=True)
                ]
                along = sum(
                    (Fraction(float(a)) * d for a, d in zip(axis, away, strict=True)),
                    start=Fraction(0),
                )
                assert abs(along) <= Fraction(float(half))


def test_axes_are_rotations() -> None:
    patches = cut(torus(), 16)
    products = np.einsum("pki,pkj->pij", patches.axes, patches.axes)
    np.testing.assert_allclose(
        products, np.eye(3)[None].repeat(len(patches), 0), atol=1e-14
    )
    assert (np.linalg.det(patches.axes) > 0.0).all()


def test_patches_are_compact() -> None:
    """The boxes follow the surface: together far smaller than the box of all."""
    mesh = torus(160, 64)
    whole = cut(mesh, 10**6)
    patches = cut(mesh, 32)
    volume = (8 * patches.half_sides.prod(axis=1)).sum()
    assert len(whole) == 1
    assert volume < 0.2 * 8 * whole.half_sides.prod()


def test_degenerate_meshes_and_equal_meshes() -> None:
    point = TriangleMesh("point", np.ones((3, 3)), [[0, 1, 2]] * 50)
    patches = cut(point, 8)
    assert len(patches) == 7
    assert (patches.half_sides < 1e-14).all()
    again = cut(torus(), 8)
    assert np.array_equal(cut(torus(), 8).triangle_order, again.triangle_order)
    with pytest.raises(GeometryError, match="0 triangles"):
        cut(point, 0)
