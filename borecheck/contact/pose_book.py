"""What poses are asked about, laid out for kernels: limits, joints, pairs, solids.

`pose_kernel` asks it; a single pose is asked without, so that kernel stays unloaded.
"""

from typing import NamedTuple, NoReturn

import numpy as np
from numpy.typing import NDArray

from borecheck.geometry.tree.addresses import address

# What is known of a pose. MIGHT_TOUCH: something is in the box of an open mesh or among
# surfaces that cancel. IN_DOUBT_STILL: rays leave a doubt, to be settled.
FREE, TOUCHES, MIGHT_TOUCH, IN_DOUBT_STILL, BEYOND_LIMITS = range(5)

Floats = NDArray[np.float64]
Ids = NDArray[np.int64]


class Limits(NamedTuple):
    """Of every moving joint: its drive in q, and its range with tolerance, (j,)."""

    source: Ids
    factor: Floats
    offset: Floats
    lower: Floats
    upper: Floats


class Joints(NamedTuple):
    """A `JointChain` as kernels take it, and which frames carry the links, (links,)."""

    parent: Ids
    kind: Ids
    source: Ids
    factor: Floats
    offset: Floats
    parts: Floats
    frames: Ids


class Pairs(NamedTuple):
    """Pairs of meshes: entries of their `PairBook`, and what stands, (1, k, 4, 4)."""

    book: Ids
    standing: Floats


class Solid(NamedTuple):
    """`Solids.arrays`."""

    boxes: Floats
    kinds: Ids
    first: Ids
    corners: Floats


class PoseBook:
    """Where all that stays the same from pose to pose lies: one array for the kernel.

    Holds the arrays; see `tree.addresses` for why. It is never copied: books of pairs
    are among its arrays, and their copies would name memory of the original.

    Args:
        limits: Of the moving joints.
        joints: The chain.
        against: Links and obstacles.
        among: Links and links.
        links: Solids of the links.
        others: Of the obstacles.

    Attributes:
        entries: Address and length of every array.
    """

    def __init__(
        self,
        limits: Limits,
        joints: Joints,
        against: Pairs,
        among: Pairs,
        links: Solid,
        others: Solid,
    ) -> None:
        self._groups = (limits, joints, against, among, links, others)
        entries = []
        for group in self._groups:
            for array in group:
                kind = np.int64 if array.dtype == np.int64 else np.float64
                entries += [address(array, kind, array.shape), _length(array)]
        self.entries: Ids = np.array(entries)

    def __reduce__(self) -> NoReturn:
        """Refused: see the class."""
        raise TypeError("a PoseBook is laid out anew, not copied")


def _length(array: NDArray[np.generic]) -> int:
    """Rows of an array; of what stands, (1, k, 4, 4), those of its one pose."""
    return array.shape[1] if array.shape[2:] == (4, 4) else len(array)
