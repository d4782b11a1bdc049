"""Differences and products of vectors as tuples of three numbers, for kernels."""

from borecheck.geometry.kernels.compile import kernel

Point = tuple[float, float, float]


@kernel
def minus(p: Point, q: Point) -> Point:
    """The vector from q to p."""
    return p[0] - q[0], p[1] - q[1], p[2] - q[2]


@kernel
def cross(u: Point, v: Point) -> Point:
    """The cross product."""
    return (
        u[1] * v[2] - u[2] * v[1],
        u[2] * v[0] - u[0] * v[2],
        u[0] * v[1] - u[1] * v[0],
    )


@kernel
def dot(u: Point, v: Point) -> float:
    """The scalar product."""
    return u[0] * v[0] + u[1] * v[1] + u[2] * v[2]
