"""How often Gauss-Newton finds the axes of an arm that is off its drawing."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from borecheck.calibration.axis_line import discs_at, discs_from_points, fit_axes
from borecheck.calibration.link_parameters import (
    lines_to_parameters,
)
from mri_arm.parameters import NAMES
from mri_arm.studies.calibration import CalibrationCase, sweeps
from mri_arm.studies.simulated_arms import forms, lines_of, nominal_arm, true_parameters

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Convergence:
    """How often axes are found without noise.

    Attributes:
        arms: How many arms were tried.
        found: Share of arms of which all six axes were found.
        most: Most iterations among them.
        mean: Mean iterations among them.
        worst: Largest error of a parameter among them, [m] or [rad].
        failed: For each joint, how many were not found.
    """

    arms: int
    found: float
    most: int
    mean: float
    worst: float
    failed: tuple[int, ...]


def convergence(
    arms: int, length: float, angle: float, start: str, rng: np.random.Generator
) -> Convergence:
    """Noise-free calibrations of many arms, each off its drawing.

    Args:
        arms: How many.
        length: Largest deviation of a length from the drawing [m].
        angle: Largest deviation of an angle [rad].
        start: "nominal" as in the paper, or "points".
        rng: Source of the arms and the samples.
    """
    case = CalibrationCase("exact", (21,) * 6, variation_deg=4.0, encoder_pulses=False)
    truth = np.array([true_parameters(rng, length, angle) for _ in range(arms)])
    seen = np.empty((arms, 6, 21, 3))
    for a in range(arms):
        lines = lines_of(truth[a])
        for i in range(6):
            seen[a, i] = sweeps(case, lines, i, 1, rng)[0]
    drawn = nominal_arm().lines
    points, directions = np.empty((arms, 6, 3)), np.empty((arms, 6, 3))
    iterations = np.empty((arms, 6), dtype=np.int64)
    for i in range(6):
        u = np.broadcast_to(drawn.directions[i], (arms, 3))
        p = np.broadcast_to(drawn.points[i], (arms, 3))
        first = discs_at(p, u, seen[:, i]) if start == "nominal" else None
        fit = fit_axes(seen[:, i], first or discs_from_points(seen[:, i], u))
        points[:, i], directions[:, i] = fit.points, fit.directions
        iterations[:, i] = np.where(fit.converged, fit.iterations, -1)
    found = lines_to_parameters(forms(), points, directions)
    errors = np.abs(np.stack([found[n] for n in NAMES], axis=1) - truth)
    right = _right(points, directions, truth) & (iterations > 0)
    whole = right.all(axis=1)
    return Convergence(
        arms,
        float(whole.mean()),
        int(iterations[whole].max(initial=0)),
        float(iterations[whole].mean()) if whole.any() else 0.0,
        float(errors[whole].max(initial=0.0)),
        tuple(int(x) for x in (~right).sum(axis=0)),
    )


def _right(points: Array, directions: Array, truth: Array) -> NDArray[np.bool_]:
    """Which axes are the true ones, (arms, 6)."""
    right = np.empty(points.shape[:2], dtype=bool)
    for a, values in enumerate(truth):
        lines = lines_of(values)
        off = np.cross(points[a] - lines.points, lines.directions)
        turn = np.cross(directions[a], lines.directions)
        far = np.maximum(np.abs(off).max(axis=1), np.abs(turn).max(axis=1))
        right[a] = far < 1e-9
    return right
