"""Findings as SARIF 2.1.0, for code scanning."""

import json
from collections.abc import Sequence
from hashlib import sha256
from pathlib import Path, PurePath
from typing import Any
from urllib.parse import quote

from borecheck.core.version import __version__
from borecheck.validation.baseline import fingerprint
from borecheck.validation.catalogue import all_checks
from borecheck.validation.findings import Finding, Severity
from borecheck.validation.registry import Check

_LEVELS = {Severity.ERROR: "error", Severity.WARNING: "warning", Severity.INFO: "note"}
_SCHEMA = (
    "https://docs.oasis-open.org/sarif/sarif/v2.1.0/os/schemas/sarif-schema-2.1.0.json"
)


def as_sarif(results: Sequence[tuple[str, Sequence[Finding]]], profile: str) -> str:
    """The whole result as SARIF text."""
    found = [finding for _, findings in results for finding in findings]
    codes = {finding.code for finding in found}
    rules = [check for check in all_checks() if check.code in codes]
    index = {check.code: number for number, check in enumerate(rules)}
    driver = {
        "name": "borecheck",
        "version": __version__,
        "rules": [_rule(check, profile) for check in rules],
    }
    run = {
        "tool": {"driver": driver},
        "columnKind": "unicodeCodePoints",
        "results": [_result(finding, index) for finding in found],
    }
    document = {"$schema": _SCHEMA, "version": "2.1.0", "runs": [run]}
    return json.dumps(document, indent=2) + "\n"


def _rule(check: Check, profile: str) -> dict[str, Any]:
    return {
        "id": check.code,
        "name": check.name,
        "shortDescription": {"text": check.title},
        "fullDescription": {"text": check.why or check.title},
        "help": {"text": check.fix or check.title},
        "defaultConfiguration": {"level": _LEVELS[check.levels[profile]]},
        "properties": {"tags": [check.tier]},
    }


def _result(finding: Finding, index: dict[str, int]) -> dict[str, Any]:
    logical = {"fullyQualifiedName": finding.element or "document"}
    physical = {
        "artifactLocation": {"uri": _uri(finding.file)},
        "region": {"startLine": max(1, finding.line)},
    }
    mark = sha256(fingerprint(finding).encode()).hexdigest()
    return {
        "ruleId": finding.code,
        "ruleIndex": index[finding.code],
        "level": _LEVELS[finding.severity],
        "message": {"text": f"{finding.message}. {finding.hint}".strip()},
        "locations": [{"physicalLocation": physical, "logicalLocations": [logical]}],
        "partialFingerprints": {"borecheck/v1": mark},
    }


def _uri(file: str) -> str:
    """A path relative to the working directory where it can be, as a URI."""
    path = PurePath(file)
    try:
        path = Path(file).resolve().relative_to(Path.cwd())
    except (ValueError, OSError):
        path = PurePath(file)
    return quote(path.as_posix())
