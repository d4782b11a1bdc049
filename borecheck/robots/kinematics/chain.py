"""Placements of all frames of a robot for many configurations in one compiled call.

For each joint T_parent_child(x) = T_parent_joint * motion(x), as URDF defines it:
turning about or sliding along the axis by x = multiplier * q[source] + offset. Mimic
joints are joints whose source is another joint's variable.
"""

import math
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from borecheck.core.se3 import check_transform
from borecheck.errors import GeometryError
from borecheck.geometry.kernels.compile import INLINE, kernel

# What a joint does with its variable.
FIXED, REVOLUTE, PRISMATIC = 0, 1, 2


Floats = NDArray[np.float64]
Ids = NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class Chain:
    """A tree of joints as plain arrays, copied and frozen.

    Frame 0 is the root; joint k carries frame k + 1. Parents come before children.

    Attributes:
        parents: Frame that each joint stands in, (j,).
        origins: T_parent_joint at joint position 0, (j, 4, 4), [m].
        axes: Axis in the joint's frame, (j, 3), unit length; ignored if fixed.
        kinds: FIXED, REVOLUTE (continuous, too) or PRISMATIC, (j,).
        sources: Which entry of q drives the joint, (j,); ignored if fixed.
        multipliers: Of that entry, (j,).
        offsets: Added to it, (j,), [rad] or [m].
        variables: Length of q.

    Raises:
        GeometryError: Arrays that do not fit together, parents behind their children,
            origins that are not rigid, axes that are not of unit length.
    """

    parents: Ids
    origins: Floats
    axes: Floats
    kinds: Ids
    sources: Ids
    multipliers: Floats
    offsets: Floats
    variables: int
    _parts: Floats = field(init=False, repr=False)

    def __post_init__(self) -> None:
        count = len(np.asarray(self.parents))
        for name, shape, kind in (
            ("parents", (), np.int64),
            ("origins", (4, 4), np.float64),
            ("axes", (3,), np.float64),
            ("kinds", (), np.int64),
            ("sources", (), np.int64),
            ("multipliers", (), np.float64),
            ("offsets", (), np.float64),
        ):
            self._keep(name, (count, *shape), kind)
        self._check()
        object.__setattr__(self, "_parts", _joint_parts(self))

    def placements(
        self,
        qs: ArrayLike,
        frames: ArrayLike | None = None,
        T_world_root: ArrayLike | None = None,
    ) -> Floats:
        """T_world_frame for every configuration, (n, frames, 4, 4).

        Args:
            qs: Configurations, (n, variables), [rad] and [m]; limits are not looked at.
            frames: Frames to give, in this order; default: all.
            T_world_root: Where the root stands; default: in the world.

        Raises:
            GeometryError: Wrong shape, a number that is not finite, no such frame.
        """
        qs = np.array(qs, np.float64, order="C")
        if qs.ndim != 2 or qs.shape[1] != self.variables:
            raise GeometryError(f"qs have shape {qs.shape}, not (n, {self.variables})")
        if not np.isfinite(qs).all():
            bad = int(np.flatnonzero(~np.isfinite(qs).all(axis=1))[0])
            raise GeometryError(
                f"configuration {bad} holds a number that is not finite"
            )
        wanted = self._wanted(frames)
        root = np.eye(4) if T_world_root is None else T_world_root
        root = check_transform(root, "T_world_root")
        placements = np.zeros((len(qs), len(wanted), 4, 4))
        _place(
            self.parents,
            self.kinds,
            self.sources,
            self.multipliers,
            self.offsets,
            self._parts,
            root,
            qs,
            wanted,
            placements,
        )
        return placements

    def _wanted(self, frames: ArrayLike | None) -> Ids:
        count = len(self.parents) + 1
        if frames is None:
            return np.arange(count)
        wanted = np.array(frames, np.int64, order="C")
        if wanted.ndim != 1 or (len(wanted) and not _inside(wanted, count)):
            raise GeometryError(f"frames must be a list of numbers below {count}")
        return wanted

    def _keep(self, name: str, shape: tuple[int, ...], kind: type) -> None:
        """Replaces a field by a checked, writable, private copy."""
        try:
            array: NDArray[Any] = np.array(getattr(self, name), dtype=kind, order="C")
        except (TypeError, ValueError):
            raise GeometryError(f"chain: {name} are no numbers") from None
        if array.shape != shape:
            raise GeometryError(f"chain: {name} have shape {array.shape}, not {shape}")
        if not np.isfinite(array).all():
            raise GeometryError(f"chain: {name} hold a number that is not finite")
        object.__setattr__(self, name, array)

    def _check(self) -> None:
        moving = self.kinds != FIXED
        if not np.isin(self.kinds, (FIXED, REVOLUTE, PRISMATIC)).all():
            raise GeometryError("chain: kinds are FIXED, REVOLUTE or PRISMATIC")
        late = (self.parents < 0) | (self.parents > np.arange(len(self.parents)))
        if late.any():
            k = int(np.flatnonzero(late)[0])
            raise GeometryError(
                f"chain: joint {k} stands in frame {self.parents[k]}, "
                f"which is not among the frames 0 to {k} before it"
            )
        if moving.any() and not _inside(self.sources[moving], self.variables):
            raise GeometryError(
                f"chain: a source is not among the {self.variables} variables"
            )
        lengths = np.linalg.norm(self.axes[moving], axis=1)
        # An axis typed with six digits is off by 1e-6.
        if (np.abs(lengths - 1.0) > 1e-6).any():
            raise GeometryError("chain: an axis is not of unit length")
        for k, T in enumerate(self.origins):
            check_transform(T, f"chain: origin of joint {k}")


