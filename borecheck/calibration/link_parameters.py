"""Axes as lines to DH and Hayati parameters, and back: [Heikkila2010] App. II.

Between axes that are not parallel: turn th about axis a, shift d along it, shift b
along c, turn be about c (DH, rot-trans-trans-rot). Between parallel axes: turn al about
a, shift d along the common normal, turn th about it, turn be about the third direction
(Hayati, rot-trans-rot-rot). World to the first axis: two shifts and two turns across.
The frames are parallel to the world at zero, as in the paper.

The printed signs of be, k and al are wrong or lost; `docs/calibration.md` has the
evidence, and the tests show that the printed ones do not give the lines back.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from borecheck.errors import GeometryError

Array = NDArray[np.float64]

# Axes nearer to parallel than this get Hayati's form: the common normal of DH would
# move by metres when the axis turns by a degree.
PARALLEL = np.radians(10.0)

# Parallel axes nearer than this cannot be told apart: [m], a rounding of drawings.
COINCIDENT = 1e-6


@dataclass(frozen=True)
class LinkParameters:
    """How one axis follows from the one before.

    Attributes:
        form: "base", "dh" or "hayati".
        names: Its four parameters in the order in which they are composed.
        a: Direction of the axis it starts from (base: of the first axis), (3,).
        b: dh: direction across which the next axis is measured; hayati: the common
            normal; base: first direction across, (3,).
        c: The third direction, (3,).
        next_axis: Direction of the next axis in the new frame, (3,).
    """

    form: str
    names: tuple[str, str, str, str]
    a: Array
    b: Array
    c: Array
    next_axis: Array


@dataclass(frozen=True)
class LinkForms:
    """The forms of all links of an arm, chosen on its nominal axes."""

    links: tuple[LinkParameters, ...]

    @property
    def names(self) -> tuple[str, ...]:
        """All parameters, link by link."""
        return tuple(name for link in self.links for name in link.names)

    @property
    def angles(self) -> tuple[str, ...]:
        """Those that are angles [rad]; the others are lengths [m]."""
        return tuple(n for n in self.names if n.startswith(("al", "be", "th")))


def choose_forms(points: ArrayLike, directions: ArrayLike) -> LinkForms:
    """DH or Hayati for every link, by the nominal axes at zero.

    Args:
        points: A point of every nominal axis, (n, 3), [m].
        directions: Their unit directions, (n, 3).

    Raises:
        GeometryError: Two axes that follow each other coincide.
    """
    p = np.asarray(points, dtype=np.float64)
    u = np.asarray(directions, dtype=np.float64)
    links: list[LinkParameters] = []
    T = np.eye(4)
    for i in range(len(u)):
        n, at = T[:3, :3].T @ u[i], T[:3, :3].T @ (p[i] - T[:3, 3])
        link = _next_link(i, links[-1].next_axis, n, at) if i else _base_link(n)
        T = T @ link_transform(link, _SOLVERS[link.form](link, at, n))
        links.append(link)
    return LinkForms(tuple(links))


def lines_to_parameters(
    forms: LinkForms, points: ArrayLike, directions: ArrayLike
) -> dict[str, Array]:
    """Parameters of measured axes, all of them at zero ([Heikkila2010] App. II).

    Args:
        forms: From `choose_forms`.
        points: A point of every axis in the world frame, (..., n, 3), [m].
        directions: Their directions, (..., n, 3).

    Returns:
        {name: value (...)}, [m] and [rad].
    """
    p_world = np.asarray(points, dtype=np.float64)
    n_world = np.asarray(directions, dtype=np.float64)
    T = np.broadcast_to(np.eye(4), (*p_world.shape[:-2], 4, 4))
    values: dict[str, Array] = {}
    for i, link in enumerate(forms.links):
        R_T = np.swapaxes(T[..., :3, :3], -1, -2)
        n = (R_T @ n_world[..., i, :, None])[..., 0]
        p = (R_T @ (p_world[..., i, :] - T[..., :3, 3])[..., None])[..., 0]
        found = _SOLVERS[link.form](link, p, n)
        values.update(zip(link.names, found, strict=True))
        T = T @ link_transform(link, found)
    return values


def parameters_to_lines(
    forms: LinkForms, values: Mapping[str, ArrayLike]
) -> tuple[Array, Array]:
    """Axes at zero that have these parameters: (points, directions), (..., n, 3)."""
    T = np.eye(4)
    points, directions = [], []
    for link in forms.links:
        numbers = [np.asarray(values[name], dtype=np.float64) for name in link.names]
        T = T @ link_transform(link, numbers)
        points.append(T[..., :3, 3])
        directions.append(T[..., :3, :3] @ link.next_axis)
    return np.stack(points, axis=-2), np.stack(directions, axis=-2)


def link_transform(link: LinkParameters, values: Sequence[ArrayLike]) -> Array:
    """The link's transform at zero joint angle, (..., 4, 4)."""
    first, second, third, fourth = values
    if link.form == "base":
        steps = _shift(link.b, first) @ _shift(link.c, second)
        return steps @ turn(link.b, third) @ turn(link.c, fourth)
    if link.form == "dh":
        steps = turn(link.a, first) @ _shift(link.a, second)
        return steps @ _shift(link.c, third) @ turn(link.c, fourth)
    steps = turn(link.a, first) @ _shift(link.b, second)
    return steps @ turn(link.b, third) @ turn(link.c, fourth)


