"""The tree is a strict pre-filter: it finds what all pairs find, wherever they are."""

import logging

import igl.predicates
import numpy as np
import pytest

from borecheck.core import cache
from borecheck.core.se3 import transform
from borecheck.errors import GeometryError, UnknownNameError
from borecheck.geometry.mesh.primitives import box as box_mesh
from borecheck.geometry.tree import kept_trees as bvh
from borecheck.geometry.tree.build import CHILD_ROW, WIDTH
from borecheck.geometry.tree.mesh_tree import MeshTree
from borecheck.geometry.triangles.narrowphase import all_contacts, narrowphase_code
from borecheck.geometry.triangles.placing import place_vertices
from borecheck.geometry.triangles.published import NARROWPHASES

EYE = np.eye(4)


def random_transform(rng, shift=1.0):
    return transform(rng.uniform(-shift, shift, 3), rng.uniform(-np.pi, np.pi, 3))


def soup(rng, count, size=0.1, spread=1.0):
    """Triangles anywhere, of very different sizes and shapes."""
    centres = rng.uniform(-spread, spread, (count, 1, 3))
    scale = size * 10.0 ** rng.uniform(-2.0, 0.5, (count, 1, 1))
    corners = centres + scale * rng.normal(size=(count, 3, 3))
    return corners.reshape(-1, 3), np.arange(3 * count).reshape(-1, 3)


def torus(rings=24, sides=16, major=1.0, minor=0.35):
    """A closed surface with a hole."""
    u, v = np.meshgrid(np.arange(rings), np.arange(sides), indexing="ij")
    a, b = 2 * np.pi * u / rings, 2 * np.pi * v / sides
    radius = major + minor * np.cos(b)
    points = np.stack([radius * np.cos(a), radius * np.sin(a), minor * np.sin(b)], -1)
    i = lambda x, y: (x % rings) * sides + y % sides  # noqa: E731
    one = np.stack([i(u, v), i(u + 1, v), i(u + 1, v + 1)], -1)
    two = np.stack([i(u, v), i(u + 1, v + 1), i(u, v + 1)], -1)
    triangles = np.concatenate([one.reshape(-1, 3), two.reshape(-1, 3)])
    return points.reshape(-1, 3), triangles


def placed(T, vertices):
    return place_vertices(np.ascontiguousarray(T), np.ascontiguousarray(vertices))


def rows(T, vertices, triangles):
    return placed(T, vertices)[triangles].reshape(-1, 9)


def plain_contacts(mesh_a, T_a, mesh_b, T_b, name="exact"):
    code = narrowphase_code(name)
    return all_contacts(code, rows(T_a, *mesh_a), rows(T_b, *mesh_b))


def assert_as_plain(mesh_a, T_a, mesh_b, T_b, name="exact"):
    """Same pairs as without a tree; how many there were."""
    a, b = MeshTree(*mesh_a), MeshTree(*mesh_b)
    expected = plain_contacts(mesh_a, T_a, mesh_b, T_b, name)
    pairs, examined = a.contacts_counted(b, T_a, T_b, name)
    np.testing.assert_array_equal(pairs, expected)
    assert a.first_contact(b, T_a, T_b, name) == (len(expected) > 0)
    assert len(expected) <= examined <= len(mesh_a[1]) * len(mesh_b[1])
    boxes = a.candidates(b, T_a, T_b)
    assert len(boxes) == examined
    keys = boxes[:, 0] * len(mesh_b[1]) + boxes[:, 1]
    assert (np.diff(keys) > 0).all()
    assert np.isin(expected[:, 0] * len(mesh_b[1]) + expected[:, 1], keys).all()
    return len(expected)


@pytest.mark.parametrize("name", NARROWPHASES)
def test_same_pairs_as_all_pairs_for_every_narrowphase(name):
    rng = np.random.default_rng(1)
    a, b = soup(rng, 120), soup(rng, 150)
    found = 0
    for _ in range(10):
        found += assert_as_plain(
            a, random_transform(rng, 0.3), b, random_transform(rng, 0.3), name
        )
    assert found > 20


