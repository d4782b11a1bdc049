"""Zerobot about a target: how the arm stands for a needle direction, and bounds.

The chart of directions is Zerobot's own, (q4, q5): the needle points along

    n = (-s S5, s S4 C5, -C4 C5).

The needle's line goes through the target t. Its station u is the distance from t back
to the tip; the arm stands for the station it has with the needle drawn in.

Bounds. A cell of directions has a centre and half widths h4, h5; p is a point of a link
at the centre's pose, p' the same point of the link at any other direction of the cell,
same station. First q4 changes, with q5 the centre's: everything behind q3 turns about
the line through t along x, so p moves by a chord of at most h4 r_x(p), r_x its distance
from that line. Then q5 changes.

* Holder, carriage and needle turn about the line through t along y' (the holder's
  axis). The first turn carried line and point together, so the distance is still
  r_y(p), the centre's: |p' - p| <= h4 r_x(p) + h5 r_y(p).
* The arm only shifts with its pivot p5, which is fixed to the holder:
  |p' - p| <= h4 r_x(p) + h5 r_y(p5).
* The crank shifts so and turns by q5 about its own axis, at distance r_c(p):
  h5 r_c(p) more. A rod shifts so and with its pin on the crank, at `rod_lever` from
  that axis: h5 rod_lever more.
* Lift, slide and cross shift along axes with the pivot p4 of the arm's roll, a point of
  the arm: |p' - p| <= h4 r_x(p4) + h5 r_y(p5). The same bounds |q1|, |q2|, |q3| against
  the centre's, which are its coordinates.

All hold for cells of any size. r_x and r_y are convex in p: over a box they are largest
at a corner, and over a range of stations, in which p moves along a line, at its ends.
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from zerobot.dimensions import Dimensions, from_arguments
from zerobot.inverse import ALONG_BORE

Array = NDArray[np.float64]

_STILL = ("base",)
_STAGES = ("lift", "slide", "cross")
_TILTED = ("holder", "carriage", "needle")
_RODS = ("rod_a", "rod_b")


def about_target(**arguments: str | float) -> "AboutTarget":
    """The chart and the bounds that the robot's arguments ask for."""
    return AboutTarget(from_arguments(arguments))


