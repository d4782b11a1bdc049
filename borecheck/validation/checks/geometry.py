"""Geometry checks that need no mesh file: sizes, scales, references, coverage."""

from collections.abc import Iterator
from pathlib import PurePosixPath, PureWindowsPath

from borecheck.geometry.mesh_files.reading import unread_format
from borecheck.robots.urdf.draft_elements import DraftShape
from borecheck.robots.urdf.rules import shapes as rules
from borecheck.validation.checks.ruled import problems
from borecheck.validation.findings import Severity
from borecheck.validation.reading.checked_urdf import CheckedUrdf
from borecheck.validation.reading.mesh_reading import resolution_of
from borecheck.validation.registry import Problem, register


def shapes(robot: CheckedUrdf) -> Iterator[DraftShape]:
    """All visuals and collisions."""
    for link in robot.links:
        yield from link.shapes


def where_checked(robot: CheckedUrdf, shape: DraftShape) -> Severity | None:
    """The check's own severity for shapes that contacts are checked with.

    A link that is drawn and has no <collision> is checked as it is drawn; what is drawn
    of the others is only a picture, and a warning.
    """
    link = robot.link_named.get(shape.link)
    bare = link is not None and not link.of_kind("collision")
    return None if bare or shape.kind == "collision" else Severity.WARNING


def _is_absolute(filename: str) -> bool:
    path = filename.removeprefix("file://")
    windows = PureWindowsPath(path)
    return PurePosixPath(path).is_absolute() or bool(windows.drive)


@register("G501", "mesh-not-found", "geometry", "WEE")
def mesh_not_found(robot: CheckedUrdf) -> Iterator[Problem]:
    """A mesh file cannot be found.

    Why: The link has no geometry then: nothing can touch it. Some libraries stop,
    others go on without the shape.

    Fix: Correct the path, or name the folder that holds the package with
    --package-path.

    Libraries: Pinocchio and Drake stop; yourdfpy and PyBullet warn and leave it out.
    """
    for shape in shapes(robot):
        if shape.filename is None:
            continue
        found = resolution_of(robot, shape.filename)
        if found.path is not None or found.near_miss is not None:
            continue
        if found.is_refused:
            continue  # G504 says so
        tried = ", ".join(str(path) for path in found.tried[:8]) or "nothing"
        message = f"{shape.filename!r}: {found.problem}; tried {tried}"
        yield Problem(shape.shape, message, "filename", where_checked(robot, shape))


@register("G502", "mesh-other-spelling", "geometry", "WEE")
def mesh_other_spelling(robot: CheckedUrdf) -> Iterator[Problem]:
    """A mesh file exists only under another spelling (case, backslash).

    Why: It is found on one system and missing on the next.

    Fix: Write the name exactly as the file is called, with forward slashes.
    """
    for shape in shapes(robot):
        if shape.filename is None:
            continue
        found = resolution_of(robot, shape.filename)
        if found.path is None and found.near_miss is not None:
            message = f"{shape.filename!r}: the file is {found.near_miss}"
            yield Problem(shape.shape, message, "filename", where_checked(robot, shape))


@register("G503", "mesh-absolute-path", "geometry", "WWW")
def mesh_absolute_path(robot: CheckedUrdf) -> Iterator[Problem]:
    """A mesh is named by an absolute path.

    Why: The robot cannot be moved to another computer.

    Fix: Use package://PACKAGE/... or a path relative to the file.
    """
    for shape in shapes(robot):
        if shape.filename is None or robot.is_by_find(shape.filename):
            continue
        if _is_absolute(shape.filename):
            message = f"{shape.filename!r} is an absolute path"
            yield Problem(shape.shape, message, "filename")


@register("G504", "mesh-path-escapes", "geometry", "EEE")
def mesh_path_escapes(robot: CheckedUrdf) -> Iterator[Problem]:
    """A mesh path leads out of the file's own folder tree.

    Why: A stranger's file has no business elsewhere on this computer; the path is not
    followed.

    Fix: Keep the meshes inside the package; or name the folder they are in with
    --package-path, or allow every file with --allow-outside.
    """
    for shape in shapes(robot):
        if shape.filename is not None:
            found = resolution_of(robot, shape.filename)
            if found.is_refused:
                message = f"{shape.filename!r}: {found.problem}"
                level = where_checked(robot, shape)
                yield Problem(shape.shape, message, "filename", level)


