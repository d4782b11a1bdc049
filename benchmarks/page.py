"""The report page and the live view at each level: size, first frame, answer rate.

    python -m benchmarks.page

Needs the extras dev and view, and Chromium; WebGL is done by software, so a first frame
on a desk is quicker.
"""

import shutil
import sys
import tempfile
import time
from pathlib import Path

import borecheck as bc
from borecheck.cli import main as borecheck
from borecheck.view.session import Session, first_plan

PLANS = Path(__file__).parents[1] / "urdf" / "zerobot" / "examples" / "plans.csv"
FLAGS = ["--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"]
GLANCES = 100


def main() -> int:
    print(
        f"{'level':8}{'page':>9}{'first frame':>13}{'answers/s':>11}{'full check':>12}"
    )
    with tempfile.TemporaryDirectory() as folder:
        for level in ("coarse", "middle", "fine"):
            page = Path(folder) / f"{level}.html"
            words = ["check", "zerobot", "ct_gantry", "--plan", str(PLANS)]
            options = ["--level", level, "--report", str(page), "--format", "json"]
            _quiet([*words, *options, "--samples", "21"])
            rate, check_s = _live(level)
            print(
                f"{level:8}{page.stat().st_size / 1e6:>6.2f} MB"
                f"{_first_frame(page):>13}{rate:>11.0f}{1e3 * check_s:>9.0f} ms"
            )
    return 0


def _quiet(words: list[str]) -> None:
    from contextlib import redirect_stdout
    from io import StringIO

    with redirect_stdout(StringIO()):
        borecheck(words)


def _live(level: str) -> tuple[float, float]:
    """Answers a second while dragging, and seconds of the full check at rest."""
    robot = bc.load_robot("zerobot", level=level)
    scene = bc.load_scene("ct_gantry", level=level)
    session = Session(robot, scene, first_plan(robot, scene))
    motion = session.motion()
    poses = [session.at(motion, k / GLANCES) for k in range(GLANCES)]
    session.glance(poses[0], motion.corridor)
    session.judge(poses[0], motion.corridor)
    start = time.perf_counter()
    for q in poses:
        session.glance(q, motion.corridor)
    rate = GLANCES / (time.perf_counter() - start)
    start = time.perf_counter()
    session.judge(poses[GLANCES // 2], motion.corridor)
    return rate, time.perf_counter() - start


def _first_frame(page: Path) -> str:
    """Time from opening the file to the first picture, as the page measures it."""
    chromium = shutil.which("chromium")
    if chromium is None:
        return "no chromium"
    from playwright.sync_api import sync_playwright

    with sync_playwright() as play:
        browser = play.chromium.launch(executable_path=chromium, args=FLAGS)
        opened = browser.new_page()
        opened.goto(page.as_uri())
        found = None
        end = time.monotonic() + 60.0
        while found is None and time.monotonic() < end:
            found = opened.evaluate(
                "document.documentElement.dataset.firstFrameMs || null"
            )
            time.sleep(0.05)
        browser.close()
    return "none in 60 s" if found is None else f"{int(found)} ms"


if __name__ == "__main__":
    sys.exit(main())
