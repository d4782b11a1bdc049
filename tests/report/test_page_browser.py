"""The report page in a real browser: headless Chromium, WebGL by software."""

import json
import re
import shutil
import time
from io import BytesIO
from pathlib import Path

import numpy as np
import pytest
from matplotlib.image import imread

from borecheck.cli import main

sync_api = pytest.importorskip("playwright.sync_api", reason="playwright is missing")

CHROMIUM = shutil.which("chromium")
pytestmark = pytest.mark.skipif(CHROMIUM is None, reason="chromium is not installed")

ROBOT = "zerobot"
HOSTILE = "<img src=x onerror=alert(1)></script><b>"
PLANS = (
    "name,entry_x,entry_y,entry_z,target_x,target_y,target_z\n"
    "vertical,0,0,-0.0011,0,0,-0.07\n"
    "chest_flank,0.16,-0.1039,-0.0064,0.16,-0.08,-0.06\n"
)
FLAGS = [
    "--no-sandbox",
    "--disable-quic",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
    "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader",
    "--ignore-gpu-blocklist",
]
# Share of the picture's pixels that robot and scanner cover at least, in any view.
COVERED = 0.1
# Seconds until something must have happened; a machine under load is slow.
PATIENCE = 30.0


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Pages of a check of two plans, of a comparison, and one with hostile names."""
    folder = tmp_path_factory.mktemp("pages")
    plans = folder / "plans.csv"
    plans.write_text(PLANS)
    words = ["check", ROBOT, "ct_gantry", "--plan", str(plans), "--samples", "5"]
    out = folder / "check.json"
    status = main(
        [*words, "--no-certificate", "--out", str(out), "--format", "json"]
        + ["--report", str(folder / "check.html")]
    )
    assert status == 1
    page = ["--report", str(folder / "compare.html"), "--format", "json"]
    poses = ["--plan", str(plans), "--samples", "2"]
    main(["compare", ROBOT, "ct_gantry", *poses, *page])
    text = out.read_text().replace('"holder"', json.dumps(HOSTILE))
    hostile = folder / "hostile.json"
    hostile.write_text(text.replace('"chest_flank"', json.dumps(HOSTILE)))
    main(["report", str(hostile), str(folder / "hostile.html")])
    return folder


@pytest.fixture(scope="module")
def browser():
    with sync_api.sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=CHROMIUM, args=FLAGS)
        yield browser
        browser.close()


class Opened:
    """A page with what it said and asked for."""

    def __init__(self, browser, path, **settings):
        settings.setdefault("viewport", {"width": 1000, "height": 800})
        self.context = browser.new_context(reduced_motion="reduce", **settings)
        self.page = self.context.new_page()
        self.complaints, self.requests = [], []
        self.page.on("console", lambda m: self.complaints.append(m.text))
        self.page.on("pageerror", lambda e: self.complaints.append(str(e)))
        self.page.on("dialog", lambda d: self.complaints.append("dialog"))
        self.page.on("request", lambda r: self.requests.append(r.url))
        self.page.goto(path.as_uri())

    def ready(self):
        self.until("document.documentElement.dataset.firstFrameMs")
        return self

    def until(self, expression):
        """Waits; the page's policy forbids Playwright's own way, which uses eval."""
        end = time.monotonic() + PATIENCE
        while not self.page.evaluate(expression):
            assert time.monotonic() < end, f"never true: {expression}"
            time.sleep(0.02)

    def picture(self):
        """The 3-D view's pixels, (h, w, 3), after it was drawn again."""
        before = self.page.evaluate("borecheckView.panes.frames")
        self.page.evaluate("borecheckView.panes.draw()")
        self.until(f"borecheckView.panes.frames > {before}")
        data = self.page.locator("#canvas-holder canvas").screenshot()
        return imread(BytesIO(data), format="png")[..., :3]

    def eye(self, pane="cut"):
        named = f"borecheckView.panes.named.{pane}.eye.camera.position.toArray()"
        return np.array(self.page.evaluate(named))

    def chips(self):
        """What the labels over the panes say, in the panes' order."""
        return self.page.locator(".marks .chip text").all_text_contents()

    def needle(self):
        """Placement of the needle in the view, 16 numbers."""
        return np.array(
            self.page.evaluate(
                "borecheckView.stage.parts.find(p => p.name == 'needle')"
                ".mesh.matrix.toArray()"
            )
        )


