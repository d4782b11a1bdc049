"""The bounding-volume tree of one mesh: eight boxes to a node, built once.

Layout, made for the queries:

* `nodes` (n, 7, 8) float32. Rows 0-2 are the centres and rows 3-5 the half extents
  of up to eight child boxes, relative to the mesh's centre; row 6 holds the bits of
  int32 references: a node, or `~leaf`. Node 0 holds one child, the whole mesh's box.
* `order` (m,): the original id of every leaf's triangle.

Boxes are conservative: each holds, as real numbers, the float64 corners of its
triangles minus the centre. Corners are rounded outwards by a whole float32 step (more
than the half step and the float64 rounding of the subtraction together), unions of
boxes are exact, and half extents are stretched by 2**-22, more than the two float32
roundings of their own computation.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from borecheck.geometry.kernels.compile import kernel

WIDTH = 8
ROWS = 7
CHILD_ROW = 6
BINS = 16
# Deeper than this the surface area heuristic has failed (it peels off triangle by
# triangle); halving the list bounds the depth.
HEURISTIC_DEPTH = 48
# An unused slot: so negative a half extent never overlaps anything.
NO_BOX = np.float32(-1e30)

F32 = np.float32
_STRETCH = F32(1.0 + 2.0**-22)
_TINY = F32(1e-36)


@dataclass(frozen=True, eq=False)
class TreeArrays:
    """A built tree.

    Attributes:
        nodes: Child boxes and references, (n, 7, 8), float32.
        order: Original triangle of every leaf, (m,), int64.
        frame: Centre of the mesh's bounds, to which boxes refer, and the largest
            coordinate measured from there, (4,), [m].
        depth: Nodes on the longest way from node 0 to a leaf.
    """

    nodes: NDArray[np.float32]
    order: NDArray[np.int64]
    frame: NDArray[np.float64]
    depth: int


def build(corners: NDArray[np.float64]) -> TreeArrays:
    """The tree over triangles given by their corners, (m, 9), [m]."""
    points = corners.reshape(-1, 3, 3)
    frame = frame_of(points)
    order = np.arange(len(corners))
    binary, children, first = _split_all(_boxes(points, frame[:3]), order)
    # Pages of it that nothing is written to take no memory, and it is cut to size.
    nodes = np.empty((len(binary) // 2 + 2, ROWS, WIDTH), F32)
    used, depth = _widen(binary, children, first, nodes)
    nodes.resize((used, ROWS, WIDTH), refcheck=False)
    return TreeArrays(nodes, order, frame, int(depth))


def _boxes(
    points: NDArray[np.float64], centre: NDArray[np.float64]
) -> NDArray[np.float32]:
    """Boxes of triangles (m, 3, 3) about a centre, rounded outwards, (m, 2, 3)."""
    boxes = np.empty((len(points), 2, 3), F32)
    lower = (points.min(axis=1) - centre).astype(F32)
    np.nextafter(lower, F32(-np.inf), out=boxes[:, 0])
    upper = (points.max(axis=1) - centre).astype(F32)
    np.nextafter(upper, F32(np.inf), out=boxes[:, 1])
    return boxes


def frame_of(points: NDArray[np.float64]) -> NDArray[np.float64]:
    """`TreeArrays.frame` of triangles with these corners, (m, 3, 3)."""
    columns = points.reshape(-1, 3).T
    bottom = np.array([column.min() for column in columns])
    top = np.array([column.max() for column in columns])
    centre = 0.5 * bottom + 0.5 * top
    # A little more than the extent: the boxes are rounded outwards.
    extent = max((top - centre).max(), (centre - bottom).max()) * (1.0 + 1e-6)
    return np.append(centre, extent)


@kernel
def _split_all(boxes, order):  # type: ignore[no-untyped-def]
    """Binary tree by the binned surface area heuristic; reorders `order`.

    Returns boxes (k, 2, 3), children (k, 2) with -1 in a leaf, and the first leaf
    below every node (k,).
    """
    n = len(order)
    binary = np.empty((2 * n, 2, 3), F32)
    children = np.full((2 * n, 2), -1, np.int32)
    first = np.empty(2 * n, np.int32)
    # One waits for every level: HEURISTIC_DEPTH of them, and as many as halvings.
    todo = np.zeros((HEURISTIC_DEPTH + 64, 4), np.int64)  # begin, end, node, depth
    todo[0, 1] = n
    waiting = 1
    used = 1
    bins = np.zeros((BINS, 2, 3), F32)
    counts = np.zeros(BINS, np.int64)
    areas = np.zeros(BINS, np.float64)
    centres = np.zeros((2, 3), F32)
    while waiting > 0:
        waiting -= 1
        begin, end = todo[waiting, 0], todo[waiting, 1]
        node, depth = todo[waiting, 2], todo[waiting, 3]
        _bound(boxes, order, begin, end, binary[node], centres)
        first[node] = begin
        if end - begin == 1:
            continue
        middle = begin
        if depth < HEURISTIC_DEPTH:
            axis, cut = _best_cut(
                boxes, order, begin, end, centres, bins, counts, areas
            )
            if axis >= 0:
                middle = _partition(boxes, order, begin, end, centres, axis, cut)
        if middle in (begin, end):
            middle = (begin + end) // 2
        for side in range(2):
            child = used + side
            children[node, side] = child
            todo[waiting, 0] = begin if side == 0 else middle
            todo[waiting, 1] = middle if side == 0 else end
            todo[waiting, 2] = child
            todo[waiting, 3] = depth + 1
            waiting += 1
        used += 2
    return binary[:used], children[:used], first[:used]


@kernel
def _bound(boxes, order, begin, end, box, centres):  # type: ignore[no-untyped-def]
    """Bounds of a range of triangles, and of (twice) their boxes' centres."""
    box[0], box[1] = F32(np.inf), F32(-np.inf)
    centres[0], centres[1] = F32(np.inf), F32(-np.inf)
    for i in range(begin, end):
        t = order[i]
        for d in range(3):
            low, high = boxes[t, 0, d], boxes[t, 1, d]
            centre = low + high
            box[0, d] = min(box[0, d], low)
            box[1, d] = max(box[1, d], high)
            centres[0, d] = min(centres[0, d], centre)
            centres[1, d] = max(centres[1, d], centre)


