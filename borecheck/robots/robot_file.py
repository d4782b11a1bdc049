"""From what a user calls a robot to its URDF: names told apart, files read once."""

import re
from collections.abc import Callable, Iterable, Mapping
from difflib import get_close_matches
from inspect import signature
from pathlib import Path

from borecheck.errors import UnknownNameError, UsageError
from borecheck.robots.description import installed_names
from borecheck.robots.urdf.reach import NO_ROOTS, Roots
from borecheck.robots.urdf.source import Source, read
from borecheck.robots.urdf.text import is_xacro, read_bytes

_MESH = re.compile(r".*\.(stl|obj|ply|dae)([:@].*)?", re.I | re.S)  # as a scene has it
_ORDER = "the robot comes first, then the scene"


def exists(path: Path) -> bool:
    """Whether there is such a file; also of a name that no file can have."""
    try:
        return path.exists()
    except (OSError, ValueError):
        return False


def is_file(path: Path) -> bool:
    """Whether there is such a regular file."""
    return exists(path) and path.is_file()


def robot_path(name: str) -> Path:
    """The file that a robot's name means, if it is not an installed robot.

    Raises:
        UsageError: It is a scanner or a mesh: robot and scene were swapped.
        UnknownNameError: A bare word that names no robot.
    """
    path = Path(name)
    if name in installed_names("scanners") and not is_file(path):
        raise UsageError(f"{name} is a scanner, not a robot: {_ORDER}")
    if _MESH.fullmatch(name):
        raise UsageError(f"{name} is a mesh, not a robot: {_ORDER}")
    if path.suffix.lower() == ".srdf":
        raise UsageError(
            f"{name} is an SRDF, not a robot: the URDF is the robot, the SRDF goes "
            f"with it as --srdf {name}"
        )
    if not exists(path) and not path.suffix and path.name == name:
        raise UnknownNameError("robot", name, installed_names("robots"))
    return path


def refuse_misspelt(
    loader: Callable[..., object], given: Mapping[str, object], takes: Iterable[str]
) -> None:
    """Nothing, unless an argument is an option of the loader, written otherwise.

    Args:
        loader: The function that was called.
        given: Arguments that it has no options of that name for.
        takes: Arguments that what is loaded does take.

    Raises:
        UsageError: Such a one; with what may have been meant.
    """
    options = [name for name in signature(loader).parameters if name != "arguments"]
    known = set(takes)
    for name, value in given.items():
        if name in known and not _MESH.fullmatch(str(value)):
            continue
        meant = get_close_matches(name, options, n=1, cutoff=0.75)
        if meant:
            raise UsageError(
                f"{loader.__name__} has no option {name!r}; did you mean {meant[0]!r}?"
            )


def refuse_robot(name: str) -> None:
    """Nothing, unless a scene's name is that of an installed robot.

    Raises:
        UsageError: Robot and scene were swapped.
    """
    if name in installed_names("robots") and not is_file(Path(name)):
        raise UsageError(f"{name} is a robot, not a scene: {_ORDER}")


def read_urdf(
    path: Path, arguments: Mapping[str, str], roots: Roots = NO_ROOTS
) -> tuple[Source, tuple[str, ...]]:
    """The URDF of a file, xacro expanded, and what was odd about it.

    Raises:
        UrdfError: The file cannot be read or expanded.
        UsageError: Arguments for a file that takes none.
    """
    raw = read_bytes(path, roots)
    if not is_xacro(path):
        if arguments:
            raise UsageError(f"{path} is no xacro file, so it takes no arguments")
        source = read(raw, str(path))
        odd = (f"{path}:{defect.line}: {defect.message}" for defect in source.defects)
        return source, tuple(odd)
    from borecheck.robots.urdf.xacro import expand  # fifteen modules

    expanded = expand(path, arguments, roots)
    unused = tuple(f"argument {name} is not used by {path}" for name in expanded.unused)
    source = read(expanded.text, str(path), expanded.places)
    return source, (*unused, *expanded.stray)
