"""Solids in solids by the compiled look: what `triangles.solid` says, pair by pair."""

from functools import cache

import numpy as np
import pytest
import trimesh

from borecheck.core.se3 import transform
from borecheck.geometry.mesh.primitives import box
from borecheck.geometry.mesh.triangle_mesh import TriangleMesh
from borecheck.geometry.surfaces import Surface
from borecheck.geometry.tree.holding import (
    CANCELS,
    HELD,
    IN_BOX,
    IN_DOUBT,
    MIGHT_HOLD,
    NOT_ASKED,
    NOTHING,
    OPEN,
    TELLS,
    Solids,
    holding,
    witnesses,
)
from borecheck.geometry.tree.many_links import MovingLinks
from borecheck.geometry.tree.rays import placed_crossings
from borecheck.geometry.triangles.placing import place_mesh
from borecheck.geometry.triangles.solid import contained
from borecheck.geometry.triangles.topology import topology
from borecheck.geometry.triangles.winding import ON_SURFACE, crossings

FAR = 9.0


def joined(name, *meshes):
    """Meshes as one, each a component."""
    vertices = np.concatenate([m.vertices for m in meshes])
    starts = np.cumsum([0, *(len(m.vertices) for m in meshes[:-1])])
    triangles = [m.triangles + k for m, k in zip(meshes, starts, strict=True)]
    return TriangleMesh(name, vertices, np.concatenate(triangles))


def shifted(mesh, *by):
    return TriangleMesh(mesh.name, mesh.vertices + np.array(by), mesh.triangles)


def turned_out(mesh):
    return TriangleMesh(mesh.name, mesh.vertices, mesh.triangles[:, ::-1])


def ball_of(name, radius):
    """A coarse ball: 80 triangles."""
    mesh = trimesh.creation.icosphere(1, radius)
    return TriangleMesh(name, np.array(mesh.vertices), np.array(mesh.faces))


@cache
def shapes():
    """Small and large, in two pieces, hollow, open, drawn twice."""
    ball, speck = ball_of("ball", 0.3), ball_of("speck", 0.01)
    whole = box("box", (0.5, 0.4, 0.3))
    hollow = joined("hollow", ball, turned_out(ball_of("inner", 0.2)))
    return [
        speck,
        joined("two", speck, shifted(speck, 0.08, 0.0, 0.0)),
        box("needle", (0.004, 0.004, 0.15)),
        ball,
        hollow,
        TriangleMesh("open", whole.vertices, whole.triangles[:-1]),
        joined("twice", whole, turned_out(whole)),
        joined("crossing", whole, shifted(whole, 0.1, 0.1, 0.1)),
    ]


def asked(meshes, others, placements, T_others, count=8):
    """Codes (n, pairs) of moving meshes against others at rest."""
    surfaces, standing = [Surface(m) for m in meshes], [Surface(m) for m in others]
    moving = MovingLinks.against(
        [s.tree for s in surfaces], [s.tree for s in standing], T_others
    )
    a = Solids(meshes, [s.topology for s in surfaces])
    b = Solids(others, [s.topology for s in standing])
    settled = np.zeros(len(placements), bool)
    while True:
        codes = np.zeros((len(placements), len(moving.pairs)), np.int8)
        asks = holding(
            moving.book.entries, a.arrays, b.arrays, placements,
            moving.T_world_others, False, count, False, settled, codes,
        )  # fmt: skip
        if not asks:
            return codes, moving
        assert a.answer() | b.answer()


def random_placements(rng, count, reach):
    return np.array(
        [[transform(rng.uniform(-reach, reach, 3), rng.uniform(-3, 3, 3))]
         for _ in range(count)]
    )  # fmt: skip


@pytest.mark.parametrize("k", range(len(shapes())))
@pytest.mark.parametrize("turned", [False, True])
def test_random_placements_of_each_against_each(k, turned, rng):
    """HELD and NOTHING are what the solid test says; its unknown is no NOTHING.

    Only of placements whose surfaces do not meet, which both ask for.
    """
    meshes = shapes()
    mesh, known = meshes[k], [topology(m) for m in meshes]
    T_others = None
    if turned:
        T_others = np.array(
            [
                transform(rng.uniform(-0.1, 0.1, 3), rng.uniform(-3, 3, 3))
                for _ in meshes
            ]
        )
    placements = random_placements(rng, 300, 0.35)
    codes, _ = asked([mesh], meshes, placements, T_others)
    alone = [
        MovingLinks.against(
            [Surface(mesh).tree],
            [Surface(other).tree],
            None if T_others is None else T_others[j : j + 1],
        ).first_contacts(placements)
        for j, other in enumerate(meshes)
    ]
    seen = 0
    for i, row in enumerate(codes):
        placed = place_mesh(placements[i, 0], mesh)
        for j, other in enumerate(meshes):
            if alone[j][i]:
                continue
            if (row[:j] == HELD).any():
                break  # what comes after is not asked
            stands = other if T_others is None else place_mesh(T_others[j], other)
            said = contained(placed, stands, known[k], known[j]).kind
            code = row[j]
            seen += 1
            if said in ("a_in_b", "b_in_a"):
                assert code == HELD
            elif said == "unknown":
                assert code in (IN_BOX, IN_DOUBT, MIGHT_HOLD)
            else:
                assert code in (NOTHING, IN_BOX, IN_DOUBT, MIGHT_HOLD)
                if known[k].is_closed and known[j].is_closed:
                    assert code in (NOTHING, IN_DOUBT)
    assert seen > 100


