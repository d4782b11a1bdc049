"""Books list what a walk may read, and nothing else; found pairs are sorted."""

import copy

import numpy as np
import pytest
from numba import njit

from borecheck.geometry.tree.addresses import (
    FRAMES,
    LEAF_COUNT,
    NODES,
    SIDE,
    PairBook,
    address,
    open_pairs,
    open_side,
)
from borecheck.geometry.tree.mesh_tree import MeshTree
from borecheck.geometry.tree.query import sort_pairs


@njit
def opened(book, first):
    return [part.copy() for part in open_side(book, first)[2:3]], open_pairs(book)[0, 1]


@njit
def frames_and_order(book, first):
    _, _, _, order, frames = open_side(book, first)
    return order.copy(), frames.copy()


@njit
def sort(found, begin, end):
    sort_pairs(found, begin, end)


def tree(rng, count):
    corners = rng.normal(size=(3 * count, 3))
    return MeshTree(corners, np.arange(3 * count).reshape(-1, 3))


def test_a_walk_reads_the_arrays_it_was_given(rng):
    a, b = tree(rng, 20), tree(rng, 7)
    book = PairBook(a.book, b.book, np.array([[0, 5]]))
    for first, side in ((0, a), (SIDE, b)):
        (corners,), named = opened(book.entries, first)
        np.testing.assert_array_equal(corners, side.corners)
        order, frames = frames_and_order(book.entries, first)
        np.testing.assert_array_equal(order, side.order)
        np.testing.assert_array_equal(frames, side.frames)
        assert named == 5


def test_a_copied_book_is_of_the_copied_arrays(rng):
    book = tree(rng, 20).book
    twin = copy.deepcopy(book)
    assert twin.entries[LEAF_COUNT] == book.entries[LEAF_COUNT] == 20
    assert twin.entries[NODES] != book.entries[NODES]
    assert twin.entries[FRAMES] != book.entries[FRAMES]


@pytest.mark.parametrize(
    "array",
    [
        np.zeros((4, 2), np.int32),
        np.zeros((4, 3), np.int64),
        np.zeros((4, 4), np.int64)[:, ::2],
        np.zeros((2, 4), np.int64).T,
    ],
)
def test_an_array_of_another_kind_has_no_address(array):
    with pytest.raises(TypeError, match="contiguous"):
        address(array, np.int64, (4, 2))


@pytest.mark.parametrize("count", [0, 1, 2, 3, 8, 50, 3000])
def test_rows_between_are_sorted_and_others_left(rng, count):
    found = rng.integers(0, max(2, count // 4), (count + 5, 4))
    before = found.copy()
    sort(found, 2, 2 + count)
    rows = before[2 : 2 + count]
    order = np.lexsort((rows[:, 3], rows[:, 2]))
    np.testing.assert_array_equal(found[2 : 2 + count, 2:], rows[order, 2:])
    np.testing.assert_array_equal(found[:2], before[:2])
    np.testing.assert_array_equal(found[2 + count :], before[2 + count :])
