"""How a robot changes with its dimensions: origins of joints, mimic offsets, shapes.

An error of a dimension is carried into the chain itself, so it acts truthfully at every
configuration of a motion. Origins are taken to shift and to turn in proportion to the
errors, vertices to move in proportion. That is how dimensions are written in a URDF;
whether it is so is looked at, three standard deviations out, and refused where not.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from borecheck.core.once import once_per_record
from borecheck.core.se3 import axis_rotation
from borecheck.errors import UsageError
from borecheck.geometry.mesh.triangle_mesh import TriangleMesh
from borecheck.robots.from_description import complete_arguments
from borecheck.robots.kinematics.chain import JointChain
from borecheck.robots.kinematics.robot_chain import chain_of
from borecheck.robots.model import RobotModel
from borecheck.robots.robot import Robot, robot_with
from borecheck.robots.robot_file import read_urdf
from borecheck.robots.urdf.reach import ANYWHERE
from borecheck.uncertainty.covariance import Block

if TYPE_CHECKING:
    from borecheck.robots.urdf.tree import UrdfTree

Array = NDArray[np.float64]

# Step of the differences by which dimensions act, [m] or [rad]: rounding gives 1e-11
# of it, curvature 1e-5 of the derivative.
STEP = 1e-5
# Where it is looked at whether they act in proportion, in standard deviations, and how
# far the robot built there may be off, [m] or [rad].
LOOKED_AT, OFF = 3.0, 1e-7


@dataclass(frozen=True, eq=False)
class DimensionErrors:
    """What errors p (n,) of the dimensions do to a robot.

    Attributes:
        names: The dimensions.
        shift: Of every joint's origin in its parent's frame, (n, joints, 3).
        turn: Of every joint's origin, a rotation vector in its own frame.
        offset: Of every joint's position, (n, joints).
        shapes: Of the vertices of parts by their number, (n, vertices, 3) each.
    """

    names: tuple[str, ...]
    shift: Array
    turn: Array
    offset: Array
    shapes: dict[int, Array]

    def applied(self, chain: JointChain, p: Array) -> JointChain:
        """The chain with these errors."""
        if not self.names:
            return chain
        origin = chain.origin.copy()
        origin[:, :3, 3] += np.tensordot(p, self.shift, 1)
        for j, turn in enumerate(np.tensordot(p, self.turn, 1)):
            origin[j, :3, :3] = origin[j, :3, :3] @ rotation(turn)
        return replace(chain, origin=origin, offset=chain.offset + p @ self.offset)

    def reshaped(self, part: int, mesh: TriangleMesh, p: Array) -> TriangleMesh:
        """A part's mesh with these errors."""
        vertices = mesh.vertices + np.tensordot(p, self.shapes[part], 1)
        return TriangleMesh(mesh.name, vertices, mesh.triangles)


def rotation(turn: Array) -> Array:
    """The rotation (3, 3) by a rotation vector."""
    angle = float(np.linalg.norm(turn))
    return axis_rotation(turn / angle, angle) if angle > 0.0 else np.eye(3)


def dimensions_of(robot: Robot, block: Block) -> DimensionErrors:
    """How the robot changes with the dimensions of a block.

    Raises:
        UsageError: A dimension that is no number, or that acts in another way.
    """
    _, chain = chain_of(robot)
    rates = [_rates(robot, name) for name in block.names]
    joints = chain.frame_count
    reach = LOOKED_AT * np.sqrt(np.diag(block.covariance))
    found = DimensionErrors(
        block.names,
        np.array([r[0] for r in rates]).reshape(-1, joints, 3),
        np.array([r[1] for r in rates]).reshape(-1, joints, 3),
        np.array([r[2] for r in rates]).reshape(-1, joints),
        _shapes(robot, block.names, reach),
    )
    for signs in _corners(len(block.names)):
        _look(robot, chain, found, signs * reach)
    return found


def _corners(count: int) -> list[Array]:
    """Each dimension off alone, both ways, and all of them at once."""
    alone = [sign * row for row in np.eye(count) for sign in (1.0, -1.0)]
    return [*alone, np.ones(count), -np.ones(count)] if count > 1 else alone


def _rates(robot: Robot, name: str) -> tuple[Array, Array, Array]:
    """Shift, turn and offset of every joint per unit of a dimension."""
    low, high = (changed_chain(robot, (name,), (s,)) for s in (-STEP, STEP))
    change = np.swapaxes(low.origin[:, :3, :3], 1, 2) @ high.origin[:, :3, :3]
    skew = 0.5 * (change - np.swapaxes(change, 1, 2))
    turn = np.stack([skew[:, 2, 1], skew[:, 0, 2], skew[:, 1, 0]], axis=1)
    shift = high.origin[:, :3, 3] - low.origin[:, :3, 3]
    width = 2.0 * STEP
    return shift / width, turn / width, (high.offset - low.offset) / width


