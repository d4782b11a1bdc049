"""Xacro checks: it expands, and its arguments are those it has."""

from collections.abc import Iterator

from borecheck.robots.urdf.rules import document
from borecheck.validation.checks.ruled import noted, problems
from borecheck.validation.reading.checked_urdf import CheckedUrdf
from borecheck.validation.registry import Problem, register


@register("D109", "left-over-xacro", "document", "EEE")
def left_over_xacro(robot: CheckedUrdf) -> Iterator[Problem]:
    """Xacro macros or expressions were left in the URDF.

    Why: URDF parsers do not evaluate them: tags are dropped, numbers become garbage.

    Fix: Expand the file with xacro, or give it the suffix .xacro.
    """
    return problems(robot, document.left_over_xacro)


@register("D110", "xacro-failed", "document", "EEE", "file")
def xacro_failed(robot: CheckedUrdf) -> Iterator[Problem]:
    """The xacro file could not be expanded.

    Why: There is no URDF to check.

    Fix: Mend the expression, macro or include at that line; give undeclared arguments
    with --arg NAME=VALUE and package roots with --package-path DIR.

    Libraries: the xacro package finds $(find pkg) only through a ROS index; borecheck
    searches the roots it is given, the folders above the file and the environment.
    """
    return noted(robot, "D110")


@register("D111", "xacro-argument-unknown", "document", "WWW")
def xacro_argument_unknown(robot: CheckedUrdf) -> Iterator[Problem]:
    """An argument was given that the xacro file does not declare.

    Why: It has no effect; a misspelt name leaves the default in force.

    Fix: Use a declared name, or declare the argument with <xacro:arg>.
    """
    return noted(robot, "D111")


@register("D112", "xacro-argument-unused", "document", "III")
def xacro_argument_unused(robot: CheckedUrdf) -> Iterator[Problem]:
    """The xacro file declares an argument that nothing refers to.

    Why: Setting it changes nothing, though a user may think so.

    Fix: Use it with $(arg name), or remove the declaration.
    """
    return noted(robot, "D112")


@register("D113", "xacro-warning", "document", "III")
def xacro_warning(robot: CheckedUrdf) -> Iterator[Problem]:
    """The xacro package gave a warning.

    Why: It usually means that a name hides another one.

    Fix: Rename the property or parameter.
    """
    return noted(robot, "D113")
