"""Whole poses in one compiled call: limits, placements, surfaces, solids.

The pieces are the kernels that answer single questions; here is only their order, and
that a pose which is settled is not asked further.
"""

import numpy as np
from numba.np.numpy_support import carray

from borecheck.contact.pose_book import (
    BEYOND_LIMITS,
    FREE,
    IN_DOUBT_STILL,
    MIGHT_TOUCH,
    TOUCHES,
    Joints,
    Limits,
    Pairs,
    Solid,
)
from borecheck.geometry.kernels.compile import INLINE, kernel
from borecheck.geometry.tree.addresses import PAIR_COUNT
from borecheck.geometry.tree.holding import (
    HELD,
    IN_DOUBT,
    MIGHT_HOLD,
    WITNESSES,
    holding,
)
from borecheck.geometry.tree.query import FIRST, NO_PAIR, search
from borecheck.geometry.tree.simd import array_at
from borecheck.robots.kinematics.forward import place_many

# Instead of a pair's row.
_NOT_RIGID = -2


@kernel(**INLINE)
def _integers(book, k):  # type: ignore[no-untyped-def]
    return carray(array_at(book[2 * k]), (book[2 * k + 1],), np.int64)


@kernel(**INLINE)
def _numbers(book, k):  # type: ignore[no-untyped-def]
    return carray(array_at(book[2 * k]), (book[2 * k + 1],), np.float64)


@kernel(**INLINE)
def _open_chain(book):  # type: ignore[no-untyped-def]
    """Limits and joints of a `PoseBook`."""
    limits = Limits(
        _integers(book, 0), _numbers(book, 1), _numbers(book, 2),
        _numbers(book, 3), _numbers(book, 4),
    )  # fmt: skip
    parts = carray(array_at(book[20]), (book[21], 3, 3, 4), np.float64)
    joints = Joints(
        _integers(book, 5), _integers(book, 6), _integers(book, 7),
        _numbers(book, 8), _numbers(book, 9), parts, _integers(book, 11),
    )  # fmt: skip
    return limits, joints


@kernel(**INLINE)
def _open_pairs(book, k):  # type: ignore[no-untyped-def]
    """The `Pairs` whose first array is array k of a `PoseBook`."""
    at, count = array_at(book[2 * k + 2]), book[2 * k + 3]
    return Pairs(_integers(book, k), carray(at, (1, count, 4, 4), np.float64))


@kernel(**INLINE)
def _open_solid(book, k):  # type: ignore[no-untyped-def]
    """The `Solid` whose first array is array k of a `PoseBook`."""
    boxes = carray(array_at(book[2 * k]), (book[2 * k + 1], 2, 3), np.float64)
    count = book[2 * k + 7]
    corners = carray(array_at(book[2 * k + 6]), (count, WITNESSES, 3), np.float64)
    return Solid(boxes, _integers(book, k + 1), _integers(book, k + 2), corners)


@kernel
def _is_within(qs, i, limits):  # type: ignore[no-untyped-def]
    """Whether configuration i is finite and within all limits."""
    finite = True
    for j in range(qs.shape[1]):
        finite &= np.isfinite(qs[i, j])
    within = finite
    for j in range(len(limits.source)):
        value = limits.factor[j] * qs[i, limits.source[j]] + limits.offset[j]
        within &= (value >= limits.lower[j]) & (value <= limits.upper[j])
    return within


@kernel
def _first_pair(against, among, placements, i, code):  # type: ignore[no-untyped-def]
    """The row of the first pair whose surfaces meet in pose i, or -1, or _NOT_RIGID."""
    hits, touches = np.empty(0, np.int64), np.empty(0, np.bool_)
    found = np.empty((0, 4), np.int64)
    _, _, bad, hit = search(
        against.book, placements, against.standing, False, i, i + 1,
        code, FIRST, 0.0, hits, touches, found,
    )  # fmt: skip
    if bad >= 0:
        return _NOT_RIGID
    if hit == NO_PAIR:
        _, _, _, hit = search(
            among.book, placements, placements, True, i, i + 1,
            code, FIRST, 0.0, hits, touches, found,
        )  # fmt: skip
        if hit != NO_PAIR:
            hit += against.book[PAIR_COUNT]
    return hit


@kernel
def ask_poses(book, qs, code, corners, states, which):  # type: ignore[no-untyped-def]
    """Fills states and which, (n,): the first pair that touches, or -1.

    Rows of `which` go on from the pairs with obstacles to those among the links.

    Args:
        book: Entries of a `PoseBook`.
        qs: Configurations, (n, joints).
        code: The narrowphase.
        corners: For `holding`, how many must be in the other's box; 0: solids are not
            asked.
        states: FREE, TOUCHES ..., int8.
        which: int64.

    Returns:
        The first pose with a placement that is not rigid, or -1; whether solids ask for
        what `Solids.answer` finds out; how many poses are IN_DOUBT_STILL, and how many
        BEYOND_LIMITS.
    """
    limits, joints = _open_chain(book)
    against, among = _open_pairs(book, 12), _open_pairs(book, 14)
    links, others = _open_solid(book, 16), _open_solid(book, 20)
    placements = np.empty((len(qs), len(joints.frames), 4, 4))
    place_many(
        joints.parent, joints.kind, joints.source, joints.factor, joints.offset,
        joints.parts, qs, joints.frames, placements,
    )  # fmt: skip
    settled = np.empty(len(qs), np.bool_)
    for i in range(len(qs)):
        states[i], which[i] = FREE, NO_PAIR
        settled[i] = True
        if not _is_within(qs, i, limits):
            states[i] = BEYOND_LIMITS
            continue
        hit = _first_pair(against, among, placements, i, code)
        if hit == _NOT_RIGID:
            return i, False, 0, 0
        if hit != NO_PAIR:
            states[i], which[i] = TOUCHES, hit
        else:
            settled[i] = False
    asks = False
    if corners > 0:
        asks |= _ask_solids(
            against, links, others, placements, against.standing, False,
            corners, settled, 0, states, which,
        )  # fmt: skip
        asks |= _ask_solids(
            among, links, links, placements, placements, True,
            corners, settled, against.book[PAIR_COUNT], states, which,
        )  # fmt: skip
    doubts, beyond = 0, 0
    for i in range(len(qs)):
        doubts += states[i] == IN_DOUBT_STILL
        beyond += states[i] == BEYOND_LIMITS
    return -1, asks, doubts, beyond


@kernel
def _ask_solids(  # type: ignore[no-untyped-def]
    pairs, links, others, placements, standing, moving, corners, settled, row,
    states, which,
):  # fmt: skip
    """Settles poses in which a solid holds another or might; whether solids ask."""
    count = pairs.book[PAIR_COUNT]
    if count == 0:
        return False
    codes = np.zeros((len(placements), count), np.int8)
    asks = holding(
        pairs.book, links, others, placements, standing, moving,
        corners, False, settled, codes,
    )  # fmt: skip
    for i in range(len(placements)):
        if settled[i]:
            continue
        for k in range(count):
            state = FREE
            if codes[i, k] == HELD:
                state, settled[i] = TOUCHES, True
            elif codes[i, k] == MIGHT_HOLD and states[i] != IN_DOUBT_STILL:
                state = MIGHT_TOUCH
            elif codes[i, k] == IN_DOUBT:
                state = IN_DOUBT_STILL
            if state != FREE:
                states[i], which[i] = state, row + k
    return asks
