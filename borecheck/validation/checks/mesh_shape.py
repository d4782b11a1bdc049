"""Mesh shape checks: closed, wound one way, sound triangles, collision as visual."""

from collections.abc import Iterator

from borecheck.robots.urdf.draft_elements import DraftShape
from borecheck.validation.checks.mesh_files import mesh_shapes
from borecheck.validation.findings import Severity
from borecheck.validation.reading.checked_urdf import CheckedUrdf
from borecheck.validation.reading.extents import shape_extent
from borecheck.validation.reading.mesh_coverage import coverage_of
from borecheck.validation.reading.mesh_facts import MeshFacts, bodies_of
from borecheck.validation.reading.mesh_reading import facts, mesh_of
from borecheck.validation.registry import Problem, register

COVERED_ENOUGH = 0.5
BEYOND_RATIO = 1.0
SMALL_EDGE = 1e-4
SMALL_SHARE = 0.5  # of the triangles: a few slivers at fillets are normal
HEAVY = 200_000
MANY_FAULTY = 0.01  # of the triangles: more are an error where an inside is asked for


def _facts(robot: CheckedUrdf) -> Iterator[tuple[DraftShape, MeshFacts]]:
    for shape in mesh_shapes(robot):
        found = facts(robot, shape)
        if found is not None:
            yield shape, found


def _level(shape: DraftShape) -> Severity | None:
    """The check's own severity for collision shapes; visuals only inform."""
    return None if shape.kind == "collision" else Severity.INFO


def _faulty(robot: CheckedUrdf, fact: str, words: str) -> Iterator[Problem]:
    """Meshes of which a count of faulty triangles is not zero, with their share."""
    for shape, found in _facts(robot):
        count = getattr(found, fact)
        if count:
            share = count / found.triangles
            too_many = robot.options.containment and share > MANY_FAULTY
            level = _level(shape) or (Severity.ERROR if too_many else None)
            message = f"{_named(shape)}: {count} {words} ({100.0 * share:.2g} %)"
            yield Problem(shape.shape, message, "filename", level)


def _named(shape: DraftShape) -> str:
    return (shape.filename or "").rpartition("/")[2]


@register("G515", "mesh-degenerate", "geometry", "IWW", "meshes")
def mesh_degenerate(robot: CheckedUrdf) -> Iterator[Problem]:
    """A mesh has triangles without area.

    Why: They have no normal: inside and outside tests and distances may fail on them.
    An error with --containment where they are more than one in a hundred.

    Fix: Remove them in a mesh editor; they bound nothing.
    """
    yield from _faulty(robot, "degenerate", "triangles without area")


@register("G516", "mesh-duplicate-faces", "geometry", "IWW", "meshes")
def mesh_duplicate_faces(robot: CheckedUrdf) -> Iterator[Problem]:
    """A mesh has the same triangle twice.

    Why: Every contact there counts double, and inside tests by counting crossings fail.
    An error with --containment where they are more than one in a hundred.

    Fix: Merge duplicate faces in a mesh editor.
    """
    yield from _faulty(robot, "duplicate", "triangles stand twice")


@register("G517", "mesh-open", "geometry", "IWW", "meshes")
def mesh_open(robot: CheckedUrdf) -> Iterator[Problem]:
    """A collision mesh is not closed.

    Why: It has no inside: that another body is wholly within it cannot be told, nor a
    penetration depth. An error once containment or signed distance is asked for.

    Fix: Close the holes in a mesh editor.

    Libraries: engines that take the convex hull never notice; exact tests do.
    """
    asked = Severity.ERROR if robot.options.containment else None
    for shape, found in _facts(robot):
        if found.open_edges:
            message = (
                f"{_named(shape)}: {found.open_edges} edges have one triangle only"
            )
            level = _level(shape) or asked
            yield Problem(shape.shape, message, "filename", level)


@register("G518", "mesh-winding-mixed", "geometry", "IWW", "meshes")
def mesh_winding_mixed(robot: CheckedUrdf) -> Iterator[Problem]:
    """The triangles of a mesh are not all wound the same way.

    Why: Their normals point to different sides: inside and outside are mixed up.

    Fix: Make the normals consistent in a mesh editor.

    Libraries: Coal's convex shapes and every signed distance rely on the winding.
    """
    for shape, found in _facts(robot):
        if found.clashing_edges:
            message = (
                f"{_named(shape)}: neighbours wound against each other at "
                f"{found.clashing_edges} edges"
            )
            yield Problem(shape.shape, message, "filename", _level(shape))


@register("G519", "mesh-inverted", "geometry", "IWW", "meshes")
def mesh_inverted(robot: CheckedUrdf) -> Iterator[Problem]:
    """A mesh is inside out.

    Why: Its inside counts as outside: signed distances have the wrong sign.

    Fix: Flip all normals (--fix writes a turned copy).
    """
    for shape, found in _facts(robot):
        if found.inverted:
            message = f"{_named(shape)}: encloses a volume of {found.volume:.3g}"
            level = None if shape.kind == "collision" else Severity.WARNING
            yield Problem(shape.shape, message, "filename", level)


