"""The colours of every page, picture, card and view: one table.

No verdict is told by colour alone: beside it stands its word and a shape, a circle for
clear, an octagon for contact, a triangle for unknown.
"""

from dataclasses import dataclass


@dataclass(frozen=True)
class Shade:
    """What is written in a verdict's colour, and the ground it is written on.

    Attributes:
        ink: Text, shapes and lines; on its ground and on the page its contrast is at
            least 4.5 to 1.
        ground: Behind them.
    """

    ink: str
    ground: str


LIGHT = {
    "clear": Shade("#00614d", "#e2f4ee"),
    "contact": Shade("#a12b00", "#fdeae2"),
    "unknown": Shade("#6a5000", "#fdf3d3"),
}
DARK = {
    "clear": Shade("#63d6b4", "#10332b"),
    "contact": Shade("#ffa37f", "#42190b"),
    "unknown": Shade("#ffd75e", "#3a2f08"),
}

# Surfaces by their role, the same by day and by night.
ROLES = {
    "robot": "#5483b5",
    "needle": "#1e1e22",
    "scanner": "#cdd1d6",
    "couch": "#949eaa",
    "patient": "#e2bca0",
    "other": "#aaa0b9",
}
# Triangles in contact, the robot's and the other surface's.
TOUCHING = ("#d55e00", "#f0c000")
# The line of a needle plan.
PLAN = "#004fc4"


def rgb(colour: str) -> tuple[int, int, int]:
    """Red, green and blue of `#rrggbb`, 0 to 255."""
    red, green, blue = bytes.fromhex(colour.removeprefix("#"))
    return red, green, blue


def style_sheet() -> str:
    """The table as custom properties of a style sheet, by day and by night."""
    fixed = {f"role-{role}": colour for role, colour in ROLES.items()}
    fixed |= {"touching": TOUCHING[0], "touched": TOUCHING[1], "plan": PLAN}
    fixed |= {f"{verdict}-mark": shade.ink for verdict, shade in LIGHT.items()}
    day, night = _properties(fixed) + _verdicts(LIGHT), _verdicts(DARK)
    return (
        f":root{{{day}}}\n"
        f"@media screen and (prefers-color-scheme: dark){{:root{{{night}}}}}\n"
    )


def _verdicts(shades: dict[str, Shade]) -> str:
    inks = {verdict: shade.ink for verdict, shade in shades.items()}
    grounds = {f"{verdict}-bg": shade.ground for verdict, shade in shades.items()}
    return _properties(inks | grounds)


def _properties(values: dict[str, str]) -> str:
    return "".join(f"--{name}:{colour};" for name, colour in values.items())
