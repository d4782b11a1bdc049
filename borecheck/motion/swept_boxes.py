"""Does a moving mesh stay clear of a standing one during an interval of time?

All numbers are taken in the frame of the standing mesh b. Row k of a *track* holds, for
one instant, the rotation of the moving mesh a (9 numbers), the place of the centre of
its boxes measured from the centre of b's (3), and a slack (1). Between two instants a
point of a stays within the slack of its chord (`motion.bounds.chord_slack`; the margin
and rounding are added), so over any run of instants it stays within the slack of the
hull of its places: an image of a box of a is computed from the least and largest
entries of the run. If no image of a triangle's box meets a triangle's box of b, no
instant of the run has contact, between the samples included.

Where boxes of two triangles do meet, a plane must separate them (`planes`).

Rounding. Images are formed in float32 with at most twelve operations on terms bounded
by X, the sum of the largest coordinates of both trees and of the places; entries of a
track are off by one rounding each. With u = 2**-24 all of it is below 64 u X, and twice
that is added to the slack (`box_rounding`). Plane tests are in float64: placements of
a chain of up to 100 joints and coordinates up to 100 m are off by less than
100 * 32 * 2**-53 * 100 m < 4e-11 m; ROUNDING, 1e-10 m, is added.
"""

import numpy as np

from borecheck.geometry.kernels.compile import BOX, INLINE, kernel
from borecheck.geometry.tree.build import CHILD_ROW, F32, WIDTH
from borecheck.geometry.triangles.distance import pair_distance
from borecheck.geometry.triangles.exact import exact_pair
from borecheck.geometry.triangles.placing import place_triangle
from borecheck.motion.planes import plane_between

ROUNDING = 1e-10
LARGEST_PLACE = 100.0  # [m], for ROUNDING to hold
_BOX_UNIT = 2.0**-17

# Columns of a row of a track; sixteen numbers are one or two vector registers.
ROW = 16
PLACE = 9
SLACK = 12
# An interval: middle and radius of the entries, their largest size; the slack.
MIDDLE, RADIUS, SIZE = 0, 1, 2

_PLANE_COST = 8  # in nodes opened

# The frame of a tree: the origin of its boxes (3), the largest coordinate from there.
EXTENT = 3

# What a walk is for, and its outcomes.
SWEEP, POSE = 0, 1
CLEAR, OPEN = 0, 1


@kernel(**INLINE)
def write_row(T, frame_a, frame_b, row):  # type: ignore[no-untyped-def]
    """One instant of a track from the placement of a in the frame of b, (3, 4)."""
    for i in range(3):
        for j in range(3):
            row[3 * i + j] = F32(T[i, j])
        place = T[i, 0] * frame_a[0] + T[i, 1] * frame_a[1] + T[i, 2] * frame_a[2]
        row[PLACE + i] = F32(place + T[i, 3] - frame_b[i])


@kernel(**INLINE)
def box_rounding(frame_a, frame_b, places):  # type: ignore[no-untyped-def]
    """What float32 images can be off by; `places` bounds the centre's coordinates."""
    return _BOX_UNIT * (frame_a[EXTENT] + frame_b[EXTENT] + places) + 1e-30


@kernel(**INLINE)
def span(lo, hi, interval):  # type: ignore[no-untyped-def]
    """Fills an interval (3, 16) from the least and largest rows of a run."""
    for k in range(ROW):
        interval[MIDDLE, k] = F32(0.5) * (lo[k] + hi[k])
        interval[RADIUS, k] = F32(0.5) * (hi[k] - lo[k])
        interval[SIZE, k] = max(abs(lo[k]), abs(hi[k]))
    interval[RADIUS, SLACK] = hi[SLACK]


@kernel(**INLINE)
def _box(nodes, reference):  # type: ignore[no-untyped-def]
    """Centre and half extents of the box in a slot; reference = 8 node + slot."""
    node, i = reference >> 3, reference & 7
    return (
        nodes[node, 0, i],
        nodes[node, 1, i],
        nodes[node, 2, i],
        nodes[node, 3, i],
        nodes[node, 4, i],
        nodes[node, 5, i],
    )


@kernel(**BOX)
def _image(interval, cx, cy, cz, hx, hy, hz, axis):  # type: ignore[no-untyped-def]
    """Centre and half extent, along one axis of b, of a box of a over the interval."""
    k = 3 * axis
    m, r, s = interval[MIDDLE], interval[RADIUS], interval[SIZE]
    centre = m[k] * cx + m[k + 1] * cy + m[k + 2] * cz + m[PLACE + axis]
    half = r[k] * abs(cx) + r[k + 1] * abs(cy) + r[k + 2] * abs(cz)
    half += s[k] * hx + s[k + 1] * hy + s[k + 2] * hz
    return centre, half + (r[PLACE + axis] + r[SLACK])


@kernel(**BOX)
def _mark_standing(nodes, node, image, flags):  # type: ignore[no-untyped-def]
    """flags[i]: child box i of a node of b may meet the image."""
    x, y, z, hx, hy, hz = image[0], image[1], image[2], image[3], image[4], image[5]
    for i in range(WIDTH):
        apart = abs(nodes[node, 0, i] - x) > nodes[node, 3, i] + hx
        apart |= abs(nodes[node, 1, i] - y) > nodes[node, 4, i] + hy
        apart |= abs(nodes[node, 2, i] - z) > nodes[node, 5, i] + hz
        flags[i] = not apart