def turn(axis: ArrayLike, angle: ArrayLike) -> Array:
    """Rotation about a unit axis through the origin, (..., 4, 4)."""
    x, y, z = np.asarray(axis, dtype=np.float64)
    K = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    angle = np.asarray(angle, dtype=np.float64)[..., None, None]
    T = np.zeros((*angle.shape[:-2], 4, 4))
    T[..., :3, :3] = np.eye(3) + np.sin(angle) * K + (1 - np.cos(angle)) * (K @ K)
    T[..., 3, 3] = 1.0
    return T


def _shift(axis: Array, distance: ArrayLike) -> Array:
    distance = np.asarray(distance, dtype=np.float64)
    T = np.zeros((*distance.shape, 4, 4))
    T[..., range(4), range(4)] = 1.0
    T[..., :3, 3] = distance[..., None] * axis
    return T


def _dot(vectors: Array, axis: Array) -> Array:
    return vectors @ axis


def _apply(T: Array, v: Array) -> Array:
    """The transposed rotation of T on vectors."""
    return (np.swapaxes(T[..., :3, :3], -1, -2) @ v[..., None])[..., 0]


def _base_link(u: Array) -> LinkParameters:
    """x0, y0, al0, be0; for an axis along z the directions across are x and y."""
    helper = np.roll(np.eye(3)[int(np.argmax(np.abs(u)))], 1)
    v = helper - (helper @ u) * u
    v = v / np.linalg.norm(v)
    return LinkParameters("base", ("x0", "y0", "al0", "be0"), u, v, np.cross(u, v), u)


def _solve_base(link: LinkParameters, p: Array, n: Array) -> tuple[Array, ...]:
    k = -_dot(p, link.a) / _dot(n, link.a)
    at = p + k[..., None] * n
    ahead, aside = _dot(n, link.b), _dot(n, link.c)
    up = _dot(n, link.a)
    be = np.arctan2(ahead, np.hypot(aside, up))
    return _dot(at, link.b), _dot(at, link.c), np.arctan2(-aside, up), be


def _next_link(i: int, a: Array, n: Array, at: Array) -> LinkParameters:
    parallel = np.linalg.norm(np.cross(a, n)) < np.sin(PARALLEL)
    return _hayati_link(i, a, n, at) if parallel else _dh_link(i, a, n)


def _dh_link(i: int, a: Array, n: Array) -> LinkParameters:
    c = np.cross(a, n)
    c = c / np.linalg.norm(c)
    c = c * np.sign(c[int(np.argmax(np.abs(c)))])
    b = n - (n @ a) * a
    b = b / np.linalg.norm(b)
    return LinkParameters("dh", (f"th{i}", f"d{i}", f"b{i}", f"be{i}"), a, b, c, b)


def _side(a: Array, b: Array, c: Array) -> float:
    """+1 if turning about c by a positive angle leads from b to a, else -1."""
    return float(np.sign(np.cross(c, b) @ a))


def _solve_dh(link: LinkParameters, p: Array, n: Array) -> tuple[Array, ...]:
    a, b, c = link.a, link.b, link.c
    th = np.arctan2(_dot(n, np.cross(a, b)), _dot(n, b))
    back = turn(a, th)
    p1, n1 = _apply(back, p), _apply(back, n)
    # printed be = asin(n_z), k = p_x / n_x: both lack their minus sign
    be = np.arctan2(_side(a, b, c) * _dot(n1, a), _dot(n1, b))
    k = -_dot(p1, b) / _dot(n1, b)
    return th, _dot(p1, a) + k * _dot(n1, a), _dot(p1, c), be


def _hayati_link(i: int, a: Array, n: Array, at: Array) -> LinkParameters:
    normal = at - (at @ a) * a
    distance = float(np.linalg.norm(normal))
    if distance < COINCIDENT:
        raise GeometryError(
            f"axes {i} and {i + 1} coincide: no measurement tells one from the other"
        )
    names = (f"al{i}", f"d{i}", f"th{i}", f"be{i}")
    b = normal / distance
    return LinkParameters("hayati", names, a, b, np.cross(b, a), a * np.sign(a @ n))


def _solve_hayati(link: LinkParameters, p: Array, n: Array) -> tuple[Array, ...]:
    a, b, c = link.a, link.b, link.c
    n = n * np.sign(link.next_axis @ a)
    t = p - (_dot(p, a) / _dot(n, a))[..., None] * n
    # printed al = atan(t_y / t_z): it lacks its minus sign
    al = np.arctan2(_dot(t, np.cross(a, b)), _dot(t, b))
    d = np.hypot(_dot(t, c), _dot(t, b))
    n1 = _apply(turn(a, al), n)
    th = np.arctan2(_dot(n1, c), _dot(n1, a))
    n2 = _apply(turn(b, th), n1)
    return al, d, th, np.arctan2(-_dot(n2, b), _dot(n2, a))


_SOLVERS = {"base": _solve_base, "dh": _solve_dh, "hayati": _solve_hayati}
