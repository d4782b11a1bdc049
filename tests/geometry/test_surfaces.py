"""Prunings are strict pre-filters: the same triangle pairs, in fewer tests."""

import gc
import sys
import weakref

import numpy as np
import pytest

from borecheck.core.se3 import transform
from borecheck.errors import GeometryError, UnknownNameError, UsageError
from borecheck.geometry.mesh.primitives import box
from borecheck.geometry.mesh.triangle_mesh import TriangleMesh
from borecheck.geometry.surfaces import (
    CHECKERS,
    PRUNINGS,
    Surface,
    check_pruning,
    checker_name,
    contacts,
    surface,
)

WORLD = np.eye(4)
POSES = 6

# Steps by which a clear pose is driven towards contact, and how often it is halved:
# 2 rad / 2^40 is about 1e-12, a grazing pose.
HALVINGS = 40


def in_contact(robot, scene, q):
    placements = robot.placements(q)
    return any(
        len(contacts(surface(p.mesh), placements[p.link], surface(o.mesh), WORLD).pairs)
        for p in robot.parts
        for o in scene.obstacles
    )


def grazing(robot, scene, clear, touching):
    """A pose in contact so near to a clear one that it only just touches."""
    for _ in range(HALVINGS):
        middle = (clear + touching) / 2
        if in_contact(robot, scene, middle):
            touching = middle
        else:
            clear = middle
    return touching


@pytest.fixture(scope="module")
def poses(zerobot, ct_gantry):
    """Random poses, and grazing ones between the home and those that touch."""
    rng = np.random.default_rng(3)
    drawn = zerobot.model.random_configurations(rng, POSES)
    touching = [q for q in drawn if in_contact(zerobot, ct_gantry, q)]
    near = [grazing(zerobot, ct_gantry, zerobot.home, q) for q in touching[:3]]
    return [*drawn, *near]


def all_found(robot, scene, q, checker, pruning):
    """Contacts of every pair of surfaces, as sets with the pair's name."""
    placements = robot.placements(q)
    found, examined, total = {}, 0, 0
    for part in robot.parts:
        a = surface(part.mesh)
        for obstacle in scene.obstacles:
            b = surface(obstacle.mesh)
            answer = contacts(a, placements[part.link], b, WORLD, checker, pruning)
            found[part.mesh.name, obstacle.name] = answer.pairs
            examined += answer.examined
            total += a.count * b.count
            assert 0 <= answer.examined <= a.count * b.count
    return found, examined, total


@pytest.mark.parametrize("checker", ["exact", "two-sided", "paper:robot"])
def test_prunings_give_the_same_pairs(zerobot, ct_gantry, poses, checker, capsys):
    """Random and grazing poses of which at least half have triangle pairs."""
    with_pairs, pairs = 0, 0
    examined = dict.fromkeys(PRUNINGS, 0)
    for q in poses:
        answers = {}
        for pruning in PRUNINGS:
            found, count, _ = all_found(zerobot, ct_gantry, q, checker, pruning)
            answers[pruning] = found
            examined[pruning] += count
        for pruning in ("coal", "bvh"):
            for name, expected in answers["none"].items():
                assert np.array_equal(answers[pruning][name], expected), (name, q)
        number = sum(len(found) for found in answers["none"].values())
        with_pairs += number > 0
        pairs += number
    with capsys.disabled():
        sys.stdout.write(
            f"\n{checker}: {with_pairs} of {len(poses)} poses with pairs, {pairs} "
            f"pairs; examined {examined}\n"
        )
    if checker == "exact":
        assert 2 * with_pairs >= len(poses)
    assert examined["bvh"] < examined["none"] / 100
    assert examined["coal"] < examined["none"]


def test_grazing_poses_graze(zerobot, ct_gantry, poses):
    """The premise: a nudge back towards home, and nothing touches any more."""
    near = poses[POSES:]
    assert near
    for q in near:
        back = q + 1e-9 * (zerobot.home - q)
        assert in_contact(zerobot, ct_gantry, q)
        assert not in_contact(zerobot, ct_gantry, back)


@pytest.mark.parametrize("pruning", PRUNINGS)
def test_vertices_that_no_triangle_uses_change_nothing(pruning):
    mesh = box("b", (1.0, 1.0, 1.0))
    more = np.vstack([[[9e3, 0, 0]], mesh.vertices, [[0.2, 0.2, 0.2]]])
    extra = TriangleMesh("b", more, mesh.triangles + 1)
    T = np.eye(4)
    T[:3, 3] = 0.9, 0.3, 0.2
    found = [
        contacts(Surface(m), T, Surface(mesh), WORLD, "exact", pruning).pairs
        for m in (mesh, extra)
    ]
    assert len(found[0]) > 4
    assert np.array_equal(*found)


@pytest.mark.parametrize("pruning", PRUNINGS)
@pytest.mark.parametrize("flat", ["segment", "point"])
def test_triangles_without_area_are_found(pruning, flat):
    corners = {
        "segment": [[0.0, 0.1, 0], [0, 0.1, 0], [0, 0.1, 3]],
        "point": [[0.1, 0.2, 0.5]] * 3,
    }[flat]
    thin = TriangleMesh("thin", np.array(corners), np.array([[0, 1, 2]]))
    cube = box("b", (1.0, 1.0, 1.0))
    found = contacts(Surface(thin), WORLD, Surface(cube), WORLD, "exact", pruning)
    assert len(found.pairs) > 0


def test_the_same_record_has_one_surface():
    mesh = box("b", (1.0, 1.0, 1.0))
    assert surface(mesh) == surface(mesh)
    assert surface(mesh).tree is surface(mesh).tree
    assert surface(mesh).topology is surface(mesh).topology


def test_all_that_is_built_of_a_mesh_dies_with_it():
    """Without the collector of circles: a planner's scenes must not pile up."""
    mesh, other = box("b", (1.0, 1.0, 1.0)), box("c", (0.5, 0.5, 0.5))
    shifted = transform((0.6, 0.0, 0.0))
    gc.collect()
    gc.disable()
    try:
        a, b = surface(mesh), surface(other)
        for pruning in PRUNINGS:
            assert len(contacts(a, WORLD, b, shifted, "exact", pruning).pairs)
        assert len(contacts(a, WORLD, b, shifted, "coal").pairs)
        assert a.topology.winding_tells
        assert len(a.representatives) == 1
        assert mesh.inner is mesh
        kept = [weakref.ref(x) for x in (mesh, a.tree, a.topology, a.coal)]
        del a, mesh
        assert [reference() for reference in kept] == [None] * 4
    finally:
        gc.enable()


def test_names():
    assert checker_name("paper") == "paper:robot"
    assert [checker_name(name) for name in CHECKERS] == list(CHECKERS)
    with pytest.raises(UnknownNameError, match="exact"):
        checker_name("fcl")
    with pytest.raises(UnknownNameError, match="bvh"):
        check_pruning("octree")


def test_refusals():
    cube = Surface(box("b", (1.0, 1.0, 1.0)))
    with pytest.raises(UsageError, match="only coal"):
        contacts(cube, WORLD, cube, WORLD, "exact", "bvh", 0.01)
    huge = Surface(box("huge", (1e13, 1.0, 1.0)))
    far = np.eye(4)
    far[0, 3] = np.nan
    for pruning in PRUNINGS:
        for checker in CHECKERS:
            with pytest.raises(GeometryError):
                contacts(huge, WORLD, cube, WORLD, checker, pruning)
            with pytest.raises(GeometryError):
                contacts(cube, far, cube, WORLD, checker, pruning)
