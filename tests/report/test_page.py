import json
import re

import numpy as np
import pytest

from borecheck.cli import main
from borecheck.core.result_file import read_result
from borecheck.errors import BorecheckError
from borecheck.geometry.mesh.primitives import box
from borecheck.geometry.mesh.triangle_mesh import TriangleMesh
from borecheck.geometry.mesh_files.reading import write_stl
from borecheck.report import (
    display,
    many_plans,
    page_check,
    page_compare,
    page_study,
)
from borecheck.report.excerpts import with_excerpts
from borecheck.report.figures_clearance import clearance_plot
from borecheck.report.figures_still import Stage, looking, png
from borecheck.report.page import embedded_json, page, short
from borecheck.report.thinning import thinned
from tests.places import ROBOTS

ROBOT = ROBOTS / "two_link.urdf"
HOSTILE = "</script><img src=x onerror=alert(1)>&'\""
# 16-bit positions in a box of a few decimetres.
PACKING_ERROR = 1e-5


@pytest.fixture
def block(tmp_path):
    path = tmp_path / "block.stl"
    write_stl(path, box("block", (0.2, 0.2, 0.2)))
    return f"{path}:m@0.2,0,0.6"


@pytest.fixture
def made(tmp_path, block, capsys):
    """Runs a command on the two-link arm and the block; its stored document."""

    def run(*words):
        out = tmp_path / "result.json"
        main([*map(str, words), "--out", str(out)])
        capsys.readouterr()
        return read_result(out)

    return lambda command, *more: run(command, ROBOT, block, *more)


@pytest.fixture
def contact(made):
    document = made("check", "--q", "j=20deg", "--date", "2026-01-02")
    assert document["verdict"] == "contact"
    return document


def body(text):
    """The page without data block, style and script: what a reader gets."""
    return re.sub(r"<(script|style)\b.*?</\1>", "", text, flags=re.DOTALL)


def test_same_document_gives_the_same_bytes(contact):
    assert page(contact) == page(json.loads(json.dumps(contact)))


def test_report_command_writes_what_the_option_writes(tmp_path, block, capsys):
    one, other, again = (tmp_path / name for name in ("1.html", "2.html", "3.html"))
    out = tmp_path / "result.json"
    words = ["check", str(ROBOT), block, "--q", "0", "--out", str(out)]
    assert main([*words, "--report", str(one)]) == 0
    assert main(["report", str(out), str(other)]) == 0
    assert main(["report", str(one), str(again)]) == 0
    assert one.read_bytes() == other.read_bytes() == again.read_bytes()
    assert read_result(one) == read_result(out)


def test_the_verdict_comes_first_in_words(contact):
    text = body(page(contact))
    assert re.search(r"<h1>\s*Contact", text)
    assert text.index("<h1>") < text.index("<table")
    assert contact["reason"] in text
    assert "2026-01-02" in text


def test_what_is_not_covered_is_named(made):
    document = made("check", "--q", "0")
    document["not_modelled"] = ["breathing", "drapes"]
    text = body(page(document))
    assert "breathing" in text
    assert "drapes" in text


def test_nothing_is_fetched_and_only_our_script_may_run(contact):
    text = page(contact)
    policy = re.search(r'Content-Security-Policy" content="([^"]*)"', text).group(1)
    assert "default-src &#39;none&#39;" in policy
    assert "unsafe" not in policy
    assert policy.count("sha256-") == 2
    assert not re.search(r'(?:src|href)="(?!data:image/png|#)', body(text))
    assert " style=" not in body(text)
    assert not re.search(r" on[a-z]+=", body(text))


def test_hostile_names_stay_text(contact):
    document = json.loads(json.dumps(contact).replace('"arm"', json.dumps(HOSTILE)))
    document["not_modelled"] = [HOSTILE]
    document["robot"]["name"] = document["scene"]["name"] = HOSTILE
    document["reason"] = document["argv"][-1] = document["date"] = HOSTILE
    text = page(document)
    assert "<img" not in text
    assert "&lt;img" in text
    assert text.count("</script>") == 2
    match = re.search(r'id="borecheck-result">(.*?)</script>', text, re.DOTALL)
    assert json.loads(match.group(1)) == document


