"""Every key of a case file, and the option of the command line that it stands for."""

from dataclasses import dataclass

from borecheck.commands.case import values
from borecheck.commands.case.values import Kind
from borecheck.core.patient_frame import POSITIONS
from borecheck.robots.description import LEVELS

# What is asked for; whoever types one of them asks for nothing else.
QUESTIONS = ("q", "path", "plan", "random", "replay")


@dataclass(frozen=True)
class Key:
    """A key.

    Attributes:
        name: As written: `robot.base`, or `patient` for tables of their own.
        option: The option, as argparse names its value.
        kind: Reads the value.
        goes_with: Options whose value on the command line replaces this one as well.
    """

    name: str
    option: str
    kind: Kind
    goes_with: tuple[str, ...] = ()

    @property
    def shown(self) -> str:
        """The key as people write it: a scanner's file stands beside its name."""
        return self.name.removesuffix(".body")


KEYS = (
    Key("robot.name", "robot", values.installed),
    Key("robot.file", "robot", values.file),
    Key("robot.arguments", "arg", values.arguments, ("robot",)),
    Key("robot.base", "base", values.pose, ("robot",)),
    Key("robot.package_paths", "package_path", values.folders, ("robot",)),
    Key("robot.allow_outside", "allow_outside", values.flag, ("robot",)),
    Key("needle.link", "needle", values.text, ("robot",)),
    Key("needle.tip", "tip", values.text, ("robot",)),
    Key("needle.insertion", "insertion", values.text, ("robot",)),
    Key("scanner.name", "scene", values.installed),
    Key("scanner.body", "scene", values.bodies),
    Key("scanner.arguments", "scene_arg", values.arguments, ("scene",)),
    Key("couch", "obstacle", values.bodies),
    Key("obstacle", "obstacle", values.bodies),
    Key("patient", "patient", values.bodies),
    Key("coordinates.isocentre", "isocentre", values.point, ("transform",)),
    Key(
        "coordinates.position",
        "position",
        values.one_of(POSITIONS),
        ("isocentre", "transform"),
    ),
    Key("coordinates.transform", "transform", values.file, ("isocentre",)),
    Key("allowed.srdf", "srdf", values.file, ("robot",)),
    Key("allowed.trust_never", "trust_never", values.flag, ("robot", "srdf")),
    Key("allowed.pairs", "allow", values.pairs, ("robot",)),
    Key("check.q", "q", values.configuration, ("robot", *QUESTIONS)),
    Key("check.path", "path", values.file, ("robot", *QUESTIONS)),
    Key("check.plan", "plan", values.file, QUESTIONS),
    Key("check.corridor", "corridor", values.corridor, ("robot", *QUESTIONS)),
    Key("check.margin", "margin", values.length),
    Key("check.margin_kind", "margin_kind", values.text),
    Key("check.level", "level", values.one_of(LEVELS)),
    Key("check.checker", "checker", values.text),
    Key("check.samples", "samples", values.whole),
    Key("check.long_way", "long_way", values.flag),
    Key("check.uncertainty", "uncertainty", values.file),
    Key("check.risk", "risk", values.number),
)

# Of each of these, one may be given.
ONE_OF = (
    ("robot.name", "robot.file"),
    ("scanner.name", "scanner.body"),
    ("coordinates.isocentre", "coordinates.transform"),
    ("check.q", "check.path", "check.plan"),
)
