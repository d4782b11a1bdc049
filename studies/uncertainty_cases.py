"""Small worlds in which the probability of contact is known in closed form.

Cubes, bars and blocks whose errors are normal: one gap, a gap on either side, a bar
that turns, registration, two obstacles, the robot itself, a solid that swallows
another, motions, margins, correlated joints, an uncertain dimension. A *kind* makes as
many cases as are asked for, each with its own gap, size of error and probability.
"""

from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtr, ndtri

from borecheck.geometry.mesh.primitives import box
from borecheck.geometry.mesh.triangle_mesh import TriangleMesh
from borecheck.robots.robot import Robot, robot_with
from borecheck.robots.scene import Obstacle, Scene

Array = NDArray[np.float64]

HALF = 0.01  # of the cubes, [m]
FAR = 1.0  # where a block's inner face stands, [m]

SLIDE = (
    '<joint name="{name}" type="prismatic"><origin xyz="{at}"/>'
    '<parent link="{parent}"/><child link="{child}"/><axis xyz="{axis}"/>'
    '<limit lower="-3" upper="3" effort="1" velocity="1"/></joint>'
)
CUBE = (
    '<link name="{name}"><collision><geometry><box size="0.02 0.02 0.02"/></geometry>'
    "</collision></link>"
)


@dataclass(frozen=True, eq=False)
class Case:
    """One question and its answer.

    Attributes:
        kind: Which of the worlds it is.
        robot: The robot.
        scene: The scene.
        motion: Waypoints, (k, n).
        errors: Document of the uncertainties.
        probability: Of contact, or of coming within the margin.
        margin: Required clearance, [m].
    """

    kind: str
    robot: Robot
    scene: Scene
    motion: Array
    errors: dict[str, Any]
    probability: float
    margin: float = 0.0


@dataclass
class World:
    """A robot and what stands around it, kept in a folder."""

    folder: Path
    name: str
    urdf: str
    obstacles: list[TriangleMesh]
    arguments: dict[str, str] = field(default_factory=dict)

    def load(self) -> tuple[Robot, Scene]:
        """Robot and scene."""
        suffix = ".urdf.xacro" if self.arguments else ".urdf"
        file = self.folder / f"{self.name}{suffix}"
        space = ' xmlns:xacro="http://www.ros.org/wiki/xacro"' if self.arguments else ""
        file.write_text(f'<robot name="{self.name}"{space}>{self.urdf}</robot>')
        standing = tuple(Obstacle(m.name, "other", m, "here") for m in self.obstacles)
        scene = Scene(self.name, None, {}, "as given", standing, {}, (), ())
        return robot_with(file, self.arguments), scene


def block(name: str, low: list[float], high: list[float]) -> TriangleMesh:
    """A solid box between two corners."""
    size = np.subtract(high, low)
    T = np.eye(4)
    T[:3, 3] = np.add(low, high) / 2.0
    return box(name, (float(size[0]), float(size[1]), float(size[2]))).moved(T)


WALL = block("wall", [FAR, -5, -5], [FAR + 5, 5, 5])
BEHIND = block("behind", [-FAR - 5, -5, -5], [-FAR, 5, 5])
ASIDE = block("aside", [-5, FAR, -5], [5, FAR + 5, 5])
POST = block("post", [-0.05, FAR, -0.05], [0.05, FAR + 5, 0.05])
SLAB = block("slab", [FAR, -5, -5], [FAR + 0.2, 5, 5])

ONE = '<link name="base"/>' + CUBE.format(name="tip")
ALONG_X = SLIDE.format(name="x", at="0 0 0", parent="base", child="tip", axis="1 0 0")
TWO = (
    '<link name="base"/><link name="mid"/>'
    + CUBE.format(name="tip")
    + SLIDE.format(name="x", at="0 0 0", parent="base", child="mid", axis="1 0 0")
    + SLIDE.format(name="y", at="0 0 0", parent="mid", child="tip", axis="{axis}")
)
PAIR = (
    '<link name="base"/>'
    + CUBE.format(name="a")
    + CUBE.format(name="b")
    + CUBE.format(name="c")
    + SLIDE.format(name="x", at="0 0 0", parent="base", child="a", axis="1 0 0")
    + SLIDE.format(name="f", at="0 0.5 0", parent="a", child="c", axis="0 1 0")
    + SLIDE.format(name="g", at="0 -0.5 0", parent="c", child="b", axis="1 0 0")
)
BAR = (
    '<link name="base"/><link name="bar"><collision><origin xyz="0.25 0 0"/><geometry>'
    '<box size="0.5 0.02 0.02"/></geometry></collision></link>'
    '<joint name="r" type="revolute"><parent link="base"/><child link="bar"/>'
    '<axis xyz="0 0 1"/><limit lower="-3" upper="3" effort="1" velocity="1"/></joint>'
)
LONG = (
    '<xacro:arg name="length" default="0"/>'
    + ONE
    + SLIDE.format(
        name="x", at="$(arg length) 0 0", parent="base", child="tip", axis="1 0 0"
    )
)