def test_hostile_names_in_plots_and_studies_stay_text():
    document = {
        "schema_version": "1",
        "command": HOSTILE,
        "argv": [HOSTILE],
        "sections": [
            {
                "title": HOSTILE,
                "text": HOSTILE,
                "table": {"columns": [HOSTILE], "rows": [[HOSTILE]]},
                "figure": {
                    "kind": "curves",
                    "lines": {HOSTILE: [[0, 1], [1, 2]]},
                    "x": HOSTILE,
                    "y": HOSTILE,
                    "title": HOSTILE,
                },
            }
        ],
    }
    text = page(document)
    assert "<img" not in text
    assert "<svg" in body(text)


def test_json_block_cannot_end_its_element():
    text = embedded_json({"a": "</script><!--\u2028"})
    assert not set(text) & set("<>&\u2028")
    assert json.loads(text) == {"a": "</script><!--\u2028"}


def test_a_damaged_result_is_one_clear_error(contact):
    del contact["scene"]["obstacles"]
    with pytest.raises(BorecheckError, match="damaged or incomplete"):
        page(contact)


def test_path_has_plot_with_margin_and_stretches(made, tmp_path):
    path = tmp_path / "path.csv"
    path.write_text("j\n0\n0.3\n")
    document = made("check", "--path", path, "--margin", "5mm", "--samples", "5")
    text = body(page(document))
    assert 'class="margin"' in text
    assert 'class="band' in text
    assert text.count('class="cursor"') == 1
    assert "margin 5 mm" in text


def test_an_unreachable_plan_has_a_row_and_no_motion(contact):
    plan = {
        **{k: v for k, v in contact.items() if k not in ("display", "robot", "scene")},
        "name": "reachable",
        "path": {
            "certified": False,
            "sampled_clear": 0,
            "samples": 1,
            "intervals": [{"from": 0.0, "to": 1.0, "verdict": "contact"}],
            "first_contact": 0.0,
            "worst": {"fraction": 0.0, "clearance_m": None, "closest": None},
            "fractions": [0.0],
            "poses": [contact],
        },
    }
    far = {"name": "far", "verdict": "unknown", "reason": "too far", "reachable": False}
    text = body(page({**contact, "plans": [far, plan]}))
    assert "too far" in text
    assert 'data-motion="0"' in text
    assert 'data-motion="1"' not in text


def with_plans(document, count):
    """A check of that many plans, each with the motion of a checked path."""
    plan = {
        **{k: v for k, v in document.items() if k not in ("display", "robot", "scene")},
        "reachable": True,
        "entry": [0.0, 0.0, 0.0],
        "target": [0.0, 0.0, -0.1],
    }
    names = [f"plan {k}" for k in range(count)]
    motion = document["display"]["motions"][0]
    display = {
        **document["display"],
        "motions": [{**motion, "name": name} for name in names],
    }
    plans = [{**plan, "name": name} for name in names]
    return {**document, "plans": plans, "display": display}


@pytest.fixture
def path_document(made, tmp_path):
    path = tmp_path / "path.csv"
    path.write_text("j\n0\n0.05\n")
    return made("check", "--path", path, "--samples", "5")


def test_very_many_plans_keep_what_is_said_and_the_pose_that_decides(path_document):
    count = many_plans.WHOLE_UP_TO + 1
    document = with_plans(path_document, count)
    thin = many_plans.for_a_page(document)
    assert [p["verdict"] for p in thin["plans"]] == [
        p["verdict"] for p in document["plans"]
    ]
    samples = [len(p["path"]["poses"]) for p in thin["plans"]]
    assert sorted(set(samples)) == [1, 5]
    assert samples.count(5) == many_plans.WHOLE_OF_MANY
    last, full = thin["display"]["motions"][-1], document["display"]["motions"][-1]
    worst = document["path"]["worst"]["fraction"]
    k = document["path"]["fractions"].index(worst)
    placed = display.inflated(full["placements"], "<f4").reshape(full["poses"], -1)
    np.testing.assert_array_equal(
        display.inflated(last["placements"], "<f4"), placed[k]
    )
    text = body(page(document))
    assert text.count("data-fly") >= count
    assert text.count('class="motion"') == page_check.MOST_DETAILED
    assert f"Of {count} plans this page carries the pose that decides" in text


