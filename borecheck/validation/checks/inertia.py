"""Inertia checks: mass, centre of mass and inertia of every link."""

import math
from collections.abc import Iterator

import numpy as np

from borecheck.core.se3 import Array
from borecheck.robots.urdf.attributes import first, number, placement
from borecheck.robots.urdf.draft_elements import DraftLink
from borecheck.validation.reading.checked_urdf import CheckedUrdf
from borecheck.validation.reading.extents import Extent, link_extent
from borecheck.validation.registry import Problem, register

TRIANGLE_TOLERANCE = 0.01  # relative: inertias are typed with a few digits
DENSITY_RANGE = 5.0, 22_600.0  # [kg/m^3] of the bounding volume: foam to osmium
SMALLEST_VOLUME = 1e-9  # [m^3]: below 1 mm^3 a density says nothing
ENTRIES = ("ixx", "ixy", "ixz", "iyy", "iyz", "izz")


def tensor_of(link: DraftLink) -> Array | None:
    """The inertia matrix as written, if all six numbers can be read."""
    element = first(link.inertial, "inertia")
    values = [number(element, name) for name in ENTRIES]
    if any(v is None for v in values):
        return None
    xx, xy, xz, yy, yz, zz = (v or 0.0 for v in values)
    return np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])


def principal(link: DraftLink) -> Array | None:
    """Principal moments, smallest first."""
    tensor = tensor_of(link)
    if tensor is None or np.abs(tensor).max() > 1e100:
        return None
    return np.array(np.linalg.eigvalsh(tensor), dtype=np.float64)


def _moving(robot: CheckedUrdf) -> Iterator[DraftLink]:
    """Links that some moving joint carries and that have an inertial."""
    for link in robot.links:
        if link.inertial is not None:
            yield link


@register("I401", "mass-negative", "inertia", "IWE")
def mass_negative(robot: CheckedUrdf) -> Iterator[Problem]:
    """The mass of a link is negative.

    Why: There is no negative mass; simulations blow up.

    Fix: Remove the sign.

    Libraries: Pinocchio and yourdfpy accept it; Drake and MuJoCo refuse it.
    """
    for link in _moving(robot):
        if link.mass is not None and link.mass < 0.0:
            element = first(link.inertial, "mass")
            yield Problem(
                element, f"link {link.name!r} weighs {link.mass:g} kg", "value"
            )


@register("I402", "mass-zero", "inertia", "IIW")
def mass_zero(robot: CheckedUrdf) -> Iterator[Problem]:
    """A link that moves weighs nothing.

    Why: A joint that carries only massless links cannot be simulated.

    Fix: Give the mass; a plain frame needs no <inertial> at all.

    Libraries: Gazebo drops massless links; MuJoCo refuses a moving body without mass.
    """
    for link in _moving(robot):
        if link.mass == 0.0:
            element = first(link.inertial, "mass")
            yield Problem(element, f"link {link.name!r} has mass 0", "value")


@register("I403", "inertial-missing", "inertia", "IIW")
def inertial_missing(robot: CheckedUrdf) -> Iterator[Problem]:
    """A link with geometry has no <inertial>.

    Why: Its weight is left out of every torque and every simulation.

    Fix: Add mass, centre of mass and inertia.

    Libraries: Pinocchio and Drake take zero mass; Gazebo drops the link; PyBullet takes
    1 kg.
    """
    for link in robot.links:
        if link.shapes and link.inertial is None:
            carried = any(j.moves for j in robot.joints_into.get(link.name, []))
            if carried:
                yield Problem(link.element, f"link {link.name!r} has no <inertial>")


@register("I404", "inertia-not-positive", "inertia", "IIE")
def inertia_not_positive(robot: CheckedUrdf) -> Iterator[Problem]:
    """The inertia matrix is not positive definite.

    Why: Some rotation would need negative or no energy: no such body exists.

    Fix: Recompute it; check signs of the products of inertia.

    Libraries: Drake replaces it by a guess (strict: refuses it); MuJoCo refuses it;
    Pinocchio accepts it.
    """
    for link in _moving(robot):
        moments = principal(link)
        if moments is None or not link.mass or link.mass < 0.0:
            continue
        if moments[0] < 0.0 or (moments[0] == 0.0 and moments[2] > 0.0):
            element = first(link.inertial, "inertia")
            message = f"smallest principal moment is {moments[0]:.4g} kg m^2"
            yield Problem(element, f"link {link.name!r}: {message}")