@pytest.mark.parametrize("other_is_world", [True, False])
def test_same_pairs_as_libigl_exact_predicates(other_is_world):
    rng = np.random.default_rng(2)
    a, b = torus(), torus(30, 12, 0.8, 0.3)
    tree_a, tree_b = MeshTree(*a), MeshTree(*b)
    touching, poses = 0, 60
    for _ in range(poses):
        T_a = random_transform(rng, 0.9)
        T_b = EYE if other_is_world else random_transform(rng, 0.3)
        _, pairs, _ = igl.predicates.find_intersections(
            placed(T_a, a[0]), a[1], placed(T_b, b[0]), b[1]
        )
        expected = pairs[np.lexsort((pairs[:, 1], pairs[:, 0]))]
        np.testing.assert_array_equal(tree_a.contacts(tree_b, T_a, T_b), expected)
        touching += len(expected) > 0
    assert touching >= poses // 2


def test_touching_boxes_have_all_pairs_of_the_closed_triangles():
    """Face to face, edge to edge, corner to corner: every tie is on a box's border."""
    vertices, triangles = box_corners(1.0)
    for shift in ([1, 0, 0], [1, 1, 0], [1, 1, 1], [1, 0.25, 0], [0.5, 0.5, 1]):
        count = assert_as_plain(
            (vertices, triangles), transform(shift), (vertices, triangles), EYE
        )
        assert count > 0


def box_corners(edge):
    mesh = box_mesh("box", np.full(3, edge))
    return np.array(mesh.vertices), np.array(mesh.triangles)


def test_equal_meshes_on_top_of_each_other():
    mesh = torus(8, 6)
    T = transform((3.0, -2.0, 0.5), (0.1, 0.7, -2.0))
    assert assert_as_plain(mesh, T, mesh, T) >= len(mesh[1])


@pytest.mark.parametrize("scale", [1e-6, 1e-3, 1.0, 1e3, 1e5])
@pytest.mark.parametrize("away", [0.0, 1.0, 1e3, 1e6])
@pytest.mark.parametrize("far", [0.0, 1e4])
def test_nothing_is_lost_at_any_size_or_distance_from_the_origin(scale, away, far):
    """Grazing at the last bit, however large the numbers are.

    `away` shifts the mesh within its own frame, `far` shifts the world; both in units
    of the mesh's size. The plane of each triangle goes through corners of the other,
    so contact hangs on roundings much smaller than a float32.
    """
    rng = np.random.default_rng(3)
    found = 0
    for _ in range(6):
        corners = rng.normal(size=(40, 3, 3))
        other = rng.normal(size=(40, 3, 3))
        other[:, 0] = corners[:, 1]  # one shared corner each
        offset = away * np.array([1.0, -0.7, 0.4])
        ids = np.arange(120).reshape(-1, 3)
        a = (scale * (corners + offset).reshape(-1, 3), ids)
        T_a = transform(scale * far * rng.normal(size=3), rng.uniform(-3, 3, 3))
        T_b = random_transform(rng, scale)
        # The other mesh in its own frame, so that in the world it meets the first.
        world = placed(T_a, scale * (other + offset).reshape(-1, 3))
        b = ((world - T_b[:3, 3]) @ T_b[:3, :3], ids)
        found += assert_as_plain(a, T_a, b, T_b)
    assert found > 100


def test_grazing_along_axes_of_long_thin_triangles():
    """Boxes as flat as can be, a hair apart or together."""
    rng = np.random.default_rng(4)
    flat = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1e-3, 0]])
    one = np.arange(3)[None]
    outcomes = set()
    for gap in (0.0, 1e-300, 5e-324, 1e-17, 1e-12, 1e-9, 1e-6):
        for rpy in ((0, 0, 0), rng.uniform(-3, 3, 3)):
            T = transform((0.3, -0.2, 0.1), rpy)
            other = flat + np.array([0.1, 0.0, gap])
            outcomes.add(assert_as_plain((flat, one), T, (other, one), T) > 0)
    assert outcomes == {True, False}