def test_few_plans_stay_whole(path_document):
    document = with_plans(path_document, 3)
    assert many_plans.for_a_page(document) is document
    assert "carries the pose that decides" not in body(page(document))


def test_a_route_says_what_it_is(path_document):
    route = {
        "from": "home",
        "to": "/home/x/plans.csv",
        "reason": "1 edge",
        "path": None,
    }
    text = page({**path_document, "route": route})
    assert "<title>borecheck route: clear" in text
    assert "<h1>The way is clear</h1>" in body(text)
    assert "<h1>Clear</h1>" in body(page(path_document))


def test_a_page_shows_names_of_files_not_their_folders(contact):
    text = body(page(contact))
    assert "two_link.urdf" in text
    assert not re.search(r"(?<![<\w])/(home|tmp|work|root|usr|opt)/", text)


def test_short_leaves_what_is_no_path():
    assert short("--plan=/a/b c.csv") == "--plan=b c.csv"
    assert short("/a/b/c.stl:mm@0,0,0.1") == "c.stl:mm@0,0,0.1"
    assert short("m/s, 1/2, and/or, ../a/b") == "m/s, 1/2, and/or, ../a/b"


def test_title_and_author_are_printed(contact, tmp_path):
    stored, out = tmp_path / "stored.json", tmp_path / "out.html"
    stored.write_text(json.dumps(contact))
    words = ["--title", "Ward <3>", "--author", "A. Nonym"]
    assert main(["report", str(stored), str(out), *words]) == 0
    text = out.read_text()
    assert "Ward &lt;3&gt; · A. Nonym" in body(text)
    assert "<title>Ward &lt;3&gt;: contact" in text


def test_compare_says_first_how_many_poses_each_checker_misses(made):
    document = made("compare", "--q", "j=20deg")
    verdicts = {name: True for name in document["poses"][0]["verdicts"]}
    pose = document["poses"][0]
    none = dict.fromkeys(verdicts, False)
    document["poses"] = [
        {**pose, "verdicts": {**verdicts, "paper:robot": False}},
        {**pose, "verdicts": verdicts},
        {**pose, "verdicts": {**none, "coal": True}},
    ]
    found = page_compare.views(document)
    assert found["by_checker"]["paper:robot"] == (1, 0)
    assert found["by_checker"]["coal"] == (0, 1)
    assert found["headline"] == "paper:robot misses 1 of 2 poses in contact"
    assert "2 of 3 poses in contact. Missed: paper:robot 1" in found["verdicts_told"]


def test_proven_clearance_is_a_band_and_its_name_lies_in_it(path_document):
    text = clearance_plot(path_document["path"], 0.005, 0, "t")
    band = re.search(
        r'class="proven" x="58.0" y="([\d.]+)" .*? height="([\d.]+)"', text
    )
    top, height = map(float, band.groups())
    name = re.search(r'class="least-name" x="[\d.]+" y="([\d.]+)"', text)
    assert top + 12 < float(name[1]) < top + height


def test_comparison_matrix_counts_the_differences(made):
    document = made("compare", "--q", "j=20deg")
    found = page_compare.views(document)
    names = found["checkers"]
    matrix = np.array(found["matrix"])
    assert (matrix == matrix.T).all()
    assert (np.diag(matrix) == 0).all()
    exact, paper = names.index("exact"), names.index("paper:robot")
    missed = [
        d
        for d in document["disagreements"]
        if d["verdicts"]["exact"] != d["verdicts"]["paper:robot"]
    ]
    assert len(missed) > 0
    assert matrix[exact, paper] == len(missed)


def test_disputes_without_a_cause_come_first_and_are_drawn(made):
    document = made("compare", "--q", "j=20deg")
    last = document["disagreements"][-1]
    last["cause"] = None
    found = page_compare.views(document)
    assert found["disputes"][0]["place"] == len(document["disagreements"]) - 1
    assert "polygon" in found["drawn"][0]["svg"]
    assert len(found["drawn"][0]["determinants"]) == 6
    text = body(page(document))
    assert "1 disagreement without a known cause" in text


