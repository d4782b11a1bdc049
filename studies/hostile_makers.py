"""Files that want something else than to be read: seeded makers, one for each kind.

Each maker writes one main file into a folder that `prepare` has furnished, and says its
name. What lies outside that folder holds `CANARY`, which must never be printed.
"""

import json
import os
import random
import struct
from collections.abc import Callable, Mapping
from pathlib import Path

from studies.hostile_expressions import expression, yaml_bomb

CANARY = "CANARY-7319"
DATA = Path(__file__).resolve().parents[1] / "tests" / "data"
XMLNS = 'xmlns:xacro="http://www.ros.org/wiki/xacro"'

OUTSIDE = (
    *("/etc/passwd", "../secret.xacro", "link.xacro", "../../../../etc/passwd"),
    *("file:///etc/passwd", "package://inside/../secret.stl", "/proc/self/environ"),
    *("$(find inside)/../secret.xacro", "/dev/zero", "pipe", "folder", "../*.xacro"),
    *("/etc/*", "/*/*/*", "main.xacro", "part.xacro", "link.yaml", "bomb.yaml", ""),
    *(
        "package://secret/secret.stl",
        "model://../secret.stl",
        "link.stl",
        "link_folder",
    ),
    *("link_folder/secret.xacro", "$(env HOME)/x", "$(cwd)/x", "x" * 5000, "a\u0007b"),
)
JOINTS = ("fixed", "revolute", "floating", "")
WORDS = (b"nan", b"inf", b"1e308", b"-1e999", b"99999999999999999999", b"-1", b"")
WORDS += (b"${x}", b"$(arg y)", b"\0", b"\xff\xfe", b"&#0;", b"&a;", b"../..", b"<!--")
WORDS += (b"]]>", b"\x1b[31m", b"1" * 5000, b"{}", b"[]", b"null", b"true", b"1e400")


def prepare(folder: Path) -> Path:
    """Furnishes a folder; gives the one inside it that files may read from."""
    inside = folder / "inside"
    inside.mkdir()
    (folder / "secret.xacro").write_text(f"<robot name='{CANARY}'><{CANARY}/></robot>")
    (folder / "secret.yaml").write_text(f"{CANARY}: [\n")
    (folder / "secret.stl").write_text(f"solid {CANARY}\n")
    (inside / "part.xacro").write_text(f"<robot {XMLNS}><link name='part'/></robot>")
    (inside / "own.yaml").write_text("a: 1\nb: [1, 2]\n")
    (inside / "bomb.yaml").write_text(yaml_bomb())
    (inside / "folder").mkdir()
    os.mkfifo(inside / "pipe")
    for suffix in ("xacro", "yaml", "stl"):
        (inside / f"link.{suffix}").symlink_to(folder / f"secret.{suffix}")
    (inside / "link_folder").symlink_to(folder)
    return inside


def mutated(rng: random.Random, data: bytes) -> bytes:
    """A file with a few places cut, doubled, swapped for a word or for noise."""
    for _ in range(rng.randint(1, 4)):
        at = rng.randrange(len(data) + 1)
        to = min(len(data), at + rng.choice((1, 2, 8, 40, 400)))
        piece = rng.choice((b"", data[at:to] * 2, rng.choice(WORDS), rng.randbytes(4)))
        data = data[:at] + piece + data[to:]
    return data[: rng.randrange(len(data) + 1)] if rng.random() < 0.05 else data


def _escaped(text: str) -> str:
    text = "".join(c for c in text if c.isprintable())
    pairs = (("&", "&amp;"), ("<", "&lt;"), ('"', "&quot;"))
    for letter, entity in pairs:
        text = text.replace(letter, entity)
    return text


def _link(rng: random.Random, name: str) -> str:
    box, foreign = '<box size="0.1 0.1 0.1"/>', _escaped(rng.choice(OUTSIDE))
    mesh = f'<mesh filename="{foreign}" scale="1 1 1"/>'
    shape = rng.choice((mesh, box, box, "<sphere radius='0.1'/>"))
    kind = rng.choice(("collision", "visual"))
    look = f"<material name='m'><texture filename='{foreign}'/></material>"
    inner = f"<geometry>{shape}</geometry>{look if kind == 'visual' else ''}"
    return f'<link name="{name}"><{kind}>{inner}</{kind}></link>'


def _doctype(rng: random.Random) -> str:
    return rng.choice(
        (
            *([""] * 12),
            '<!DOCTYPE robot [<!ENTITY a "b">]>',
            '<!DOCTYPE robot SYSTEM "../secret.xacro">',
            '<!DOCTYPE robot [<!ENTITY a SYSTEM "file:///etc/passwd">]>',
            '<!DOCTYPE robot [<!ENTITY % p SYSTEM "../secret.xacro"> %p;]>',
            '<!DOCTYPE a [<!ENTITY a "x"><!ENTITY b "&a;&a;&a;&a;&a;&a;&a;&a;&a;">]>',
            "<!DOCTYPE robot>",
        )
    )


