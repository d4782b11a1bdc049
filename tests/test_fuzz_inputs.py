"""Damaged files end in a verdict or in one clear line, never in a traceback.

Good files are mutated by a seeded generator: bytes changed, cut, doubled, swapped for
words that programs trip over. Each mutant goes through the command line whole.
"""

from pathlib import Path

import numpy as np
import pytest

from borecheck.cli import main
from borecheck.geometry.mesh.primitives import box
from borecheck.geometry.mesh_files.reading import write_stl
from tests.places import ROBOTS

ROBOT = ROBOTS / "two_link.urdf"
MUTANTS = 40

WORDS = (
    b"nan",
    b"inf",
    b"-1e999",
    b"1e308",
    b"99999999999999999999",
    b"-1",
    b"0",
    b"",
    b"\0",
    b"\xff\xfe",
    b"\n",
    b'"',
    b"<",
    b"&#0;",
    b"${1/0}",
    b"../../..",
    "\u0661".encode(),
)


def mutated(data, rng):
    """The file with one or two accidents."""
    for _ in range(rng.integers(1, 3)):
        at, to = sorted(rng.integers(0, len(data) + 1, 2))
        kind = rng.integers(0, 9)
        if kind == 0:
            data = data[:at]
        elif kind == 1:
            data = data[:at] + data[min(to, at + 40) :]
        elif kind == 2:
            data = data[:at] + data[at : at + 60] + data[at:]
        elif kind == 3:
            data = data[:at] + bytes(rng.integers(0, 256, 4, np.uint8)) + data[at + 4 :]
        else:
            word = WORDS[rng.integers(len(WORDS))]
            data = _word_replaced(data, at, word)
    return data


def _word_replaced(data, at, word):
    """The number or word that stands there, replaced."""
    stop = b" ,\n\"'<>=:[]{}"
    start = at
    while start > 0 and data[start - 1 : start] not in [bytes([c]) for c in stop]:
        start -= 1
    end = at
    while end < len(data) and data[end : end + 1] not in [bytes([c]) for c in stop]:
        end += 1
    return data[:start] + word + data[end:]


def outcome(capsys, *words):
    """Exit status and standard error; argparse's own refusals count as status 2."""
    try:
        status = main([str(word) for word in words])
    except SystemExit as stop:
        status = stop.code
    captured = capsys.readouterr()
    return status, captured.out, captured.err


def check_answer(status, out, err, data):
    """A verdict on standard output, or one line on standard error."""
    assert "Traceback" not in err, (err, data)
    assert status in (0, 1, 2), (status, data)
    lines = [line for line in err.splitlines() if line.startswith("borecheck: error:")]
    if out == "":
        assert status == 2
        assert len(lines) == 1, (err, data)
    else:
        assert lines == [], (err, data)


def run_mutants(capsys, tmp_path, name, data, *words, count=MUTANTS):
    """Runs every mutant; returns how many were refused and how many answered."""
    rng = np.random.default_rng(abs(hash_of(name)))
    file = tmp_path / name
    tally = {"refused": 0, "answered": 0}
    file.write_bytes(data)
    assert outcome(capsys, *words)[1] != "", "the file as it was must be good"
    for _ in range(count):
        mutant = mutated(data, rng)
        file.write_bytes(mutant)
        before = set(tmp_path.iterdir())
        status, out, err = outcome(capsys, *words)
        check_answer(status, out, err, mutant)
        assert set(tmp_path.iterdir()) == before
        tally["refused" if out == "" else "answered"] += 1
    return tally


def hash_of(name):
    return sum(ord(c) * 31**k for k, c in enumerate(name))


@pytest.fixture
def block(tmp_path):
    path = tmp_path / "block.stl"
    write_stl(path, box("block", (0.2, 0.2, 0.2)))
    return f"{path}:m@0.4,0,0.6"


OBJ = b"v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n"

PLY = (
    b"ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\n"
    b"property float z\nelement face 4\nproperty list uchar int vertex_indices\n"
    b"end_header\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n3 0 2 1\n3 0 1 3\n3 1 2 3\n3 2 0 3\n"
)

ASCII_STL = (
    b"solid a\n"
    + b"".join(
        b"facet normal 0 0 1\nouter loop\nvertex 0 0 %d\nvertex 1 0 0\nvertex 0 1 0\n"
        b"endloop\nendfacet\n" % k
        for k in range(3)
    )
    + b"endsolid a\n"
)