def _inside(ids: Ids, count: int) -> bool:
    return bool(ids.min() >= 0 and ids.max() < count)


def _joint_parts(chain: Chain) -> Floats:
    """Per joint the constants A, B, C, (j, 3, 3, 4), of its motion.

    Revolute (Rodrigues, K the cross product matrix of the axis, O the origin): rotation
    A + sin(x) B + (1 - cos(x)) C with A = O, B = O K, C = O K^2, translation that of A.
    Prismatic: rotation that of A, translation that of A plus x times that of B.
    """
    parts = np.zeros((len(chain.parents), 3, 3, 4))
    parts[:, 0] = chain.origins[:, :3]
    for k, kind in enumerate(chain.kinds):
        R = chain.origins[k, :3, :3]
        if kind == FIXED:
            continue
        x, y, z = chain.axes[k] / math.hypot(*chain.axes[k])
        if kind == PRISMATIC:
            parts[k, 1, :, 3] = R @ (x, y, z)
            continue
        K = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
        parts[k, 1, :, :3] = R @ K
        parts[k, 2, :, :3] = R @ K @ K
    return parts


@kernel(**INLINE)
def _local_row(parts, k, r, b, c):  # type: ignore[no-untyped-def]
    """Row r of T_parent_child of joint k: its constants weighed with 1, b and c."""
    return (
        parts[k, 0, r, 0] + b * parts[k, 1, r, 0] + c * parts[k, 2, r, 0],
        parts[k, 0, r, 1] + b * parts[k, 1, r, 1] + c * parts[k, 2, r, 1],
        parts[k, 0, r, 2] + b * parts[k, 1, r, 2] + c * parts[k, 2, r, 2],
        parts[k, 0, r, 3] + b * parts[k, 1, r, 3] + c * parts[k, 2, r, 3],
    )


@kernel
def _place(  # type: ignore[no-untyped-def]
    parents, kinds, sources, multipliers, offsets, parts, root, qs, wanted, placements
):
    """Fills placements (n, wanted, 4, 4); see `Chain`."""
    frames = np.zeros((len(parents) + 1, 3, 4))
    frames[0] = root[:3]
    for i in range(len(qs)):
        for k in range(len(parents)):
            # The two numbers by which the parts of a joint are weighed.
            b = c = 0.0
            if kinds[k] != FIXED:
                b = multipliers[k] * qs[i, sources[k]] + offsets[k]
            if kinds[k] == REVOLUTE:
                # Of the half angle: 1 - cos has no cancellation near 0.
                sine, cosine = math.sin(0.5 * b), math.cos(0.5 * b)
                b, c = 2.0 * sine * cosine, 2.0 * sine * sine
            u = _local_row(parts, k, 0, b, c)
            v = _local_row(parts, k, 1, b, c)
            w = _local_row(parts, k, 2, b, c)
            parent = parents[k]
            for r in range(3):
                x, y, z = (
                    frames[parent, r, 0],
                    frames[parent, r, 1],
                    frames[parent, r, 2],
                )
                t = frames[parent, r, 3]
                frames[k + 1, r, 0] = x * u[0] + y * v[0] + z * w[0]
                frames[k + 1, r, 1] = x * u[1] + y * v[1] + z * w[1]
                frames[k + 1, r, 2] = x * u[2] + y * v[2] + z * w[2]
                frames[k + 1, r, 3] = x * u[3] + y * v[3] + z * w[3] + t
        for f in range(len(wanted)):
            for r in range(3):
                for s in range(4):
                    placements[i, f, r, s] = frames[wanted[f], r, s]
            placements[i, f, 3, 3] = 1.0