@dataclass(frozen=True)
class AboutTarget:
    """Directions about a target, in the world frame W; angles are (q4, q5).

    Attributes:
        d: The dimensions.
        axes: The joints whose positions are the chart's coordinates.
    """

    d: Dimensions
    axes: tuple[str, str] = ("q4", "q5")

    def direction(self, angles: Array) -> Array:
        """Unit vectors (k, 3) along the needle, for angles (k, 2), [rad]."""
        S4, C4, S5, C5 = self._turns(angles)
        s = self.d.mount_sign
        return np.stack([-s * S5, s * S4 * C5, -C4 * C5], axis=-1)

    def angles(self, direction: Array) -> Array:
        """The chart's coordinates (k, 2) of unit vectors (k, 3); NaN where none are."""
        s, o = self.d.mount_sign, self.d.offsets
        x, y, z = np.moveaxis(direction, -1, 0)
        across = np.hypot(y, z)
        q5 = np.arctan2(-s * x, across) - o[4]
        q4 = np.arctan2(s * y, -z) - o[3]
        found = np.stack([_within_turn(q4), _within_turn(q5)], axis=-1)
        return np.where((across < ALONG_BORE)[..., None], np.nan, found)

    def spread(self, angles: Array, half: Array) -> Array:
        """Bound on the angle between a cell's directions and its centre's, (k,), [rad].

        The way straight through the chart is no shorter than the angle; its length is
        that of (C5 dq4, dq5).
        """
        q5 = angles[:, 1] + self.d.offsets[4]
        least = np.maximum(np.abs(q5) - half[:, 1], 0.0)
        return np.hypot(np.cos(np.minimum(least, math.pi)) * half[:, 0], half[:, 1])

    def halves(self, angles: Array, angle: float) -> Array:
        """Half widths (2,) of a cell about (q4, q5) that holds a cone of directions.

        q5 is a latitude, q4 a longitude: a cap of that radius is as wide as it is high,
        and reaches asin(sin(angle) / C5) in longitude; infinite if it holds the pole.
        """
        q5 = abs(float(angles[1]) + self.d.offsets[4])
        if q5 + angle >= 0.5 * math.pi:
            return np.full(2, np.inf)
        return np.array([math.asin(math.sin(angle) / math.cos(q5)), angle])

    def configurations(
        self, target: Array, angles: Array, station: Array, insertion: float
    ) -> Array:
        """Configurations (k, 6), the tip at stations (k,) before the target, [m]."""
        d, o = self.d, self.d.offsets
        S4, C4, S5, C5 = self._turns(angles)
        s, ly = d.mount_sign, d.tip_offset_y
        length = insertion + o[5] + d.l9 + d.lE + d.tip_offset_z
        l7 = d.l7 - d.tip_offset_x
        rho = d.l2 + length * C5 + l7 * S5
        tip = target - station[:, None] * self.direction(angles)
        q = np.empty((len(angles), 6))
        q[:, 0] = tip[:, 2] - d.l6 + C4 * rho - S4 * ly - o[0]
        q[:, 1] = -tip[:, 0] - d.l4 + s * d.l1 + s * (l7 * C5 - length * S5) - o[1]
        q[:, 2] = d.l3 - tip[:, 1] - d.l5 + s * (S4 * rho + C4 * ly) - o[2]
        q[:, 3:5] = angles
        q[:, 5] = insertion
        return q

    def joint_changes(self, target: Array, q: Array, half: Array) -> Array:
        """Bounds on |q - the centre's| in a cell at the same station, (k, 6)."""
        p4, p5 = self._pivots(q)
        stage = half[:, 0] * _from_x_line(p4 - target)
        stage += half[:, 1] * _from_side_line(p5 - target, self._side(q))
        columns = (stage, stage, stage, half[:, 0], half[:, 1], 0.0 * stage)
        return np.stack(columns, axis=-1)

    def displacements(
        self, link: str, points: Array, target: Array, q: Array, half: Array
    ) -> Array:
        """Bounds on how far points (k, n, 3) of a link move in a cell, (k, n), [m].

        Args:
            link: The link.
            points: Points of it at the centre's pose.
            target: The target, (3,).
            q: The centre's configurations, (k, 6).
            half: Half widths of the cells, (k, 2), [rad].

        Raises:
            KeyError: A link that the chart does not know.
        """
        if link in _STILL:
            return np.zeros(points.shape[:2])
        if link in _STAGES:
            return np.tile(
                self.joint_changes(target, q, half)[:, :1], points.shape[1:2]
            )
        h4, h5, side = half[:, :1], half[:, 1:], self._side(q)[:, None]
        turned = h4 * _from_x_line(points - target)
        if link in _TILTED:
            return np.asarray(turned + h5 * _from_side_line(points - target, side))
        p5 = self._pivots(q)[1][:, None]
        shifted = turned + h5 * _from_side_line(p5 - target, side)
        if link == "arm":
            return np.asarray(shifted)
        if link in _RODS:
            return np.asarray(shifted + h5 * self.d.rod_lever)
        if link != "crank":
            raise KeyError(link)
        crank = p5 - self.d.mount_sign * self.d.rod_length * np.eye(3)[0]
        return np.asarray(shifted + h5 * _from_side_line(points - crank, side))

    def speed(self, link: str, angles: Array) -> Array:
        """How a link moves with the station, (k, 3), [m/m]; it does not turn."""
        back = -self.direction(angles)
        if link in _STILL:
            return np.zeros_like(back)
        if link == "lift":
            return back * (0.0, 0.0, 1.0)
        if link == "slide":
            return back * (1.0, 0.0, 1.0)
        return back

    def _turns(self, angles: Array) -> tuple[Array, Array, Array, Array]:
        q4, q5 = np.moveaxis(angles + np.array(self.d.offsets[3:5]), -1, 0)
        return np.sin(q4), np.cos(q4), np.sin(q5), np.cos(q5)

    def _pivots(self, q: Array) -> tuple[Array, Array]:
        """Origins of frames 4 and 5, (k, 3): the arm's end on its axis, the tilt's."""
        d, o, s = self.d, self.d.offsets, self.d.mount_sign
        S4, C4, _, _ = self._turns(q[:, 3:5])
        x = -d.l4 - q[:, 1] - o[1] + s * d.l1
        y = d.l3 - q[:, 2] - o[2] - d.l5
        z = q[:, 0] + o[0] + d.l6
        p4 = np.stack([x, y, z], axis=-1)
        p5 = np.stack([x, y + s * d.l2 * S4, z - d.l2 * C4], axis=-1)
        return p4, p5

    def _side(self, q: Array) -> Array:
        """The holder's axis, (k, 3)."""
        S4, C4, _, _ = self._turns(q[:, 3:5])
        return np.stack([0.0 * S4, self.d.mount_sign * C4, S4], axis=-1)


def _from_x_line(v: Array) -> Array:
    """Distance of points v from the line along x."""
    return np.asarray(np.hypot(v[..., 1], v[..., 2]))


def _from_side_line(v: Array, side: Array) -> Array:
    """Distance of points v from the line along a unit vector across x."""
    across = v[..., 1] * side[..., 2] - v[..., 2] * side[..., 1]
    return np.asarray(np.hypot(v[..., 0], across))


def _within_turn(angle: Array) -> Array:
    return np.asarray(np.remainder(angle + math.pi, 2.0 * math.pi) - math.pi)
