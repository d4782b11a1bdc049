"""A baseline: findings that are known, so that only new ones are reported."""

import json
from collections import Counter
from collections.abc import Iterable, Sequence
from pathlib import Path, PurePath

from borecheck.core.whole_files import write_whole
from borecheck.errors import InputError
from borecheck.validation.findings import Finding


def fingerprint(finding: Finding) -> str:
    """What stays the same when lines are inserted above: code, file, element."""
    name = PurePath(finding.file).name
    return f"{finding.code} {name} {finding.element} {finding.attribute or ''}".rstrip()


def write_baseline(path: Path, findings: Iterable[Finding]) -> None:
    """Writes the findings there are as known ones."""
    counts = Counter(fingerprint(finding) for finding in findings)
    document = {"borecheck_baseline": 1, "findings": dict(sorted(counts.items()))}
    write_whole(path, json.dumps(document, indent=2) + "\n")


def read_baseline(path: Path) -> Counter[str]:
    """How often each known finding may occur.

    Raises:
        InputError: The file cannot be read or is no baseline.
    """
    try:
        document = json.loads(path.read_text(encoding="utf-8"))
        known = document["findings"]
        return Counter({str(key): int(count) for key, count in known.items()})
    except OSError as error:
        raise InputError(path, error.strerror or str(error)) from error
    except (ValueError, KeyError, TypeError, AttributeError) as error:
        raise InputError(path, "is no baseline of borecheck") from error


def new_findings(findings: Sequence[Finding], known: Counter[str]) -> list[Finding]:
    """The findings beyond the known ones; of equal ones, the first are known."""
    left = Counter(known)
    fresh = []
    for finding in findings:
        mark = fingerprint(finding)
        if left[mark] > 0:
            left[mark] -= 1
        else:
            fresh.append(finding)
    return fresh
