"""From a file to the record that checks look at, or to the finding that stops it."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from borecheck.core.text import printable
from borecheck.errors import UrdfError
from borecheck.robots.urdf.rules.defect import Defect
from borecheck.robots.urdf.rules.tree import too_deep
from borecheck.robots.urdf.source import read
from borecheck.robots.urdf.text import is_xacro, read_bytes
from borecheck.validation.findings import Finding
from borecheck.validation.options import Options
from borecheck.validation.reading.checked_urdf import CheckedUrdf
from borecheck.validation.registry import find_check
from borecheck.validation.suppress import Suppression, suppressions_in, suppressions_of

_MESH = "is a mesh, not a URDF file: name the URDF that uses it, its meshes are checked"
# What is given in place of the robot file that it belongs to.
_OTHER_KINDS = {suffix: _MESH for suffix in (".stl", ".obj", ".ply", ".dae")} | {
    ".srdf": "is an SRDF, not a URDF file: name the URDF, the SRDF beside it is checked"
}

Loaded = tuple[CheckedUrdf | Finding, tuple[Suppression, ...]]


def load_file(path: Path, options: Options) -> Loaded:
    """A file as a robot; a finding if no XML tree can be had from it."""
    try:
        raw = read_bytes(path, options.roots)
    except UrdfError as error:
        return _stopped("D101", error, str(path), options), ()
    other = _OTHER_KINDS.get(path.suffix.lower())
    if other is not None:
        return _stopped("D101", UrdfError(path, other), str(path), options), ()
    if is_xacro(path):
        return _load_xacro(path, raw, options)
    return _load(raw, str(path), path.parent, options)


def load_text(text: str | bytes, file: str, options: Options) -> Loaded:
    """A text as a robot; relative mesh names start in the working directory."""
    return _load(text, file, Path.cwd(), options)


def _load(
    raw: str | bytes,
    file: str,
    folder: Path,
    options: Options,
    origins: Sequence[tuple[Path, int]] = (),
) -> Loaded:
    try:
        source = read(raw, file, origins)
    except UrdfError as error:
        code = "D102" if "well-formed" in error.problem else "D101"
        return _stopped(code, error, file, options), ()
    robot = CheckedUrdf(source=source, file=file, options=options, folder=folder)
    deep = next(too_deep(robot), None)
    if deep is not None:
        return _refused("T211", robot, deep), ()
    found, faulty = suppressions_in(source, file)
    if not origins:
        robot.notes["D131"] = [(c.element, f"the comment {c.problem}") for c in faulty]
    return robot, found


def _load_xacro(path: Path, raw: bytes, options: Options) -> Loaded:
    from borecheck.robots.urdf.xacro import expand

    try:
        expanded = expand(path, options.arguments, options.roots)
    except UrdfError as error:
        return _stopped("D110", error, str(path), options), ()
    robot, _ = _load(expanded.text, str(path), path.parent, options, expanded.places)
    if isinstance(robot, CheckedUrdf):
        robot.holds_macros_only = not robot.links and b"xacro:macro" in raw
        robot.found_packages = expanded.packages
        robot.notes["D111"] = [
            (None, f"argument {name!r} is not declared") for name in expanded.unused
        ]
        robot.notes["D112"] = [
            (None, f"argument {name!r} is never used") for name in expanded.unreferenced
        ]
        robot.notes["D135"] = [(None, line) for line in expanded.stray]
        robot.notes["D113"] = [
            (None, line) for line in expanded.warnings if line.startswith("warning:")
        ]
    return robot, suppressions_of(expanded.files)


def _refused(code: str, robot: CheckedUrdf, problem: Defect) -> Finding:
    """What keeps all other checks from looking at the robot."""
    place = robot.source.place(problem.element)
    error = UrdfError(f"{place.file}:{place.line}", problem.message, place.path)
    return replace(
        _stopped(code, error, robot.file, robot.options),
        element=printable(place.path),
        message=printable(problem.message),
    )


def _stopped(code: str, error: UrdfError, file: str, options: Options) -> Finding:
    check = find_check(code)
    where = error.element or ""
    named, _, number = error.file.rpartition(":")
    if not number.isdigit():
        named, number = error.file, _line_in(where)
    return Finding(
        code=code,
        severity=check.levels[options.profile],
        tier=check.tier,
        element="" if where.startswith("line ") else printable(where),
        file=named or file,
        line=int(number),
        message=printable(f"{where}: {error.problem}" if where else error.problem),
        why=check.why,
        hint=check.fix,
        libraries=check.libraries,
        name=check.name,
    )


def _line_in(where: str) -> str:
    words = where.replace(",", " ").split()
    return words[1] if len(words) > 1 and words[1].isdigit() else "1"
