"""Lines of the source around every finding, for the page of `validate`."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from borecheck.core.text import printable
from borecheck.robots.urdf.text import text_of

# Lines before and after the finding's own.
AROUND = 1
# A minified file is one line; so much of it is shown.
LONGEST = 200


def with_excerpts(document: Mapping[str, Any]) -> dict[str, Any]:
    """The document, each finding with `excerpt: [{line, text}]` of its file.

    A file that cannot be read any more gives no excerpt.
    """
    sources: dict[str, list[str]] = {}
    files = [
        {
            **entry,
            "findings": [
                {**finding, "excerpt": _excerpt(finding, sources)}
                for finding in entry["findings"]
            ],
        }
        for entry in document["files"]
    ]
    return {**document, "files": files}


def _excerpt(
    finding: Mapping[str, Any], sources: dict[str, list[str]]
) -> list[dict[str, Any]]:
    file, line = finding["file"], finding["line"]
    if not file or not line:
        return []
    if file not in sources:
        sources[file] = _lines(Path(file))
    lines = sources[file]
    first = max(line - AROUND, 1)
    shown = lines[first - 1 : line + AROUND]
    return [{"line": first + k, "text": text[:LONGEST]} for k, text in enumerate(shown)]


def _lines(path: Path) -> list[str]:
    try:
        return [printable(line) for line in text_of(path.read_bytes()).split("\n")]
    except OSError:
        return []
