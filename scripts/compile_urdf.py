"""Expands the xacro files of robots and scanners into plain URDF beside them.

The plain files are for tools without xacro; borecheck itself reads the xacro. They
name the coarse meshes. With --check nothing is written: the shipped files are
compared with fresh ones.
"""

import argparse
import sys
from collections.abc import Iterator
from pathlib import Path

from lxml import etree
from make_meshes import descriptions

from borecheck.robots.description import Description
from borecheck.robots.urdf.reach import ANYWHERE
from borecheck.robots.urdf.xacro import expand


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("names", nargs="*", help="robots, scanners (default: all)")
    parser.add_argument("--check", action="store_true", help="compare, write nothing")
    options = parser.parse_args()
    stale = 0
    for description in descriptions(options.names):
        for path, text in compiled(description):
            if not options.check:
                path.write_text(text, encoding="utf-8")
                print(path)
            elif not path.is_file() or path.read_text(encoding="utf-8") != text:
                print(f"{path}: differs from its xacro", file=sys.stderr)
                stale += 1
    return 1 if stale else 0


def compiled(description: Description) -> Iterator[tuple[Path, str]]:
    """Path and text of the plain URDF, and of one for each other mount."""
    defaults = {name: a.default for name, a in description.arguments.items()}
    stem = description.xacro.name.removesuffix(".urdf.xacro")
    folder = description.xacro.parent
    yield folder / f"{stem}.urdf", plain(description.xacro, defaults)
    if "mount" in description.arguments:
        mount = description.arguments["mount"]
        for choice in mount.choices:
            if choice != mount.default:
                text = plain(description.xacro, {**defaults, "mount": choice})
                yield folder / f"{stem}_mount{choice}.urdf", text


def plain(path: Path, arguments: dict[str, str]) -> str:
    """URDF text without comments, but for one that says where it comes from."""
    parser = etree.XMLParser(remove_comments=True, remove_blank_text=True)
    robot = etree.fromstring(expand(path, arguments, ANYWHERE).text.encode(), parser)
    given = " ".join(f"{name}:={value}" for name, value in arguments.items())
    robot.insert(0, etree.Comment(f" made from {path.name} {given} "))
    etree.indent(robot, "  ")
    return '<?xml version="1.0"?>\n' + etree.tostring(robot, encoding="unicode") + "\n"


if __name__ == "__main__":
    sys.exit(main())
