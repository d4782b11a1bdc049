"""Which solids hold which, of many poses at once: the compiled first look.

What it cannot tell (crossings that cancel, open meshes) is asked pair by pair with
`contact.containment`, which knows the reasons.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from borecheck.geometry.surfaces import Surface
from borecheck.geometry.tree.holding import WITNESSES, Solids, holding
from borecheck.geometry.tree.many_links import MovingLinks

Array = NDArray[np.float64]


def solids_of(surfaces: Sequence[Surface]) -> Solids:
    """What the compiled look asks of some surfaces, found once."""
    return Solids([s.mesh for s in surfaces], [s.topology for s in surfaces])


class SolidPairs:
    """The pairs of `MovingLinks` as solids.

    Args:
        moving: Links and what they are asked against.
        links: Of the links.
        others: Of the others; the same object where those are the links.
    """

    def __init__(self, moving: MovingLinks, links: Solids, others: Solids) -> None:
        self._moving = moving
        self._links = links
        self._others = others

    def codes(
        self,
        placements: Array,
        *,
        unseen: bool = False,
    ) -> NDArray[np.int8]:
        """What can be told of every pair in every pose, (n, pairs), see `tree.holding`.

        Surfaces must be known not to meet.

        Args:
            placements: T_world_link of every pose, (n, links, 4, 4), rigid.
            unseen: Whether surfaces may meet that the checker does not see.
        """
        moving = self._moving
        count = len(placements)
        settled = np.zeros(count, np.bool_)
        others = moving.T_world_others
        while True:
            codes = np.zeros((count, len(moving.pairs)), np.int8)
            asks = holding(
                moving.book.entries,
                self._links.arrays,
                self._others.arrays,
                placements,
                placements if others is None else others,
                others is None,
                1 if unseen else WITNESSES,
                True,
                settled,
                codes,
            )
            if not asks:
                return codes
            self._links.answer()
            self._others.answer()
