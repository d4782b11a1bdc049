"""The three meanings of a safety margin, by name.

offset: the true distance must exceed it. enlarge-axes: the robot grows by it along
each axis ([Matsuno2020] section 4.1), in body or world axes. security: Coal's own.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from borecheck.core.once import once_per_record
from borecheck.errors import UnknownNameError, UsageError
from borecheck.geometry.mesh.enlarge import Enlarged, enlarge
from borecheck.geometry.mesh.triangle_mesh import TriangleMesh

OFFSET = "offset"
ENLARGE_BODY = "enlarge-axes"
ENLARGE_WORLD = "enlarge-axes:world"
SECURITY = "security"
KINDS = (OFFSET, ENLARGE_BODY, ENLARGE_WORLD, SECURITY)

_ALLOWED = {
    "exact": (OFFSET, ENLARGE_BODY, ENLARGE_WORLD),
    "two-sided": (OFFSET, ENLARGE_BODY, ENLARGE_WORLD),
    "paper:robot": (ENLARGE_BODY, ENLARGE_WORLD),
    "paper:scanner": (ENLARGE_BODY, ENLARGE_WORLD),
    "coal": (SECURITY, ENLARGE_BODY, ENLARGE_WORLD),
}


@dataclass(frozen=True)
class Margin:
    """A required clearance.

    Attributes:
        size: [m], not negative.
        kind: One of KINDS.
    """

    size: float
    kind: str

    @property
    def enlarges(self) -> bool:
        """Whether the robot's geometry itself grows."""
        return self.size > 0.0 and self.kind in (ENLARGE_BODY, ENLARGE_WORLD)


# A larger margin leaves no room for a robot in a scanner's bore: a mistaken unit, [m].
LARGEST_MARGIN = 0.5

NO_MARGIN = Margin(0.0, OFFSET)


def margin_for(checker: str, size: float, kind: str | None = None) -> Margin:
    """The margin a checker is to keep; each checker has its natural kind.

    Raises:
        UnknownNameError: No such kind.
        UsageError: Negative, not finite, or a kind that the checker does not take.
    """
    check_size(size)
    if kind is None:
        return Margin(float(size), _ALLOWED[checker][0])
    if kind not in KINDS:
        raise UnknownNameError("margin kind", kind, KINDS)
    if kind not in _ALLOWED[checker]:
        takes = ", ".join(_ALLOWED[checker])
        raise UsageError(f"checker {checker} takes no {kind} margin, only {takes}")
    return Margin(float(size), kind)


def check_size(size: float) -> float:
    """The same size of a margin, [m], if it can be one.

    Raises:
        UsageError: Negative, not finite, or more than LARGEST_MARGIN.
    """
    if not (np.isfinite(size) and size >= 0.0):
        raise UsageError(f"margin {size} m is not a length of 0 or more")
    if size > LARGEST_MARGIN:
        raise UsageError(
            f"margin {size:g} m is over {LARGEST_MARGIN:g} m: are these millimetres? "
            f"Bare numbers are metres; for millimetres write {size:g}mm"
        )
    return size


def enlarged(
    mesh: TriangleMesh, margin: Margin, R_world_link: NDArray[np.float64]
) -> Enlarged:
    """The link's mesh grown by the margin, in the link's frame, with a map back."""
    if margin.kind == ENLARGE_BODY:
        return _in_body_axes(mesh, margin.size)
    return enlarge(mesh, margin.size, R_world_link.T)


@once_per_record
def _in_body_axes(mesh: TriangleMesh, size: float) -> Enlarged:
    return enlarge(mesh, size)
