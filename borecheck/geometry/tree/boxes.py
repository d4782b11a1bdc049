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

from borecheck.core.se3 import ROTATION_TOLERANCE
from borecheck.geometry.kernels.compile import BOX, INLINE, kernel
from borecheck.geometry.tree.build import F32
from borecheck.geometry.tree.simd import BACK_ROWS, BOUNDS, CENTRE, OWN, PROBE_SLACK

# Columns of one row of a relation: M (9), m (3), slack.
SHIFT = 9
SLACK = 12
RELATION_SHAPE = (2, 13)
# Columns of the frames of trees: origin (3), largest coordinate, node 0.
EXTENT, ROOT, FRAME_COLUMNS = 3, 4, 5

# float32 boxes square coordinates; nothing in a scanner room is larger.
LARGEST_COORDINATE = 1e12

_BOX_UNIT = 2.0**-17  # 2 * 64 u
_WORLD_UNIT = 2.0**-45  # 2 * 128 v
_SMALLEST = 1e-30  # keeps float32 away from its denormal numbers
# Distances in the frame of a mesh against those in the world, for `inflate`.
_RIGID = 1.0 + 1e-5


@kernel(**INLINE)
def copy_placement(placements, i, j, T):  # type: ignore[no-untyped-def]
    """Copies the upper rows of placement (i, j) into T, (3, 4)."""
    for row in range(3):
        for column in range(4):
            T[row, column] = placements[i, j, row, column]


@kernel(**INLINE)
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


@kernel(**INLINE)
def motion_of(T):  # type: ignore[no-untyped-def]
    """A (3, 4) transform as twelve numbers: its matrix row by row, then its shift.

    Numbers, not arrays: what is written piece by piece and read back as a vector
    stalls the processor for longer than the arithmetic takes.
    """
    x, y = (T[0, 0], T[0, 1], T[0, 2]), (T[1, 0], T[1, 1], T[1, 2])
    z = (T[2, 0], T[2, 1], T[2, 2])
    return (*x, *y, *z, T[0, 3], T[1, 3], T[2, 3])


@kernel(**INLINE)
def is_identity(T):  # type: ignore[no-untyped-def]
    """Whether a motion leaves every point where it is."""
    turned = abs(T[0] - 1.0) + abs(T[4] - 1.0) + abs(T[8] - 1.0)
    turned += abs(T[1]) + abs(T[2]) + abs(T[3]) + abs(T[5]) + abs(T[6]) + abs(T[7])
    return turned + abs(T[9]) + abs(T[10]) + abs(T[11]) == 0.0


@kernel(**INLINE)
def turn(M, x, y, z):  # type: ignore[no-untyped-def]
    """The matrix of a motion times a vector."""
    return (
        M[0] * x + M[1] * y + M[2] * z,
        M[3] * x + M[4] * y + M[5] * z,
        M[6] * x + M[7] * y + M[8] * z,
    )


@kernel(**INLINE)
def undo(M):  # type: ignore[no-untyped-def]
    """The inverse of a motion that is near rigid, its matrix by cofactors."""
    a, b = M[4] * M[8] - M[5] * M[7], M[5] * M[6] - M[3] * M[8]
    c = M[3] * M[7] - M[4] * M[6]
    s = 1.0 / (M[0] * a + M[1] * b + M[2] * c)
    R = (
        s * a,
        s * (M[2] * M[7] - M[1] * M[8]),
        s * (M[1] * M[5] - M[2] * M[4]),
        s * b,
        s * (M[0] * M[8] - M[2] * M[6]),
        s * (M[2] * M[3] - M[0] * M[5]),
        s * c,
        s * (M[1] * M[6] - M[0] * M[7]),
        s * (M[0] * M[4] - M[1] * M[3]),
    )
    x, y, z = turn(R, M[9], M[10], M[11])
    return (*R, -x, -y, -z)


@kernel(**INLINE)
def relate(T_a, T_b, b_is_world, frames_a, a, frames_b, b):  # type: ignore[no-untyped-def]
    """M and m of the module's text, twelve numbers.

    Args:
        T_a: Motion of mesh a.
        T_b: Motion of mesh b.
        b_is_world: Whether that is the identity.
        frames_a: Of trees, (k, 5).
        a: Which of them.
        frames_b: As frames_a.
        b: As a.
    """
    x, y, z = turn(T_a, frames_a[a, 0], frames_a[a, 1], frames_a[a, 2])
    x += T_a[9] - T_b[9]
    y += T_a[10] - T_b[10]
    z += T_a[11] - T_b[11]
    M = (T_a[0], T_a[1], T_a[2], T_a[3], T_a[4], T_a[5], T_a[6], T_a[7], T_a[8])
    if not b_is_world:
        back = undo(T_b)
        x, y, z = turn(back, x, y, z)
        p0, p1, p2 = turn(back, M[0], M[3], M[6])
        q0, q1, q2 = turn(back, M[1], M[4], M[7])
        r0, r1, r2 = turn(back, M[2], M[5], M[8])
        M = (p0, q0, r0, p1, q1, r1, p2, q2, r2)
    return (*M, x - frames_b[b, 0], y - frames_b[b, 1], z - frames_b[b, 2])


@kernel(**INLINE)
def slack_of(M, T_a, T_b, frames_a, a, frames_b, b, inflate):  # type: ignore[no-untyped-def]
    """What every comparison allows: roundings, and `inflate` [m] if that is not 0."""
    size = frames_a[a, EXTENT] + frames_b[b, EXTENT]
    size += abs(M[9]) + abs(M[10]) + abs(M[11])
    reach = abs(frames_a[a, 0]) + abs(frames_a[a, 1]) + abs(frames_a[a, 2])
    reach += abs(frames_b[b, 0]) + abs(frames_b[b, 1]) + abs(frames_b[b, 2])
    reach += abs(T_a[9]) + abs(T_a[10]) + abs(T_a[11])
    reach += abs(T_b[9]) + abs(T_b[10]) + abs(T_b[11])
    slack = _BOX_UNIT * size + _WORLD_UNIT * (size + reach) + inflate * _RIGID
    return F32(slack * 1.000001 + _SMALLEST)


@kernel(**INLINE)
def keep_relation(M, slack, row, relation):  # type: ignore[no-untyped-def]
    """Row 0 takes boxes of a into the frame of b (M), row 1 back (its inverse)."""
    for i in range(12):
        relation[row, i] = F32(M[i])
    relation[row, SLACK] = slack


@kernel(**INLINE)
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


@kernel(**BOX)
def set_probe(box, relation, row, probe):  # type: ignore[no-untyped-def]
    """Fills what `tree.simd` asks of the box that stays while a node is opened.

    Args:
        box: Centre and half extents in the frame of its own tree.
        relation: See `keep_relation`.
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


@kernel(**BOX)
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