def test_single_triangles_and_many_duplicates():
    triangle = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0]])
    one = (triangle, np.arange(3)[None])
    same = (triangle, np.tile(np.arange(3), (100, 1)))
    T = transform((0.2, 0.1, 0.0), (0.3, 0.0, 0.0))
    assert assert_as_plain(one, EYE, one, T) == 1
    assert assert_as_plain(one, EYE, same, T) == 100
    assert assert_as_plain(same, T, same, EYE) == 10_000
    assert assert_as_plain(one, EYE, one, transform((0, 0, 0.5))) == 0


def test_degenerate_triangles_points_and_segments():
    rng = np.random.default_rng(5)
    grid = rng.integers(-2, 3, (60, 3, 3)).astype(float)
    grid[::4, 1] = grid[::4, 0]  # segments
    grid[::8, 2] = grid[::8, 0]  # points
    ids = np.arange(180).reshape(-1, 3)
    mesh = (grid.reshape(-1, 3), ids)
    assert assert_as_plain(mesh, EYE, mesh, EYE) > 100
    assert assert_as_plain(mesh, transform((1, 0, 1)), mesh, EYE) > 100


def test_trees_that_no_split_can_balance():
    """Sizes in geometric progression: cutting by size peels one triangle at a time."""
    scale = 2.0 ** -np.arange(900.0)[:, None, None]
    corners = scale * np.array([[1.0, 0, 0], [0.9, 0.1, 0], [0.9, 0, 0.1]])
    mesh = (corners.reshape(-1, 3), np.arange(2700).reshape(-1, 3))
    tree = MeshTree(*mesh)
    assert tree.depth < 100
    assert assert_as_plain(mesh, EYE, mesh, EYE) >= 900
    T = transform((0.0, 0.0, 0.0), (0.5, 0.0, 0.0))
    assert assert_as_plain(mesh, T, mesh, EYE) > 0


@pytest.mark.parametrize("offset", [0.0, 1e5])
def test_every_box_holds_its_triangles(offset):
    rng = np.random.default_rng(6)
    vertices, triangles = soup(rng, 500)
    tree = MeshTree(vertices + offset, triangles)
    points = (tree.corners.reshape(-1, 3, 3) - tree.frames[0, :3])[:, None]
    nodes = tree.nodes.astype(np.float64)
    children = tree.nodes.view(np.int32)[:, CHILD_ROW]

    def leaves_below(node):
        below = []
        for slot in range(WIDTH):
            if tree.nodes[node, 3, slot] < 0:
                continue
            child = int(children[node, slot])
            ids = [~child] if child < 0 else leaves_below(child)
            inside = points[ids, 0]
            centre, half = nodes[node, :3, slot], nodes[node, 3:6, slot]
            assert (np.abs(inside - centre) <= half).all()
            below += ids
        return below

    assert sorted(leaves_below(0)) == list(range(500))
    np.testing.assert_array_equal(np.sort(tree.order), np.arange(500))
    np.testing.assert_array_equal(
        tree.corners, (vertices + offset)[triangles[tree.order]].reshape(-1, 9)
    )


def test_inflated_candidates_hold_every_near_pair():
    rng = np.random.default_rng(7)
    a, b = soup(rng, 60, 0.02), soup(rng, 70, 0.02)
    T_a, T_b = random_transform(rng), random_transform(rng, 0.5)
    tree_a, tree_b = MeshTree(*a), MeshTree(*b)
    corners_a = placed(T_a, a[0])[a[1]]
    corners_b = placed(T_b, b[0])[b[1]]
    for inflate in (0.0, 0.01, 0.1, 1.0):
        kept = {tuple(p) for p in tree_a.candidates(tree_b, T_a, T_b, inflate)}
        apart = corners_a[:, None, :, None] - corners_b[None, :, None, :]
        near = np.linalg.norm(apart, axis=-1).min(axis=(2, 3)) <= inflate
        assert {tuple(p) for p in np.argwhere(near)} <= kept
    assert len(kept) > len(tree_a.candidates(tree_b, T_a, T_b))