def _xacro_piece(rng: random.Random) -> str:
    """An element that reaches out, computes, or makes much of little."""
    outside, value = _escaped(rng.choice(OUTSIDE)), _escaped(expression(rng, 3))
    variable = rng.choice(("HOME", "GITHUB_TOKEN", "NONE"))
    deep = rng.randint(2, 60)
    yaml = f"${{xacro.load_yaml(&quot;{outside}&quot;)}}"
    pieces: tuple[Callable[[], str], ...] = (
        lambda: f'<xacro:include filename="{outside}"/>',
        lambda: f'<xacro:include filename="{outside}" optional="true" ns="n"/>',
        lambda: f"<xacro:property name='y' value='{yaml}'/><link name='y${{y}}'/>",
        lambda: f'<xacro:property name="x" value="${{{value}}}"/><link name="${{x}}"/>',
        lambda: f'<xacro:if value="${{{value}}}"><link name="i"/></xacro:if>',
        lambda: f'<link name="e$(eval {value})"/>',
        lambda: f'<link name="$(env {variable})"/>',
        lambda: f'<xacro:arg name="a" default="{value}"/><link name="a$(arg a)"/>',
        lambda: f"<xacro:macro name='m' params='a:=&quot;{'x' * deep} b'/>",
        lambda: _doubling_macros(deep),
        lambda: _doubling_texts(deep),
        lambda: "<a>" * (deep * 40) + "</a>" * (deep * 40),
        lambda: f'<xacro:property name="p" value="{"$a" * deep * 200}"/>',
        lambda: f"<link name='{'$' * deep * 9}{{1}}'/>",
        lambda: "<a/>" * (deep * 400),
        lambda: f'<xacro:element xacro:name="${{{value}}}"/>',
        lambda: f'<xacro:call macro="{value}"/>',
        lambda: f'<xacro:insert_block name="{value}"/>',
    )
    return rng.choice(pieces)()


def _doubling_macros(depth: int) -> str:
    macros = "".join(
        f'<xacro:macro name="m{i}" params="">{2 * f"<xacro:m{i - 1}/>"}</xacro:macro>'
        for i in range(1, depth)
    )
    first = '<xacro:macro name="m0" params=""><link name="l"/></xacro:macro>'
    return f"{first}{macros}<xacro:m{depth - 1}/>"


def _doubling_texts(depth: int) -> str:
    texts = "".join(
        f'<xacro:property name="p{i}" value="${{p{i - 1}}}${{p{i - 1}}}"/>'
        for i in range(1, depth)
    )
    first = '<xacro:property name="p0" value="ab"/>'
    return f'{first}{texts}<link name="${{p{depth - 1}}}"/>'


def xacro(rng: random.Random, inside: Path) -> Path:
    """A xacro file that includes, computes, repeats itself."""
    pieces = [_xacro_piece(rng) for _ in range(rng.randint(1, 3))]
    pieces += [_link(rng, "base")]
    rng.shuffle(pieces)
    text = f'{_doctype(rng)}<robot name="r" {XMLNS}>{"".join(pieces)}</robot>'
    data = text.encode(rng.choice(("utf-8", "utf-8", "utf-8", "utf-16")), "replace")
    path = inside / "main.xacro"
    path.write_bytes(mutated(rng, data) if rng.random() < 0.3 else data)
    return path


def urdf(rng: random.Random, inside: Path) -> Path:
    """A URDF that names foreign files, or a good one with accidents."""
    path = inside / "main.urdf"
    if rng.random() < 0.5:
        seeds = sorted((DATA / "urdf").rglob("*.urdf"))
        path.write_bytes(mutated(rng, rng.choice(seeds).read_bytes()))
        return path
    links = [_link(rng, f"l{i}") for i in range(rng.choice((1, 1, 2, 3)))]
    joints = [
        f'<joint name="j{i}" type="{rng.choice(JOINTS)}">'
        f'<parent link="l{i - 1}"/><child link="l{i}"/>'
        f'<limit lower="{rng.choice(("0", "nan", "-1e999"))}" upper="1"/></joint>'
        for i in range(1, len(links))
    ]
    deep = "<a>" * rng.choice((0, 0, 100, 5000))
    body = "".join([*links, *joints]) + deep
    text = (
        f'{_doctype(rng)}<robot name="{rng.choice(("r", CANARY[:3]))}">{body}</robot>'
    )
    data = text.encode(rng.choice(("utf-8", "utf-8", "utf-16", "latin-1")), "replace")
    path.write_bytes(mutated(rng, data) if rng.random() < 0.3 else data)
    return path


