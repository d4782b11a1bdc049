"""Whether the needle can be tilted to all sides, proven between the tilts tried.

[CRANE] eqs. (22), (23): for every needle of a cone about the entry there is a
configuration, joined to the nominal one. The tilts are the points of a disk. It is
covered by triangles; at their corners the arm is solved for, and within a triangle it
moves as its joints do between the corners, straight. Of each triangle a proof is asked:
how far any point of a part can be from where it is in the triangle's middle (corners by
their own placements, what lies between by the bound of second order of
`motion.bounds`), against the certified distances there. A triangle without a proof is
cut in four.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from borecheck.plans.corridor import SLACK
from borecheck.setup.sweeps import Sweeps
from borecheck.setup.terms import NAMES, NOTHING, Terms

Array = NDArray[np.float64]
# Rotation vectors (m, 3) to configurations (m, joints): how the arm follows the needle.
Follow = Callable[[Array], Array]

# Corners of the fan of triangles, on a circle so wide that it covers the disk.
RIM = 16
# Triangles are cut so often, and so many are looked at; what is open then has no proof.
CUTS = 5
MOST = 3000
# The needle's line may be so far from the entry between tilts, [m]: what a corridor
# leaves beside the needle.
OFF = SLACK


@dataclass(frozen=True)
class ConeProof:
    """What is shown of a cone.

    Attributes:
        certified: Whether every tilt is shown to keep all constraints.
        reason: What stands against it, else how it was shown.
        zenith: Of the cone, [rad].
        triangles: How many were looked at.
        off: Bound on the tip's distance from the entry on the way, [m].
        against: A tilt, (3,), at which the arm breaks a constraint; or None.
    """

    certified: bool
    reason: str
    zenith: float
    triangles: int
    off: float
    against: Array | None = None


def rim(axis: Array, zenith: float, count: int) -> Array:
    """Rotation vectors (count, 3) square to an axis, evenly round, so long [rad]."""
    u, v = square_to(axis)
    at = 2.0 * np.pi * np.arange(count) / count
    return zenith * (np.outer(np.cos(at), u) + np.outer(np.sin(at), v))


def square_to(axis: Array) -> tuple[Array, Array]:
    """Two unit vectors square to a unit vector and to each other, (3,) each."""
    u = np.cross(axis, np.eye(3)[np.abs(axis).argmin()])
    u /= np.linalg.norm(u)
    return u, np.cross(axis, u)


def prove_cone(terms: Terms, axis: Array, follow: Follow) -> ConeProof:
    """The proof that the needle can be tilted by the zenith to all sides, or why not.

    Args:
        terms: What is asked of every configuration.
        axis: The needle's direction, scene's frame, (3,), unit.
        follow: How the arm follows; NaN where it does not.
    """
    zenith = terms.asked.cone
    if zenith == 0.0:
        return ConeProof(True, "no cone is asked", 0.0, 0, 0.0)
    sweeps = Sweeps(terms, OFF)
    corners = rim(axis, zenith / np.cos(np.pi / RIM), RIM)
    fan = np.stack([0.0 * corners, corners, np.roll(corners, -1, axis=0)], axis=1)
    fan = _cut(fan, zenith)  # the whole fan has never been proven at once
    looked, off = 0, 0.0
    for _ in range(CUTS + 1):
        qs = follow(fan.reshape(-1, 3)).reshape(len(fan), 3, -1)
        looked += len(fan)
        broken = _broken(terms, fan, qs, zenith)
        if broken is not None:
            return ConeProof(False, broken[0], zenith, looked, off, broken[1])
        proven, offs = sweeps.proven(qs)
        off = max(off, float(offs[proven].max(initial=0.0)))
        fan = _cut(fan[~proven], zenith)
        if not len(fan):
            return ConeProof(True, f"{looked} triangles", zenith, looked, off)
        if sweeps.hopeless or looked + len(fan) > MOST:
            break
    reason = f"{len(fan)} of its triangles have no proof: too near to a constraint"
    return ConeProof(False, reason, zenith, looked, off)


def _broken(
    terms: Terms, fan: Array, qs: Array, zenith: float
) -> tuple[str, Array] | None:
    """What stands against a corner in the cone, if anything does, and which corner."""
    tilts, flat = fan.reshape(-1, 3), qs.reshape(-1, qs.shape[-1])
    codes = terms.broken(flat)
    inside = np.linalg.norm(tilts, axis=1) <= zenith * (1.0 + 1e-12)
    against = np.flatnonzero((codes != NOTHING) & inside)
    if not len(against):
        return None
    k = int(against[0])
    tilt = np.degrees(np.linalg.norm(tilts[k]))
    return f"{NAMES[codes[k]]}, tilted by {tilt:.1f} deg", tilts[k]


def _cut(fan: Array, zenith: float) -> Array:
    """Every triangle in four; those wholly outside of the disk are left out."""
    a, b, c = fan[:, 0], fan[:, 1], fan[:, 2]
    ab, bc, ca = 0.5 * (a + b), 0.5 * (b + c), 0.5 * (c + a)
    four = [(a, ab, ca), (ab, b, bc), (ca, bc, c), (bc, ca, ab)]
    cut = np.concatenate([np.stack(one, axis=1) for one in four])
    return cut[_nearest(cut) <= zenith]


def _nearest(fan: Array) -> Array:
    """Distance of the origin to each triangle's edges, (n,); 0 never matters here."""
    p, q = fan, np.roll(fan, -1, axis=1)
    along = q - p
    size = np.einsum("nij,nij->ni", along, along)
    t = np.clip(-np.einsum("nij,nij->ni", p, along) / np.maximum(size, 1e-300), 0, 1)
    foot = p + t[..., None] * along
    # a triangle about the origin has an edge nearer than any of its corners
    return np.linalg.norm(foot, axis=2).min(axis=1)
