#!/usr/bin/env python3
"""Pictures of the pages for `docs/pictures`: three sizes, light and dark.

Needs Chromium and Playwright (extra `dev`); the live view's picture is not made here.
"""

import argparse
import shutil
import sys
import tempfile
import time
from collections.abc import Iterator
from io import BytesIO
from pathlib import Path
from typing import Any

from PIL import Image
from playwright.sync_api import sync_playwright

from borecheck.cli import main as borecheck

PICTURES = Path(__file__).parent.parent / "docs" / "pictures"
SIZES = {"": (1366, 768), "_wide": (1920, 1080), "_phone": (390, 844)}
SCHEMES = {"": "light", "_dark": "dark"}
FLAGS = ("--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader")
# Colours of a picture; more are not seen.
COLOURS = 256
PATIENCE_S = 60.0

PLANS = """name,entry_x,entry_y,entry_z,target_x,target_y,target_z
vertical,0,0,-0.0011,0,0,-0.07
chest_flank,0.16,-0.1039,-0.0064,0.16,-0.08,-0.06
"""
FAULTY = """<robot name="r"><link name="a"/><link name="a"/>
<joint name="j" type="revolute"><parent link="a"/><child link="b"/></joint></robot>
"""
# Pages, and what is scrolled to where it is not the top.
PLACES = {
    "report": ("check", None),
    "report_path": ("check", ".motion"),
    "report_compare": ("compare", None),
    "report_triangles": ("compare", "#alone"),
    "report_route": ("route", None),
    "report_validate": ("validate", None),
}


def main() -> int:
    """Makes them all."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("out", nargs="?", type=Path, default=PICTURES)
    out = parser.parse_args().out
    chromium = shutil.which("chromium")
    if chromium is None:
        print("chromium is not installed: no pictures can be made")
        return 2
    with tempfile.TemporaryDirectory() as folder, sync_playwright() as playwright:
        pages = made(Path(folder))
        browser = playwright.chromium.launch(executable_path=chromium, args=FLAGS)
        for name, picture in taken(browser, pages):
            write(out / f"{name}.png", picture)
        browser.close()
    return 0


def made(folder: Path) -> dict[str, Path]:
    """Pages of a check of two plans, a comparison, a route and a faulty file."""
    plans, faulty = folder / "plans.csv", folder / "faulty.urdf"
    plans.write_text(PLANS)
    faulty.write_text(FAULTY)
    where = ["zerobot", "ct_gantry"]
    asked = {
        "check": [*where, "--plan", str(plans)],
        "compare": [*where, "--plan", str(plans), "--samples", "3"],
        "route": [*where, "--to", f"{plans}:vertical"],
        "validate": [str(faulty)],
    }
    pages = {}
    for command, words in asked.items():
        pages[command] = folder / f"{command}.html"
        borecheck([command, *words, "--report", str(pages[command])])
    return pages


def taken(browser: Any, pages: dict[str, Path]) -> Iterator[tuple[str, bytes]]:
    """Every place of every page at every size, by day and by night."""
    for size, (width, height) in SIZES.items():
        for shade, scheme in SCHEMES.items():
            context = browser.new_context(
                viewport={"width": width, "height": height},
                color_scheme=scheme,
                reduced_motion="reduce",
            )
            page, shown = context.new_page(), ""
            for name, (command, place) in PLACES.items():
                if command != shown:
                    page.goto(pages[command].as_uri())
                    wait(page)
                    shown = command
                if place is not None:
                    page.evaluate(f"document.querySelector('{place}').scrollIntoView()")
                time.sleep(0.3)
                yield f"{name}{size}{shade}", page.screenshot()
            context.close()


def wait(page: Any) -> None:
    """Until the first frame of the 3-D view, if there is one."""
    end = time.monotonic() + PATIENCE_S
    there = "document.documentElement.dataset.firstFrameMs"
    drawn = f"{there} || !document.querySelector('.stage')"
    while not page.evaluate(drawn) and time.monotonic() < end:
        time.sleep(0.05)


def write(path: Path, picture: bytes) -> None:
    """The picture with fewer colours: a third of the bytes."""
    image = Image.open(BytesIO(picture)).convert("RGB").quantize(COLOURS, dither=0)
    path.parent.mkdir(parents=True, exist_ok=True)
    image.save(path, "PNG", optimize=True)


if __name__ == "__main__":
    sys.exit(main())