def test_replay_line_asks_the_same_pose_again(made, capsys):
    document = made("compare", "--q", "j=20deg")
    line = page_compare.replay_line(document["argv"], document["poses"][0]["q"])
    import shlex

    words = shlex.split(line)
    assert words[:2] == ["borecheck", "compare"]
    assert main([*words[1:], "--format", "json"]) == 0
    again = json.loads(capsys.readouterr().out)
    pairs = [
        [(d["link_triangle"], d["obstacle_triangle"]) for d in x["disagreements"]]
        for x in (document, again)
    ]
    assert pairs[0] == pairs[1]
    assert len(pairs[0]) > 0


def test_a_replayed_result_has_a_page(made, tmp_path, capsys):
    made("compare", "--q", "j=20deg")
    target = tmp_path / "replayed.html"
    stored = tmp_path / "result.json"
    words = ["compare", str(ROBOT), str(ROBOT), "--replay", str(stored)]
    assert main([*words, "--report", str(target)]) == 0
    capsys.readouterr()
    assert "Every disagreement has a known cause" in body(target.read_text())


def test_a_result_without_names_has_a_page(made):
    document = made("compare", "--q", "j=20deg")
    document["robot"] = document["scene"] = {"warnings": []}
    del document["display"]
    assert "Checkers" in body(page(document))


def test_replay_line_drops_what_chose_poses_and_places():
    argv = "borecheck compare a b --random 5 --seed=3 --level middle --out x.json"
    line = page_compare.replay_line(argv.split(), {"j": 0.5})
    assert line == "borecheck compare a b --level middle --q=j=0.5"


def test_kinematics_page(capsys, tmp_path):
    out = tmp_path / "fk.json"
    main(["fk", str(ROBOT), "--random", "3", "--out", str(out)])
    capsys.readouterr()
    text = body(page(read_result(out)))
    assert "All sources agree" in text
    assert 'class="bar"' in text


def test_validate_page_shows_findings_with_their_lines(capsys, tmp_path):
    path = tmp_path / "bad.urdf"
    path.write_text('<robot name="r">\n<link name="a"/>\n<link name="a"/>\n</robot>\n')
    target = tmp_path / "page.html"
    main(["validate", str(path), "--report", str(target)])
    capsys.readouterr()
    document = read_result(target)
    findings = document["files"][0]["findings"]
    assert findings
    text = body(target.read_text())
    for finding in findings:
        assert finding["code"] in text
    order = [
        f["severity"]
        for f in page_study.validate_views(document)["files"][0]["findings"]
    ]
    assert order == sorted(order, key=page_study.SEVERITIES.index)


def test_any_study_gets_a_page_of_its_tables():
    document = {
        "schema_version": "1",
        "command": "trials",
        "summary": "57 of 64",
        "trials": [{"point": "P1", "verdicts": {"exact": "clear"}, "ok": True}] * 3,
        "parameters": {"l1": {"value": 0.5, "sigma": 1e-6}},
        "sections": [
            {
                "title": "map",
                "figure": {
                    "kind": "heat_map",
                    "columns": ["a", "b"],
                    "rows": [["r", 0.0, 1.0]],
                },
            }
        ],
    }
    text = body(page(document))
    assert "57 of 64" in text
    assert text.count("<td>P1</td>") == 3
    assert text.count('class="badge clear"') == 3
    assert 'class="v4"' in text
    assert "sigma" in text


def test_packed_mesh_comes_back():
    mesh = box("b", (0.3, 0.2, 0.1))
    corners = display.unpacked(display.packed(mesh))
    np.testing.assert_allclose(
        np.sort(corners.reshape(-1, 9), axis=0),
        np.sort(mesh.corners.reshape(-1, 9), axis=0),
        atol=PACKING_ERROR,
    )


def grid(n):
    x, y = np.meshgrid(np.linspace(0, 1, n), np.linspace(0, 1, n))
    z = 0.1 * np.sin(6 * x)
    a = (np.arange(n - 1)[:, None] * n + np.arange(n - 1)).reshape(-1)
    triangles = np.concatenate(
        [np.stack([a, a + 1, a + n], 1), np.stack([a + 1, a + n + 1, a + n], 1)]
    )
    return np.stack([x, y, z], -1).reshape(-1, 3), triangles


