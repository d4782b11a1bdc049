"""Outside is said where nothing hides: of a way out, or a surface without crossings."""

import numpy as np
import pytest
from numpy.typing import NDArray

from borecheck.core.se3 import transform
from borecheck.geometry.mesh.primitives import box, cylinder, sphere
from borecheck.geometry.mesh.triangle_mesh import TriangleMesh
from borecheck.verify.distance import GroupedMesh
from borecheck.verify.solid import Side, is_embedded, side_of

Array = NDArray[np.float64]


def _block(
    size: float, shift: float = 0.0, *, inside_out: bool = False
) -> TriangleMesh:
    mesh = box("block", [size] * 3).moved(transform([shift, 0.0, 0.0]))
    triangles = mesh.triangles[:, ::-1] if inside_out else mesh.triangles
    return TriangleMesh("block", mesh.vertices, triangles)


def _joined(*meshes: TriangleMesh) -> GroupedMesh:
    starts = np.cumsum([0, *(len(mesh.vertices) for mesh in meshes)])
    triangles = [m.triangles + s for m, s in zip(meshes, starts[:-1], strict=True)]
    vertices = np.concatenate([m.vertices for m in meshes])
    return GroupedMesh(vertices, np.concatenate(triangles))


def _grouped(mesh: TriangleMesh) -> GroupedMesh:
    return GroupedMesh(mesh.vertices, mesh.triangles)


ORIGIN = np.array([0.01, 0.02, 0.03])


@pytest.mark.parametrize(
    ("mesh", "side"),
    [
        (_joined(_block(2.0)), Side.INSIDE),
        (_joined(_block(2.0, inside_out=True)), Side.INSIDE),
        # a room: its walls are solid, what is in it is not
        (_joined(_block(2.0), _block(1.9, inside_out=True)), Side.OUTSIDE),
        # inside out: such a room, or a block in another one
        (_joined(_block(2.0, inside_out=True), _block(1.9)), Side.UNTOLD),
        # drawn on both sides; and as two skins that nobody can tell from that
        (_joined(_block(2.0), _block(2.0, inside_out=True)), Side.UNTOLD),
        (_joined(_block(2.0), _block(2.0 - 1e-7, inside_out=True)), Side.UNTOLD),
        # two blocks that overlap there, one of them inside out
        (_joined(_block(2.0, 0.5), _block(2.0, -0.5, inside_out=True)), Side.UNTOLD),
        (_joined(_block(2.0, 0.5), _block(2.0, -0.5)), Side.INSIDE),
        # a way out is a way out, whatever is beside it
        (_joined(_block(2.0, 3.0), _block(2.0, 3.0, inside_out=True)), Side.OUTSIDE),
        (_joined(_block(2.0, 3.0), _block(2.0, -3.0)), Side.OUTSIDE),
    ],
)
def test_what_a_surface_says_of_a_point(mesh: GroupedMesh, side: Side) -> None:
    assert side_of(ORIGIN, mesh) is side


def test_a_bore_is_outside() -> None:
    """A ring of boxes round the origin: a line leads out along its axis."""
    ring = [
        box("side", [0.2, 1.0, 1.0]).moved(transform(0.6 * np.array([c, s, 0.0]), turn))
        for c, s, turn in ((1, 0, [0, 0, 0]), (-1, 0, [0, 0, 0]),
                           (0, 1, [0, 0, np.pi / 2]), (0, -1, [0, 0, np.pi / 2]))
    ]  # fmt: skip
    assert side_of(ORIGIN, _joined(*ring)) is Side.OUTSIDE


def test_a_room_of_walls_that_cross_is_free_within() -> None:
    """No line leads out, but no wall is round the point, whichever way it is wound."""
    walls = []
    for k in range(3):
        size = np.full(3, 2.2 + 0.03 * k)
        size[k] = 0.2
        for sign in (1.0, -1.0):
            wall = box("wall", size).moved(transform(sign * np.eye(3)[k]))
            walls.append(wall)
    assert side_of(ORIGIN, _joined(*walls)) is Side.OUTSIDE
    back = TriangleMesh("w", walls[0].vertices, walls[0].triangles[:, ::-1])
    assert side_of(ORIGIN, _joined(back, *walls[1:])) is Side.OUTSIDE
    assert side_of(np.array([1.0, 0.1, 0.2]), _joined(back, *walls[1:])) is Side.INSIDE
    # nor does such a room make free what is drawn twice in it
    twice = _block(0.5), _block(0.5, inside_out=True)
    assert side_of(ORIGIN, _joined(*walls, *twice)) is Side.UNTOLD


@pytest.mark.parametrize(
    "mesh", [box("b", [1.0, 2.0, 3.0]), sphere("s", 0.5), cylinder("c", 1e-3, 0.1)]
)
def test_shapes_meet_themselves_nowhere(mesh: TriangleMesh) -> None:
    assert is_embedded(_grouped(mesh))


def test_a_corner_drawn_through_another_wall_is_seen() -> None:
    """A block of which one corner is pulled out through the opposite side."""
    mesh = _block(1.0)
    vertices = mesh.vertices.copy()
    vertices[np.lexsort(vertices.T)[0]] = [0.7, 0.0, 0.0]
    assert not is_embedded(GroupedMesh(vertices, mesh.triangles))


def test_a_fold_onto_its_neighbour_is_seen() -> None:
    """A pyramid whose tip is laid down onto its own base."""
    corners = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0.4, 0.5, 0.3]])
    faces = np.array([[0, 2, 1], [0, 3, 2], [0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4]])
    assert is_embedded(GroupedMesh(corners, faces))
    corners[4, 2] = 0.0
    assert not is_embedded(GroupedMesh(corners, faces))
