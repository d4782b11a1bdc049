"""From where the arm reaches the head: base places against entry points.

[Heikkila2010] section 3: the needle follows the head's surface normal; the base "has to
be located carefully to avoid singularities", and "a feasible location is on either side
of the patient". Section 2: the main body stands outside the 2 mT line.
"""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

import borecheck as bc
from borecheck.robots.scene import Scene
from borecheck_models.scanners.head import EntryPoints, entry_points
from mri_arm.kinematics import inverse, singularity

Array = NDArray[np.float64]

# "to a distance 10 mm from the surface", section 5.
STANDOFF = 0.010

# The body's axis 1 stays outside 2 mT, 1 m from the image centre (section 2).
NEAREST_BASE = 1.0

# Measures of `kinematics.singularity` below which a pose counts as singular, assumed:
# a wrist within 6 deg of straight, an elbow within 6 deg of stretched, a wrist centre
# within a seventh of the arm's length of axis 1.
SINGULAR = {"wrist": 0.1, "elbow": 0.1, "shoulder": 0.15}

# Tilted directions tried around a normal, after the normal itself.
AZIMUTHS = 6

# Rolls tried about a needle at right angles.
ROLLS = tuple(2.0 * np.pi * k / 12 for k in range(12))


@dataclass(frozen=True)
class BasePlace:
    """A place of the base in the scanner's frame.

    Attributes:
        x: Along the patient, towards the feet [m].
        y: Across, [m].
        yaw: Direction in which the forearm points at q1 = 0, about z, from +y, [rad].
    """

    x: float
    y: float
    yaw: float

    @property
    def distance(self) -> float:
        """From the vertical line through the image centre, [m]."""
        return float(np.hypot(self.x, self.y))


@dataclass(frozen=True)
class Reached:
    """How many entry points a place serves, each condition on top of those before.

    Attributes:
        place: Where the base stands.
        entries: How many entry points were asked for.
        reachable: With a joint position within the limits.
        regular: And off all singularities.
        clear: And the arm touches neither magnet, table, coil, patient nor itself.
    """

    place: BasePlace
    entries: int
    reachable: int
    regular: int
    clear: int

    @property
    def share(self) -> float:
        """Of entry points that are served."""
        return self.clear / self.entries


def places(xs: Iterable[float], ys: Iterable[float]) -> list[BasePlace]:
    """Places outside the 2 mT line, the forearm pointing at the image centre."""
    grid = [
        BasePlace(float(x), float(y), float(np.arctan2(x, -y))) for y in ys for x in xs
    ]
    return [place for place in grid if place.distance >= NEAREST_BASE]


def directions(normal: Array, cone: float) -> Array:
    """Ways into the head: against the normal, then tilted by the cone's half angle."""
    helper = np.eye(3)[int(np.argmin(np.abs(normal)))]
    u = np.cross(normal, helper)
    u /= np.linalg.norm(u)
    w = np.cross(normal, u)
    if cone <= 0.0:
        return np.asarray(-normal[None])
    a = 2.0 * np.pi * np.arange(AZIMUTHS) / AZIMUTHS
    aside = np.cos(a)[:, None] * u + np.sin(a)[:, None] * w
    tilted = np.cos(cone) * normal + np.sin(cone) * aside
    half = np.cos(cone / 2) * normal + np.sin(cone / 2) * aside
    return np.asarray(-np.vstack([normal, half, tilted]))


def reach(
    place: BasePlace,
    entries: EntryPoints,
    scene: Scene,
    *,
    cone: float = 0.0,
    needle_mount: str = "along",
) -> Reached:
    """What one place of the base serves.

    Args:
        place: Where the base stands.
        entries: On the head, in the scanner's frame.
        scene: The magnet with table and patient.
        cone: Largest tilt from the surface normal, [rad].
        needle_mount: "along" or "square".
    """
    arguments = {
        "base_x": repr(place.x),
        "base_y": repr(place.y),
        "base_yaw": repr(place.yaw),
        "needle_mount": needle_mount,
    }
    robot = bc.load_robot(
        "mri_arm",
        base_x=arguments["base_x"],
        base_y=arguments["base_y"],
        base_yaw=arguments["base_yaw"],
        needle_mount=needle_mount,
    )
    rolls = ROLLS if needle_mount == "square" else None
    reachable = regular = 0
    tried: list[Array] = []
    owner: list[int] = []
    for k, (point, normal) in enumerate(
        zip(entries.points, entries.normals, strict=True)
    ):
        found = _joint_positions(point, normal, cone, rolls, arguments)
        good = [q for q in found if is_regular(q)]
        reachable += bool(found)
        regular += bool(good)
        tried += good
        owner += [k] * len(good)
    served: set[int] = set()
    if tried:
        touching = bc.first_contacts(robot, scene, np.array(tried))
        served = {k for k, bad in zip(owner, touching, strict=True) if not bad}
    return Reached(place, len(entries.points), reachable, regular, len(served))


def _joint_positions(
    point: Array,
    normal: Array,
    cone: float,
    rolls: Sequence[float] | None,
    arguments: dict[str, str],
) -> list[Array]:
    """All joint positions before an entry point, the tip 10 mm off the surface."""
    found: list[Array] = []
    for direction in directions(normal, cone):
        tip = point - STANDOFF * direction
        solutions = inverse(tip, direction, 0.0, rolls=rolls, **arguments)  # type: ignore[arg-type]
        found += solutions.configurations
    return found


def is_regular(q: Array) -> bool:
    """Whether no measure of singularity is below its bound."""
    measures = singularity(q)
    return all(float(measures[name]) >= bound for name, bound in SINGULAR.items())


def study(
    candidates: Sequence[BasePlace],
    count: int = 60,
    cone: float = 0.0,
    needle_mount: str = "along",
    progress: Callable[[int, int], None] = lambda done, total: None,
    gap: str = "0.44",
) -> list[Reached]:
    """What each place serves; see `reach`.

    Args:
        candidates: Places of the base.
        count: Entry points on the vault of the head.
        cone: Largest tilt from the surface normal, [rad].
        needle_mount: "along" or "square".
        progress: Called after each place.
        gap: Of the magnet, [m].
    """
    scene = bc.load_scene("mri_open_magnet", gap=gap)
    entries = entry_points(count)
    results = []
    for done, place in enumerate(candidates, start=1):
        results.append(
            reach(place, entries, scene, cone=cone, needle_mount=needle_mount)
        )
        progress(done, len(candidates))
    return results
