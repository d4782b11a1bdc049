"""What stands where in a Collada scene: every surface placed, or a refusal.

Of each element that the standard (COLLADA 1.4.1, and 1.5) lets carry or move a
surface it is known here what becomes of it. All others are refused by their name:
a reader that passes over what it does not know says clear of what it has not read.
"""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from borecheck.geometry.mesh_files.collada_document import (
    Document,
    Element,
    descendants,
)
from borecheck.geometry.mesh_files.collada_geometry import corners_of
from borecheck.geometry.mesh_files.collada_sources import floats

Array = NDArray[np.float64]

# In a node without meaning for where its surfaces are.
_LOOKS = ("asset", "instance_camera", "instance_light")
_MOVES = ("matrix", "rotate", "scale", "translate")
# Moves whose sense the loaders disagree on; nobody places a part with them.
_UNCLEAR_MOVES = ("lookat", "skew")
_INSTANCES = ("instance_geometry", "instance_controller", "instance_node")
# What a vendor's <extra> must not hold if all surfaces are to be counted.
_SURFACES = (
    *("mesh", "convex_mesh", "brep", "spline", "skin", "morph"),
    *("polygons", "polylist", "triangles", "trifans", "tristrips"),
    *("instance_physics_scene", "instance_rigid_body", "input"),
)
_HIDDEN = frozenset((*_SURFACES, *_INSTANCES, *_MOVES, *_UNCLEAR_MOVES))
_LIBRARIES_OF_LOOKS = frozenset(
    f"library_{kind}"
    for kind in ("images", "effects", "materials", "cameras", "lights")
)
# Instances of instances grow without end; so many more than there are <node>s.
_MOST_NODES = 5_000
_MOST_COPIED = 1_000_000  # triangles


def scene_corners(document: Document) -> Array:
    """Corners of all triangles in the scene, (n, 3, 3), in the unit of the file.

    Depth first in the order of the nodes; a mirrored instance keeps its outside
    outside.

    Raises:
        MeshError: Something carries or moves a surface in a way not read here.
    """
    scene = _Scene(document)
    for node in _root_nodes(document):
        scene.walk(node, np.eye(4), None)
    _refuse_animated(document, scene.carriers)
    return np.concatenate([np.zeros((0, 3, 3)), *scene.placed])


def unplaced_geometries(document: Document) -> list[str]:
    """Ids of the <geometry> elements that no instance refers to."""
    used = {e.get("url") for e in document.all("instance_geometry")}
    ids = [str(e.get("id")) for e in document.all("geometry")]
    return [word for word in ids if f"#{word}" not in used]


def _root_nodes(document: Document) -> list[Element]:
    for child in document.root:
        name = document.name(child)
        if name not in ("asset", "scene", "extra") and name[:8] != "library_":
            raise document.error(f"<{name}> in <COLLADA> is not read", child)
    _refuse_hidden(document)
    shown = _shown_scene(document)
    document.check_asset_of(shown)
    for other in document.all("visual_scene"):
        names = {name for name, _ in descendants(document, other)}
        if other is not shown and names & set(_INSTANCES):
            said = "a second <visual_scene> with surfaces: which one is meant?"
            raise document.error(said, other)
    for child in shown:
        if document.name(child) not in ("asset", "node", "evaluate_scene", "extra"):
            name = document.name(child)
            raise document.error(f"<{name}> in <visual_scene> is not read", child)
    return document.children(shown, "node")


def _shown_scene(document: Document) -> Element:
    scene = document.only(document.root, "scene")
    if scene is None:
        raise document.error("has no <scene>: nothing in it stands anywhere")
    for child in scene:
        name = document.name(child)
        if name not in ("instance_visual_scene", "extra"):
            raise document.error(f"<{name}> is not read: it may move surfaces", child)
    instance = document.only(scene, "instance_visual_scene")
    if instance is None:
        raise document.error("its <scene> shows no <visual_scene>", scene)
    return document.target(instance, "url", "visual_scene")


def _refuse_hidden(document: Document) -> None:
    """Surfaces and moves in a vendor's own data would be lost in silence."""
    for kind in ("extra", "technique", "asset", "evaluate_scene"):
        for element in document.root.iter(f"{{*}}{kind}"):
            above = {document.name(e) for e in element.iterancestors()}
            if above & _LIBRARIES_OF_LOOKS:
                continue
            for name, found in descendants(document, element):
                if name in _HIDDEN:
                    raise document.error(f"<{name}> within <{kind}> is not read", found)


