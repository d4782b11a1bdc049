"""A model from an installed description: its arguments checked, its meshes made."""

from collections.abc import Mapping

from borecheck.errors import UnknownNameError
from borecheck.robots.described_names import check_names
from borecheck.robots.description import Description
from borecheck.robots.generated_meshes import mesh_folder
from borecheck.robots.model import RobotModel
from borecheck.robots.urdf.expanded_text import expanded_text


def complete_arguments(
    description: Description, given: Mapping[str, str]
) -> dict[str, str]:
    """All xacro arguments: the given ones checked, defaults for the others.

    Raises:
        UnknownNameError: An argument the description does not have.
        UsageError: A value that is no choice or no quantity.
    """
    complete = {name: a.default for name, a in description.arguments.items()}
    for name, text in given.items():
        if name not in description.arguments:
            raise UnknownNameError("argument", name, description.arguments)
        complete[name] = description.arguments[name].value(name, str(text))
    return complete


def build_installed(
    description: Description, level: str, arguments: Mapping[str, str]
) -> tuple[RobotModel, str, tuple[str, ...]]:
    """Model, URDF text and warnings of an installed description.

    Args:
        description: Of a robot or scanner.
        level: Level of detail of its meshes.
        arguments: The xacro arguments, complete.

    Raises:
        UsageError: The description names what is not in its URDF.
    """
    folder = mesh_folder(description, level, arguments)
    complete = dict(arguments)
    if folder is not None:
        complete["mesh_dir"] = str(folder)
    text = expanded_text(description.xacro, complete)
    model = RobotModel(text, str(description.xacro))
    return model, text, check_names(description, model, complete)
