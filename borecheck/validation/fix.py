"""`--fix`: mends what needs no guessing, shown as a diff before anything is written.

Three things only: a misspelt attribute whose right name is not there, an axis of a
turning joint that is not of length one, and a closed STL mesh that is inside out (a
turned copy under a new name). A number whose intent is unknown is never changed: the
length of a prismatic joint's axis may be meant as a factor, so it stays.
"""

import difflib
import math
import re
import sys
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from xml.parsers import expat

from borecheck.core.text import printable
from borecheck.core.whole_files import write_all
from borecheck.errors import UsageError
from borecheck.robots.urdf.attributes import first
from borecheck.robots.urdf.draft_elements import DraftShape
from borecheck.robots.urdf.rules.joints import UNIT_TOLERANCE
from borecheck.robots.urdf.rules.names import nearest
from borecheck.robots.urdf.schema import SCHEMA
from borecheck.robots.urdf.source import elements
from borecheck.validation.findings import Finding
from borecheck.validation.load import load_file
from borecheck.validation.options import Options
from borecheck.validation.reading.checked_urdf import CheckedUrdf
from borecheck.validation.suppress import Suppression

DONE, COULD_NOT = 0, 2


@dataclass(frozen=True)
class Edit:
    """One attribute of one element gets another name or value.

    `mesh` is the turned mesh to be written beside, for a value that names it.
    """

    element: Any
    attribute: str
    name: str
    value: str
    mesh: tuple[Path, Any] | None = None


def fix_files(files: Mapping[str, Options], *, write: bool) -> int:
    """Shows the diffs of all files, and writes them if told to; the exit status.

    Raises:
        UsageError: A file that is no plain URDF, or a turned mesh that exists already.
        InputError: A file that cannot be written; then none is.
    """
    for file in files:
        if file == "-" or file.endswith(".xacro"):
            raise UsageError(f"{file}: --fix changes plain URDF files only")
    status = DONE
    meshes: dict[Path, bytes] = {}
    texts: dict[Path, bytes] = {}
    for file, options in files.items():
        path = Path(file)
        robot, suppressions = load_file(path, options)
        if isinstance(robot, Finding):
            sys.stderr.write(f"{printable(file)}: {robot.message}\n")
            status = COULD_NOT
            continue
        before = path.read_bytes()
        if not _is_plain(before, robot):
            problem = "--fix changes UTF-8 text that begins with its first tag"
            sys.stderr.write(f"{printable(file)}: {problem}\n")
            status = COULD_NOT
            continue
        edits = [e for e in edits_of(robot) if not _is_silent(robot, e, suppressions)]
        after = fixed_text(before, robot, edits)
        if after == before:
            nothing = "nothing that can be mended without guessing"
            sys.stderr.write(f"{printable(file)}: {nothing}\n")
        sys.stdout.write(printable(diff(path, after), keep="\t\r\n"))
        if after != before:
            texts[path] = after
            meshes |= _meshes(edits)
    if write:
        write_all(meshes | texts)
    return status


def _is_plain(raw: bytes, robot: CheckedUrdf) -> bool:
    """Whether places in the text are places in the file: UTF-8, and nothing stray."""
    coding = robot.root.getroottree().docinfo.encoding or "UTF-8"
    try:
        raw.decode("utf-8")
    except UnicodeDecodeError:
        return False
    is_stray = any(defect.kind == "stray" for defect in robot.source.defects)
    return not is_stray and coding.upper() in ("UTF-8", "US-ASCII", "ASCII")


def edits_of(robot: CheckedUrdf) -> list[Edit]:
    """Everything that can be mended without guessing."""
    found = [*_spelling(robot), *_axes(robot)]
    if robot.options.meshes:
        found += _inverted(robot)
    return found


def fixed_text(raw: bytes, robot: CheckedUrdf, edits: Sequence[Edit]) -> bytes:
    """The file's bytes with the edits made; nothing else is touched."""
    order = {element: index for index, element in enumerate(elements(robot.root))}
    starts = _tag_starts(raw)
    result = raw
    for edit in sorted(edits, key=lambda e: -order[e.element]):
        start = starts[order[edit.element]]
        end = _tag_end(result, start)
        tag = result[start:end].decode("utf-8")
        pattern = rf"(\s){re.escape(edit.attribute)}(\s*=\s*)(\"[^\"]*\"|'[^']*')"
        new = f'{edit.name}="{edit.value}"'
        match = re.search(pattern, tag)
        if match is None:
            continue  # written in a way that is better mended by hand
        changed = tag[: match.start()] + match[1] + new + tag[match.end() :]
        result = result[:start] + changed.encode() + result[end:]
    return result


