"""Small inputs that were once judged wrong: what comes out of each today.

    python -m studies.cases [FOLDER] [--only NAME]

A line per command: the case, and what is right or wrong about what came out. What must
come out stands in `tests/data/cases/cases.toml`, the inputs beside it (or in FOLDER).
"""

import argparse
import re
import shutil
import subprocess
import sys
import tempfile
import tomllib
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from typing import Any

CASES = Path(__file__).resolve().parents[1] / "tests" / "data" / "cases"
TIMEOUT_S = 900.0


@dataclass(frozen=True)
class Answer:
    """What one command did.

    Attributes:
        status: Its exit status.
        text: Both streams.
        folder: Where it ran.
    """

    status: int
    text: str
    folder: Path


def rows(folder: Path = CASES) -> list[dict[str, Any]]:
    """All expectations, one a command: `each` is spread over its files."""
    listed = tomllib.loads((CASES / "cases.toml").read_text("utf-8"))["case"]
    return [row for case in listed for row in _spread(case, folder)]


def _spread(case: dict[str, Any], folder: Path) -> Iterator[dict[str, Any]]:
    if "each" not in case:
        yield case | {"label": case["name"], "file": ""}
        return
    for file in sorted((folder / case["name"]).glob(case["each"])):
        if file.name not in case.get("skip", ()):
            label = f"{case['name']}/{file.name}"
            run = case.get("run", "").replace("FILE", file.name)
            yield case | {"label": label, "file": file.name, "run": run}


def problems(row: dict[str, Any], folder: Path = CASES) -> list[str]:
    """Runs one row in a copy of its folder; what is not as it must be."""
    with tempfile.TemporaryDirectory() as copy:
        shutil.copy(folder / "box.stl", copy)
        place = Path(shutil.copytree(folder / row["name"], Path(copy) / row["name"]))
        if "agree" in row:
            return _disagreement(row, place)
        return list(_wrong(row, _run(row["run"], place)))


def _run(words: str, folder: Path) -> Answer:
    command = [sys.executable, "-m", "borecheck", *words.split()]
    done = subprocess.run(
        command,
        cwd=folder,
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        timeout=TIMEOUT_S,
    )
    return Answer(done.returncode, done.stdout.decode("utf-8", "replace"), folder)


def _wrong(row: dict[str, Any], answer: Answer) -> Iterator[str]:
    first = next(iter(answer.text.splitlines()), "")
    if answer.status not in row["status"]:
        yield f"status {answer.status}, not {row['status']}: {first}"
    if "has" in row and not re.search(row["has"], answer.text):
        yield f"does not say /{row['has']}/: {first}"
    if "lacks" in row and re.search(row["lacks"], answer.text):
        yield f"says /{row['lacks']}/"
    if "unwritten" in row and (answer.folder / row["unwritten"]).exists():
        yield f"wrote {row['unwritten']}"


def _disagreement(row: dict[str, Any], folder: Path) -> list[str]:
    judged = _run(f"validate --profile collision {row['file']}", folder).status
    checked = _run(f"check {row['file']} {row['agree']}", folder)
    refused = "borecheck: error" in checked.text
    if refused == (judged != 0):
        return []
    return [f"validate ends with {judged}, check with {checked.status}"]


def main() -> int:
    """Prints the table; 0 if every row is right."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folder", nargs="?", type=Path, default=CASES)
    parser.add_argument("--only", default="", metavar="NAME")
    args = parser.parse_args()
    chosen = [row for row in rows(args.folder) if row["name"].startswith(args.only)]
    with ThreadPoolExecutor(2) as pool:
        answers = pool.map(lambda row: problems(row, args.folder), chosen)
        wrong = 0
        for row, found in zip(chosen, answers, strict=True):
            wrong += bool(found)
            said = f"WRONG: {'; '.join(found)}" if found else f"right: {row['right']}"
            print(f"{row['label']:42} {said}", flush=True)
    print(f"{len(chosen)} commands, {len(chosen) - wrong} right, {wrong} wrong")
    return int(wrong > 0)


if __name__ == "__main__":
    sys.exit(main())