@pytest.fixture(scope="module")
def opened(browser, folder):
    found = Opened(browser, folder / "check.html").ready()
    yield found
    found.context.close()


@pytest.fixture
def check(opened):
    """The page of the check as it is when it has just been opened."""
    page = opened.page
    page.evaluate("borecheckView.show(borecheckView.worstMotion(), null)")
    page.evaluate("document.querySelector('details.more').open = true")
    page.locator("#cut").check()
    page.locator('button[data-view="cut"]').click()
    page.locator('button[data-view="four"]').click()
    page.evaluate("borecheckView.frameAll(false)")
    return opened


def covered(picture):
    background = picture[2, 2]
    return float((np.abs(picture - background).max(axis=2) > 0.05).mean())


def difference(a, b):
    return float((np.abs(a - b).max(axis=2) > 0.05).mean())


def test_webgl_draws_robot_and_scanner(check):
    assert covered(check.picture()) > COVERED


def test_it_opens_with_four_panes_cut_open_that_say_the_verdict(browser, folder):
    size = {"width": 1366, "height": 768}
    opened = Opened(browser, folder / "check.html", viewport=size).ready()
    page = opened.page
    names = page.locator(".pane-name").all_text_contents()
    assert names == ["Cut open", "Along the bore", "From the side", "Narrowest place"]
    assert page.locator("#cut").is_checked()
    assert opened.chips() == ["contact: holder – gantry"] * 4
    assert page.locator(".marks .chip.contact .shape").count() == 4
    for name in ("#play", "#slider", "#instant"):  # without scrolling
        box = page.locator(name).bounding_box()
        assert box["y"] + box["height"] < size["height"]
    opened.context.close()


def test_lines_are_two_pixels_wide_and_part_from_what_is_behind(check):
    widths = check.page.evaluate(
        "[...document.querySelectorAll('.marks line.plan, .marks .halo')]"
        ".map(e => [e.classList[0], parseFloat(getComputedStyle(e).strokeWidth)])"
    )
    assert {kind for kind, _ in widths} == {"plan", "halo"}
    assert all(wide >= 2.0 for _, wide in widths)
    assert min(w for k, w in widths if k == "halo") > max(
        w for k, w in widths if k == "plan"
    )


def test_a_click_enlarges_a_pane_and_a_drag_turns_it(check):
    page = check.page
    window = page.locator('[data-pane="side"] .window')
    before, box = check.eye("side"), window.bounding_box()
    page.mouse.move(box["x"] + 60, box["y"] + 60)
    page.mouse.down()
    page.mouse.move(box["x"] + 120, box["y"] + 60, steps=3)
    page.mouse.up()
    assert np.linalg.norm(check.eye("side") - before) > 0.05
    assert page.locator(".pane.is-large").count() == 0
    window.click(position={"x": 60, "y": 60})
    assert page.locator(".pane.is-large").get_attribute("data-pane") == "side"
    assert window.bounding_box()["width"] > 1.3 * box["width"]
    page.keyboard.press("Escape")
    assert page.locator(".pane.is-large").count() == 0
    page.keyboard.press("Enter")
    assert page.locator(".pane.is-large").count() == 1


def test_the_wheel_scrolls_the_page_unless_a_pane_was_chosen(check):
    page = check.page
    page.evaluate("scrollTo(0, 0); document.activeElement.blur()")
    box = page.locator('[data-pane="cut"] .window').bounding_box()
    page.mouse.move(box["x"] + 40, box["y"] + 40)
    before = check.eye()
    page.mouse.wheel(0, 200)
    check.until("scrollY > 100")
    np.testing.assert_allclose(check.eye(), before)
    page.evaluate("scrollTo(0, 0)")
    page.locator('[data-pane="cut"] .window').focus()
    page.mouse.wheel(0, 200)
    check.until("borecheckView.panes.named.cut.eye.camera.position.length() > 0")
    end = time.monotonic() + PATIENCE
    while np.allclose(check.eye(), before) and time.monotonic() < end:
        time.sleep(0.02)
    assert not np.allclose(check.eye(), before)
    assert page.evaluate("scrollY") == 0