@register("G509", "scale-zero", "geometry", "EEE")
def scale_zero(robot: CheckedUrdf) -> Iterator[Problem]:
    """A mesh is scaled by zero.

    Why: It becomes flat: nothing touches it.

    Fix: Give the scale; 1 1 1 is the default.

    Libraries: most accept it in silence.
    """
    return problems(robot, rules.scales)


@register("G510", "scale-mirrored", "geometry", "WWW")
def scale_mirrored(robot: CheckedUrdf) -> Iterator[Problem]:
    """A mesh is mirrored by a negative scale.

    Why: Mirroring turns the winding inside out: what is inside becomes outside for
    libraries that do not turn the triangles back.

    Fix: Mirror the mesh file itself, with its winding turned.

    Libraries: Coal and FCL keep the winding (inside out); viewers often light it wrong;
    borecheck turns the triangles back.
    """
    for shape in shapes(robot):
        if shape.tag == "mesh" and min(shape.scale) < 0.0:
            level = None if shape.kind == "collision" else Severity.INFO
            text = f"scale={shape.shape.get('scale')!r}"
            yield Problem(shape.shape, text, "scale", level)


@register("G511", "scale-uneven", "geometry", "III")
def scale_uneven(robot: CheckedUrdf) -> Iterator[Problem]:
    """A mesh is scaled differently along its axes.

    Why: Rarely meant; angles and round shapes are distorted.

    Fix: Use one scale, or stretch the mesh file itself.

    Libraries: some take the first number for all three.
    """
    for shape in shapes(robot):
        sizes = {abs(s) for s in shape.scale} if shape.tag == "mesh" else {1.0}
        if max(sizes) - min(sizes) > 1e-9 * max(sizes):
            yield Problem(shape.shape, f"scale={shape.shape.get('scale')!r}", "scale")


@register("G522", "collision-missing", "geometry", "IWW")
def collision_missing(robot: CheckedUrdf) -> Iterator[Problem]:
    """A link is drawn but has no collision geometry.

    Why: It can drive through everything without a contact being reported.

    Fix: Add <collision>, or name the link among those not modelled.

    Libraries: MoveIt, Drake and Pinocchio check nothing there; borecheck's own checks
    and some tools take the visual.
    """
    for link in robot.links:
        if link.of_kind("collision"):
            continue
        if link.name in robot.options.links:
            message = f"link {link.name!r} must have collision geometry and has none"
            yield Problem(link.element, message, None, Severity.ERROR)
        elif link.of_kind("visual"):
            yield Problem(link.element, f"link {link.name!r} has no <collision>")


@register("G525", "size-not-positive", "geometry", "EEE")
def size_not_positive(robot: CheckedUrdf) -> Iterator[Problem]:
    """A box, cylinder, sphere or capsule has a size that is zero or negative.

    Why: There is no such solid; libraries skip it, take the absolute value or stop.

    Fix: Give positive sizes in metres.

    Libraries: Drake and MuJoCo refuse it; urdfdom and yourdfpy accept it.
    """
    return problems(robot, rules.sizes)


@register("G530", "mesh-format", "geometry", "WEE")
def mesh_format(robot: CheckedUrdf) -> Iterator[Problem]:
    """The mesh is in a format that is not read here.

    Why: It was not checked, borecheck's own checks refuse a robot that is made of it,
    and many libraries cannot read it.

    Fix: Export STL, OBJ, PLY or Collada.
    """
    for shape in shapes(robot):
        suffix = PurePosixPath(shape.filename or "x.stl").suffix.strip().lower()
        problem = unread_format(suffix)
        if problem is not None:
            message = f"{shape.filename!r}: {problem}"
            level = where_checked(robot, shape)
            yield Problem(shape.shape, message, "filename", level)


@register("G536", "shape-repeated", "geometry", "IWW")
def shape_repeated(robot: CheckedUrdf) -> Iterator[Problem]:
    """A link has the same shape twice at the same place.

    Why: It costs time in every check, and the second was probably meant elsewhere.

    Fix: Remove one, or correct its origin.
    """
    for link in robot.links:
        seen = set()
        for shape in link.shapes:
            if shape.shape is None:
                continue
            origin = shape.element.find("origin")
            where = () if origin is None else tuple(sorted(origin.attrib.items()))
            what = (shape.kind, shape.tag, tuple(sorted(shape.shape.attrib.items())))
            if (what, where) in seen:
                yield Problem(
                    shape.element, f"link {link.name!r} has this {shape.kind} twice"
                )
            seen.add((what, where))
