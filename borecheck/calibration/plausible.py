"""Is what a fit found an arm that somebody could have built from the drawing?

Least squares gives numbers for any data: for points in another unit, for joints in each
other's columns, for a target that slipped. They are asked here, and what is odd named.
"""

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from borecheck.calibration.fit import Fit, residuals
from borecheck.calibration.measurements import Measurements
from borecheck.calibration.noise import Noise, seen_noise, whitening

Array = NDArray[np.float64]

# All lengths together may be off the drawing by this share; another unit is off by more
# (a foot is a third of a metre, an inch two and a half centimetres). Assumed.
SCALE = 0.1

# No single joint of an arm that is drawn as it was built is off by more. Assumed: ten
# times what [Heikkila2010] finds (section 5), [m] and [rad].
LENGTH, ANGLE = 0.03, np.radians(5.0)

# All samples together, weighed by what device and encoders scatter, fit the whole arm
# as well as each axis fits its own: honest data stay below 1.5 (tests).
WORSE = 3.0

# A residual of so many robust standard deviations is a mistake, not noise: of 10^4
# normal residuals none is beyond 6 but once in 10^5 sets.
FAR_OFF = 8.0

# Residuals of noise-free data are rounding errors, which scatter as they like, [m].
ROUNDING = 1e-9


def oddities(found: Fit, data: Measurements) -> list[str]:
    """What is odd about a fit, a line each; a sound one has none.

    Args:
        found: The fit.
        data: What it was made from.
    """
    scale = _scale(found)
    if scale is not None:
        return [scale]  # then every length is odd, and says nothing more
    noise = _noise(found, data)
    size = _weighed(found, data, noise)
    return [
        *_parameters(found),
        *_worse_together(found, size, noise),
        *_far_off(found, size),
    ]


def _noise(found: Fit, data: Measurements) -> Noise | None:
    """How device and encoders scatter, as far as joints turned alone."""
    if found.axes is None:
        return None
    return seen_noise(found.axes.lines, data, found.arm.joint_names)


def _weighed(found: Fit, data: Measurements, noise: Noise | None) -> Array:
    """Size of every residual as that of a coordinate, (n,), [m]."""
    off = residuals(found, data)
    if noise is not None:
        best = found.best
        names = found.arm.joint_names
        W = whitening(best.lines, data, best.target, noise, names)
        off = (W @ off[..., None])[..., 0]
    return np.asarray(np.sqrt((off**2).mean(axis=1)))


def _scale(found: Fit) -> str | None:
    """Whether all lengths are the drawn ones times the same factor."""
    arm, values = found.arm, found.best.parameters
    names = [name for name in arm.forms.names if name not in arm.forms.angles]
    drawn = np.array([arm.nominal[name] for name in names])
    fitted = np.array([values[name] for name in names])
    if not drawn @ drawn > 0.0:
        return None
    factor = float(fitted @ drawn / (drawn @ drawn))
    if abs(factor - 1.0) <= SCALE:
        return None
    return (
        f"all lengths together come out {factor:.4g} times as drawn: are the points "
        "in another unit than their columns say (x_mm, x_cm)?"
    )


def _parameters(found: Fit) -> Iterator[str]:
    """Single parameters too far from the drawing."""
    arm = found.arm
    for name in arm.forms.names:
        angle = name in arm.forms.angles
        change = found.best.parameters[name] - arm.nominal[name]
        if abs(change) <= (ANGLE if angle else LENGTH):
            continue
        size, unit = (np.degrees(change), "deg") if angle else (1e3 * change, "mm")
        yield (
            f"{name} is {size:.2f} {unit} off the drawing: do joints stand in each "
            "other's columns, or is it another arm?"
        )


def _worse_together(found: Fit, size: Array, noise: Noise | None) -> Iterator[str]:
    """Whether the axes fit their own points far better than the whole arm all."""
    if noise is None:
        return
    together = float(np.sqrt((size**2).mean()))
    if found.robust:  # what is far off was left out
        together = _typical(size)
    if together > WORSE * noise.point + ROUNDING:
        yield (
            f"the points are {1e3 * together:.3g} mm off the whole arm, but only "
            f"{1e3 * noise.point:.3g} mm off its axes one by one: did the target slip, "
            "or do joints stand in each other's columns?"
        )


def _far_off(found: Fit, size: Array) -> Iterator[str]:
    """Samples far off the others, where none were left out or trusted less."""
    if found.robust:
        return
    typical = _typical(size)
    far = np.flatnonzero(size > FAR_OFF * typical + ROUNDING)
    if len(far):
        named = ", ".join(str(k + 1) for k in far)
        yield (
            f"samples {named} are up to {1e3 * size[far].max():.3g} mm off, the others "
            f"about {1e3 * typical:.3g} mm: mistakes among them? (--robust)"
        )


def _typical(size: Array) -> float:
    """A size that few mistakes do not change, [m]."""
    return 1.4826 * float(np.median(size))