def test_the_pointer_names_what_it_is_on(check):
    page = check.page
    page.locator("#canvas-holder").scroll_into_view_if_needed()
    box = page.locator('[data-pane="narrow"] .window').bounding_box()
    page.mouse.move(box["x"] + box["width"] / 2, box["y"] + box["height"] / 2)
    page.mouse.move(box["x"] + box["width"] / 2 + 3, box["y"] + box["height"] / 2 + 9)
    check.until("!document.getElementById('hover').hidden")
    names = page.evaluate("borecheckView.stage.parts.map(p => p.name)")
    assert page.locator("#hover").inner_text().split(" (")[0] in names
    page.mouse.move(2, 2)


def test_a_sample_is_green_only_where_the_motion_around_it_is_proven(browser, folder):
    """Clear samples of a motion that is not certified are not told to be clear."""
    result = json.loads((folder / "check.json").read_text())
    plan = next(p for p in result["plans"] if p["name"] == "vertical")
    plan["path"]["intervals"] = [{"from": 0.0, "to": 1.0, "verdict": "unknown"}]
    plan["verdict"], result["plans"] = "unknown", [plan]
    result["display"]["motions"] = result["display"]["motions"][:1]
    changed = folder / "uncertified.json"
    changed.write_text(json.dumps(result))
    main(["report", str(changed), str(folder / "uncertified.html")])
    opened = Opened(browser, folder / "uncertified.html").ready()
    assert opened.page.locator(".marks .chip.unknown").count() == 4
    assert opened.page.locator(".marks .chip.clear").count() == 0
    opened.context.close()


def test_a_single_pose_has_nothing_to_play(browser, folder, tmp_path):
    page = tmp_path / "pose.html"
    words = ["check", ROBOT, "ct_gantry", "--q", "home", "--format", "json"]
    assert main([*words, "--report", str(page)]) == 0
    opened = Opened(browser, page).ready()
    for name in ("#play", "#slider"):
        assert not opened.page.locator(name).is_visible()
    assert opened.page.locator("#instant").inner_text().startswith("clear: ")
    assert opened.complaints == []
    opened.context.close()


def test_it_opens_at_the_plan_in_contact_and_lights_its_triangles(check):
    page = check.page
    assert page.locator("#motion").evaluate("e => e.value") == "1"
    assert "contact" in page.locator("#instant").inner_text()
    assert page.evaluate("borecheckView.stage.marks.children.length") > 0
    before = check.picture()
    page.locator("#show-contacts").uncheck()
    after = check.picture()
    assert check.chips() == []
    page.locator("#show-contacts").check()
    assert difference(before, after) > 0.0


def test_slider_moves_the_robot(check):
    page = check.page
    page.locator("#motion").select_option("0")
    page.locator("#slider").fill("0")
    before, picture = check.needle(), check.picture()
    page.locator("#slider").fill("4")
    assert np.abs(check.needle() - before).max() > 0.01
    assert difference(picture, check.picture()) > 0.001
    assert "sample 5 of 5" in page.locator("#instant").inner_text()


def test_placements_are_those_of_the_result(check, folder):
    import borecheck as bc

    result = json.loads((folder / "check.json").read_text())
    robot = bc.load_robot(ROBOT)
    pose = result["plans"][0]["path"]["poses"][2]
    check.page.locator("#motion").select_option("0")
    check.page.locator("#slider").fill("2")
    shown = check.needle().reshape(4, 4).T
    placed = robot.placements(robot.model.configuration(pose["q"]))["needle"]
    np.testing.assert_allclose(shown, placed, atol=1e-6)


def test_play_runs_to_the_end(check):
    page = check.page
    page.locator("#slider").fill("0")
    page.locator("#play").click()
    check.until("borecheckView.pose == 4")
    check.until("document.getElementById('play').textContent == 'Play'")


def test_section_plane_cuts(check):
    page = check.page
    cut = check.picture()
    page.locator("#cut").uncheck()
    whole = check.picture()
    assert difference(cut, whole) > 0.05
    page.locator('button[data-view="side"]').click()
    assert not page.locator("#cut").is_checked()  # a view leaves it as it is
    page.locator("#cut").check()
    page.locator('button[data-view="four"]').click()
    page.locator("#cut-at").fill("0.3")
    assert difference(cut, check.picture()) > 0.01
    page.locator("#cut-at").fill("0")