Maker = Callable[[np.random.Generator, Robot, Scene], Case]
MM = 1e-3


def _tail(z: float) -> float:
    return float(ndtr(-z))


def _z(rng: np.random.Generator) -> float:
    """A gap in standard deviations; probabilities from 0.5 % to 50 %, evenly by log."""
    return float(-ndtri(np.exp(rng.uniform(np.log(0.005), np.log(0.5)))))


def _sigma(rng: np.random.Generator) -> float:
    return float(rng.uniform(0.5, 5.0) * MM)


def one_gap(rng: np.random.Generator, robot: Robot, scene: Scene) -> Case:
    """A cube before a wall, one joint that is not exact."""
    z, s = _z(rng), _sigma(rng)
    q = np.array([[FAR - HALF - z * s]])
    return Case("one gap", robot, scene, q, {"joints": {"x": s}}, _tail(z))


def two_gaps(rng: np.random.Generator, robot: Robot, scene: Scene) -> Case:
    """A cube between two walls: registration shifts it, the walls stand 2 m apart."""
    near, off = _z(rng), rng.uniform(1.0, 1.5)
    s = (FAR - HALF) / (near + off)
    p = _tail(near) + _tail((FAR - HALF + off * s) / s)
    errors = {"registration": {"x": s}}
    return Case("two gaps", robot, scene, np.array([[off * s]]), errors, p)


def turning_bar(rng: np.random.Generator, robot: Robot, scene: Scene) -> Case:
    """A bar that turns towards a wall: its corner arrives first."""
    # the corner (0.5, 0.01) lies on a circle; it meets y = 0.4 at a known angle
    radius, start = np.hypot(0.5, 0.01), np.arctan2(0.01, 0.5)
    meets = np.arcsin(0.4 / radius) - start
    z, s = _z(rng), float(rng.uniform(0.001, 0.02))
    q = np.array([[meets - z * s]])
    return Case("turning bar", robot, scene, q, {"joints": {"r": s}}, _tail(z))


def registration(rng: np.random.Generator, robot: Robot, scene: Scene) -> Case:
    """Registration shifts along three axes, one of them towards the wall."""
    z, s = _z(rng), _sigma(rng)
    shifts = {"x": s, "y": float(rng.uniform(1, 9)) * MM, "z": 5 * MM}
    q = np.array([[FAR - HALF - z * s]])
    return Case("registration", robot, scene, q, {"registration": shifts}, _tail(z))


def two_obstacles(rng: np.random.Generator, robot: Robot, scene: Scene) -> Case:
    """Walls at right angles: two independent joints, either of which may fail."""
    z, s = (_z(rng), _z(rng)), (_sigma(rng), _sigma(rng))
    q = FAR - HALF - np.array(z) * s
    p = 1.0 - (1.0 - _tail(z[0])) * (1.0 - _tail(z[1]))
    errors = {"joints": {"x": s[0], "y": s[1]}}
    return Case("two obstacles", robot, scene, q[None], errors, p)


def self_pair(rng: np.random.Generator, robot: Robot, scene: Scene) -> Case:
    """Two cubes of the robot that must not meet, and may jump past each other."""
    z, s = _z(rng), float(rng.uniform(2.0, 15.0) * MM)
    gap = z * s
    p = _tail(z) - _tail((gap + 4.0 * HALF) / s)
    # with f at 0 both cubes lie on one line along x
    q = np.array([[0.0, 0.0, 2.0 * HALF + gap]])
    return Case("self pair", robot, scene, q, {"joints": {"g": s}}, p)


