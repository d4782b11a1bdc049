"""Generated meshes: whole or not there, made once, made again for another shape."""

import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import pytest

import borecheck as bc
from borecheck.errors import BorecheckError, UnknownNameError
from borecheck.geometry.mesh_files.reading import read_mesh
from borecheck.robots import generated_meshes
from borecheck.robots.description import installed
from borecheck.robots.from_description import complete_arguments
from borecheck.robots.generated_meshes import mesh_folder


@pytest.fixture
def store(tmp_path, monkeypatch):
    monkeypatch.setenv("BORECHECK_CACHE", str(tmp_path / "cache"))
    return tmp_path / "cache" / "meshes"


@pytest.fixture
def gantry():
    return installed("scanners", "scanner", "ct_gantry")


def arguments(description, **given):
    return complete_arguments(description, given)


def names(folder):
    return sorted(path.name for path in folder.iterdir())


def test_coarse_meshes_of_the_defaults_are_shipped(gantry, store):
    assert mesh_folder(gantry, "coarse", arguments(gantry)) == gantry.shipped
    assert mesh_folder(gantry, "coarse", arguments(gantry, tilt="10deg")) == (
        gantry.shipped
    )
    assert not store.exists()


def test_another_shape_is_generated_once(gantry, store, monkeypatch):
    wide = arguments(gantry, bore="850mm")
    folder = mesh_folder(gantry, "coarse", wide)
    assert folder.parent == store
    assert (folder / "complete").is_file()
    shipped = {path.name for path in gantry.shipped.glob("*.stl")}
    assert {path.name for path in folder.glob("*.stl")} == shipped
    monkeypatch.setattr(generated_meshes, "_generate", None)
    assert mesh_folder(gantry, "coarse", wide) == folder
    # an argument that shapes nothing shares the meshes
    tilted = arguments(gantry, bore="0.85", tilt="5deg")
    assert mesh_folder(gantry, "coarse", tilted) == folder


def test_shapes_and_levels_have_folders_of_their_own(gantry, store):
    folders = {
        mesh_folder(gantry, "coarse", arguments(gantry, bore=bore))
        for bore in ("0.70", "0.80", "0.85")
    }
    assert len(folders) == 3
    assert names(store) == sorted(folder.name for folder in folders)


def test_middle_level_with_a_shape_argument(gantry, store):
    """The bore that was asked for, in the finer mesh too."""
    coarse = bc.load_scene("ct_gantry", bore="850mm")
    middle = bc.load_scene("ct_gantry", bore="850mm", level="middle")
    counts = [sum(len(o.mesh.triangles) for o in s.obstacles) for s in (coarse, middle)]
    assert counts[1] > 5 * counts[0]
    for a, b in zip(coarse.obstacles, middle.obstacles, strict=True):
        assert a.name == b.name
        # a finer round part reaches the same outline within its sagitta
        assert abs(a.mesh.bounds - b.mesh.bounds).max() < 5e-3


def test_a_folder_without_its_mark_is_made_again(gantry, store):
    wide = arguments(gantry, bore="850mm")
    folder = mesh_folder(gantry, "coarse", wide)
    (folder / "complete").unlink()
    (folder / "gantry.stl").write_bytes(b"half of it")
    assert mesh_folder(gantry, "coarse", wide) == folder
    assert len(read_mesh(folder / "gantry.stl").triangles) > 1000


def test_a_damaged_mesh_is_named_not_skipped(gantry, store):
    folder = mesh_folder(gantry, "coarse", arguments(gantry, bore="850mm"))
    whole = (folder / "gantry.stl").read_bytes()
    (folder / "gantry.stl").write_bytes(whole[: len(whole) // 2])
    with pytest.raises(BorecheckError, match=r"gantry\.stl"):
        bc.load_scene("ct_gantry", bore="850mm")


def test_nothing_half_written_when_writing_fails(gantry, store, monkeypatch):
    real, written = generated_meshes.write_stl, []

    def full_disk(path, mesh):
        if written:
            raise OSError(28, "No space left on device")
        written.append(path)
        real(path, mesh)

    monkeypatch.setattr(generated_meshes, "write_stl", full_disk)
    with pytest.raises(BorecheckError, match="No space left"):
        mesh_folder(gantry, "coarse", arguments(gantry, bore="850mm"))
    assert written
    assert names(store) == []


def test_a_cache_that_cannot_be_written_says_how_to_choose_another(
    gantry, tmp_path, monkeypatch
):
    (tmp_path / "file").touch()
    monkeypatch.setenv("BORECHECK_CACHE", str(tmp_path / "file"))
    with pytest.raises(BorecheckError, match="BORECHECK_CACHE"):
        mesh_folder(gantry, "middle", arguments(gantry))
    # what is shipped needs no cache
    assert mesh_folder(gantry, "coarse", arguments(gantry)) == gantry.shipped


def test_first_runs_at_the_same_time_do_not_disturb_each_other(tmp_path):
    code = (
        "import borecheck as bc\n"
        "s = bc.load_scene('ct_gantry', bore='850mm')\n"
        "print(sorted((o.name, o.mesh.sha256) for o in s.obstacles))"
    )
    environment = {"BORECHECK_CACHE": str(tmp_path / "cache"), "PATH": "/usr/bin:/bin"}
    runs = [
        subprocess.Popen(
            [sys.executable, "-c", code],
            env=environment,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        )
        for _ in range(3)
    ]
    answers = [run.communicate(timeout=120) for run in runs]
    assert [run.returncode for run in runs] == [0, 0, 0], answers
    assert len({out for out, _ in answers}) == 1
    left = list((tmp_path / "cache" / "meshes").iterdir())
    assert len(left) == 1, left


def test_another_generator_makes_another_folder(gantry, store):
    wide = arguments(gantry, bore="850mm")
    other = replace(gantry, meshes="zerobot.meshes:build")
    shaping = {"bore": "0.85"}
    assert generated_meshes._key(gantry, "coarse", shaping) != generated_meshes._key(
        other, "coarse", shaping
    )
    assert mesh_folder(gantry, "coarse", wide).name == generated_meshes._key(
        gantry,
        "coarse",
        {n: wide[n] for n, a in gantry.arguments.items() if a.shapes},
    )


def test_unknown_level(gantry):
    with pytest.raises(UnknownNameError, match="coarse, middle, fine"):
        mesh_folder(gantry, "finest", arguments(gantry))


@pytest.mark.parametrize("folder", ["with space", "quote'd", "dollar$(arg x)${1+1}"])
def test_the_cache_may_have_any_name(tmp_path, monkeypatch, folder):
    monkeypatch.setenv("BORECHECK_CACHE", str(tmp_path / folder))
    scene = bc.load_scene("ct_gantry", bore="850mm")
    assert Path(tmp_path / folder / "meshes").is_dir()
    assert {o.name for o in scene.obstacles} >= {"gantry", "couch"}