def test_named_views_differ(check):
    eyes = []
    for name in ("cut", "side", "bore", "narrow", "top", "operator"):
        check.page.locator(f'button[data-view="{name}"]').click()
        eyes.append(check.eye(name if name in ("side", "bore", "narrow") else "cut"))
        assert covered(check.picture()) > COVERED
    gaps = [np.linalg.norm(a - b) for k, a in enumerate(eyes) for b in eyes[:k]]
    assert min(gaps) > 0.3


def test_opacity_and_parts(check):
    page = check.page
    before = check.picture()
    page.locator("#opacity").fill("0.2")
    assert difference(before, check.picture()) > 0.05
    page.locator("#opacity").fill("1")
    box = page.locator("#parts label", has_text="gantry").locator("input")
    box.uncheck()
    assert difference(before, check.picture()) > 0.05
    box.check()


def test_frames_appear(check):
    before = check.picture()
    check.page.locator("#show-frames").check()
    after = check.picture()
    check.page.locator("#show-frames").uncheck()
    assert difference(before, after) > 0.0


def test_click_on_a_row_flies_to_the_pair(check):
    page = check.page
    page.locator("#motion").select_option("0")
    before = check.eye("narrow")
    page.locator('tr[data-fly="lit"] button').first.click()
    assert page.locator("tr.chosen").count() == 1
    assert np.linalg.norm(check.eye("narrow") - before) > 0.1
    target = np.array(
        page.evaluate("borecheckView.panes.named.narrow.eye.controls.target.toArray()")
    )
    lit = page.evaluate("borecheckView.pairs().slice(0, 18)")
    corners = np.array(lit).reshape(6, 3)
    assert (target >= corners.min(axis=0) - 1e-6).all()
    assert (target <= corners.max(axis=0) + 1e-6).all()


def test_click_on_a_plot_moves_robot_and_cursor(check):
    page = check.page
    plot = page.locator('svg[data-plot="0"]')
    plot.scroll_into_view_if_needed()
    box = plot.bounding_box()
    plot.click(position={"x": 0.645 * box["width"], "y": 0.4 * box["height"]})
    assert page.evaluate("[borecheckView.motion, borecheckView.pose]") == [0, 3]
    cursor = plot.locator(".cursor")
    assert float(cursor.get_attribute("x1")) == pytest.approx(58 + 0.75 * 574)


def test_tables_sort(check):
    page = check.page
    head = page.locator("table.sortable").first.locator("thead button").nth(2)
    cells = page.locator("table.sortable").first.locator("tbody td:nth-child(3)")

    def values():
        return [float(cell.get_attribute("data-value")) for cell in cells.all()]

    head.click()
    assert values() == sorted(values())
    head.click()
    assert values() == sorted(values(), reverse=True)
    assert len(set(values())) > 1


def test_plans_are_filtered_by_verdict_and_by_words(check):
    page = check.page
    rows = page.locator("#plans-table tbody tr:visible")
    assert rows.count() == 2
    box = page.locator('.filters input[data-verdict="contact"]')
    box.uncheck()
    assert rows.all_text_contents()[0].startswith("vertical")
    assert rows.count() == 1
    box.check()
    page.locator("[data-words]").fill("FLANK")
    assert rows.count() == 1
    assert page.locator("[data-count]").inner_text() == "1 of 2 listed"
    page.locator("[data-words]").fill("")
    assert rows.count() == 2


def test_the_pointer_reads_a_plot(check):
    plot = check.page.locator('svg[data-plot="0"]')
    plot.scroll_into_view_if_needed()
    box = plot.bounding_box()
    plot.hover(position={"x": 0.645 * box["width"], "y": 0.4 * box["height"]})
    value = plot.locator(".value").text_content()
    assert re.fullmatch(r"75\.0 %: [\d.]+ mm", value)


def test_keys_turn_the_view(check):
    page = check.page
    page.locator('[data-pane="cut"] .window').focus()
    before = check.eye()
    page.keyboard.press("ArrowRight")
    turned = check.eye()
    assert np.linalg.norm(turned - before) > 0.05
    page.keyboard.press("+")
    assert np.linalg.norm(check.eye() - turned) > 0.05
    page.keyboard.press("Home")
    np.testing.assert_allclose(check.eye(), before, atol=1e-9)