@dataclass(eq=False)
class _Scene:
    """A walk over the nodes, and what it has placed.

    Attributes:
        document: The file.
        placed: Corners of each instance, (n, 3, 3).
        carriers: Nodes and geometries that an animation must not move.
    """

    document: Document
    placed: list[Array] = field(default_factory=list)
    carriers: set[Element] = field(default_factory=set)
    _read: dict[Element, Array] = field(default_factory=dict)
    _open: list[Element] = field(default_factory=list)
    _visited: int = 0
    _copied: int = 0

    def __post_init__(self) -> None:
        self._most_nodes = len(self.document.all("node")) + _MOST_NODES

    def walk(self, node: Element, T_scene_parent: Array, unclear: str | None) -> None:
        """Place all surfaces of a node and of those below.

        Args:
            node: A <node>.
            T_scene_parent: Placement of what it stands in, (4, 4).
            unclear: Name of a move above that is not read, if there is one.
        """
        document = self.document
        self._visited += 1
        if node in self._open:
            raise document.error("a <node> that holds itself", node)
        if self._visited > self._most_nodes or len(self._open) > 100:
            raise document.error("more nodes than any scene has", node)
        self._open.append(node)
        document.check_asset_of(node)
        T_scene_node, unclear = _placement(document, node, T_scene_parent, unclear)
        for child in node:
            name = document.name(child)
            _check_kind(document, child, name)
            if name == "node":
                self.walk(child, T_scene_node, unclear)
            elif name == "instance_node":
                self.walk(document.target(child, "url", "node"), T_scene_node, unclear)
            elif name == "instance_geometry":
                self._place(child, T_scene_node, unclear)
            elif name == "instance_controller":
                raise document.error(_controller(document, child), child)
            elif name not in (*_LOOKS, *_MOVES, *_UNCLEAR_MOVES, "extra"):
                raise document.error(f"<{name}> in a <node> is not read", child)
        self._open.pop()

    def _place(self, instance: Element, T: Array, unclear: str | None) -> None:
        document = self.document
        if unclear is not None:
            said = f"<{unclear}> moves a surface: not read, use <matrix>"
            raise document.error(said, instance)
        geometry = document.target(instance, "url", "geometry")
        self.carriers.update((*self._open, geometry))
        if geometry in self._read:
            self._copied += len(self._read[geometry])
        else:
            self._read[geometry] = corners_of(document, geometry)
        if self._copied > _MOST_COPIED:
            raise document.error("more copies of surfaces than any scene has", instance)
        corners = self._read[geometry]
        with np.errstate(all="ignore"):  # what is not finite is reported later
            moved = corners.reshape(-1, 3) @ T[:3, :3].T + T[:3, 3]
            is_mirrored = np.linalg.det(T[:3, :3]) < 0.0
        moved = moved.reshape(-1, 3, 3)
        self.placed.append(moved[:, ::-1] if is_mirrored else moved)


def _check_kind(document: Document, element: Element, name: str) -> None:
    """An element that holds or names what belongs to another kind is refused."""
    target = element.get("url", "")
    is_move = name in (*_MOVES, *_UNCLEAR_MOVES)
    if not is_move and (element.text or "").strip():
        raise document.error(f"<{name}> with text in it is not read", element)
    if target and not name.startswith("instance_"):
        raise document.error(f"<{name}> with a url is not read", element)
    named = {document.name(e) for e in document.with_id(target[1:])}
    if name in _LOOKS and named & {"geometry", "node", "controller"}:
        raise document.error(f"<{name}> of a surface is not read", element)


def _placement(
    document: Document, node: Element, T_scene_parent: Array, unclear: str | None
) -> tuple[Array, str | None]:
    """T_scene_node: the node's moves in the order of the file, the first outermost."""
    T = T_scene_parent
    with np.errstate(all="ignore"):
        for child in node:
            name = document.name(child)
            if name in _MOVES:
                T = T @ _move(document, child, name)
            elif name in _UNCLEAR_MOVES and unclear is None:
                unclear = name
    return T, unclear


def _move(document: Document, element: Element, name: str) -> Array:
    """One move as a matrix, (4, 4)."""
    values = floats(document, element)
    expected = {"matrix": 16, "rotate": 4, "scale": 3, "translate": 3}[name]
    if len(values) != expected:
        said = f"<{name}> of {len(values)} numbers, not {expected}"
        raise document.error(said, element)
    T = np.eye(4)
    if name == "matrix":
        T = values.reshape(4, 4)
        if not np.array_equal(T[3], [0.0, 0.0, 0.0, 1.0]):
            said = "<matrix> whose last row is not 0 0 0 1"
            raise document.error(said, element)
    elif name == "translate":
        T[:3, 3] = values
    elif name == "scale":
        T[:3, :3] = np.diag(values)
    else:
        T[:3, :3] = _rotation(document, element, values)
    return T


def _rotation(document: Document, element: Element, values: Array) -> Array:
    """Rodrigues' formula; <rotate> is an axis and degrees."""
    length = float(np.linalg.norm(values[:3]))
    angle = float(np.deg2rad(values[3]))
    if not np.isfinite([length, angle]).all():
        raise document.error("<rotate> is not finite", element)
    if length == 0.0:
        if angle == 0.0:
            return np.eye(3)
        raise document.error("<rotate> about no axis", element)
    x, y, z = values[:3] / length
    K = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    turned: Array = np.eye(3) + np.sin(angle) * K + (1.0 - np.cos(angle)) * (K @ K)
    return turned


def _controller(document: Document, instance: Element) -> str:
    """What an instance_controller is, for the refusal."""
    controller = document.target(instance, "url", "controller")
    kinds = [document.name(c) for c in document.children(controller, "skin", "morph")]
    kind = f" (<{kinds[0]}>)" if kinds else ""
    return f"<instance_controller>{kind} is not read: export the mesh as it stands"


def _refuse_animated(document: Document, carriers: set[Element]) -> None:
    """Where an animated surface stands depends on a time that nobody stated."""
    for channel in document.all("channel"):
        target = channel.get("target", "").split("/")[0]
        found = document.with_id(target)
        if not found:
            said = "<channel> moves something that is not there"
            raise document.error(said, channel)
        for element in found:
            if any(e in carriers for e in (element, *element.iterancestors())):
                raise document.error("<channel> moves a surface: not read", channel)
