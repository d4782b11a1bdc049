"""Runs the command behind every claim and writes docs/evidence.md with what it printed.

    python scripts/make_evidence.py [--only 2.4 --only 3.6] [--list]

Each row of evidence.toml names the claim, the command and how many lines of its output
to keep. A row that is not run keeps what stood there before.
"""

import argparse
import os
import platform
import re
import subprocess
import sys
import time
import tomllib
from datetime import date
from pathlib import Path

PROJECT = Path(__file__).resolve().parents[1]
PAGE = PROJECT / "docs" / "evidence.md"

HEAD = """# Evidence

One command for every claim, and what it printed. Written by
`python scripts/make_evidence.py`; the claims stand in `scripts/evidence.toml`. Run them
from the project's folder with its virtual environment active.
"""


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--only", action="append", default=[], metavar="ITEM")
    parser.add_argument("--list", action="store_true")
    args = parser.parse_args()
    rows = tomllib.loads((PROJECT / "scripts" / "evidence.toml").read_text())["claim"]
    if args.list:
        print("\n".join(f"{row['item']}: {row['command']}" for row in rows))
        return 0
    before = _sections(PAGE.read_text()) if PAGE.exists() else {}
    sections = []
    for row in rows:
        if args.only and row["item"] not in args.only:
            sections.append(before.get(row["item"], _not_run(row)))
        else:
            sections.append(_section(row))
            before[row["item"]] = sections[-1]
    PAGE.write_text(HEAD + "".join(sections))
    return 0


def _sections(text: str) -> dict[str, str]:
    # What a command printed may have headings too; a claim's begins with its number.
    parts = re.split(r"(?=^## \d+\.\d)", text, flags=re.MULTILINE)[1:]
    return {part.split()[1]: part for part in parts}


def _not_run(row: dict) -> str:
    command = f"```\n$ {row['command']}\n```"
    return f"\n## {row['item']} {row['claim']}\n\n{command}\n\nNot run yet.\n"


def _section(row: dict) -> str:
    print(f"{row['item']}: {row['command']}", file=sys.stderr, flush=True)
    start = time.monotonic()
    environment = dict(os.environ, COLUMNS="100", NO_COLOR="1")
    bin_folder = str(Path(sys.executable).parent)
    environment["PATH"] = bin_folder + os.pathsep + environment["PATH"]
    done = subprocess.run(
        ["bash", "-c", row["command"]],
        cwd=PROJECT,
        env=environment,
        capture_output=True,
        text=True,
        timeout=row.get("timeout_s", 1800),
    )
    seconds = time.monotonic() - start
    lines = (done.stdout if done.stdout.strip() else done.stderr).splitlines()
    keep = row.get("lines", 20)
    shown = lines[-keep:] if row.get("tail", False) else lines[:keep]
    more = f"\n... ({len(lines) - keep} more lines)" if len(lines) > keep else ""
    where = f"{date.today().isoformat()}, {_processor()}"
    return (
        f"\n## {row['item']} {row['claim']}\n\n"
        f"```\n$ {row['command']}\n" + "\n".join(shown) + f"{more}\n```\n\n"
        f"Exit status {done.returncode}, {seconds:.0f} s, {where}.\n"
    )


def _processor() -> str:
    for line in Path("/proc/cpuinfo").read_text().splitlines():
        if line.startswith("model name"):
            return f"{line.partition(':')[2].strip()}, {os.cpu_count()} cores"
    return platform.processor() or platform.machine()


if __name__ == "__main__":
    sys.exit(main())
