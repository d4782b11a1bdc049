"""Which boxes of a tree node can meet a box of another tree: eight at a time, safely.

One point belongs to both meshes a and b if p_b = M p_a + m, where p_a and p_b are
measured from the origins of the two trees, M = R_b^-1 R_a and
m = R_b^-1 (R_a o_a + t_a - t_b) - o_b. Two boxes are apart if their projections on
one of the six box axes are; the nine cross products of axes are not tried (they cut
the visits by a tenth and cost more). Nothing here assumes that R is exactly a
rotation: the way back uses the true inverse of M.

Rounding. A *relation* holds M, m and their inverse in float32, and a slack that
every comparison allows. With u = 2**-24, C_a and C_b the largest coordinates in
the two trees and X = C_a + C_b + |m|:

* own axes: at most eight operations, each a relative u, on terms bounded by
  sqrt(3) C_a, |m| and C_b, on both sides of the comparison: below 32 u X;
* foreign axes: the differences above, off by at most 18 u X, pass through a matrix
  with row sums below sqrt(3), and eight operations more: below 64 u X;
* M and m in float64: below 64 v Y with v = 2**-53 and Y the sum of the sizes of both
  origins and both translations. Placing the corners in the world, where the leaf
  tests see them, is off by less than 64 v (X + Y): together below 128 v (X + Y).
  (Rotations are checked to 1e-6, so an error keeps its size from frame to frame.)

The slack is 2 * (64 u X + 128 v (X + Y)), twice what is needed, in each comparison.
These are written so that a NaN keeps a pair. Gaps are measured as differences of the
same terms, so the slack covers them too.
"""

from typing import Any

from numba import njit

from borecheck.bvh_build import F32
from borecheck.bvh_lanes import BACK_ROWS, BOUNDS, CENTRE, OWN, PROBE_SLACK
from borecheck.se3 import ROTATION_TOLERANCE

# Columns of one row of a relation: M (9), m (3), slack.
SHIFT = 9
SLACK = 12
RELATION_SHAPE = (2, 13)
# The float64 scratch of one pair: M and m, their inverse, R_b^-1.
PAIR_SHAPE = (3, 3, 4)
FORTH, BACK, UNDO_B = range(3)
# Columns of the frames of trees: origin (3), largest coordinate, node 0.
EXTENT, ROOT = 3, 4

# float32 boxes square coordinates; nothing in a scanner room is larger.
LARGEST_COORDINATE = 1e12

_BOX_UNIT = 2.0**-17  # 2 * 64 u
_WORLD_UNIT = 2.0**-45  # 2 * 128 v
_SMALLEST = 1e-30  # keeps float32 away from its denormal numbers
# Distances in the frame of a mesh against those in the world, for `inflate`.
_RIGID = 1.0 + 1e-5

KERNEL: dict[str, Any] = {"cache": True, "nogil": True, "error_model": "numpy"}
INLINE: dict[str, Any] = {**KERNEL, "forceinline": True}
# Only box tests may contract a * b + c: one rounding less, and the slack covers all.
BOX: dict[str, Any] = {**INLINE, "fastmath": {"contract"}}


@njit(**INLINE)
def copy_placement(placements, i, j, T):  # type: ignore[no-untyped-def]
    """Copies the upper rows of placement (i, j) into T, (3, 4)."""
    for row in range(3):
        for column in range(4):
            T[row, column] = placements[i, j, row, column]


