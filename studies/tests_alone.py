"""Does every test file pass in a process of its own?

    python -m studies.tests_alone [FILE ...] [--state FILE] [--again]

A file that stands only on what another one imported or left behind fails here. What
passed is kept in the state file with a hash of the tree, so that an interrupted run
goes on; a change of any Python file begins anew. One line at the end; what fails is
named.
"""

import argparse
import json
import subprocess
import sys
from collections.abc import Iterable
from hashlib import sha256
from pathlib import Path

PROJECT = Path(__file__).resolve().parents[1]
STATE = PROJECT / "build" / "tests_alone.json"
CODE = (
    *("borecheck", "borecheck_models", "zerobot", "mri_arm", "crane", "studies"),
    "tests",
)
NO_TESTS = 5  # pytest's exit status where every test is left out on this machine


def test_files() -> list[str]:
    """All test files, by their path from the project."""
    found = (PROJECT / "tests").rglob("test_*.py")
    return sorted(file.relative_to(PROJECT).as_posix() for file in found)


def tree_hash() -> str:
    """Of all Python code that tests stand on."""
    digest = sha256()
    for folder in CODE:
        for file in sorted((PROJECT / folder).rglob("*.py")):
            digest.update(str(file.relative_to(PROJECT)).encode())
            digest.update(file.read_bytes())
    return digest.hexdigest()


def passed_before(state: Path, tree: str) -> set[str]:
    """Files that passed with this very tree."""
    try:
        known = json.loads(state.read_text("utf-8"))
    except (OSError, ValueError):
        return set()
    return set(known["passed"]) if known.get("tree") == tree else set()


def failure(file: str) -> str:
    """The last line of pytest about one file alone; empty if it passed."""
    words = [sys.executable, "-m", "pytest", "-q", "-n", "0", file]
    done = subprocess.run(words, cwd=PROJECT, capture_output=True, text=True)
    if done.returncode in (0, NO_TESTS):
        return ""
    lines = done.stdout.splitlines() or done.stderr.splitlines()
    return lines[-1] if lines else f"status {done.returncode}"


def run(files: Iterable[str], state: Path, tree: str, known: set[str]) -> list[str]:
    """The failures, one line each; what passes is kept as it passes."""
    failures = []
    for file in files:
        if file in known:
            continue
        problem = failure(file)
        if problem:
            failures.append(f"{file}: {problem}")
            continue
        known.add(file)
        state.parent.mkdir(parents=True, exist_ok=True)
        content = json.dumps({"tree": tree, "passed": sorted(known)}, indent=1)
        state.write_text(content, "utf-8")
    return failures


def main() -> int:
    """Runs what has not passed yet; 1 if a file fails."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("files", nargs="*", metavar="FILE", help="default: all")
    parser.add_argument("--state", type=Path, default=STATE)
    parser.add_argument("--again", action="store_true", help="forget what passed")
    options = parser.parse_args()
    files, tree = options.files or test_files(), tree_hash()
    known = set() if options.again else passed_before(options.state, tree)
    failures = run(files, options.state, tree, known)
    for line in failures:
        print(line)
    print(f"{len(files)} test files, each alone: {len(failures)} fail")
    return 1 if failures else 0


if __name__ == "__main__":
    sys.exit(main())