def diff(path: Path, after: bytes) -> str:
    """A unified diff between the file and the mended text; empty if equal."""
    before = path.read_bytes().decode("utf-8", "replace").splitlines(keepends=True)
    lines = after.decode("utf-8", "replace").splitlines(keepends=True)
    return "".join(difflib.unified_diff(before, lines, str(path), f"{path} (mended)"))


def _is_silent(
    robot: CheckedUrdf, edit: Edit, suppressions: Sequence[Suppression]
) -> bool:
    line = robot.source.place(edit.element).line
    return any(s.first <= line <= s.last for s in suppressions)


def _spelling(robot: CheckedUrdf) -> Iterator[Edit]:
    for element in elements(robot.root):
        known = SCHEMA.get(str(element.tag), ((), ()))[0]
        unknown = [a for a in element.attrib if a not in known and "{" not in a]
        for attribute in unknown:
            right = nearest(attribute, known)
            rivals = [a for a in unknown if nearest(a, known) == right]
            if right is not None and right not in element.attrib and len(rivals) == 1:
                value = element.get(attribute)
                if not set(value) & set('"<&'):
                    yield Edit(element, attribute, right, value)


def _axes(robot: CheckedUrdf) -> Iterator[Edit]:
    for joint in robot.joints:
        axis, element = joint.axis, first(joint.element, "axis")
        if (
            element is None
            or axis is None
            or joint.type not in ("revolute", "continuous")
        ):
            continue
        length = math.hypot(*axis)
        if length > 0.0 and abs(length - 1.0) > UNIT_TOLERANCE:
            value = " ".join(f"{a / length:.17g}" for a in axis)
            yield Edit(element, "xyz", "xyz", value)


def _inverted(robot: CheckedUrdf) -> Iterator[Edit]:
    from borecheck.geometry.mesh.triangle_mesh import TriangleMesh
    from borecheck.validation.checks.geometry import shapes
    from borecheck.validation.reading.mesh_reading import facts, mesh_of, path_of

    for shape in shapes(robot):
        found, path = facts(robot, shape), path_of(robot, shape)
        mesh = mesh_of(robot, shape)
        if found is None or path is None or mesh is None or not found.inverted:
            continue
        if path.suffix.lower() == ".stl" and min(shape.scale) > 0.0:
            turned = TriangleMesh(mesh.name, mesh.vertices, mesh.triangles[:, ::-1])
            target = path.with_name(f"{path.stem}_turned.stl")
            yield Edit(
                shape.shape,
                "filename",
                "filename",
                _renamed(shape, target),
                (target, turned),
            )


def _renamed(shape: DraftShape, target: Path) -> str:
    folder, slash, _ = (shape.filename or "").rpartition("/")
    return f"{folder}{slash}{target.name}"


def _meshes(edits: Sequence[Edit]) -> dict[Path, bytes]:
    """The turned meshes, by the file that is to be made."""
    from borecheck.geometry.mesh_files.stl import stl_bytes

    meshes = dict(edit.mesh for edit in edits if edit.mesh is not None)
    for target in meshes:
        if target.exists():
            raise UsageError(f"{target} exists already; nothing was overwritten")
    return {target: stl_bytes(target, mesh) for target, mesh in meshes.items()}


def _tag_starts(raw: bytes) -> list[int]:
    """Where each element's start tag begins, in document order."""
    parser = expat.ParserCreate()
    starts: list[int] = []

    def note(name: str, attributes: object) -> None:
        starts.append(parser.CurrentByteIndex)

    parser.StartElementHandler = note
    parser.Parse(raw, True)
    return starts


def _tag_end(raw: bytes, start: int) -> int:
    """Behind the `>` that closes a start tag; one within quotes does not."""
    quote = b""
    for at in range(start, len(raw)):
        character = raw[at : at + 1]
        if quote:
            quote = b"" if character == quote else quote
        elif character in (b'"', b"'"):
            quote = character
        elif character == b">":
            return at + 1
    return len(raw)