@njit(**INLINE)
def is_rigid(placements, i, j):  # type: ignore[no-untyped-def]
    """Whether placement (i, j) is finite and rigid as `se3.check_transform` asks."""
    xx, xy, xz = placements[i, j, 0, 0], placements[i, j, 0, 1], placements[i, j, 0, 2]
    yx, yy, yz = placements[i, j, 1, 0], placements[i, j, 1, 1], placements[i, j, 1, 2]
    zx, zy, zz = placements[i, j, 2, 0], placements[i, j, 2, 1], placements[i, j, 2, 2]
    worst = max(
        abs(xx * xx + yx * yx + zx * zx - 1.0), abs(xx * xy + yx * yy + zx * zy)
    )
    worst = max(worst, abs(xy * xy + yy * yy + zy * zy - 1.0))
    worst = max(worst, abs(xx * xz + yx * yz + zx * zz))
    worst = max(worst, abs(xz * xz + yz * yz + zz * zz - 1.0))
    worst = max(worst, abs(xy * xz + yy * yz + zy * zz))
    determinant = (
        xx * (yy * zz - yz * zy) + xy * (yz * zx - yx * zz) + xz * (yx * zy - yy * zx)
    )
    x, y, z = placements[i, j, 0, 3], placements[i, j, 1, 3], placements[i, j, 2, 3]
    far = max(abs(x), max(abs(y), abs(z)))
    last = abs(placements[i, j, 3, 0]) + abs(placements[i, j, 3, 1])
    last += abs(placements[i, j, 3, 2]) + abs(placements[i, j, 3, 3] - 1.0)
    # A number that is not finite makes this sum NaN, and every comparison false.
    finite = (determinant + worst + x + y + z + last) * 0.0 == 0.0
    sized = finite & (far <= LARGEST_COORDINATE) & (determinant > 0.0)
    return sized & (worst <= ROTATION_TOLERANCE) & (last == 0.0)


@njit(**INLINE)
def is_identity(T):  # type: ignore[no-untyped-def]
    """Whether a transform leaves every point where it is."""
    same = True
    for i in range(3):
        for j in range(4):
            same &= T[i, j] == (1.0 if i == j else 0.0)
    return same


@njit(**INLINE)
def relate(T_a, T_b, b_is_world, frames_a, a, frames_b, b, inflate, pair, relation):  # type: ignore[no-untyped-def]
    """Fills row 0 of a relation, which takes boxes of a into the frame of b.

    Args:
        T_a: Placement of mesh a, (4, 4).
        T_b: Placement of mesh b.
        b_is_world: Whether that is the identity.
        frames_a: Of trees, (k, 5).
        a: Which of them.
        frames_b: As frames_a.
        b: As a.
        inflate: Boxes nearer than this count as meeting, [m].
        pair: Scratch; M and m are filled.
        relation: (2, 13), float32.
    """
    reach = abs(frames_b[b, 0]) + abs(frames_b[b, 1]) + abs(frames_b[b, 2])
    for i in range(3):
        reach += abs(frames_a[a, i]) + abs(T_a[i, 3]) + abs(T_b[i, 3])
        for j in range(3):
            pair[FORTH, i, j] = T_a[i, j]
        pair[FORTH, i, 3] = (
            T_a[i, 0] * frames_a[a, 0]
            + T_a[i, 1] * frames_a[a, 1]
            + T_a[i, 2] * frames_a[a, 2]
            + (T_a[i, 3] - T_b[i, 3])
        )
    if not b_is_world:
        for i in range(3):
            for j in range(3):
                pair[BACK, i, j] = T_b[i, j]
        _invert(pair, BACK, UNDO_B)
        _multiply(pair, UNDO_B, FORTH, BACK)
        for i in range(3):
            for j in range(4):
                pair[FORTH, i, j] = pair[BACK, i, j]
    size = frames_a[a, EXTENT] + frames_b[b, EXTENT]
    for i in range(3):
        pair[FORTH, i, 3] -= frames_b[b, i]
        size += abs(pair[FORTH, i, 3])
    slack = _BOX_UNIT * size + _WORLD_UNIT * (size + reach) + inflate * _RIGID
    relation[0, SLACK] = F32(slack * 1.000001 + _SMALLEST)
    relation[1, SLACK] = relation[0, SLACK]
    _round(pair, FORTH, relation, 0)


@njit(**INLINE)
def relate_back(pair, relation):  # type: ignore[no-untyped-def]
    """Fills row 1 of a relation, which takes boxes of b into the frame of a."""
    _invert(pair, FORTH, BACK)
    for i in range(3):
        pair[BACK, i, 3] = -(
            pair[BACK, i, 0] * pair[FORTH, 0, 3]
            + pair[BACK, i, 1] * pair[FORTH, 1, 3]
            + pair[BACK, i, 2] * pair[FORTH, 2, 3]
        )
    _round(pair, BACK, relation, 1)


