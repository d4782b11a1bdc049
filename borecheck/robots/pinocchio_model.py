"""The door to Pinocchio: placements of links by their names."""

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from borecheck.robots.urdf.skeleton import pieces, skeleton
from borecheck.robots.urdf.tree import UrdfTree

Array = NDArray[np.float64]
MOVING = ("revolute", "continuous", "prismatic")
MOST_AT_ONCE = 100  # joints in one model of Pinocchio: 0.2 GB


class PinocchioModel:
    """Pinocchio's models and data behind joint and link names.

    One model for each piece of the tree: of n moving joints Pinocchio keeps n^3
    numbers, which for a chain of a thousand is more than any memory.
    """

    def __init__(self, tree: UrdfTree) -> None:
        self._root = tree.root.name
        self._pieces = [_Piece(piece) for piece in pieces(tree, MOST_AT_ONCE)]

    def placements(self, positions: Mapping[str, float]) -> dict[str, Array]:
        """T_root_link of every link, from all moving joints' positions."""
        placed = {self._root: np.eye(4)}
        for piece in self._pieces:
            above = placed[piece.root]
            for link, T in piece.placements(positions).items():
                placed[link] = T if piece.root == self._root else above @ T
        return placed


class _Piece:
    """Pinocchio about one piece of the tree: links placed in the piece's root."""

    def __init__(self, tree: UrdfTree) -> None:
        import pinocchio as pin  # 0.2 s, and only placements need it

        self._pin = pin
        self.root = tree.root.name
        self._model = pin.buildModelFromXML(skeleton(tree), False)
        self._data = self._model.createData()
        self._neutral = np.array(pin.neutral(self._model))
        self._joints = {
            joint.name: self._slot(f"j{number}")
            for number, joint in enumerate(tree.joints)
            if joint.type in MOVING
        }
        self._frames = {
            link.name: int(self._model.getFrameId(f"l{number}", pin.BODY))
            for number, link in enumerate(tree.links)
        }

    def _slot(self, joint: str) -> tuple[int, int]:
        entry: Any = self._model.joints[self._model.getJointId(joint)]
        return int(entry.idx_q), int(entry.nq)

    def placements(self, positions: Mapping[str, float]) -> dict[str, Array]:
        q = self._neutral.copy()
        for name, (start, size) in self._joints.items():
            value = positions[name]
            if size == 2:  # a continuous joint is stored as cosine and sine
                q[start : start + 2] = np.cos(value), np.sin(value)
            else:
                q[start] = value
        self._pin.framesForwardKinematics(self._model, self._data, q)
        frames = self._data.oMf
        return {
            link: np.array(frames[index].homogeneous)
            for link, index in self._frames.items()
        }
