"""From where the MRI arm reaches the head: a map of base places.

For every place of the base around the table, the share of entry points on the vault of
the head that are reachable, off singularity and clear of magnet, table and patient.
Every place is kept in FOLDER when it is done: an interrupted study goes on from there.
"""

import argparse
import json
import sys
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np

from borecheck.commands.progress import Progress
from mri_arm.studies.workspace import NEAREST_BASE, BasePlace, places, study

CELL = 36  # of the map [pixel]

Result = dict[str, Any]

VARIANTS = (("along", 0.0), ("along", 30.0), ("square", 0.0), ("square", 30.0))


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--folder", type=Path, default=Path("study_workspace"))
    parser.add_argument("--entries", type=int, default=60)
    parser.add_argument("--step", type=float, default=0.15, help="of the grid [m]")
    parser.add_argument("--gap", default="0.44", help="of the magnet [m]")
    parser.add_argument("--map", type=Path, help="write the map there (SVG)")
    options = parser.parse_args()
    options.folder.mkdir(parents=True, exist_ok=True)
    results = {(mount, cone): variant(options, mount, cone) for mount, cone in VARIANTS}
    if options.map is not None:
        options.map.write_text(svg(results), encoding="utf-8")
    print(table(options, results))
    return 0


def grid(options: argparse.Namespace) -> list[BasePlace]:
    xs = np.arange(-0.6, 0.91, options.step)
    outwards = np.arange(1.0, 1.46, options.step)
    return places(xs, [*(-outwards[::-1]), *outwards])


def variant(options: argparse.Namespace, mount: str, cone: float) -> list[Result]:
    name = f"{mount}_{cone:g}_{options.entries}_{options.gap}.jsonl"
    file = options.folder / name
    done: dict[tuple[float, float], Result] = {}
    if file.is_file():
        for line in file.read_text().splitlines():
            result = json.loads(line)
            done[result["place"]["x"], result["place"]["y"]] = result
    wanted = grid(options)
    progress = Progress(f"places, {mount}, {cone:g} deg")
    with file.open("a", encoding="utf-8") as stream:
        for number, place in enumerate(wanted, start=1):
            key = (place.x, place.y)
            if key not in done:
                angle = float(np.radians(cone))
                found = study([place], options.entries, angle, mount, gap=options.gap)
                done[key] = asdict(found[0])
                stream.write(json.dumps(done[key]) + "\n")
                stream.flush()
            progress(number, len(wanted))
    return [done[place.x, place.y] for place in wanted]


def table(
    options: argparse.Namespace, results: dict[tuple[str, float], list[Result]]
) -> str:
    lines = [
        f"Made by `python -m studies.workspace --entries {options.entries} "
        f"--step {options.step:g} --gap {options.gap}`.",
        "",
        "| needle | cone [deg] | side | places | best place x, y [m] | reachable | "
        "off singularity | clear | places with any |",
        "|---|---|---|---|---|---|---|---|---|",
    ]
    for (mount, cone), found in results.items():
        for side, sign in (("right (-y)", -1.0), ("left (+y)", 1.0)):
            here = [r for r in found if sign * r["place"]["y"] > 0.0]
            best = max(here, key=lambda r: r["clear"])
            n = best["entries"]
            some = sum(r["clear"] > 0 for r in here)
            shares = " | ".join(
                f"{100 * best[k] / n:.0f} %" for k in ("reachable", "regular", "clear")
            )
            at = f"{best['place']['x']:.2f}, {best['place']['y']:.2f}"
            where = f"{mount} | {cone:g} | {side} | {len(here)} | {at}"
            lines.append(f"| {where} | {shares} | {some} |")
    return "\n".join(lines)


def svg(results: dict[tuple[str, float], list[Result]]) -> str:
    """Four maps side by side, seen from above, the share served as a shade."""
    width, height = 540, 850
    parts = [
        f"<svg xmlns='http://www.w3.org/2000/svg' viewBox='0 0 {4 * width} {height}' "
        "font-family='sans-serif' font-size='15'>",
        f"<rect width='{4 * width}' height='{height}' fill='white'/>",
    ]
    for k, ((mount, cone), found) in enumerate(results.items()):
        parts.append(f"<g transform='translate({k * width + 265},445)'>")
        parts.append(
            f"<text x='-220' y='-415'>needle {mount}, tilt up to {cone:g} deg</text>"
        )
        parts += surroundings()
        parts += [cell(result) for result in found]
        parts.append("</g>")
    return "\n".join([*parts, "</svg>"]) + "\n"


def surroundings() -> list[str]:
    """Poles, table, head, and the 2 mT line; x to the right, y upwards."""
    s = CELL / 0.15
    return [
        f"<circle r='{0.6 * s:.0f}' fill='#eef' stroke='#88a'/>",
        f"<rect x='{-0.2 * s:.0f}' y='{-0.22 * s:.0f}' width='{1.2 * s:.0f}' "
        f"height='{0.44 * s:.0f}' fill='#dde6f0' stroke='#9ab'/>",
        f"<ellipse rx='{0.1125 * s:.0f}' ry='{0.0765 * s:.0f}' fill='#e8c8b4'/>",
        f"<circle r='{NEAREST_BASE * s:.0f}' fill='none' stroke='#c90' "
        "stroke-dasharray='6 4'/>",
        f"<text x='{-0.22 * s:.0f}' y='{0.5 * s:.0f}' fill='#558'>pole</text>",
        f"<text x='{-0.66 * s:.0f}' y='{-0.72 * s:.0f}' fill='#a70'>2 mT</text>",
    ]


def cell(result: Result) -> str:
    s = CELL / 0.15
    share = result["clear"] / result["entries"]
    red, green, blue = (int(255 - k * share) for k in (200, 95, 180))
    shade = f"rgb({red},{green},{blue})"
    x, y = s * result["place"]["x"], -s * result["place"]["y"]
    half = 0.5 * CELL - 1
    return (
        f"<rect x='{x - half:.1f}' y='{y - half:.1f}' width='{2 * half}' "
        f"height='{2 * half}' fill='{shade}' stroke='#999'/>"
        f"<text x='{x:.1f}' y='{y + 5:.1f}' text-anchor='middle'>"
        f"{100 * share:.0f}</text>"
    )


if __name__ == "__main__":
    sys.exit(main())