@pytest.mark.parametrize(
    ("name", "data"),
    [("m.obj", OBJ), ("m.ply", PLY), ("m.stl", ASCII_STL), ("b.stl", None)],
    ids=["obj", "ply", "ascii stl", "binary stl"],
)
def test_meshes(capsys, tmp_path, block, name, data):
    if data is None:
        data = Path(block.partition(":")[0]).read_bytes()
    words = ("check", ROBOT, f"{tmp_path / name}@2,0,0", "--q", "0")
    tally = run_mutants(capsys, tmp_path, name, data, *words)
    assert tally["refused"] > 5


def test_urdf(capsys, tmp_path, block):
    words = ("check", tmp_path / "r.urdf", block, "--q", "home")
    tally = run_mutants(capsys, tmp_path, "r.urdf", ROBOT.read_bytes(), *words)
    assert tally["refused"] > 5


def test_urdf_as_obstacle(capsys, tmp_path, block):
    words = ("check", ROBOT, f"{tmp_path / 'o.urdf'}@3,0,0", "--q", "0")
    run_mutants(capsys, tmp_path, "o.urdf", ROBOT.read_bytes(), *words, count=30)


def test_xacro(capsys, tmp_path, block):
    data = (
        b'<robot name="r" xmlns:xacro="http://www.ros.org/wiki/xacro">\n'
        b'<xacro:arg name="size" default="0.1"/>'
        b'<xacro:property name="n" value="${2*3}"/>'
        b'<link name="a"><collision><geometry><box size="$(arg size) ${n/60} 0.1"/>'
        b"</geometry></collision></link></robot>\n"
    )
    words = ("check", tmp_path / "r.xacro", block, "--q", "home")
    tally = run_mutants(capsys, tmp_path, "r.xacro", data, *words, count=40)
    assert tally["refused"] > 5


def test_paths(capsys, tmp_path, block):
    data = b"j\n-0.5\n0.0\n0.25\n-1.5\n"
    words = ("check", ROBOT, block, "--path", tmp_path / "p.csv", "--no-certificate")
    tally = run_mutants(
        capsys, tmp_path, "p.csv", data, *words, "--samples", "2", count=40
    )
    assert tally["refused"] > 5
    assert tally["answered"] > 2


PLAN_CSV = (
    b"name,entry_x,entry_y,entry_z,target_x,target_y,target_z\n"
    b"liver,0.0,0.0,-0.0011,0.0,0.0,-0.07\n"
)
PLAN_JSON = (
    b'{"unit": "mm", "frame": "scanner", "plans": [{"name": "liver", "entry_x": 0, '
    b'"entry_y": 0, "entry_z": -1.1, "target_x": 0, "target_y": 0, "target_z": -70}]}'
)


@pytest.mark.parametrize(("name", "data"), [("p.csv", PLAN_CSV), ("p.json", PLAN_JSON)])
def test_plans(capsys, tmp_path, name, data):
    words = ("check", "zerobot", "ct_gantry", "--plan", tmp_path / name)
    options = ("--no-certificate", "--samples", "1")
    tally = run_mutants(capsys, tmp_path, name, data, *words, *options, count=25)
    assert tally["refused"] > 5


def test_results(capsys, tmp_path, block):
    """What was written by ourselves, damaged, as a page and as a replay."""
    wall = tmp_path / "wall.obj"
    wall.write_text("v 0.03 -9 -9\nv 0.03 9 -9\nv 0.03 0 9\nf 1 2 3\n")
    dump, damaged = tmp_path / "dump.json", tmp_path / "damaged.json"
    words = ("compare", ROBOT, f"{wall}:m", "--q", "0", "--out", dump)
    assert outcome(capsys, *words)[0] == 0
    data = dump.read_bytes()
    rng = np.random.default_rng(5)
    for _ in range(15):
        damaged.write_bytes(mutated(data, rng))
        for again in (
            ("compare", ROBOT, block, "--replay", damaged),
            ("report", damaged, tmp_path / "page.html"),
        ):
            status, _, err = outcome(capsys, *again)
            assert "Traceback" not in err, err
            assert status in (0, 1, 2)


@pytest.mark.parametrize(
    "text",
    [
        "nan",
        "inf",
        "1e999",
        "",
        " ",
        "j",
        "j=",
        "=1",
        "j=1=2",
        "0,0",
        "\0",
        "1_0",
        "\u0661",
    ],
)
@pytest.mark.parametrize("option", ["--q", "--margin", "--base", "--level"])
def test_options(capsys, block, option, text):
    words = ["check", ROBOT, block, f"{option}={text}"]
    if option != "--q":
        words += ["--q", "0"]
    status, out, err = outcome(capsys, *words)
    assert "Traceback" not in err
    assert status == 2
    assert out == ""
