"""One measured figure beside what was asked for."""

from dataclasses import dataclass

from benchmarks.run import unit_of


@dataclass(frozen=True)
class Figure:
    """A number and its goal.

    Attributes:
        what: The call, its scene and its case.
        value: What was measured.
        goal: What was asked for.
        unit: "s", "bytes", or "times", of which more is better.
    """

    what: str
    value: float
    goal: float
    unit: str = "s"

    @property
    def reached(self) -> bool:
        """Whether the goal is kept."""
        if self.unit == "times":
            return self.value >= self.goal
        return self.value <= self.goal

    def __str__(self) -> str:
        bound = "at least" if self.unit == "times" else "at most"
        mark = "" if self.reached else "  BELOW"
        return f"{self.what:62s} {self._said(self.value):>9s}, {bound} " + (
            f"{self._said(self.goal)}{mark}"
        )

    def _said(self, number: float) -> str:
        if self.unit == "s":
            return unit_of(number)
        if self.unit == "times":
            return f"x{number:.3g}"
        return f"{number / 1e9:.2f} GB" if number > 1e8 else f"{number:.0f} B"