@kernel(**BOX)
def _mark_moving(nodes, node, interval, box, images, flags):  # type: ignore[no-untyped-def]
    """Images (6, 8) of the child boxes of a node of a, and which may meet a box."""
    bx, by, bz, kx, ky, kz = box
    for i in range(WIDTH):
        cx, cy, cz = nodes[node, 0, i], nodes[node, 1, i], nodes[node, 2, i]
        hx, hy, hz = nodes[node, 3, i], nodes[node, 4, i], nodes[node, 5, i]
        x, wx = _image(interval, cx, cy, cz, hx, hy, hz, 0)
        y, wy = _image(interval, cx, cy, cz, hx, hy, hz, 1)
        z, wz = _image(interval, cx, cy, cz, hx, hy, hz, 2)
        images[0, i], images[1, i], images[2, i] = x, y, z
        images[3, i], images[4, i], images[5, i] = wx, wy, wz
        apart = (abs(x - bx) > wx + kx) | (abs(y - by) > wy + ky)
        apart |= (abs(z - bz) > wz + kz) | (hx < F32(0.0))
        flags[i] = not apart


@kernel(**INLINE)
def start_walk(nodes_a, nodes_b, interval, boxes):  # type: ignore[no-untyped-def]
    """Whether the image of all of a may meet the box of all of b; fills boxes[0]."""
    cx, cy, cz, hx, hy, hz = _box(nodes_a, 0)
    bx, by, bz, kx, ky, kz = _box(nodes_b, 0)
    x, wx = _image(interval, cx, cy, cz, hx, hy, hz, 0)
    y, wy = _image(interval, cx, cy, cz, hx, hy, hz, 1)
    z, wz = _image(interval, cx, cy, cz, hx, hy, hz, 2)
    boxes[0, 0], boxes[0, 1], boxes[0, 2] = x, y, z
    boxes[0, 3], boxes[0, 4], boxes[0, 5] = wx, wy, wz
    apart = (abs(x - bx) > wx + kx) | (abs(y - by) > wy + ky) | (abs(z - bz) > wz + kz)
    return not apart


@kernel
def walk(  # type: ignore[no-untyped-def]
    nodes_a, corners_a, nodes_b, corners_b, interval, task, ends, places,
    distance, budget, stack, boxes, images, flags,
):  # fmt: skip
    """Whether a stays clear of b over an interval, or at one pose.

    Args:
        nodes_a: Tree of the moving mesh.
        corners_a: Its triangles in the order of the leaves, (m, 9).
        nodes_b: Tree of the standing mesh.
        corners_b: Its triangles.
        interval: See `span`.
        task: SWEEP or POSE.
        ends: SWEEP: placements of a in the frame of b at both ends, (2, 3, 4).
        places: POSE: placements of a and b in the world, (2, 4, 4).
        distance: SWEEP: by how much a plane must separate triangles. POSE: triangles
            this near count as meeting. [m]
        budget: Nodes that may be opened before giving up.
        stack: (k, 2) int64, deep enough for both trees.
        boxes: Images of the boxes of a on the stack, (k, 6) float32.
        images: (6, 8) float32 scratch.
        flags: (8,) uint8 scratch.

    Returns:
        CLEAR, which is proven, or OPEN; for a POSE that ends within the budget OPEN
        means that triangles meet.
    """
    if not start_walk(nodes_a, nodes_b, interval, boxes):
        return CLEAR
    children_a, children_b = nodes_a.view(np.int32), nodes_b.view(np.int32)
    any_flag = flags.view(np.uint64)
    stack[0, 0], stack[0, 1] = 0, 0
    top, opened = 1, 0
    image = np.zeros(6, F32)
    while top > 0:
        top -= 1
        a, b = stack[top, 0], stack[top, 1]
        node_a = int(children_a[a >> 3, CHILD_ROW, a & 7])
        node_b = int(children_b[b >> 3, CHILD_ROW, b & 7])
        if node_a < 0 and node_b < 0:
            if task == POSE:
                if _near(corners_a, ~node_a, corners_b, ~node_b, places, distance):
                    return OPEN
            elif not plane_between(
                corners_a, ~node_a, corners_b, ~node_b, ends, distance
            ):
                return OPEN
            opened += _PLANE_COST
            continue
        opened += 1
        if opened > budget:
            return OPEN
        for k in range(6):
            image[k] = boxes[top, k]
        box = _box(nodes_b, b)
        size_a = max(image[3], max(image[4], image[5]))
        size_b = max(box[3], max(box[4], box[5]))
        if node_a < 0 or (node_b >= 0 and size_b >= size_a):
            _mark_standing(nodes_b, node_b, image, flags)
            if any_flag[0] != np.uint64(0):
                for i in range(WIDTH):
                    stack[top, 0], stack[top, 1] = a, 8 * node_b + i
                    for k in range(6):
                        boxes[top, k] = image[k]
                    top += flags[i]
        else:
            _mark_moving(nodes_a, node_a, interval, box, images, flags)
            if any_flag[0] != np.uint64(0):
                for i in range(WIDTH):
                    stack[top, 0], stack[top, 1] = 8 * node_a + i, b
                    for k in range(6):
                        boxes[top, k] = images[k, i]
                    top += flags[i]
    return CLEAR


@kernel
def _near(corners_a, i, corners_b, j, places, distance):  # type: ignore[no-untyped-def]
    """Whether two triangles, placed in the world, meet or are as near as that."""
    moving = place_triangle(places[0], corners_a, i)
    standing = place_triangle(places[1], corners_b, j)
    if distance == 0.0:
        return exact_pair(moving, standing)
    return pair_distance(moving, standing)[0] <= distance
