"""Every JSON result is as its published schema says."""

import json
import tomllib

import jsonschema
import pytest

import borecheck
from borecheck.cli import main
from borecheck.commands.init import template
from borecheck.geometry.mesh.primitives import box
from borecheck.geometry.mesh_files.reading import write_stl
from tests.patients.series import block, straight, write_series
from tests.places import DATA, PROJECT, ROBOTS

SCHEMAS = PROJECT / "borecheck" / "schemas"
NAMES = sorted(p.name.removesuffix(".schema.json") for p in SCHEMAS.glob("*.json"))
ARM = str(ROBOTS / "two_link.urdf")
CALIBRATION = DATA / "cases" / "cal_wrong_scale" / "feet.csv"


def schema(name):
    return json.loads((SCHEMAS / f"{name}.schema.json").read_text())


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A folder with a block, a path and plans."""
    made = tmp_path_factory.mktemp("results")
    write_stl(made / "block.stl", box("block", (0.2, 0.2, 0.2)))
    write_series(made / "scan", block(), straight(8))
    (made / "path.csv").write_text("j\n0\n0.1\n")
    (made / "plans.csv").write_text(
        "name,entry_x,entry_y,entry_z,target_x,target_y,target_z\n"
        "a,0,0.02,-0.1,0,0.02,-0.14\nfar,0.9,0.9,0.9,0.9,0.9,0.8\n"
    )
    return made


def commands(folder):
    block = f"{folder / 'block.stl'}:m@2,0,0"
    near = f"{folder / 'block.stl'}:m@0.2,0,0.6"
    path, plans = str(folder / "path.csv"), str(folder / "plans.csv")
    certificate = str(folder / "certificate.json")
    fit = ["calibrate", "fit", "mri_arm", str(CALIBRATION), "--refine"]
    return {
        "pose": ("check", ["check", ARM, block, "--q", "0"]),
        "contact": ("check", ["check", ARM, near, "--q", "j=20deg"]),
        "path": (
            "check",
            ["check", ARM, block, "--path", path, "--certificate", certificate],
        ),
        "plans": ("check", ["check", "zerobot", "ct_gantry", "--plan", plans]),
        "way": ("check", ["route", ARM, block, "--to", "j=20deg"]),
        "no way": ("route", ["route", ARM, near, "--to", "j=20deg"]),
        "setup": ("setup", ["setup", "zerobot", "ct_gantry", "--plan", plans]),
        "directions": (
            "directions",
            [
                *("directions", "zerobot", "ct_gantry", "--target", "0,0,-50mm"),
                *("--resolution", "8deg", "--asked", "0,0,0"),
            ],
        ),
        "compare": ("compare", ["compare", ARM, near, "--random", "2"]),
        "fk": ("fk", ["fk", ARM, "--random", "2", "--seed", "1"]),
        "robots": ("robots", ["robots"]),
        "validate": ("validate", ["validate", ARM]),
        "verify": ("verify", ["verify", certificate]),
        "patient": ("patient", ["patient", str(folder / "scan"), "--geometry-only"]),
        "fit": ("calibrate_fit", fit),
        "observe": (
            "calibrate_observe",
            ["calibrate", "observe", "mri_arm", str(CALIBRATION)],
        ),
    }


@pytest.fixture(scope="module")
def documents(folder):
    """What every command prints, by the row's name: (schema, document)."""
    with pytest.MonkeyPatch.context() as patch:
        found = {}
        for name, (kind, words) in commands(folder).items():
            written = []
            patch.setattr("sys.stdout.write", written.append)
            main([*words, "--format", "json"])
            found[name] = (kind, json.loads("".join(written)))
        truth = folder / "truth.json"
        words = ["calibrate", "simulate", "mri_arm", "--samples", "3"]
        main([*words, "--out", str(folder / "d.csv"), "--truth", str(truth)])
    found["truth"] = ("calibrate_truth", json.loads(truth.read_text()))
    certificate = json.loads((folder / "certificate.json").read_text())
    found["case"] = ("case", tomllib.loads(template()))
    found["certificate"] = ("certificate", certificate)
    return found


def test_every_result_fits_its_schema(documents):
    assert {kind for kind, _ in documents.values()} == set(NAMES)
    for name, (kind, document) in documents.items():
        problems = jsonschema.Draft202012Validator(schema(kind)).iter_errors(document)
        assert not [f"{name} {list(p.absolute_path)}: {p.message}" for p in problems]


def test_a_schema_notices_what_is_missing_or_of_another_kind(documents):
    for kind, document in documents.values():
        if kind == "case":
            continue  # nothing of it is required: a command asks for what it needs
        judge = jsonschema.Draft202012Validator(schema(kind))
        required = schema(kind).get("required") or schema(kind)["allOf"][0]["required"]
        for key in required:
            without = {k: v for k, v in document.items() if k != key}
            assert not judge.is_valid(without), (kind, key)
            assert not judge.is_valid({**document, key: object}), (kind, key)


@pytest.mark.parametrize("name", NAMES)
def test_schemas_are_schemas(name):
    jsonschema.Draft202012Validator.check_schema(schema(name))


def test_schemas_are_installed():
    from importlib.resources import files

    assert (files(borecheck) / "schemas" / "check.schema.json").is_file()