def test_counts_fall_far_below_all_pairs():
    a, b = torus(40, 30), torus(40, 30)
    T = transform((0.6, 0.3, 0.1), (1.2, 0.3, 0.0))
    pairs, examined = MeshTree(*a).contacts_counted(MeshTree(*b), T, EYE)
    assert len(pairs) > 10
    assert examined < 0.01 * len(a[1]) * len(b[1])


def test_rotation_within_the_tolerance_of_rigid_loses_nothing():
    rng = np.random.default_rng(8)
    mesh = torus()
    T_a, T_b = random_transform(rng, 0.5), random_transform(rng, 0.5)
    T_a[:3, :3] += rng.uniform(-2e-7, 2e-7, (3, 3))
    T_b[:3, :3] += rng.uniform(-2e-7, 2e-7, (3, 3))
    assert assert_as_plain(mesh, T_a, mesh, T_b) > 0


def test_arrays_are_copied_and_any_layout_is_taken():
    vertices, triangles = torus(8, 6)
    expected = MeshTree(vertices, triangles).contacts(
        MeshTree(vertices, triangles), EYE, EYE
    )
    strided = np.repeat(vertices, 2, axis=0)[::2].astype(np.float32)
    a = MeshTree(np.asfortranarray(vertices), triangles.astype(np.int32))
    b = MeshTree(vertices.tolist(), triangles.tolist())
    T = np.asfortranarray(np.eye(4))
    T.setflags(write=False)
    np.testing.assert_array_equal(a.contacts(b, T, EYE.tolist()), expected)
    assert MeshTree(strided, triangles).first_contact(a, T, EYE)
    vertices += 10.0
    np.testing.assert_array_equal(a.contacts(b, T, EYE), expected)


TRIANGLE = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0]])


@pytest.mark.parametrize(
    ("vertices", "triangles", "words"),
    [
        (TRIANGLE[:, :2], [[0, 1, 2]], "vertices have shape"),
        (TRIANGLE, [[0, 1]], "triangles have shape"),
        (TRIANGLE, np.zeros((0, 3), int), "has no triangles"),
        (TRIANGLE, [[0, 1, 3]], "names vertex 3"),
        (TRIANGLE, [[0, 1, -1]], "names vertex"),
        (TRIANGLE, [[0.0, 1.0, 2.0]], "float64"),
        (TRIANGLE * np.nan, [[0, 1, 2]], "not finite"),
        (TRIANGLE * 1e13, [[0, 1, 2]], "exceeds"),
    ],
)
def test_meshes_without_an_answer_are_refused(vertices, triangles, words):
    with pytest.raises(GeometryError, match=words) as error:
        MeshTree(vertices, triangles)
    assert "\n" not in str(error.value)


def test_placements_that_are_not_rigid_are_refused():
    tree = MeshTree(*torus(8, 6))
    mirror = np.diag([1.0, 1.0, -1.0, 1.0])
    stretched = np.diag([1.0, 1.0, 1.001, 1.0])
    for bad in (mirror, stretched, EYE * np.nan, EYE[:3], transform((1e13, 0, 0))):
        with pytest.raises(GeometryError, match="T_self"):
            tree.first_contact(tree, bad, EYE)
        with pytest.raises(GeometryError, match="T_other"):
            tree.contacts(tree, EYE, bad)
    sheared = np.eye(4)
    sheared[3, 0] = 1e-9
    infinite = transform((0, 0, 0))
    infinite[1, 3] = np.inf
    for bad in (sheared, infinite):
        with pytest.raises(GeometryError, match="T_self"):
            tree.candidates(tree, bad, EYE)


def test_unknown_narrowphase_and_bad_inflation_are_refused():
    tree = MeshTree(*torus(8, 6))
    with pytest.raises(UnknownNameError, match="exact"):
        tree.first_contact(tree, EYE, EYE, "exactly")
    for inflate in (-1.0, np.nan, np.inf):
        with pytest.raises(GeometryError, match="inflate"):
            tree.candidates(tree, EYE, EYE, inflate)