def test_rays_through_the_tree_cross_what_rays_past_all_triangles_cross(rng):
    mesh = joined(
        "m", *(shifted(ball_of("s", 0.2), *rng.uniform(-0.3, 0.3, 3)) for _ in range(6))
    )
    tree = Surface(mesh).tree
    stack = np.zeros(8 * (tree.depth + 2), np.int64)
    children = tree.nodes.view(np.int32)
    counted = set()
    for k in range(300):
        T = (
            np.eye(4)
            if k % 3 == 0
            else transform(rng.uniform(-1, 1, 3), rng.uniform(-3, 3, 3))
        )
        placed = place_mesh(T, mesh)
        p = tuple(placed.vertices.mean(axis=0) + rng.uniform(-0.4, 0.4, 3))
        if k % 10 == 0:
            p = tuple(placed.corners[k, 0])
        M = (*T[:3, :3].ravel(), *T[:3, 3])
        M = tuple(float(x) for x in M)
        found = placed_crossings(
            p, tree.nodes, children, tree.corners, tree.frames, 0,
            np.ascontiguousarray(T[:3]), M, bool((np.eye(4) == T).all()), stack,
        )  # fmt: skip
        expected = crossings(p, placed.corners.reshape(-1, 9))
        if expected[0] == ON_SURFACE:
            assert found[0] == ON_SURFACE
        else:
            assert found == expected
        counted.add(expected[0])
    assert {ON_SURFACE, 0, 1, 2} <= counted


def test_whether_winding_tells_is_found_out_only_when_asked():
    ring = joined("ring", box("a", (1.0, 1.0, 1.0)), box("b", (3.0, 3.0, 3.0)))
    far = transform((FAR, 0.0, 0.0), (0.0, 0.0, 0.0))[None, None]
    speck = ball_of("speck", 0.01)
    solids = Solids([ring], [topology(ring)])
    assert solids.kinds.tolist() == [NOT_ASKED]
    assert not solids.answer()
    codes, _ = asked([speck], [ring], far, None)
    assert codes.tolist() == [[NOTHING]]
    open_box = TriangleMesh("open", ring.vertices, ring.triangles[:-1])
    cancel = joined("twice", box("a", (1.0,) * 3), turned_out(box("a", (1.0,) * 3)))
    for mesh, kind in ((open_box, OPEN), (cancel, CANCELS), (ring, TELLS)):
        solids = Solids([mesh], [topology(mesh)])
        solids.kinds[solids.kinds == NOT_ASKED] = 4
        solids.answer()
        assert solids.kinds.tolist() == [kind]


def test_witnesses_are_corners_of_their_component_the_first_and_the_extreme():
    parts = [shifted(box("a", (1.0, 2.0, 3.0)), 5.0, 0.0, 0.0), ball_of("b", 0.2)]
    mesh = joined("m", *parts)
    known = topology(mesh)
    found = witnesses(mesh, known)
    assert found.shape == (2, 8, 3)
    for k in range(2):
        corners = mesh.corners[known.component == k].reshape(-1, 3)
        assert (found[k, 0] == corners[0]).all()
        assert all((corners == point).all(axis=1).any() for point in found[k])
        np.testing.assert_array_equal(found[k].min(axis=0), corners.min(axis=0))
        np.testing.assert_array_equal(found[k].max(axis=0), corners.max(axis=0))


def test_one_witness_is_enough_where_surfaces_may_meet_unseen():
    """A rod half in a box: asked of all corners it cannot be inside, of one it is."""
    rod, room = box("rod", (0.02, 0.02, 1.0)), box("room", (0.3, 0.3, 0.3))
    first = rod.vertices[rod.triangles[0, 0]]
    T = transform(-first, (0.0, 0.0, 0.0))[None, None]
    assert asked([rod], [room], T, None)[0].tolist() == [[NOTHING]]
    assert asked([rod], [room], T, None, count=1)[0].tolist() == [[HELD]]


def test_a_settled_pose_is_left_out():
    speck, room = ball_of("speck", 0.01), box("room", (0.3, 0.3, 0.3))
    inside = np.tile(np.eye(4), (3, 1, 1, 1))
    a, b = Solids([speck], [topology(speck)]), Solids([room], [topology(room)])
    moving = MovingLinks.against([Surface(speck).tree], [Surface(room).tree])
    codes = np.zeros((3, 1), np.int8)
    settled = np.array([True, False, True])
    holding(
        moving.book.entries, a.arrays, b.arrays, inside, moving.T_world_others,
        False, 8, False, settled, codes,
    )  # fmt: skip
    assert codes[:, 0].tolist() == [NOTHING, HELD, NOTHING]