@kernel(inline="always")
def _bin_of(boxes, t, d, centres):  # type: ignore[no-untyped-def]
    """The bin of a triangle along axis d (the bounds of centres are not flat)."""
    extent = centres[1, d] - centres[0, d]
    place = (boxes[t, 0, d] + boxes[t, 1, d] - centres[0, d]) / extent
    return min(BINS - 1, int(place * F32(BINS)))


@kernel(inline="always")
def _half_area(box):  # type: ignore[no-untyped-def]
    x, y, z = box[1, 0] - box[0, 0], box[1, 1] - box[0, 1], box[1, 2] - box[0, 2]
    return x * y + y * z + z * x


@kernel
def _best_cut(boxes, order, begin, end, centres, bins, counts, areas):  # type: ignore[no-untyped-def]
    """Axis and last bin of the left side with the least cost; axis -1: no cut."""
    best, best_axis, best_cut = np.inf, -1, 0
    for axis in range(3):
        if not centres[1, axis] > centres[0, axis]:
            continue
        _fill_bins(boxes, order, begin, end, centres, axis, bins, counts)
        left = np.zeros((2, 3), F32)
        _sweep_right(bins, counts, areas, left)
        left[0], left[1] = F32(np.inf), F32(-np.inf)
        count = 0
        for cut in range(BINS - 1):
            _join(left, bins[cut])
            count += counts[cut]
            rest = end - begin - count
            if count == 0 or rest == 0:
                continue
            cost = count * _half_area(left) + rest * areas[cut + 1]
            if cost < best:
                best, best_axis, best_cut = cost, axis, cut
    return best_axis, best_cut


@kernel
def _fill_bins(boxes, order, begin, end, centres, axis, bins, counts):  # type: ignore[no-untyped-def]
    bins[:, 0] = F32(np.inf)
    bins[:, 1] = F32(-np.inf)
    counts[:] = 0
    for i in range(begin, end):
        t = order[i]
        b = _bin_of(boxes, t, axis, centres)
        counts[b] += 1
        for d in range(3):
            bins[b, 0, d] = min(bins[b, 0, d], boxes[t, 0, d])
            bins[b, 1, d] = max(bins[b, 1, d], boxes[t, 1, d])