@register("G520", "mesh-several-bodies", "geometry", "III", "meshes")
def mesh_several_bodies(robot: CheckedUrdf) -> Iterator[Problem]:
    """A collision mesh consists of several pieces.

    Why: A convex hull around all of them fills the gaps between them.

    Fix: Nothing, for exact tests; use several <collision> for engines with hulls.

    Libraries: MuJoCo, Bullet and Drake collide with the convex hull of the whole.
    """
    for shape in mesh_shapes(robot):
        mesh = mesh_of(robot, shape) if shape.kind == "collision" else None
        bodies = 1 if mesh is None else bodies_of(mesh)
        if bodies > 1:
            message = f"{_named(shape)}: {bodies} pieces with gaps between them"
            yield Problem(shape.shape, message, "filename")


@register("G521", "mesh-self-intersection", "geometry", "WWW", "meshes")
def mesh_self_intersection(robot: CheckedUrdf) -> Iterator[Problem]:
    """Triangles of one mesh cross each other (searched for on request).

    Why: Volume, inside and outside are not defined where they do.

    Fix: Form the union in a mesh editor.
    """
    if not robot.options.self_intersection:
        return
    from borecheck.validation.reading.mesh_crossing import crossing_pairs

    for shape in mesh_shapes(robot):
        mesh = mesh_of(robot, shape)
        if mesh is not None:
            pairs = crossing_pairs(mesh)
            if len(pairs):
                message = f"{_named(shape)}: {len(pairs)} pairs of triangles cross"
                text = f"{message}, the first {tuple(pairs[0].tolist())}"
                yield Problem(shape.shape, text, "filename", _level(shape))


@register("G523", "collision-incomplete", "geometry", "IWW", "meshes")
def collision_incomplete(robot: CheckedUrdf) -> Iterator[Problem]:
    """Much of what is drawn of a link lies outside its collision geometry.

    Why: The uncovered part can drive into an obstacle without a contact.

    Fix: Enlarge or move the collision geometry so that it covers the visual.
    """
    for link in robot.links:
        found = coverage_of(robot, link)
        if found is None or found.is_elsewhere or found.share >= COVERED_ENOUGH:
            continue
        message = (
            f"link {link.name!r}: {100 * found.share:.0f} % of the visual's surface is "
            f"covered; the farthest point is {found.farthest:.3g} m outside"
        )
        yield Problem(link.of_kind("collision")[0].element, message)


@register("G524", "collision-elsewhere", "geometry", "IWW", "meshes")
def collision_elsewhere(robot: CheckedUrdf) -> Iterator[Problem]:
    """The collision geometry of a link is not where the link is drawn.

    Why: Contacts are reported where nothing is, and missed where the link is.

    Fix: Correct the collision's origin, size or scale.
    """
    for link in robot.links:
        found = coverage_of(robot, link)
        if found is None:
            continue
        if found.is_elsewhere:
            message = f"the collision is {found.farthest:.3g} m away from the visual"
        elif found.beyond > BEYOND_RATIO * found.visual_size and found.beyond > 0.05:
            message = f"the collision reaches {found.beyond:.3g} m beyond the visual"
        else:
            continue
        element = link.of_kind("collision")[0].element
        yield Problem(element, f"link {link.name!r}: {message}")


@register("G526", "mesh-small-triangles", "geometry", "III", "meshes")
def mesh_small_triangles(robot: CheckedUrdf) -> Iterator[Problem]:
    """Most triangles of a collision mesh are smaller than 0.1 mm.

    Why: Contact tests with an absolute tolerance cannot resolve them.

    Fix: Simplify the mesh.

    Libraries: Coal's mesh contact has an absolute tolerance of 1e-6 length units.
    """
    import numpy as np

    for shape in mesh_shapes(robot, scaled=True):
        mesh = mesh_of(robot, shape)
        if mesh is None or shape.kind != "collision":
            continue
        corners = mesh.corners * np.abs(shape.scale)
        edges = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2)
        small = edges.min(axis=1) < SMALL_EDGE
        if small.mean() > SMALL_SHARE:
            message = f"{_named(shape)}: {int(small.sum())} of {len(small)} triangles"
            yield Problem(
                shape.shape, f"{message} have an edge below 0.1 mm", "filename"
            )


@register("G533", "mesh-heavy", "geometry", "III", "meshes")
def mesh_heavy(robot: CheckedUrdf) -> Iterator[Problem]:
    """A collision mesh has very many triangles.

    Why: Checks take longer than they need to.

    Fix: Simplify the collision mesh; keep the fine one as visual.
    """
    for shape, found in _facts(robot):
        if found.triangles > HEAVY and shape.kind == "collision":
            message = f"{_named(shape)}: {found.triangles} triangles"
            yield Problem(shape.shape, message, "filename")


@register("G537", "mesh-flat", "geometry", "IWW", "meshes")
def mesh_flat(robot: CheckedUrdf) -> Iterator[Problem]:
    """A collision mesh is flat: it has no thickness.

    Why: It has no inside, and thin obstacles pass through it between two samples.

    Fix: Give it its thickness.
    """
    for shape, _ in _facts(robot):
        extent = shape_extent(robot, shape)
        if extent is None or shape.kind != "collision":
            continue
        size = extent.high - extent.low
        if float(size.min()) <= 1e-9 * float(size.max()):
            yield Problem(
                shape.shape, f"{_named(shape)} is {size.min():g} m thick", "filename"
            )
