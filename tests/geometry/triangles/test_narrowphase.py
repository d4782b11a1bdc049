"""The loops over triangle pairs give what the pairwise functions give."""

import numpy as np
import pytest

from borecheck.errors import UnknownNameError
from borecheck.geometry.triangles.exact import exact
from borecheck.geometry.triangles.narrowphase import (
    all_contacts,
    contact_pairs,
    first_contact,
    narrowphase_code,
)
from borecheck.geometry.triangles.published import NARROWPHASES, paper
from borecheck.geometry.triangles.two_sided import two_sided

REFERENCE = {
    "paper:robot": paper,
    "paper:scanner": lambda robot, scanner: paper(scanner, robot),
    "two-sided": two_sided,
    "exact": exact,
}


@pytest.fixture
def meshes():
    rng = np.random.default_rng(3)
    robot = rng.normal(size=(60, 1, 3)) + 0.7 * rng.normal(size=(60, 3, 3))
    scanner = rng.normal(size=(70, 1, 3)) + 0.7 * rng.normal(size=(70, 3, 3))
    return robot.reshape(-1, 9), scanner.reshape(-1, 9)


def everything(robot, scanner):
    i, j = np.meshgrid(np.arange(len(robot)), np.arange(len(scanner)), indexing="ij")
    return np.stack([i.ravel(), j.ravel()], axis=1)


@pytest.mark.parametrize("name", NARROWPHASES)
def test_loops_agree_with_the_pairwise_form(meshes, name):
    robot, scanner = meshes
    pairs = everything(robot, scanner)
    reference = REFERENCE[name](
        robot[pairs[:, 0]].reshape(-1, 3, 3), scanner[pairs[:, 1]].reshape(-1, 3, 3)
    )
    assert 64 < reference.sum() < len(pairs)  # more than the list starts with
    code = narrowphase_code(name)
    assert (contact_pairs(code, robot, scanner, pairs) == reference).all()
    assert np.array_equal(all_contacts(code, robot, scanner), pairs[reference])
    assert first_contact(code, robot, scanner) == tuple(pairs[reference][0])


def test_the_two_names_of_the_published_test_differ(meshes):
    robot, scanner = meshes
    first = all_contacts(NARROWPHASES["paper:robot"], robot, scanner)
    second = all_contacts(NARROWPHASES["paper:scanner"], robot, scanner)
    assert first.tolist() != second.tolist()


def test_nothing_found_when_far_apart(meshes):
    robot, scanner = meshes
    assert first_contact(3, robot, scanner + 100.0) == (-1, -1)
    assert all_contacts(3, robot, scanner + 100.0).shape == (0, 2)


def test_unknown_name_lists_the_known_ones():
    with pytest.raises(UnknownNameError, match="paper:robot"):
        narrowphase_code("paper")


def found_by(robot, scanner):
    return {
        name: len(all_contacts(code, robot, scanner)) > 0
        for name, code in NARROWPHASES.items()
    }


def closed(corners, faces):
    return np.array(corners, dtype=float)[np.array(faces)].reshape(-1, 9)


def spike(tip, base):
    """A closed, pointed tetrahedron."""
    x, y, z = base
    corners = [tip, [x + 5e-4, y, z], [x - 5e-4, y + 5e-4, z], [x - 5e-4, y - 5e-4, z]]
    return closed(corners, [[0, 1, 2], [0, 2, 3], [0, 3, 1], [1, 3, 2]])


def wall(size):
    """A closed slab of twelve triangles, its top at z = 0."""
    corners = [
        [x * size, y * size, z] for z in (-0.3, 0.0) for y in (-1, 1) for x in (-1, 1)
    ]
    quads = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2]]
    quads += [[1, 3, 7, 5]]
    return closed(corners, [t for a, b, c, d in quads for t in ((a, b, c), (a, c, d))])


def test_needle_in_a_coarse_wall_is_lost_with_the_robot_as_alpha():
    needle = spike((0.2, 0.1, -0.005), (0.2, 0.1, 0.15))
    assert found_by(needle, wall(1.0)) == {
        "paper:robot": False,
        "paper:scanner": True,
        "two-sided": True,
        "exact": True,
    }


def test_scanner_corner_in_a_robot_plate_is_lost_with_the_scanner_as_alpha():
    corner = spike((0.05, 0.02, -0.005), (0.05, 0.02, 0.15))
    assert found_by(wall(0.2), corner) == {
        "paper:robot": True,
        "paper:scanner": False,
        "two-sided": True,
        "exact": True,
    }