@register("I405", "inertia-triangle", "inertia", "IIE")
def inertia_triangle(robot: CheckedUrdf) -> Iterator[Problem]:
    """One principal moment is larger than the sum of the other two.

    Why: No distribution of mass has such an inertia.

    Fix: Recompute it: often one entry has a wrong exponent.

    Libraries: Drake and MuJoCo refuse it (balanceinertia mends it); Pinocchio and
    yourdfpy accept it.
    """
    for link in _moving(robot):
        moments = principal(link)
        if moments is None or moments[0] <= 0.0:
            continue
        low, mid, high = map(float, moments)
        if high > (low + mid) * (1.0 + TRIANGLE_TOLERANCE):
            element = first(link.inertial, "inertia")
            message = f"principal moments {low:.4g}, {mid:.4g}, {high:.4g}: the last"
            yield Problem(
                element, f"link {link.name!r}: {message} exceeds the others' sum"
            )


@register("I406", "density-implausible", "inertia", "IIW")
def density_implausible(robot: CheckedUrdf) -> Iterator[Problem]:
    """The mass does not fit the size of the geometry.

    Why: Usual causes are grams for kilograms, or millimetres for metres.

    Fix: Check the unit of the mass and of the geometry.
    """
    for link in _moving(robot):
        extent, mass = link_extent(robot, link), link.mass
        if extent is None or not mass or mass < 0.0:
            continue
        if extent.volume < SMALLEST_VOLUME:
            continue
        density = mass / extent.volume
        if not DENSITY_RANGE[0] <= density <= DENSITY_RANGE[1]:
            element = first(link.inertial, "mass")
            message = f"{mass:.4g} kg in {extent.volume:.3g} m^3: {density:.3g} kg/m^3"
            yield Problem(element, f"link {link.name!r}: {message}", "value")


@register("I407", "centre-of-mass-outside", "inertia", "IIW")
def centre_of_mass_outside(robot: CheckedUrdf) -> Iterator[Problem]:
    """The centre of mass lies outside the link's geometry.

    Why: The usual causes are millimetres, or an origin in another frame.

    Fix: Give it in the link's frame, in metres.
    """
    for link in _moving(robot):
        extent = link_extent(robot, link)
        T_link_com = placement(link.inertial)
        if extent is None or T_link_com is None or not link.mass:
            continue
        away = extent.distance(T_link_com[:3, 3])
        if away > 0.5 * extent.diagonal:
            element = first(link.inertial, "origin")
            message = f"centre of mass is {away:.3g} m outside of its geometry"
            target = link.inertial if element is None else element
            yield Problem(target, f"link {link.name!r}: {message}", "xyz")


@register("I408", "inertia-placeholder", "inertia", "IIW")
def inertia_placeholder(robot: CheckedUrdf) -> Iterator[Problem]:
    """The inertia is a placeholder: 1 1 1, or the same tiny number three times.

    Why: Simulations become sluggish or unstable.

    Fix: Compute it from geometry and mass.
    """
    for link in _moving(robot):
        tensor = tensor_of(link)
        if tensor is None or not link.mass:
            continue
        if (tensor == np.eye(3)).all():
            element = first(link.inertial, "inertia")
            yield Problem(element, f"link {link.name!r} has the unit matrix as inertia")


@register("I409", "inertia-zero", "inertia", "IIW")
def inertia_zero(robot: CheckedUrdf) -> Iterator[Problem]:
    """A link has mass but no inertia.

    Why: It resists no rotation; simulations divide by it.

    Fix: Compute it from geometry and mass.

    Libraries: MuJoCo and Drake refuse a moving body without inertia.
    """
    for link in _moving(robot):
        tensor = tensor_of(link)
        if tensor is not None and link.mass and not tensor.any():
            element = first(link.inertial, "inertia")
            yield Problem(element, f"link {link.name!r} has mass but inertia 0")


@register("I410", "inertia-implausible", "inertia", "IIW")
def inertia_implausible(robot: CheckedUrdf) -> Iterator[Problem]:
    """The inertia is far too large or too small for mass and size.

    Why: The usual causes are units (g mm^2, kg mm^2) or the inertia about another
    point.

    Fix: Give it in kg m^2 about the centre of mass.
    """
    for link in _moving(robot):
        moments, mass = principal(link), link.mass
        extent = link_extent(robot, link)
        if moments is None or not mass or mass < 0.0 or extent is None:
            continue
        if moments[2] <= 0.0 or extent.diagonal <= 0.0:
            continue
        radius = math.sqrt(moments[2] / mass)  # of gyration
        T_link_com = placement(link.inertial)
        centre = np.zeros(3) if T_link_com is None else T_link_com[:3, 3]
        if not _fits(radius, extent, centre):
            element = first(link.inertial, "inertia")
            size = f"{extent.diagonal:.3g} m"
            message = f"radius of gyration {radius:.3g} m on a link of {size}"
            yield Problem(element, f"link {link.name!r}: {message}")


def _fits(radius: float, extent: Extent, centre: Array) -> bool:
    # No body has a radius of gyration beyond its farthest point; a solid box has about
    # half of it. Room is left for parts that are not drawn.
    reach = np.maximum(np.abs(extent.low - centre), np.abs(extent.high - centre))
    farthest = float(np.linalg.norm(reach))
    return 0.02 * extent.diagonal < radius < 1.5 * farthest
