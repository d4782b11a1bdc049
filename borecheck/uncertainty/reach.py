"""How far can errors move a part: proven bounds, linear in the sizes of the errors.

A placement is a product of fixed origins and joint motions. Change its factors one
after the other, those nearest to the standing body first: each change moves a point of
the moving body by what it would move it by if all factors behind had their nominal
value. An error of a joint therefore moves it by no more than the error times the
point's nominal distance from the joint's axis (a chord is shorter than its arc), or by
the error itself if the joint slides; an origin that shifts by a vector, by its length;
an origin that turns by an angle, by the angle times the distance from the origin; and
registration, the outermost factor, by its shift and its turn about the scene's origin.
So the displacement between nominal and disturbed place is at most

    sum_k c_k |M_k x|,

M_k x being the k-th of these effects and c_k its arm at the nominal place.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from borecheck.motion.bounds import Route
from borecheck.motion.problem import Body
from borecheck.robots.kinematics.chain import JointChain
from borecheck.robots.kinematics.forward import FIXED, TURNS
from borecheck.uncertainty.disturbed import Disturbance

Array = NDArray[np.float64]

# What an effect does: registration's shift and turn, a joint's position, the shift and
# turn of an origin, the vertices of a part.
SHIFT, TURN, JOINT, ORIGIN_SHIFT, ORIGIN_TURN, SHAPE = range(6)


class Effect(NamedTuple):
    """One effect of the errors: M x, and what it acts on.

    Attributes:
        kind: What it does.
        whose: Joint of the chain, or part, by its number.
        matrix: M, (rows, n).
    """

    kind: int
    whose: int
    matrix: Array


def effects_of(disturbance: Disturbance) -> list[Effect]:
    """All effects that are not zero."""
    eye = np.eye(len(disturbance.uncertainty.names))
    registration = np.array([disturbance.registration(x) for x in eye])
    off = np.array([disturbance.joints(x) for x in eye])
    found = [
        Effect(SHIFT, 0, registration[:, :3].T),
        Effect(TURN, 0, registration[:, 3:].T),
    ]
    chain, dimensions = disturbance.nominal, disturbance.dimensions
    own = eye[disturbance.of_dimensions]
    for j in range(chain.frame_count):
        position = np.zeros(len(eye))
        if chain.kind[j] != FIXED:
            position = chain.factor[j] * off[:, chain.source[j]]
        if len(own):
            position = position + dimensions.offset[:, j] @ own
            shift, turn = dimensions.shift[:, j].T @ own, dimensions.turn[:, j].T @ own
            found += [Effect(ORIGIN_SHIFT, j, shift), Effect(ORIGIN_TURN, j, turn)]
        found.append(Effect(JOINT, j, position[None]))
    for part, rates in dimensions.shapes.items():
        for k, rate in enumerate(rates):
            largest = float(np.linalg.norm(rate, axis=1).max())
            found.append(Effect(SHAPE, part, largest * own[k][None]))
    return [effect for effect in found if effect.matrix.any()]


def arms(
    effects: list[Effect],
    chain: JointChain,
    way: Route,
    moving: Body,
    numbers: tuple[int, int],
    to_world: bool,
    placed: Array,
) -> Array:
    """The arm of every effect where the frames are as placed, (effects,).

    Args:
        effects: From `effects_of`.
        chain: The nominal chain.
        way: From the standing body to the moving one.
        moving: The moving body; the arms are the largest of its box's corners.
        numbers: Of the parts that take part, for effects on shapes (-1: none).
        to_world: Whether the other body stands in the world.
        placed: T_world_frame of all frames, nominal.
    """
    T = placed[moving.frame]
    corners = box_corners(moving.mesh.bounds) @ T[:3, :3].T + T[:3, 3]
    on_the_way = {int(j) for j in way.joints}
    found = np.zeros(len(effects))
    for k, effect in enumerate(effects):
        j = effect.whose
        if effect.kind == SHAPE:
            found[k] = float(j in numbers)
        elif effect.kind in (SHIFT, TURN):
            far = 1.0 if effect.kind == SHIFT else _farthest(corners)
            found[k] = far if to_world else 0.0
        elif j not in on_the_way:
            continue
        elif effect.kind == ORIGIN_TURN:
            found[k] = _farthest(corners - placed[j, :3, 3])
        elif effect.kind == JOINT and chain.kind[j] == TURNS:
            axis = placed[j, :3, :3] @ chain.axis[j]
            found[k] = _farthest(np.cross(corners - placed[j, :3, 3], axis))
        else:
            found[k] = 1.0
    return found


def grows_with_motion(effects: list[Effect], chain: JointChain) -> NDArray[np.bool_]:
    """Effects whose arms change while the body moves, (effects,)."""
    return np.array(
        [
            e.kind in (TURN, ORIGIN_TURN)
            or (e.kind == JOINT and chain.kind[e.whose] == TURNS)
            for e in effects
        ],
        dtype=bool,
    )


def sizes(effects: list[Effect], xs: Array) -> Array:
    """|M_k x| of every effect for errors (n, quantities), (n, effects)."""
    found = [np.linalg.norm(xs @ e.matrix.T, axis=1) for e in effects]
    return np.stack(found, axis=1) if found else np.zeros((len(xs), 0))


def per_sigma(effects: list[Effect], coefficients: Array, blocks: list[Array]) -> Array:
    """Bound of sum_k c_k |M_k x| over all x = A z with |z| <= 1, (pieces,).

    The columns of A fall into blocks on which different effects act; in each block the
    sum is bounded by the norm of the columns' sums, and by the sum of the effects' own
    norms: the smaller counts. Blocks add up by Cauchy and Schwarz.

    Args:
        effects: The effects.
        coefficients: Arms, (pieces, effects).
        blocks: Columns of A of each block, (quantities, k) each.
    """
    squares = np.zeros(len(coefficients))
    for root in blocks:
        moved = [effect.matrix @ root for effect in effects]
        if not moved or root.shape[1] == 0:
            continue
        columns = np.stack([np.linalg.norm(m, axis=0) for m in moved])
        wholes = np.array([np.linalg.norm(m, 2) for m in moved])
        by_column = np.linalg.norm(coefficients @ columns, axis=1)
        squares += np.minimum(by_column, coefficients @ wholes) ** 2
    return np.sqrt(squares)


def box_corners(bounds: Array) -> Array:
    """The eight corners of a box (2, 3)."""
    pick = np.array([[i >> 2 & 1, i >> 1 & 1, i & 1] for i in range(8)])
    return np.where(pick == 1, bounds[1], bounds[0])


def _farthest(vectors: Array) -> float:
    return float(np.linalg.norm(vectors, axis=1).max())