def test_no_complaint_and_no_request_but_the_page(opened):
    assert opened.complaints == []
    assert len(opened.requests) == 1
    assert opened.requests[0].startswith("file://")


def test_comparison_shows_the_two_triangles_alone(browser, folder):
    found = Opened(browser, folder / "compare.html").ready()
    page = found.page
    page.locator('tr[data-fly="dispute"] button').first.click()
    page.locator("#only-pair").check()
    assert page.evaluate("borecheckView.stage.robot.visible") is False
    assert page.evaluate("borecheckView.pairs().length") == 18
    assert covered(found.picture()) > 0.0
    assert found.complaints == []
    found.context.close()


def test_hostile_names_stay_text(browser, folder):
    found = Opened(browser, folder / "hostile.html").ready()
    page = found.page
    assert page.locator("img, main b").count() == 0
    assert HOSTILE in page.locator("#parts").inner_text() or HOSTILE in (
        page.locator("#parts").text_content()
    )
    assert page.locator(f"text={HOSTILE}").count() > 0
    assert found.complaints == []
    assert len(found.requests) == 1
    found.context.close()


@pytest.mark.parametrize(
    ("name", "scheme"), [("check", "light"), ("check", "dark"), ("compare", "light")]
)
def test_axe_finds_no_serious_fault(browser, folder, name, scheme):
    axe = pytest.importorskip("axe_playwright_python", reason="axe is missing")
    script = (Path(axe.__file__).parent / "axe.min.js").read_text()
    settings = {"color_scheme": scheme, "bypass_csp": True}
    found = Opened(browser, folder / f"{name}.html", **settings).ready()
    found.page.evaluate(script)
    result = found.page.evaluate("axe.run()")
    serious = [
        (v["id"], [node["html"][:200] for node in v["nodes"]][:3])
        for v in result["violations"]
        if v["impact"] in ("serious", "critical")
    ]
    assert len(result["passes"]) > 10
    assert serious == []
    found.context.close()


def test_without_scripts_verdict_tables_and_pictures_are_there(browser, folder):
    found = Opened(browser, folder / "check.html", java_script_enabled=False)
    page = found.page
    assert page.locator("h1").inner_text() == "Contact"
    assert page.locator(".still:visible").count() >= 3
    assert page.locator("table:visible").count() > 0
    assert page.locator("#view:visible").count() == 0
    data = page.locator(".still").first.screenshot()
    assert covered(imread(BytesIO(data), format="png")[..., :3]) > COVERED
    found.context.close()


def test_without_webgl_the_pictures_stand_in(browser, folder):
    flags = ["--no-sandbox", "--disable-background-networking", "--disable-3d-apis"]
    bare = browser.browser_type.launch(executable_path=CHROMIUM, args=flags)
    found = Opened(bare, folder / "check.html")
    found.until("document.documentElement.classList.contains('no-gl')")
    assert "No 3-D view" in found.page.locator("#view-note").inner_text()
    assert found.page.locator(".still:visible").count() >= 3
    bare.close()


def test_phone_does_not_scroll_sideways(browser, folder):
    size = {"width": 390, "height": 800}
    found = Opened(browser, folder / "check.html", viewport=size, is_mobile=True)
    found.ready()
    assert found.page.evaluate("document.documentElement.scrollWidth") <= 390
    # nor where the robot lies deep in folders: paths are words without a gap
    found.page.evaluate(
        "document.querySelectorAll('main p, main li, footer p')"
        ".forEach(e => e.append(' /' + 'folder_'.repeat(20)))"
    )
    assert found.page.evaluate("document.documentElement.scrollWidth") <= 390
    found.context.close()


def test_prints_on_a4_with_pictures(opened):
    data = opened.page.pdf(prefer_css_page_size=True)
    boxes = re.findall(rb"/MediaBox\s*\[([^\]]*)\]", data)
    width, height = (float(v) for v in boxes[0].split()[2:])
    # A4 is 595.28 by 841.89 points
    assert abs(width - 595.28) < 1.0
    assert abs(height - 841.89) < 1.0
    assert data.count(b"/Subtype /Image") >= 3
