"""The arm's parameters axis by axis: [Heikkila2010] section 4, Appendices I and II."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from borecheck.calibration.axes_motion import Lines, target_from, turned
from borecheck.calibration.axis_line import (
    FEWEST_POINTS,
    AxisFit,
    discs_at,
    discs_from_points,
    fit_axes,
)
from borecheck.calibration.measurements import STILL, Measurements
from borecheck.calibration.serial_arm import SerialArm
from borecheck.errors import GeometryError

Array = NDArray[np.float64]

STARTS = ("points", "nominal")

# Standard deviation of the disc's centre over its radius above which the arc does not
# fix the axis: beyond it the estimate is biased by as much as it scatters.
LOOSEST = 0.1

# Residuals beyond this many robust standard deviations are outliers (robust option).
OUTLIER = 5.0

# Circles through three points tried to find the one most points lie on: with a third
# of the points wrong, 200 all fail with probability (1 - 0.3)^200 < 1e-30.
TRIPLES = 200


@dataclass(frozen=True, eq=False)
class AxisByAxis:
    """The arm as the discs of its joints show it.

    Attributes:
        lines: Its axes at zero.
        target: The target's place at zero, (3,), [m].
        parameters: By name, [m] and [rad].
        covariance: Of tilt 1, tilt 2, shift 1, shift 2 of every axis as `Lines.moved`
            takes them, (4 k, 4 k).
        iterations: Gauss-Newton steps of every axis, (k,).
        rms: Of the plane and cylinder errors of every axis, (k,), [m].
        radius: Of the discs, (k,), [m].
        arc: Angle that each joint turned through, (k,), [rad].
        samples: Points that each axis was found from, (k,).
        outliers: Samples left out, by index.
    """

    lines: Lines
    target: Array
    parameters: dict[str, float]
    covariance: Array
    iterations: NDArray[np.int64]
    rms: Array
    radius: Array
    arc: Array
    samples: NDArray[np.int64]
    outliers: NDArray[np.intp]


def estimate(
    arm: SerialArm, data: Measurements, start: str = "points", robust: bool = False
) -> AxisByAxis:
    """Axes, one after the other from the base, and the parameters they have.

    Args:
        arm: The arm as drawn; only the signs of the axes and the forms are taken from
            it (and the start, if it is nominal).
        data: With every joint turned alone.
        start: "points" never starts too far away; "nominal" is the paper's.
        robust: Leaves out points far off the disc of the others.

    Raises:
        GeometryError: A joint that was not turned, an arc too short for its noise, a
            fit that does not settle; names the joint.
    """
    found = Lines(arm.lines.points.copy(), arm.lines.directions.copy())
    k = len(arm.lines)
    own, passed_on = np.zeros((4 * k, 4 * k)), np.zeros((4 * k, 4 * k))
    fits, arcs, outliers = [], [], []
    for i, name in enumerate(arm.joint_names):
        members = data.of(name)
        q = data.q[members]
        points = _upstream_at_zero(found, i, q, data.points[members])
        try:
            fit, kept = _fit(arm, i, q, points, start, robust)
        except GeometryError as error:
            raise GeometryError(f"joint {name}: {error}") from error
        found.points[i], found.directions[i] = fit.points[0], fit.directions[0]
        block = slice(4 * i, 4 * i + 4)
        own[block, block] = _line_covariance(found, i, fit)
        passed_on[block, : 4 * i] = _passed_on(found, i, q.mean(axis=0))
        fits.append(fit)
        arcs.append(float(np.ptp(q[:, i])))
        outliers.append(members[~kept])
    # deviation = own + passed_on deviation, from the base outwards
    total = np.linalg.inv(np.eye(4 * k) - passed_on)
    return AxisByAxis(
        lines=found,
        target=target_from(found, data.q, data.points),
        parameters=arm.parameters(found),
        covariance=np.asarray(total @ own @ total.T),
        iterations=np.array([fit.iterations[0] for fit in fits]),
        rms=np.array([fit.rms[0] for fit in fits]),
        radius=np.array([fit.discs.radius[0] for fit in fits]),
        arc=np.array(arcs),
        samples=np.array([fit.residuals.shape[1] for fit in fits]),
        outliers=np.concatenate(outliers),
    )


def _upstream_at_zero(lines: Lines, joint: int, q: Array, points: Array) -> Array:
    """Where the points would be if the joints above stood at zero."""
    for i in range(joint):
        points = turned(lines, i, -q[:, i], points)
    return points


def _fit(
    arm: SerialArm, i: int, q: Array, points: Array, start: str, robust: bool
) -> tuple[AxisFit, NDArray[np.bool_]]:
    if len(points) < FEWEST_POINTS:
        raise GeometryError(
            f"{len(points)} samples in which it turned alone; it takes at least "
            f"{FEWEST_POINTS}"
        )
    if np.ptp(q[:, i + 1 :], axis=0).max(initial=0.0) > STILL:
        raise GeometryError("joints below it did not stand still while it turned")
    kept = near_one_circle(points) if robust else np.ones(len(points), dtype=bool)
    fit = _fit_disc(arm, i, q[kept], points[kept], start)
    _check(fit, q[kept, i], start)
    return fit, kept


def near_one_circle(points: Array) -> NDArray[np.bool_]:
    """Which points lie on the circle that most of them lie on.

    Circles through three points each are tried (with a fixed seed); the one with the
    smallest median distance wins, and decides what is far off.
    """
    rng = np.random.default_rng(0)
    triples = np.array([rng.permutation(len(points))[:3] for _ in range(TRIPLES)])
    spread = np.linalg.svd(
        points[triples] - points[triples].mean(axis=1, keepdims=True), compute_uv=False
    )
    triples = triples[spread[:, 1] > 1e-3 * spread[:, 0].max()]
    if not len(triples):
        return np.ones(len(points), dtype=bool)
    discs = discs_from_points(points[triples])
    T = discs.T_world_disc
    p = (points - T[:, None, :3, 3]) @ T[:, :3, :3]
    flat = np.hypot(p[..., 0], p[..., 1]) - discs.radius[:, None]
    off = np.hypot(flat, p[..., 2])
    best = off[int(np.median(off, axis=1).argmin())]
    return np.asarray(best <= OUTLIER * 1.4826 * np.median(best) + 1e-12)


def _fit_disc(arm: SerialArm, i: int, q: Array, points: Array, start: str) -> AxisFit:
    nominal_point, nominal = (
        arm.lines.points[i : i + 1],
        arm.lines.directions[i : i + 1],
    )
    if start == "nominal":
        discs = discs_at(nominal_point, nominal, points[None])
    else:
        discs = discs_from_points(points[None], nominal)
    fit = fit_axes(points[None], discs)
    if fit.converged[0] and turning_sense(fit, q[:, i], points) < 0.0:
        raise GeometryError(
            "turns the other way round than its axis in the URDF; reverse the sign of "
            "the encoder or the axis"
        )
    return fit


def turning_sense(fit: AxisFit, angle: Array, points: Array) -> float:
    """Positive if the points turn about the axis by the right hand as angles grow."""
    order = np.argsort(angle)
    away = points[order] - fit.points[0]
    sweep = np.cross(away[:-1], away[1:]) @ fit.directions[0]
    return float(sweep[np.diff(angle[order]) < np.pi].sum())


def _check(fit: AxisFit, angle: Array, start: str) -> None:
    if not fit.converged[0] and start != "points":
        raise GeometryError(
            "the estimation of its axis does not settle; start from the points"
        )
    if not fit.converged[0]:
        raise GeometryError(
            f"its arc of {np.degrees(np.ptp(angle)):.3g} deg is too short for the "
            "errors of its points: the estimation of its axis does not settle"
        )
    C = fit.covariance[0]
    if not np.isfinite(C).all():
        raise GeometryError("its arc is too short to fix an axis: singular equations")
    loose = _scatter(fit) * float(np.sqrt(np.linalg.eigvalsh(C[2:4, 2:4]).max()))
    if loose > LOOSEST * fit.discs.radius[0]:
        raise GeometryError(
            f"its arc of {np.degrees(np.ptp(angle)):.3g} deg is too short for "
            f"errors of {1e3 * fit.rms[0]:.3g} mm: its axis is uncertain by "
            f"{1e3 * loose:.3g} mm"
        )


def _scatter(fit: AxisFit) -> float:
    """Standard deviation of one error, from the residuals."""
    e = fit.residuals[0]
    free = max(e.size - 6, 1)
    return float(np.sqrt((e**2).sum() / free))


def _line_covariance(lines: Lines, i: int, fit: AxisFit) -> Array:
    """Covariance of the axis in the coordinates of `Lines.moved`, (4, 4)."""
    T = fit.discs.T_world_disc[0]
    v, w = (vectors[i] for vectors in lines.bases())
    x, y = T[:3, 0], T[:3, 1]
    turn = np.array([[v @ x, v @ y], [w @ x, w @ y]])
    # an increment (alpha, beta, x, y) of the points moves the disc the other way:
    # its z axis by (-beta, alpha), its origin by (-x, -y)
    A = np.zeros((4, 6))
    A[:2, :2] = turn @ np.array([[0.0, -1.0], [1.0, 0.0]])
    A[2:, 2:4] = -turn
    return np.asarray(_scatter(fit) ** 2 * A @ fit.covariance[0] @ A.T)


def _passed_on(lines: Lines, i: int, q: Array) -> Array:
    """How deviations of the axes above move this one when they do not stand at zero.

    An axis is measured where the joints above put it and turned back about their found
    axes. Derivative in the coordinates of `Lines.moved`, (4, 4 i), by differences.
    """
    if not np.abs(q[:i]).max(initial=0.0) > STILL:
        return np.zeros((4, 4 * i))
    p, u = lines.points[i], lines.directions[i]
    ends = np.stack([p, p + u])
    angles = np.repeat(q[None], 2, axis=0)
    for j in reversed(range(i)):
        ends = turned(lines, j, angles[:, j], ends)
    v, w = (vectors[i] for vectors in lines.bases())
    step = 1e-6
    columns = []
    for j in range(4 * i):
        move = np.zeros(4 * len(lines))
        move[j] = step
        sides = []
        for side in (lines.moved(move), lines.moved(-move)):
            sides.append(_upstream_at_zero(side, i, angles, ends))
        (p1, e1), (p2, e2) = sides
        shift, tilt = (p1 - p2) / (2 * step), ((e1 - p1) - (e2 - p2)) / (2 * step)
        columns.append([tilt @ v, tilt @ w, shift @ v, shift @ w])
    return np.array(columns).T
