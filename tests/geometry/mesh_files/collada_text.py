"""Collada documents for tests: a plain far cube, and whatever stands beside it."""

NAMESPACE = "http://www.collada.org/2005/11/COLLADASchema"
ASSET = '<asset><unit name="meter" meter="1"/><up_axis>Z_UP</up_axis></asset>'
FACES = "0 1 3 0 3 2 4 6 7 4 7 5 0 4 5 0 5 1 2 3 7 2 7 6 0 2 6 0 6 4 1 5 7 1 7 3"
QUADS = "0 1 3 2 4 6 7 5 0 4 5 1 2 3 7 6 0 2 6 4 1 5 7 3"
NEAR, FAR, HALF = 0.4, 3.0, 0.1
TRIANGLES = (
    '<triangles count="12"><input semantic="VERTEX" source="#{id}-v" offset="0"/>'
    f"<p>{FACES}</p></triangles>"
)
ACCESSOR = (
    '<accessor source="#{id}-a" count="8" stride="3"><param name="X" type="float"/>'
    '<param name="Y" type="float"/><param name="Z" type="float"/></accessor>'
)


def cube_points(x: float) -> list[list[float]]:
    """Corners of a cube about (x, 0, 0)."""
    signs = (-HALF, HALF)
    return [[x + a, b, c] for a in signs for b in signs for c in signs]


def source(word: str, x: float = 0.0, accessor: str = ACCESSOR) -> str:
    """The positions of a cube about (x, 0, 0) and their <vertices>."""
    numbers = " ".join(repr(v) for p in cube_points(x) for v in p)
    return (
        f'<source id="{word}-p"><float_array id="{word}-a" count="24">{numbers}'
        f"</float_array><technique_common>{accessor.format(id=word)}"
        f'</technique_common></source><vertices id="{word}-v">'
        f'<input semantic="POSITION" source="#{word}-p"/></vertices>'
    )


def cube(word: str, x: float = 0.0, primitives: str = TRIANGLES) -> str:
    """A <geometry> that is a cube about (x, 0, 0)."""
    inner = source(word, x) + primitives.format(id=word)
    return f'<geometry id="{word}"><mesh>{inner}</mesh></geometry>'


def document(
    near: str = "",
    geometries: str = "",
    more: str = "",
    scene: str = '<instance_visual_scene url="#s"/>',
    asset: str = ASSET,
) -> bytes:
    """A far cube, and beside it `near` among the nodes of the scene.

    Args:
        near: Elements of the <visual_scene>.
        geometries: Further <geometry> elements.
        more: Further libraries.
        scene: What <scene> holds; empty for no <scene>.
        asset: The document's own asset.
    """
    shown = f"<scene>{scene}</scene>" if scene else ""
    text = (
        f'<?xml version="1.0" encoding="utf-8"?><COLLADA xmlns="{NAMESPACE}" '
        f'version="1.4.1">{asset}<library_geometries>{cube("far", FAR)}{geometries}'
        f'</library_geometries>{more}<library_visual_scenes><visual_scene id="s">'
        f'<node id="far-node"><instance_geometry url="#far"/></node>{near}'
        f"</visual_scene></library_visual_scenes>{shown}</COLLADA>"
    )
    return text.encode()