@kernel(inline="always")
def _join(box, other):  # type: ignore[no-untyped-def]
    for d in range(3):
        box[0, d] = min(box[0, d], other[0, d])
        box[1, d] = max(box[1, d], other[1, d])


@kernel
def _sweep_right(bins, counts, areas, box):  # type: ignore[no-untyped-def]
    """areas[b]: half the area of the union of bins b and up."""
    box[0], box[1] = F32(np.inf), F32(-np.inf)
    filled = 0
    for b in range(BINS - 1, -1, -1):
        _join(box, bins[b])
        filled += counts[b]
        areas[b] = _half_area(box) if filled > 0 else 0.0


@kernel
def _partition(boxes, order, begin, end, centres, axis, cut):  # type: ignore[no-untyped-def]
    """Brings triangles up to bin `cut` to the front; where the others begin."""
    i, j = begin, end - 1
    while i <= j:
        if _bin_of(boxes, order[i], axis, centres) <= cut:
            i += 1
        else:
            order[i], order[j] = order[j], order[i]
            j -= 1
    return i


@kernel
def _widen(binary, children, first, nodes):  # type: ignore[no-untyped-def]
    """Eight-wide nodes: the largest boxes below a node are opened until eight stand.

    Returns how many nodes there are, and how deep they stand.
    """
    references = nodes.view(np.int32)
    # Seven wait for every level, and a level here holds one of the binary tree or more.
    levels = HEURISTIC_DEPTH + 64
    todo = np.zeros((WIDTH * levels, 3), np.int64)  # binary node, wide node, depth
    _write_child(nodes, references, 0, 0, binary[0], ~first[0])
    _write_rest(nodes, references, 0, 1)
    used, waiting, deepest = 1, 0, 1
    if children[0, 0] >= 0:
        references[0, CHILD_ROW, 0] = 1
        todo[0, 1], todo[0, 2] = 1, 2
        used, waiting = 2, 1
    opened = np.zeros(WIDTH, np.int64)
    while waiting > 0:
        waiting -= 1
        node, wide, depth = todo[waiting, 0], todo[waiting, 1], todo[waiting, 2]
        deepest = max(deepest, depth)
        k = _open(binary, children, node, opened)
        for slot in range(k):
            child = opened[slot]
            reference = ~first[child]
            if children[child, 0] >= 0:
                reference = used
                todo[waiting, 0], todo[waiting, 1] = child, used
                todo[waiting, 2] = depth + 1
                waiting += 1
                used += 1
            _write_child(nodes, references, wide, slot, binary[child], reference)
        _write_rest(nodes, references, wide, k)
    return used, deepest


@kernel
def _open(binary, children, node, opened):  # type: ignore[no-untyped-def]
    """Fills `opened` with up to eight nodes that cover `node`; how many."""
    opened[0], opened[1] = children[node, 0], children[node, 1]
    k = 2
    while k < WIDTH:
        largest, area = -1, F32(-1.0)
        for i in range(k):
            size = _half_area(binary[opened[i]])
            if children[opened[i], 0] >= 0 and size > area:
                largest, area = i, size
        if largest < 0:
            break
        parent = opened[largest]
        opened[largest], opened[k] = children[parent, 0], children[parent, 1]
        k += 1
    return k


@kernel
def _write_child(nodes, references, node, slot, box, reference):  # type: ignore[no-untyped-def]
    for d in range(3):
        centre = F32(0.5) * (box[0, d] + box[1, d])
        half = max(box[1, d] - centre, centre - box[0, d])
        nodes[node, d, slot] = centre
        nodes[node, 3 + d, slot] = half * _STRETCH + _TINY
    references[node, CHILD_ROW, slot] = reference


@kernel
def _write_rest(nodes, references, node, used):  # type: ignore[no-untyped-def]
    for slot in range(used, WIDTH):
        for d in range(3):
            nodes[node, d, slot] = F32(0.0)
            nodes[node, 3 + d, slot] = NO_BOX
        references[node, CHILD_ROW, slot] = -1