def collada(rng: random.Random, inside: Path) -> Path:
    """A good Collada file with accidents, foreign references, entities."""
    seeds = sorted((DATA / "cases").rglob("*.dae")) + sorted(DATA.rglob("good/*.dae"))
    data = rng.choice(seeds).read_bytes()
    if rng.random() < 0.4:
        start = data.find(b"<COLLADA")
        data = data[:start] + _doctype(rng).encode() + data[start:]
    if rng.random() < 0.4:
        name = rng.choice(OUTSIDE).encode()
        data = data.replace(b'url="#', b'url="' + name + b"#", 1)
    if rng.random() < 0.2:
        image = f"<library_images><image><init_from>{rng.choice(OUTSIDE)}</init_from>"
        image += "</image></library_images>"
        data = data.replace(
            b"<library_geometries", image.encode() + b"<library_geometries"
        )
    if rng.random() < 0.1:
        data = data.decode("utf-8", "replace").encode("utf-16")
    path = inside / "main.dae"
    path.write_bytes(mutated(rng, data) if rng.random() < 0.6 else data)
    return path


def stl(rng: random.Random, inside: Path) -> Path:
    """An STL file with wrong counts, wild numbers, or of another kind."""
    path = inside / "main.stl"
    seeds = [p for p in DATA.rglob("*.stl") if p.stat().st_size < 100_000]
    data = rng.choice(sorted(seeds)).read_bytes()
    kind = rng.randrange(6)
    if kind == 0:
        count = rng.choice((0, 1, 2**31, 2**32 - 1, len(data)))
        data = data[:80] + struct.pack("<I", count) + data[84:]
    elif kind == 1:
        data = f"solid {CANARY[:3]}\n".encode() + rng.randbytes(rng.randint(0, 4000))
    elif kind == 2:
        vertices = "\n".join(
            f"vertex {rng.choice((b'1e39', b'nan', b'0')).decode()} 0 1"
            for _ in range(99)
        )
        data = f"solid a\nfacet normal 0 0 1\nouter loop\n{vertices}\n".encode()
    elif kind > 3:
        data = mutated(rng, data)
    path.write_bytes(data)
    return path


PLAN = {
    "unit": "mm",
    "frame": "scanner",
    "plans": [
        {"name": "liver", "entry_x": 0, "entry_y": 0, "entry_z": -1.1}
        | {"target_x": 0, "target_y": 0, "target_z": -70}
    ],
}
SETTINGS = {"registration": {"sigma_mm": [1, 1, 1], "sigma_deg": [0.1, 0.1, 0.1]}}


def json_file(rng: random.Random, inside: Path) -> Path:
    """A certificate, plan, result or uncertainty file with accidents in its values."""
    kind = rng.choice(("certificate", "plan", "result", "uncertainty"))
    path = inside / f"{kind}.json"
    document = _document(rng, kind, inside)
    for _ in range(rng.randint(1, 4)):
        document = _with_accident(rng, document)
    data = json.dumps(document).encode()
    if rng.random() < 0.1:
        data = b"[" * rng.choice((100, 100_000))
    path.write_bytes(mutated(rng, data) if rng.random() < 0.3 else data)
    return path


def _document(rng: random.Random, kind: str, inside: Path) -> object:
    if kind == "plan":
        return PLAN
    if kind == "uncertainty":
        return SETTINGS
    if kind == "certificate":
        seeds = [
            p for p in (DATA / "cases").rglob("c.json") if p.stat().st_size < 20_000
        ]
        chosen = rng.choice(sorted(seeds))
        (inside / "certificate.npz").write_bytes(
            chosen.with_suffix(".npz").read_bytes()
        )
        return json.loads(chosen.read_bytes())
    seeds = sorted((DATA / "cases").rglob("*.json"))
    for _ in range(20):
        try:
            found = json.loads(rng.choice(seeds).read_bytes())
        except ValueError:
            continue
        if isinstance(found, dict):
            return found
    return {}


def _with_accident(rng: random.Random, document: object) -> object:
    """One value somewhere in the document replaced, removed or doubled."""
    wild = (
        None,
        True,
        -1,
        0,
        1e308,
        10**400,
        float("nan"),
        "x" * 1000,
        [],
        {},
        "\x1b[2J",
    )
    if rng.random() < 0.25 or not document or not isinstance(document, list | dict):
        return rng.choice(wild)
    if isinstance(document, list):
        at = rng.randrange(len(document))
        return [*document[:at], _with_accident(rng, document[at]), *document[at + 1 :]]
    name = rng.choice(sorted(document))
    if rng.random() < 0.1:
        return {key: value for key, value in document.items() if key != name}
    return {**document, name: _with_accident(rng, document[name])}


MAKERS: Mapping[str, Callable[[random.Random, Path], Path]] = {
    "xacro": xacro,
    "urdf": urdf,
    "collada": collada,
    "stl": stl,
    "json": json_file,
}