@pytest.fixture
def small_cache(tmp_path, monkeypatch):
    monkeypatch.setenv("BORECHECK_CACHE", str(tmp_path))
    monkeypatch.setattr(bvh, "CACHED_TRIANGLES", 1)
    return tmp_path


def same_tree(a, b):
    # References in float32 rows look like NaN: bytes are compared.
    return all(
        np.asarray(getattr(a, name)).tobytes() == np.asarray(getattr(b, name)).tobytes()
        for name in ("nodes", "order", "corners", "frames", "depth")
    )


def test_a_cached_tree_is_the_built_one(small_cache):
    mesh = torus()
    built = MeshTree(*mesh)
    (file,) = small_cache.iterdir()
    before = file.stat().st_mtime_ns
    assert same_tree(MeshTree(*mesh), built)
    assert same_tree(MeshTree(*mesh, cached=False), built)
    assert file.stat().st_mtime_ns == before
    MeshTree(mesh[0] * 2.0, mesh[1])
    assert len(list(small_cache.iterdir())) == 2


def wrong_nodes(nodes):
    """Trees in range whose walk would lose triangles, or read what is not there."""

    def changed(node, row, slot, value):
        other = nodes.copy()
        other[node, row, slot] = value
        return other

    leaf = len(nodes) - 1
    for row in range(3):
        yield changed(0, row, 0, nodes[0, row, 0] + np.float32(0.01))
        yield changed(leaf, row, 0, nodes[leaf, row, 0] - np.float32(0.01))
        yield changed(1, 3 + row, 1, nodes[1, 3 + row, 1] * np.float32(0.9))
    for row, value in ((0, np.nan), (4, np.nan), (4, -1e30), (3, np.inf), (0, 1e30)):
        yield changed(leaf, row, 0, np.float32(value))
    unused = np.argwhere(nodes[:, 3] < 0.0)[0]
    yield changed(unused[0], 3, unused[1], np.float32(-1.0))
    yield changed(unused[0], 3, unused[1], np.float32(1.0))
    # a node that refers to itself, in range and once: no way leads to it from the first
    circle = nodes.copy()
    references = circle.view(np.int32)[:, CHILD_ROW]
    inner = np.argwhere((circle[:, 3] >= 0.0) & (references >= 0))
    down = {int(references[n, s]): (int(n), int(s)) for n, s in inner}
    child = next(c for c, (n, _) in down.items() if n > 0)
    parent = down[child][0]
    first, second = down[parent], down[child]
    references[first], references[second] = child, parent
    yield circle


def test_a_tree_that_does_not_fit_is_built_again(small_cache, caplog):
    mesh = torus()
    built = MeshTree(*mesh)
    (file,) = small_cache.iterdir()
    with np.load(file) as stored:
        arrays = dict(stored)
    references = arrays["nodes"].copy()
    references.view(np.int32)[0, CHILD_ROW, 0] = 10**6
    assert len(arrays["nodes"]) > 10
    for wrong in (
        *({"nodes": nodes} for nodes in wrong_nodes(arrays["nodes"])),
        {"frame": arrays["frame"] * 1.001},
        {"frame": arrays["frame"] * np.nan},
        {"depth": arrays["depth"] + 1},
        {"depth": arrays["depth"] - 1},
        {"order": arrays["order"][::-1]},
        {"nodes": references},
        {"order": arrays["order"][:-1]},
        {"order": np.zeros_like(arrays["order"])},
        {"frame": arrays["frame"][:2]},
        {"depth": np.array(0)},
        {"depth": np.array("deep")},
    ):
        with caplog.at_level(logging.WARNING):
            np.savez(file, **{**arrays, **wrong})
            assert same_tree(MeshTree(*mesh), built)
        assert "built again" in caplog.text
        caplog.clear()
        with caplog.at_level(logging.WARNING):
            assert same_tree(MeshTree(*mesh), built)
        assert not caplog.text


def test_small_meshes_leave_no_files(tmp_path, monkeypatch):
    monkeypatch.setenv("BORECHECK_CACHE", str(tmp_path / "none"))
    MeshTree(*torus())
    assert not cache.cache_folder().exists()
