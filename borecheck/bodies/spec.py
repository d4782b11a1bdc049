"""Which body is asked for: `body:sex=f,bmi=35,height=1.65,arms=up`."""

import math
from collections.abc import Mapping
from dataclasses import dataclass

from borecheck.bodies.table import KEYS, STATURE
from borecheck.core.units import PLAIN_NUMBER, parse_length, parse_pair
from borecheck.errors import UnknownNameError, UsageError

PREFIX = "body:"
FIELDS = ("sex", "bmi", "height", "arms")
ARMS = ("side", "up")

# Beyond these a body that is only scaled is nobody's, [m].
SHORTEST, TALLEST = 1.40, 2.10


@dataclass(frozen=True)
class BodySpec:
    """A body.

    Attributes:
        sex: "m" or "f".
        bmi: Body mass index, [kg/m2].
        height: Stature, [m].
        arms: "side" or "up".
    """

    sex: str
    bmi: float
    height: float
    arms: str = "up"

    def __post_init__(self) -> None:
        if self.sex not in STATURE:
            raise UnknownNameError("sex", str(self.sex), STATURE)
        if self.arms not in ARMS:
            raise UnknownNameError("place of the arms", str(self.arms), ARMS)
        _within("bmi", self.bmi, KEYS[0], KEYS[-1], "kg/m2")
        _within("height", self.height, SHORTEST, TALLEST, "m")

    def __str__(self) -> str:
        return (
            f"{PREFIX}sex={self.sex},bmi={self.bmi:g},height={self.height:g},"
            f"arms={self.arms}"
        )

    @property
    def mass(self) -> float:
        """[kg]."""
        return self.bmi * self.height**2


def body_spec(text: str) -> BodySpec:
    """The body that a text names, with or without `body:` before it.

    Raises:
        UsageError: It has no sex or no body mass index, or a number that is none.
        UnknownNameError: A field, sex or place of arms that does not exist.
    """
    found: dict[str, str] = {}
    for part in text.removeprefix(PREFIX).split(","):
        name, value = parse_pair(part.strip(), "body")
        if name not in FIELDS:
            raise UnknownNameError("field of a body", name, FIELDS)
        if name in found:
            raise UsageError(f"body: {name} is given twice")
        found[name] = value.strip()
    return spec_of(found)


def spec_of(fields: Mapping[str, str]) -> BodySpec:
    """The body of these fields, as typed; see `body_spec`."""
    for name in ("sex", "bmi"):
        if name not in fields:
            example = f"{PREFIX}sex=f,bmi=35,height=1.65,arms=up"
            raise UsageError(f"body: {name} is missing; write for example {example}")
    sex = fields["sex"]
    if sex not in STATURE:
        raise UnknownNameError("sex", sex, STATURE)
    bmi = fields["bmi"]
    if PLAIN_NUMBER.fullmatch(bmi) is None:
        raise UsageError(f"body: bmi {bmi!r} is no number")
    height = fields.get("height")
    return BodySpec(
        sex,
        float(bmi),
        STATURE[sex] if height is None else parse_length(height),
        fields.get("arms", "up"),
    )


def _within(name: str, value: float, low: float, high: float, unit: str) -> None:
    if not (math.isfinite(value) and low <= value <= high):
        raise UsageError(
            f"body: {name} {value:g} is not from {low:g} to {high:g} {unit}"
        )
