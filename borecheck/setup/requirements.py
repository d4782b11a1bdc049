"""What is asked of a set-up: [CRANE] eqs. (17) to (25) as numbers with their sources.

None of the paper's numbers survives in the text that is public; what stands here is
assumed, with the reason, and can be set.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from typing import Any

from borecheck.errors import UsageError
from borecheck.robots.given import length


def _number(value: float, unit: str, source: str) -> Any:
    return field(default=value, metadata={"unit": unit, "source": source})


def _hold(name: str, value: Any, most: float) -> None:
    numeric = isinstance(value, int | float) and not isinstance(value, bool)
    if not (numeric and math.isfinite(value) and 0.0 <= value <= most):
        upper = "" if math.isinf(most) else f" to {most:.4g}"
        raise UsageError(f"{name} is {value!r}, not a number from 0{upper or ' on'}")


@dataclass(frozen=True)
class Weights:
    """What counts how much in the cost, eq. (25); all 0 or more.

    Attributes:
        dexterity: w1, of the manipulability mu of the needle's direction.
        scanner: w2, of the distance of the robot to the scanner.
        patient: w3, of the distance of the robot to the patient; the insertion
            mechanism is left out.
        motion: w4, of the way from home, metres and radians alike.
    """

    dexterity: float = _number(1.0, "1", "assumed: mu is 0 to 2")
    scanner: float = _number(5.0, "1/m", "assumed: 20 cm count like all of mu")
    patient: float = _number(5.0, "1/m", "assumed, as of the scanner")
    motion: float = _number(0.1, "1/m, 1/rad", "assumed: breaks ties, decides nothing")

    def __post_init__(self) -> None:
        for name, value in vars(self).items():
            _hold(f"weight {name}", value, math.inf)


@dataclass(frozen=True)
class Requirements:
    """What a set-up must fulfil.

    Attributes:
        padding: Distance kept from every obstacle, [m]; eq. (21). The needle may be as
            near to the patient as it wants, and parts of the robot to each other.
        force: On the needle along itself, either way, [N]; eq. (17).
        moment: On the needle about any axis, [Nm]; eq. (17).
        cone: How far the needle can be tilted to all sides about its entry, [rad];
            eqs. (22), (23). 0: not at all.
        depth: How far the insertion joint must be able to drive the needle, [m]; None:
            as deep as the plan goes.
        position: How far the tip may be from the entry, [m]; eq. (20).
        direction: How far the needle may be turned from its direction, [rad].
        weights: Of the cost.
        excluded: Pairs of names, link and obstacle, that need not keep the padding;
            they may not touch.
    """

    padding: float = _number(0.01, "m", "assumed: a drape, and errors of a few mm")
    force: float = _number(5.0, "N", "[CRANE] section III-A3: the load of its test")
    moment: float = _number(0.1, "Nm", "assumed: 10 N bent in 10 mm")
    cone: float = _number(math.radians(10.0), "rad", "assumed: phi_max is lost")
    depth: float | None = _number(None, "m", "the plan")  # type: ignore[arg-type]
    position: float = _number(0.5e-3, "m", "assumed: a public script of the author")
    direction: float = _number(0.06, "rad", "assumed: a public script of the author")
    weights: Weights = Weights()
    excluded: tuple[tuple[str, str], ...] = ()

    def __post_init__(self) -> None:
        for name, most in _MOST.items():
            value = getattr(self, name)
            if value is not None:
                _hold(name, value, most)

    def to_json(self) -> dict[str, Any]:
        """Every number with its unit and its source."""
        told: dict[str, Any] = {f: _told(self, f) for f in _MOST}
        told["weights"] = {f.name: _told(self.weights, f.name) for f in fields(Weights)}
        told["excluded"] = [list(pair) for pair in self.excluded]
        return told


_MOST: Mapping[str, float] = {
    **{"padding": 1.0, "force": 1e4, "moment": 1e3, "cone": math.radians(80.0)},
    **{"depth": 1.0, "position": 0.01, "direction": 0.5},
}


def requirements(
    padding: float | str = Requirements.padding,
    force: float = Requirements.force,
    moment: float = Requirements.moment,
    cone: float = Requirements.cone,
    depth: float | str | None = None,
    weights: Mapping[str, float] | None = None,
    excluded: tuple[tuple[str, str], ...] = (),
) -> Requirements:
    """Requirements from what a caller gives, lengths as text with a unit or not.

    Raises:
        UsageError: A number that is none, or no weight of that name.
    """
    known = [f.name for f in fields(Weights)]
    for name in weights or {}:
        if name not in known:
            raise UsageError(
                f"no weight is called {name!r} (known: {', '.join(known)})"
            )
    return Requirements(
        padding=length(padding, "margin"),
        force=force,
        moment=moment,
        cone=cone,
        depth=None if depth is None else length(depth, "depth"),
        weights=Weights(**(weights or {})),
        excluded=excluded,
    )


def _told(record: Any, name: str) -> dict[str, Any]:
    about = type(record).__dataclass_fields__[name]
    value = getattr(record, name)
    source = about.metadata["source"] if value == about.default else "set"
    return {"value": value, "unit": about.metadata["unit"], "source": source}
