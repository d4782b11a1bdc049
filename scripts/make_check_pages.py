"""Writes docs/checks: a page for each check of validate, from its docstring.

python scripts/make_check_pages.py           writes the pages
python scripts/make_check_pages.py --check   only says whether they are up to date
"""

import sys
from pathlib import Path

from borecheck.validation.catalogue import all_checks
from borecheck.validation.registry import TIERS, Check

FOLDER = Path(__file__).resolve().parents[1] / "docs" / "checks"


def page(check: Check) -> str:
    """The page of one check."""
    levels = " | ".join(str(level) for level in check.levels.values())
    lines = [
        f"# {check.code} {check.name}",
        "",
        check.title,
        "",
        "| " + " | ".join(check.levels) + " |",
        "|---|---|---|",
        f"| {levels} |",
    ]
    for heading, text in (
        ("Why it matters", check.why),
        ("How to fix it", check.fix),
    ):
        if text:
            lines += ["", f"## {heading}", "", text]
    if check.libraries:
        lines += ["", "## Libraries that behave differently", ""]
        lines += [f"- {library}" for library in check.libraries]
    corpus = f"tests/data/urdf/{check.code}-{check.name}"
    if (FOLDER.parents[1] / corpus).is_dir():
        lines += ["", f"Examples, defective and sound: `{corpus}`."]
    return "\n".join(lines) + "\n"


def index() -> str:
    """The list of all checks."""
    checks = all_checks()
    lines = [
        "# Checks of `borecheck validate`",
        "",
        f"{len(checks)} checks; severity in kinematics, collision, dynamics.",
    ]
    for tier in TIERS:
        lines += [
            "",
            f"## {tier.capitalize()}",
            "",
            "| code | name | severity | what |",
        ]
        lines.append("|---|---|---|---|")
        for check in checks:
            if check.tier == tier:
                levels = ", ".join(str(level) for level in check.levels.values())
                code = f"[{check.code}]({check.code}.md)"
                lines.append(f"| {code} | {check.name} | {levels} | {check.title} |")
    return "\n".join(lines) + "\n"


def pages() -> dict[Path, str]:
    """Every page by its path."""
    found = {FOLDER / f"{check.code}.md": page(check) for check in all_checks()}
    return {FOLDER / "README.md": index(), **found}


def main() -> int:
    wanted = pages()
    if "--check" in sys.argv[1:]:
        stale = [
            p for p, text in wanted.items() if not p.exists() or p.read_text() != text
        ]
        stale += [p for p in FOLDER.glob("*.md") if p not in wanted]
        for path in stale:
            print(f"{path} is not up to date; run scripts/make_check_pages.py")
        return 1 if stale else 0
    FOLDER.mkdir(parents=True, exist_ok=True)
    for path in FOLDER.glob("*.md"):
        if path not in wanted:
            path.unlink()
    for path, text in wanted.items():
        path.write_text(text)
    print(f"{len(wanted)} pages in {FOLDER}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
