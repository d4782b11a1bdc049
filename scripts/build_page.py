#!/usr/bin/env python3
"""Builds the report page's scripts from `web/`, or checks that they are current.

Needs Node.js and npm, which users of borecheck do not: the built scripts are part of
the repository and of the wheel.
"""

import argparse
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).parent.parent
WEB = ROOT / "web"
ASSETS = ROOT / "borecheck" / "report" / "assets"


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument(
        "--check", action="store_true", help="build elsewhere and compare"
    )
    args = parser.parse_args()
    if shutil.which("npm") is None:
        print("npm is not installed: the page's scripts cannot be built")
        return 2
    if not (WEB / "node_modules").is_dir():
        subprocess.run(["npm", "ci", "--no-audit", "--no-fund"], cwd=WEB, check=True)
    if not args.check:
        ASSETS.mkdir(exist_ok=True)
        build(ASSETS)
        return 0
    with tempfile.TemporaryDirectory() as folder:
        build(Path(folder))
        stale = [
            path.name
            for path in sorted(Path(folder).iterdir())
            if not same(path, ASSETS / path.name)
        ]
    for name in stale:
        print(f"{name} is not what web/ builds: run scripts/build_page.py")
    return 1 if stale else 0


def build(out: Path) -> None:
    subprocess.run(["node", "build.mjs", str(out)], cwd=WEB, check=True)


def same(one: Path, other: Path) -> bool:
    return other.is_file() and one.read_bytes() == other.read_bytes()


if __name__ == "__main__":
    sys.exit(main())
