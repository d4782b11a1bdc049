"""`verify` by itself and bound: what it says, and what it refuses."""

import json
import shutil
from pathlib import Path
from typing import Any

import pytest

import borecheck as bc
from borecheck.cli import main
from borecheck.errors import UsageError
from borecheck.geometry.mesh.primitives import box
from borecheck.geometry.mesh_files.reading import write_stl
from borecheck.motion.certificate import digest
from borecheck.verify.reading import mesh_hash, read_meshes
from tests.places import ROBOTS

ROBOT = ROBOTS / "two_link.urdf"
Capsys = pytest.CaptureFixture[str]


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A robot, a block, a path and its certificate."""
    folder = tmp_path_factory.mktemp("made")
    write_stl(folder / "block.stl", box("block", (0.2, 0.2, 0.2)))
    write_stl(folder / "larger.stl", box("block", (0.2, 0.2, 0.21)))
    shutil.copy(ROBOT, folder / "arm.urdf")
    (folder / "path.csv").write_text("j\n0\n-0.5\n")
    (folder / "other.csv").write_text("j\n0\n-0.4\n")
    (folder / "longer.csv").write_text("j\n0\n-0.4\n-0.5\n")
    words = _scene(folder, "block.stl", "path.csv", "5mm")
    words = [words[1], *words[3:]]  # in check, robot and scene have no option
    certificate = ["--certificate", str(folder / "c.json")]
    assert main(["check", *words, *certificate]) == 0
    return folder


def _scene(folder: Path, mesh: str, path: str, margin: str) -> list[str]:
    scene = f"{folder / mesh}:m@0.4,0,0.6"
    given = ["--robot", str(folder / "arm.urdf"), "--scene", scene]
    return [*given, "--path", str(folder / path), "--margin", margin]


def _run(capsys: Capsys, *words: object) -> tuple[int, str, str]:
    status = main(list(map(str, words)))
    captured = capsys.readouterr()
    return status, captured.out, captured.err


def test_by_itself_it_says_what_it_could_not_know(capsys: Capsys, made: Path) -> None:
    status, out, _ = _run(capsys, "verify", made / "c.json")
    assert status == 0
    assert out.startswith("ACCEPTED: ")
    assert "by itself" in out.splitlines()[0]
    assert "not bound to any file" in out
    assert "not known: whether chain and parts are those of the robot meant" in out


def test_bound_to_its_files_it_holds(capsys: Capsys, made: Path) -> None:
    words = _scene(made, "block.stl", "path.csv", "5mm")
    page = made / "page.html"
    status, out, _ = _run(
        capsys, "verify", made / "c.json", *words, "--report", page, "--date", "today"
    )
    assert status == 0, out
    assert "bound to files" in out.splitlines()[0]
    assert "names are as its writer" not in out
    assert "Bound: every mesh, joint, pair, margin and waypoint" in page.read_text()
    status, out, _ = _run(
        capsys, "verify", made / "c.json", "--format", "json", "--report", page
    )
    assert json.loads(out)["bound"] is False
    assert "Not bound: the certificates were checked by themselves" in page.read_text()


@pytest.mark.parametrize(
    ("mesh", "path", "margin", "more", "saying"),
    [
        ("larger.stl", "path.csv", "5mm", [], ": another mesh than its file's"),
        ("block.stl", "other.csv", "5mm", [], "waypoint 2: off by up to 0.1"),
        ("block.stl", "longer.csv", "5mm", [], "waypoints: 2, not 3"),
        ("block.stl", "path.csv", "6mm", [], "margin: 0.005, not 0.006"),
        ("block.stl", "path.csv", "5mm", ["--base", "0,0,1e-3"], "joint 0 of"),
        ("block.stl", "path.csv", "5mm", ["--obstacle", "block.stl:m@5,0,0"],
         "2 parts and 1 obstacles, not 2 and 2"),
    ],
)  # fmt: skip
def test_any_difference_is_named(
    capsys: Capsys,
    monkeypatch: pytest.MonkeyPatch,
    made: Path,
    mesh: str,
    path: str,
    margin: str,
    more: list[str],
    saying: str,
) -> None:
    monkeypatch.chdir(made)
    words = [*_scene(made, mesh, path, margin), *more]
    status, out, err = _run(capsys, "verify", made / "c.json", *words)
    assert (status, err) == (1, "")
    assert out.startswith("REJECTED: ")
    assert saying in out


def test_a_robot_whose_joint_does_not_move_is_told(capsys: Capsys, made: Path) -> None:
    """The same names and meshes, another joint: true by itself, not of these files."""
    document = json.loads((made / "c.json").read_text())
    document["chain"][1]["kind"] = "fixed"
    _rewrite(made / "fixed.json", document, made)
    assert _run(capsys, "verify", made / "fixed.json")[0] == 0
    words = _scene(made, "block.stl", "path.csv", "5mm")
    status, out, _ = _run(capsys, "verify", made / "fixed.json", *words)
    assert status == 1
    assert "joint 1 of the chain: kind fixed, not turns" in out


def _rewrite(file: Path, document: dict[str, Any], made: Path) -> None:
    content = {k: v for k, v in document.items() if k != "sha256"}
    file.write_text(json.dumps({**content, "sha256": digest(content)}))
    shutil.copy(made / "c.npz", file.with_suffix(".npz"))


def test_a_name_moves_no_cursor(capsys: Capsys, made: Path) -> None:
    document = json.loads((made / "c.json").read_text())
    name = "arm\x1b[1A\x1b[2K\nACCEPTED: 266 intervals\x9b"
    document["bodies"][1]["name"] = name
    _rewrite(made / "spoof.json", document, made)
    for change in (0.0, 1.0):
        document["pairs"][1]["intervals"][0][3] += change
        _rewrite(made / "spoof.json", document, made)
        status, out, _ = _run(capsys, "verify", made / "spoof.json")
        assert status == (1 if change else 0)
        assert all(c.isprintable() or c == "\n" for c in out)
        assert "\\x1b[2K\\nACCEPTED" in out
        assert (
            sum(line.startswith("ACCEPTED") for line in out.splitlines()) == 1 - status
        )


def test_what_binding_takes_is_said(capsys: Capsys, made: Path) -> None:
    for words in (["--robot", ROBOT], ["--margin", "1mm"], ["--obstacle", "x.stl"]):
        status, out, err = _run(capsys, "verify", made / "c.json", *words)
        assert (status, out) == (2, "")
        assert "give --robot, --scene, and --path or --plan" in err
    robot = bc.load_robot(ROBOT)
    with pytest.raises(UsageError, match="give robot, scene, and either"):
        bc.verify(made / "c.json", robot)


def test_from_python(made: Path) -> None:
    robot = bc.load_robot(made / "arm.urdf")
    scene = bc.load_scene(f"{made / 'block.stl'}:m@0.4,0,0.6")
    alone = bc.verify(made / "c.json")
    assert alone.accepted
    assert alone.bound_to is None
    assert len(alone.not_known) == 1
    points = [[0.0], [-0.5]]
    bound = bc.verify(made / "c.json", robot, scene, waypoints=points, margin=0.005)
    assert bound.accepted, bound.problems
    assert bound.bound_to is not None
    assert not bc.verify(made / "c.json", robot, scene, waypoints=points).accepted


def test_hashes_tell_arrays_apart(made: Path) -> None:
    """Numbers that move from one array to the other make another mesh."""
    mesh = box("b", (1.0, 2.0, 3.0))
    ((known, (vertices, triangles)),) = read_meshes(
        [(mesh.vertices, mesh.triangles)]
    ).items()
    assert known == mesh.sha256
    fewer, more = triangles[1:], [*vertices, triangles[0].view(float)]
    assert mesh_hash(*next(iter(read_meshes([(more, fewer)]).values()))) != known
    for name in read_meshes(made / "c.npz"):
        assert f'"{name}"' in (made / "c.json").read_text()
