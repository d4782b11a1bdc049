"""The arm that is steered: what the model of the controller does not know of it."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from borecheck_models.closed_form import number, values
from crane.kinematics import forward, space_jacobian
from crane.transmission import Transmission, transmission
from crane.turning import turns

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Plant:
    """Faults of the simulated arm and tracker; nothing of them is printed but the load.

    Forces [N], lengths [m], angles [rad].
    """

    load: float = number(5.0, "the load of section III-A3, hung on the guide")
    link: float = number(5e3, "assumed, [N/m]: tube's end; statics.py has it so")
    free_length: float = number(0.93, "assumed: slide to pitch axis, as the meshes are")
    joint: float = number(40.0, "assumed, [Nm/rad], q5 to q7: statics.py for 28 mm")
    play: float = number(4e-3, "assumed: q5 to q7 follow their cables within +-")
    coupling: float = number(0.02, "assumed: C_cable's entries are off by this part")
    tracker_shift: float = number(0.0, "rms length of its noise, none by default")
    tracker_turn: float = number(0.0, "rms angle of its noise, none by default")

    def __post_init__(self) -> None:
        """Refuses numbers of which no plant is made.

        Raises:
            ValueError: There is one.
        """
        for name, value in values(self).items():
            stiff = name in ("link", "joint")  # may be rigid: infinite
            least_is_none = stiff or name == "free_length"
            if not (value > 0.0 if least_is_none else value >= 0.0) or not (
                stiff or np.isfinite(value)
            ):
                raise ValueError(f"{name} = {value!r} is none of a plant's")

    def true_coupling(self) -> Transmission:
        """C of the arm: later joints move 2 % more, the coupling is 2 % less."""
        C = np.array(transmission().matrix)
        C[4:, 4:] *= 1.0 - self.coupling * (1.0 - 2.0 * np.eye(4))
        return Transmission(C)

    def stretched(self, q: Array) -> Array:
        """Where joints come to as the load stretches their cables, (n, 8)."""
        give = np.zeros(8)
        give[4:7] = 1.0 / self.joint
        return q + give * self._torques(q)

    def placement(self, q: ArrayLike) -> Array:
        """True pose of frame 8 with joints at q: the tube bends under the load.

        Args:
            q: (n, 8).
        """
        T = forward(np.asarray(q, float))
        down = self.load / self.link
        slope = 1.5 * down / self.free_length  # of a beam loaded at its end
        # the arm points along x of the base: its end goes down and nods
        at = T["4"][:, :3, 3]
        nod = np.eye(4)
        axis = T["W"][0, :3, 1]
        nod[:3, :3] = turns(slope * axis[None])[0]
        moved = T["8"].copy()
        moved[:, :3, :3] = nod[:3, :3] @ T["8"][:, :3, :3]
        moved[:, :3, 3] = (T["8"][:, :3, 3] - at) @ nod[:3, :3].T + at
        moved[:, 2, 3] -= down
        return moved

    def seen(self, T: Array, rng: np.random.Generator | None) -> Array:
        """What the tracker says of a pose: eq. (27), with noise if there is any."""
        if rng is None or (self.tracker_shift == 0.0 and self.tracker_turn == 0.0):
            return T
        shift = rng.normal(scale=self.tracker_shift / np.sqrt(3.0), size=(len(T), 3))
        turn = rng.normal(scale=self.tracker_turn / np.sqrt(3.0), size=(len(T), 3))
        read = T.copy()
        read[:, :3, 3] += shift
        read[:, :3, :3] = turns(turn) @ T[:, :3, :3]
        return read

    def _torques(self, q: Array) -> Array:
        """J^T F of the load, which pulls down at frame 8; eq. (16)."""
        p = forward(q)["8"][:, :3, 3]
        force = np.array([0.0, 0.0, -self.load])
        wrench = np.concatenate(
            [np.broadcast_to(force, p.shape), np.cross(p, force)], axis=1
        )
        return np.asarray(np.einsum("nij,ni->nj", space_jacobian(q), wrench))


PERFECT = replace(Plant(), load=0.0, play=0.0, coupling=0.0)


def followed(before: Array, pulled: Array, play: float) -> Array:
    """Hysteresis: joints q5 to q7 stay until the cable has taken up its play."""
    half = np.array([0.0] * 4 + [play] * 3 + [0.0])
    return np.asarray(np.minimum(np.maximum(before, pulled - half), pulled + half))
