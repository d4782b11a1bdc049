"""Measurements to an arm's parameters: axis by axis, then if wanted all at once."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from borecheck.calibration.axes_motion import Lines, positions
from borecheck.calibration.axis_by_axis import AxisByAxis, estimate
from borecheck.calibration.measurements import Measurements
from borecheck.calibration.noise import Noise, seen_noise
from borecheck.calibration.refinement import Refinement, parameter_sigmas, refine
from borecheck.calibration.serial_arm import SerialArm
from borecheck.core.result_file import SCHEMA_VERSION
from borecheck.core.text import in_lines
from borecheck.core.version import __version__
from borecheck.errors import GeometryError

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Fit:
    """An arm as its measurements show it.

    Attributes:
        arm: As drawn.
        axes: The result axis by axis; None if not every joint turned alone.
        refined: The result all at once, or None.
        noise: How device and encoders scatter.
        sigmas: Standard deviations of the parameters.
        robust: Whether what is far off was left out or trusted less.
    """

    arm: SerialArm
    axes: AxisByAxis | None
    refined: Refinement | None
    noise: Noise | None
    sigmas: Mapping[str, float]
    robust: bool = False

    @property
    def best(self) -> "AxisByAxis | Refinement":
        """The refined result if there is one."""
        chosen = self.refined or self.axes
        assert chosen is not None  # `fit` makes at least one
        return chosen

    @property
    def lines(self) -> Lines:
        """The found axes at zero."""
        return self.best.lines


def fit(
    arm: SerialArm,
    data: Measurements,
    *,
    refined: bool = False,
    start: str = "points",
    robust: bool = False,
) -> Fit:
    """The arm that measurements show.

    Args:
        arm: As drawn.
        data: Joints turned alone; with `refined` poses of their own too, or only.
        refined: Whether to fit all parameters at once afterwards.
        start: Of each axis: "points", or the paper's "nominal".
        robust: Leaves out (axes) or trusts less (refinement) what is far off.

    Raises:
        GeometryError: What the samples do not fix, by joint or parameter.
    """
    alone = {name for name in data.moving if name}
    complete = all(name in alone for name in arm.joint_names)
    if not complete and not refined:
        missing = ", ".join(n for n in arm.joint_names if n not in alone)
        raise GeometryError(
            f"{missing} never turned alone; calibrating axis by axis needs that of "
            "every joint (--refine takes poses of any kind)"
        )
    axes = estimate(arm, data, start=start, robust=robust) if complete else None
    if not refined:
        assert axes is not None
        sigmas = parameter_sigmas(arm, axes.lines, axes.covariance)
        return Fit(arm, axes, None, None, sigmas, robust)
    lines = None if axes is None else axes.lines
    noise = None if lines is None else seen_noise(lines, data, arm.joint_names)
    result = refine(arm, data, lines, "cauchy" if robust else "linear", noise)
    sigmas = parameter_sigmas(arm, result.lines, result.covariance)
    return Fit(arm, axes, result, noise, sigmas, robust)


def residuals(found: Fit, data: Measurements) -> Array:
    """Measured minus fitted places, (n, 3), [m]."""
    best = found.best
    return np.asarray(data.points - positions(best.lines, data.q, best.target))


def as_document(
    found: Fit,
    data: Measurements,
    robot: str,
    argv: Sequence[str],
    odd: Sequence[str] = (),
) -> dict[str, Any]:
    """The result as JSON, with everything a report needs."""
    arm, best = found.arm, found.best
    off = residuals(found, data)
    names = arm.forms.names
    document: dict[str, Any] = {
        "schema_version": SCHEMA_VERSION,
        "command": "calibrate fit",
        "argv": ["borecheck", *argv],
        "version": __version__,
        "robot": robot,
        "data": data.file,
        "world_link": arm.world_link,
        "tip_link": arm.tip_link,
        "not_identified": dict(arm.held),
        "parameters": {
            name: {
                "value": best.parameters[name],
                "nominal": arm.nominal[name],
                "sigma": found.sigmas[name],
                "unit": "rad" if name in arm.forms.angles else "m",
            }
            for name in names
        },
        "iterations": _iterations(found),
        "odd": list(odd),
        "repeated": data.repeated,
        "rms_m": float(np.sqrt((off**2).mean())),
        "target_at_zero_m": best.target.tolist(),
        "refined": found.refined is not None,
        "condition": found.refined.condition if found.refined else None,
        "axes": _axes(found),
        "samples": [
            {"moving": name, "q": q.tolist(), "residual_m": e.tolist()}
            for name, q, e in zip(data.moving, data.q, off, strict=True)
        ],
    }
    if found.axes is not None:
        document["outliers"] = [int(i) for i in found.axes.outliers]
    if found.noise is not None:
        document["noise"] = {
            "point_m": found.noise.point,
            "joints_rad": dict(
                zip(arm.joint_names, map(float, found.noise.joints), strict=True)
            ),
        }
    return document


def as_text(document: Mapping[str, Any]) -> str:
    """The result for people."""
    lines = [f"{'parameter':10} {'value':>14} {'nominal':>12} {'sigma':>12}"]
    for name, row in document["parameters"].items():
        scale, unit = (1e3, "mm") if row["unit"] == "m" else (np.degrees(1.0), "deg")
        value, nominal, sigma = (scale * row[k] for k in ("value", "nominal", "sigma"))
        lines.append(f"{name:10} {value:14.5f} {nominal:12.5f} {sigma:12.5f} {unit}")
    for axis in document["axes"]:
        lines.append(
            f"axis {axis['joint']}: {axis['samples']} samples over "
            f"{np.degrees(axis['arc_rad']):.1f} deg, radius "
            f"{1e3 * axis['radius_m']:.1f} mm, rms "
            f"{1e3 * axis['rms_m']:.4f} mm, {axis['iterations']} iterations"
        )
    if document["condition"] is not None:
        lines.append(f"condition number {document['condition']:.1f} (1 is best)")
    if document.get("outliers"):
        lines.append(f"left out as far off: samples {document['outliers']}")
    lines.append(
        f"rms of the points {1e3 * document['rms_m']:.4f} mm, "
        f"{document['iterations']} iterations"
    )
    if document["repeated"]:
        lines.append(f"{document['repeated']} samples repeat others to the last digit")
    lines += [f"odd: {what}" for what in document["odd"]]
    return in_lines(lines)


def _iterations(found: Fit) -> int:
    if found.refined is not None:
        return found.refined.iterations
    assert found.axes is not None
    return int(found.axes.iterations.max())


def _axes(found: Fit) -> list[dict[str, Any]]:
    axes = found.axes
    if axes is None:
        return []
    return [
        {
            "joint": name,
            "point_m": axes.lines.points[i].tolist(),
            "direction": axes.lines.directions[i].tolist(),
            "samples": int(axes.samples[i]),
            "arc_rad": float(axes.arc[i]),
            "radius_m": float(axes.radius[i]),
            "rms_m": float(axes.rms[i]),
            "iterations": int(axes.iterations[i]),
        }
        for i, name in enumerate(found.arm.joint_names)
    ]