def _look(robot: Robot, chain: JointChain, found: DimensionErrors, p: Array) -> None:
    """Refuses dimensions that act otherwise than in proportion."""
    built = changed_chain(robot, found.names, tuple(float(x) for x in p))
    taken = found.applied(chain, p)
    same = np.array_equal(built.parent, taken.parent) and np.array_equal(
        built.kind, taken.kind
    )
    off = np.inf
    if same:
        off = max(
            float(np.abs(getattr(built, field) - getattr(taken, field)).max())
            for field in ("origin", "axis", "factor", "offset")
        )
    if off > OFF:
        whose = [name for name, x in zip(found.names, p, strict=True) if x != 0.0]
        raise UsageError(
            f"dimensions: {' with '.join(whose)} moves joints in another way than in "
            f"proportion to its error (off by {off:.1g} at three standard deviations): "
            "its uncertainty cannot be drawn"
        )


def changed_chain(
    robot: Robot, names: tuple[str, ...], by: tuple[float, ...]
) -> JointChain:
    """The chain of the robot with some dimensions changed."""
    return chain_of(replace(robot, model=_with_arguments(robot, names, by)))[1]


def _arguments(
    robot: Robot, names: Sequence[str], by: Sequence[float]
) -> dict[str, str]:
    changed = {}
    for name, change in zip(names, by, strict=True):
        try:
            changed[name] = repr(float(robot.arguments[name]) + change)
        except ValueError:
            raise UsageError(
                f"dimensions: {name} is {robot.arguments[name]!r}, not a number"
            ) from None
    return {**robot.arguments, **changed}


@once_per_record
def _with_arguments(
    robot: Robot, names: tuple[str, ...], by: tuple[float, ...]
) -> RobotModel:
    """The model with xacro arguments changed; meshes are not looked at."""
    arguments = _arguments(robot, names, by)
    if robot.description is None:
        source, _ = read_urdf(robot.file, arguments, robot.roots)
    else:
        arguments = complete_arguments(robot.description, arguments)
        source, _ = read_urdf(robot.file, arguments, ANYWHERE)
    return RobotModel(source)


def _shapes(robot: Robot, names: tuple[str, ...], reach: Array) -> dict[int, Array]:
    """Rates of the vertices of all parts that a dimension changes."""
    found: dict[int, Array] = {}
    for k, name in enumerate(names):
        if reach[k] == 0.0 or not _changes_shapes(robot, name):
            continue
        ends = [
            _parts_with(robot, name, float(sign * reach[k])) for sign in (-1.0, 1.0)
        ]
        for part, (low, high) in enumerate(zip(*ends, strict=True)):
            mesh = robot.parts[part].mesh
            rate = _shape_rate(name, mesh, low, high) / (2.0 * reach[k])
            if rate.any():
                rates = found.setdefault(part, np.zeros((len(names), *rate.shape)))
                rates[k] = rate
    return found


def _parts_with(robot: Robot, name: str, by: float) -> list[TriangleMesh]:
    arguments = _arguments(robot, (name,), (by,))
    built = robot_with(robot.name, arguments, robot.level, roots=robot.roots)
    return [part.mesh for part in built.parts]


def _shape_rate(
    name: str, mesh: TriangleMesh, low: TriangleMesh, high: TriangleMesh
) -> Array:
    """How far the vertices go from low to high, straight through the mesh's own."""
    like = all(np.array_equal(mesh.triangles, m.triangles) for m in (low, high))
    like = like and mesh.vertices.shape == low.vertices.shape == high.vertices.shape
    middle = 0.5 * (low.vertices + high.vertices) if like else np.inf
    # generated meshes are files of float32: 1e-7 of a metre
    if not like or np.abs(middle - mesh.vertices).max() > 2.0 * OFF:
        raise UsageError(
            f"dimensions: {name} changes the shape of {mesh.name} in another way than "
            "in proportion to its error: its uncertainty cannot be drawn"
        )
    return np.asarray(high.vertices - low.vertices, dtype=np.float64)


def _changes_shapes(robot: Robot, name: str) -> bool:
    if robot.description is not None:
        return robot.description.arguments[name].shapes
    low, high = (_with_arguments(robot, (name,), (s,)).tree for s in (-STEP, STEP))
    return _shapes_of(low) != _shapes_of(high)


def _shapes_of(tree: "UrdfTree") -> list[object]:
    return [
        (link.name, shape.geometry, shape.origin.tolist())
        for link in tree.links
        for shape in link.collisions or link.visuals
    ]
