"""Pictures from the command line, without a browser."""

import re
from io import BytesIO

import numpy as np
import pytest
from matplotlib.image import imread

from borecheck.cli import main
from borecheck.core.palette import LIGHT, rgb
from borecheck.geometry.mesh.primitives import box
from borecheck.geometry.mesh_files.reading import write_stl
from tests.places import ROBOTS

ROBOT = ROBOTS / "two_link.urdf"


@pytest.fixture(scope="module")
def result(tmp_path_factory):
    """A clear motion beside a block."""
    folder = tmp_path_factory.mktemp("pictures")
    write_stl(folder / "block.stl", box("block", (0.2, 0.2, 0.2)))
    (folder / "path.csv").write_text("j\n0\n0.05\n")
    out = folder / "result.json"
    words = ["check", str(ROBOT), f"{folder}/block.stl:m@0.2,0,0.6", "--path"]
    more = ["--samples", "3", "--out", str(out), "--format", "json"]
    assert main([*words, str(folder / "path.csv"), *more]) == 0
    return out


def pixels(path):
    return np.rint(255 * imread(BytesIO(path.read_bytes()), format="png"))[..., :3]


def share(picture, colour):
    return float((np.abs(picture - np.array(rgb(colour))).max(axis=2) < 3).mean())


@pytest.mark.parametrize("view", ["cut", "bore", "side", "narrow"])
def test_a_view_has_the_size_and_the_verdict_in_its_colour(result, tmp_path, view):
    out = tmp_path / "p.png"
    words = ["--picture", str(out), "--view", view, "--size", "400x300"]
    assert main(["report", str(result), *words]) == 0
    picture = pixels(out)
    assert picture.shape == (300, 400, 3)
    assert share(picture, LIGHT["clear"].ink) > 0.005
    assert share(picture, LIGHT["contact"].ink) == 0.0


def test_a_curve_has_its_proven_band(result, tmp_path):
    out = tmp_path / "p.png"
    words = ["--picture", str(out), "--view", "curve", "--size", "800x400"]
    assert main(["report", str(result), *words]) == 0
    assert share(pixels(out), LIGHT["clear"].ground) > 0.05


def test_an_svg_stands_alone(result, tmp_path):
    out, page = tmp_path / "p.svg", tmp_path / "page.html"
    assert main(["report", str(result), str(page), "--picture", str(out)]) == 0
    text = out.read_text()
    assert text.startswith('<svg xmlns="http://www.w3.org/2000/svg" width="1200"')
    assert not re.search(r'href="(?!data:image/png)', text)
    assert "<style>" in text
    assert page.is_file()


@pytest.mark.parametrize(
    "words",
    [
        [],
        ["--picture", "p.gif"],
        ["--picture", "p.svg", "--size", "12"],
        ["--picture", "p.svg", "--size", "9x9"],
    ],
)
def test_what_cannot_be_drawn_is_one_line(result, words, capsys, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert main(["report", str(result), *words]) == 2
    assert len(capsys.readouterr().err.splitlines()) == 1
    assert list(tmp_path.iterdir()) == []