def test_thinned_surface_stays_near_and_small():
    vertices, triangles = grid(60)
    found, corners, moved = thinned(vertices, triangles, 2000)
    assert 500 < len(corners) <= 2000
    assert 0.0 < moved < 0.1
    assert corners.max() < len(found)
    gaps = np.linalg.norm(vertices[:, None] - found[None], axis=2).min(axis=1)
    assert gaps.max() <= moved * (1 + 1e-12)


def test_thinning_is_said():
    vertices, triangles = grid(190)
    mesh = TriangleMesh("g", vertices, triangles)
    assert len(triangles) > display.MOST_TRIANGLES
    block = display.packed(mesh)
    assert block["triangles"] <= display.MOST_TRIANGLES
    assert block["triangles_checked"] == len(triangles)
    assert block["moved_m"] > 0.0


def test_lit_triangles_are_those_that_were_checked(contact):
    pair = contact["contacts"][0]
    lit = contact["display"]["motions"][0]["lit"][0]
    corners = display.inflated(lit["corners"], "<f4").reshape(-1, 2, 3, 3)
    assert lit["of"] == len(contact["contacts"]) + len(contact["self_contacts"])
    block = box("block", (0.2, 0.2, 0.2))
    expected = block.corners[pair["obstacle_triangle"]] + [0.2, 0.0, 0.6]
    np.testing.assert_allclose(corners[0, 1], expected, atol=1e-6)


def test_still_picture_shows_the_robot(contact):
    stage = Stage(contact["display"])
    points = stage.robot_points(0, 0)
    camera = looking(points.mean(axis=0), (0.0, 1.0, 0.0), 2.0)
    picture = stage.picture(0, 0, camera)
    assert picture.startswith(b"\x89PNG")
    away = looking(np.array([50.0, 0.0, 0.0]), (0.0, 1.0, 0.0), 2.0)
    assert len(picture) > 2 * len(stage.picture(0, 0, away))
    assert picture == stage.picture(0, 0, camera)


def test_png_is_read_by_others():
    from io import BytesIO

    from matplotlib.image import imread

    image = np.random.default_rng(1).integers(0, 256, (7, 5, 3)).astype(np.uint8)
    read = np.rint(255 * imread(BytesIO(png(image)), format="png")).astype(np.uint8)
    assert (read[..., :3] == image).all()


def test_excerpts_show_the_lines_around_a_finding(tmp_path):
    path = tmp_path / "a.urdf"
    path.write_text("one\n<two & two>\nthree\nfour\n")
    finding = {"file": str(path), "line": 2}
    gone = {"file": str(tmp_path / "gone"), "line": 2}
    document = {"files": [{"file": "f", "findings": [finding, gone]}]}
    first, second = with_excerpts(document)["files"][0]["findings"]
    assert [entry["line"] for entry in first["excerpt"]] == [1, 2, 3]
    assert first["excerpt"][1]["text"] == "<two & two>"
    assert second["excerpt"] == []


@pytest.mark.parametrize(
    ("where", "value"),
    [
        (("poses", 0, "verdicts"), [1]),
        (("display", "links", 0, "low", 1), 10**400),
        (("robot", "name"), "\ud800"),
        (("display", "motions", 0, "placements"), "AAAA"),
        (("display", "motions", 0, "placements"), "no base64!"),
        (("display", "motions"), {"a": 1}),
        (("closest",), 7),
    ],
)
def test_a_damaged_result_is_one_line(contact, where, value):
    document = json.loads(json.dumps(contact))
    parent = document
    for key in where[:-1]:
        parent = parent.setdefault(key, {}) if isinstance(parent, dict) else parent[key]
    if where[0] == "poses":
        document["command"] = "compare"
    parent[where[-1]] = value
    with pytest.raises(BorecheckError, match="damaged or incomplete"):
        page(document)


def test_packed_numbers_are_bounded(monkeypatch):
    packed = display.deflated(np.zeros(1000))
    assert len(display.inflated(packed, "float64")) == 1000
    monkeypatch.setattr(display, "MAX_INFLATED", 100)
    with pytest.raises(ValueError, match="more than a page can hold"):
        display.inflated(packed, "float64")