def swallowed(rng: np.random.Generator, robot: Robot, scene: Scene) -> Case:
    """A cube that large errors put wholly inside a slab, or behind it."""
    z, s = _z(rng), float(rng.uniform(0.02, 0.2))
    gap = z * s
    p = _tail(z) - _tail((gap + 0.2 + 2.0 * HALF) / s)
    q = np.array([[FAR - HALF - gap]])
    return Case("swallowed", robot, scene, q, {"joints": {"x": s}}, p)


def motion_to(rng: np.random.Generator, robot: Robot, scene: Scene) -> Case:
    """There and back: the middle waypoint is nearest."""
    z, s = _z(rng), _sigma(rng)
    nearest = FAR - HALF - z * s
    q = np.array([[0.0], [nearest], [nearest - 0.3]])
    return Case("motion", robot, scene, q, {"joints": {"x": s}}, _tail(z))


def motion_past(rng: np.random.Generator, robot: Robot, scene: Scene) -> Case:
    """Past a post that stands beside the way, near no waypoint."""
    z, s = _z(rng), _sigma(rng)
    beside = FAR - HALF - z * s
    q = np.array([[-0.4, beside], [0.5, beside]])
    errors = {"registration": {"y": s, "z": 1 * MM}}
    return Case("motion past a post", robot, scene, q, errors, _tail(z))


def margin(rng: np.random.Generator, robot: Robot, scene: Scene) -> Case:
    """As near as a margin counts as contact."""
    z, s = _z(rng), _sigma(rng)
    wide = float(rng.uniform(1.0, 20.0)) * MM
    q = np.array([[FAR - HALF - wide - z * s]])
    return Case("margin", robot, scene, q, {"joints": {"x": s}}, _tail(z), wide)


def correlated(rng: np.random.Generator, robot: Robot, scene: Scene) -> Case:
    """Two joints along one line whose errors depend on each other."""
    z, a, b = _z(rng), _sigma(rng), _sigma(rng)
    r = float(rng.uniform(-0.9, 0.9))
    s = float(np.sqrt(a * a + b * b + 2.0 * r * a * b))
    matrix = [[a * a, r * a * b], [r * a * b, b * b]]
    q = np.array([[0.2, FAR - HALF - 0.2 - z * s]])
    errors = {"joints": {"names": ["x", "y"], "covariance": matrix}}
    return Case("correlated joints", robot, scene, q, errors, _tail(z))


def dimension(rng: np.random.Generator, robot: Robot, scene: Scene) -> Case:
    """A length of the robot is not exact, and a joint is not either."""
    z, a, b = _z(rng), _sigma(rng), _sigma(rng)
    s = float(np.hypot(a, b))
    q = np.array([[FAR - HALF - 0.1 - z * s]])
    errors = {"dimensions": {"length": a}, "joints": {"x": b}}
    return Case("dimension", robot, scene, q, errors, _tail(z))


def makers(folder: Path) -> list[Callable[[np.random.Generator], Case]]:
    """All kinds, each with its robot and scene loaded; files go to the folder."""
    square = [block("far", [-5, 0.4, -5], [5, 5, 5])]
    remote = [block("remote", [20, 20, 20], [21, 21, 21])]
    across, along = TWO.replace("{axis}", "0 1 0"), TWO.replace("{axis}", "1 0 0")
    worlds: list[tuple[Maker, str, list[TriangleMesh], dict[str, str]]] = [
        (one_gap, ONE + ALONG_X, [WALL], {}),
        (two_gaps, ONE + ALONG_X, [WALL, BEHIND], {}),
        (turning_bar, BAR, square, {}),
        (registration, ONE + ALONG_X, [WALL], {}),
        (two_obstacles, across, [WALL, ASIDE], {}),
        (self_pair, PAIR, remote, {}),
        (swallowed, ONE + ALONG_X, [SLAB], {}),
        (motion_to, ONE + ALONG_X, [WALL], {}),
        (motion_past, across, [POST], {}),
        (margin, ONE + ALONG_X, [WALL], {}),
        (correlated, along, [WALL], {}),
        (dimension, LONG, [WALL], {"length": "0.1"}),
    ]
    return [_bound(folder, *world) for world in worlds]


def _bound(
    folder: Path,
    make: Maker,
    urdf: str,
    obstacles: list[TriangleMesh],
    arguments: dict[str, str],
) -> Callable[[np.random.Generator], Case]:
    world = World(folder, make.__name__, urdf, obstacles, arguments)
    robot, scene = world.load()
    return lambda rng: make(rng, robot, scene)
