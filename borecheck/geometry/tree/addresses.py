"""Where the arrays of trees lie in memory: one array of numbers instead of many arrays.

Every array handed to a compiled function costs a tenth of a microsecond, as much as a
link that is clear. A *book* lists the addresses and lengths of all that a walk reads;
the walk opens it (`open_side`, `open_pairs`). Books never leave the objects that made
them, and those hold the arrays: no array can end before its book.
"""

from typing import Any

import numpy as np
from numba.np.numpy_support import carray
from numpy.typing import NDArray

from borecheck.geometry.kernels.compile import INLINE, kernel
from borecheck.geometry.tree.boxes import FRAME_COLUMNS
from borecheck.geometry.tree.build import F32, ROWS, WIDTH
from borecheck.geometry.tree.simd import array_at

# Entries of one side, a or b: addresses, and how many rows lie there.
NODES, NODE_COUNT, CORNERS, ORDER, LEAF_COUNT, FRAMES, FRAME_COUNT, DEPTH = range(8)
SIDE = 8
# Behind both sides.
PAIRS, PAIR_COUNT = 16, 17

Numbers = NDArray[np.int64]


class Book:
    """Addresses of the arrays of one side; holds the arrays.

    Copied or unpickled, it is made anew from the copied arrays.

    Args:
        nodes: See `tree.build`, (n, 7, 8), float32.
        corners: (m, 9), float64.
        order: (m,), int64.
        frames: (k, 5), float64.
        depth: Of the deepest tree.

    Attributes:
        entries: The numbers, (8,), for `joined`.
    """

    __slots__ = ("_arrays", "_depth", "entries")

    def __init__(
        self,
        nodes: NDArray[np.float32],
        corners: NDArray[np.float64],
        order: NDArray[np.int64],
        frames: NDArray[np.float64],
        depth: int,
    ) -> None:
        n, m, k = len(nodes), len(corners), len(frames)
        self._arrays = (nodes, corners, order, frames)
        self._depth = depth
        self.entries: Numbers = np.array(
            [
                address(nodes, F32, (n, ROWS, WIDTH)),
                n,
                address(corners, np.float64, (m, 9)),
                address(order, np.int64, (m,)),
                m,
                address(frames, np.float64, (k, FRAME_COLUMNS)),
                k,
                depth,
            ]
        )

    def __reduce__(self) -> tuple[Any, ...]:
        return Book, (*self._arrays, self._depth)


class PairBook:
    """Two books and which mesh of one is asked against which of the other.

    Attributes:
        entries: The numbers, (18,), for kernels.
    """

    __slots__ = ("_parts", "entries")

    def __init__(self, a: Book, b: Book, pairs: Numbers) -> None:
        self._parts = (a, b, pairs)
        where = [address(pairs, np.int64, (len(pairs), 2)), len(pairs)]
        self.entries: Numbers = np.concatenate([a.entries, b.entries, where])

    def __reduce__(self) -> tuple[Any, ...]:
        return PairBook, self._parts


def address(array: NDArray[Any], kind: Any, shape: tuple[int, ...]) -> int:
    """Where an array begins that is what a walk takes it for.

    Raises:
        TypeError: Another type or shape, or not contiguous.
    """
    if array.dtype != kind or array.shape != shape or not array.flags.c_contiguous:
        raise TypeError(f"{array.dtype}{array.shape} is not {kind} {shape}, contiguous")
    return int(array.__array_interface__["data"][0])


@kernel(**INLINE)
def open_side(book, first):  # type: ignore[no-untyped-def]
    """Nodes, their references, corners, order and frames of the side from `first`."""
    n, m, k = (
        book[first + NODE_COUNT],
        book[first + LEAF_COUNT],
        book[first + FRAME_COUNT],
    )
    at = array_at(book[first + NODES])
    nodes = carray(at, (n, ROWS, WIDTH), np.float32)
    children = carray(at, (n, ROWS, WIDTH), np.int32)
    corners = carray(array_at(book[first + CORNERS]), (m, 9), np.float64)
    order = carray(array_at(book[first + ORDER]), (m,), np.int64)
    frames = carray(array_at(book[first + FRAMES]), (k, FRAME_COLUMNS), np.float64)
    return nodes, children, corners, order, frames


@kernel(**INLINE)
def open_pairs(book):  # type: ignore[no-untyped-def]
    """Which mesh against which, (p, 2)."""
    return carray(array_at(book[PAIRS]), (book[PAIR_COUNT], 2), np.int64)