@njit(**INLINE)
def _invert(pair, source, target):  # type: ignore[no-untyped-def]
    """The inverse of a 3x3 matrix near a rotation, by cofactors."""
    for j in range(3):
        p, q = (j + 1) % 3, (j + 2) % 3
        for i in range(3):
            r, s = (i + 1) % 3, (i + 2) % 3
            pair[target, i, j] = (
                pair[source, p, r] * pair[source, q, s]
                - pair[source, p, s] * pair[source, q, r]
            )
    scale = 1.0 / (
        pair[source, 0, 0] * pair[target, 0, 0]
        + pair[source, 0, 1] * pair[target, 1, 0]
        + pair[source, 0, 2] * pair[target, 2, 0]
    )
    for i in range(3):
        for j in range(3):
            pair[target, i, j] *= scale


@njit(**INLINE)
def _multiply(pair, left, right, target):  # type: ignore[no-untyped-def]
    """Target = the 3x3 part of left times the whole of right."""
    for i in range(3):
        for j in range(4):
            pair[target, i, j] = (
                pair[left, i, 0] * pair[right, 0, j]
                + pair[left, i, 1] * pair[right, 1, j]
                + pair[left, i, 2] * pair[right, 2, j]
            )


@njit(**INLINE)
def _round(pair, source, relation, row):  # type: ignore[no-untyped-def]
    for i in range(3):
        for j in range(3):
            relation[row, 3 * i + j] = F32(pair[source, i, j])
        relation[row, SHIFT + i] = F32(pair[source, i, 3])


@njit(**INLINE)
def child_box(nodes, reference):  # type: ignore[no-untyped-def]
    """Centre and half extents of the box in a slot; reference = 8 node + slot."""
    node, slot = reference >> 3, reference & 7
    return (
        nodes[node, 0, slot],
        nodes[node, 1, slot],
        nodes[node, 2, slot],
        nodes[node, 3, slot],
        nodes[node, 4, slot],
        nodes[node, 5, slot],
    )


@njit(**BOX)
def set_probe(box, relation, row, probe):  # type: ignore[no-untyped-def]
    """Fills what `bvh_lanes` asks of the box that stays while a node is opened.

    Args:
        box: Centre and half extents in the frame of its own tree.
        relation: See `relate`.
        row: The row that takes the box into the frame of the opened tree.
        probe: (19,), float32.
    """
    cx, cy, cz, hx, hy, hz = box
    slack = relation[row, SLACK]
    for i in range(3):
        mx, my, mz = (
            relation[row, 3 * i],
            relation[row, 3 * i + 1],
            relation[row, 3 * i + 2],
        )
        probe[CENTRE + i] = mx * cx + my * cy + mz * cz + relation[row, SHIFT + i]
        probe[BOUNDS + i] = abs(mx) * hx + abs(my) * hy + abs(mz) * hz + slack
    probe[OWN], probe[OWN + 1], probe[OWN + 2] = hx + slack, hy + slack, hz + slack
    for i in range(9):
        probe[BACK_ROWS + i] = relation[1 - row, i]
    probe[PROBE_SLACK] = slack


@njit(**BOX)
def roots_apart(nodes_a, root_a, nodes_b, root_b, relation):  # type: ignore[no-untyped-def]
    """Whether the boxes of two whole meshes are apart along the axes of b."""
    cx, cy, cz, hx, hy, hz = child_box(nodes_a, 8 * root_a)
    bx, by, bz, kx, ky, kz = child_box(nodes_b, 8 * root_b)
    m = relation[0]
    slack = m[SLACK]
    x = m[0] * cx + m[1] * cy + m[2] * cz + m[9]
    y = m[3] * cx + m[4] * cy + m[5] * cz + m[10]
    z = m[6] * cx + m[7] * cy + m[8] * cz + m[11]
    wx = abs(m[0]) * hx + abs(m[1]) * hy + abs(m[2]) * hz + slack
    wy = abs(m[3]) * hx + abs(m[4]) * hy + abs(m[5]) * hz + slack
    wz = abs(m[6]) * hx + abs(m[7]) * hy + abs(m[8]) * hz + slack
    return (abs(x - bx) > kx + wx) | (abs(y - by) > ky + wy) | (abs(z - bz) > kz + wz)
