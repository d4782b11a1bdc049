"""Findings as one JSON document."""

import json
from collections.abc import Sequence
from typing import Any

from borecheck.core.result_file import SCHEMA_VERSION
from borecheck.validation.findings import Finding
from borecheck.validation.outputs.text import count_by_severity


def to_record(finding: Finding) -> dict[str, Any]:
    """One finding as plain data."""
    return {
        "code": finding.code,
        "name": finding.name,
        "severity": str(finding.severity),
        "tier": finding.tier,
        "element": finding.element,
        "attribute": finding.attribute,
        "file": finding.file,
        "line": finding.line,
        "message": finding.message,
        "why": finding.why,
        "hint": finding.hint,
        "libraries": list(finding.libraries),
    }


def to_document(
    results: Sequence[tuple[str, Sequence[Finding]]],
    profile: str,
    extra: dict[str, Any] | None = None,
) -> dict[str, Any]:
    """The whole result as plain data; `extra` adds what else a report needs."""
    found = [finding for _, findings in results for finding in findings]
    counts: dict[str, Any] = {"files": len(results), **count_by_severity(found)}
    return {
        "schema_version": SCHEMA_VERSION,
        "command": "validate",
        "profile": profile,
        **(extra or {}),
        "files": [
            {"file": file, "findings": [to_record(finding) for finding in findings]}
            for file, findings in results
        ],
        "summary": counts,
    }


def as_json(
    results: Sequence[tuple[str, Sequence[Finding]]],
    profile: str,
    extra: dict[str, Any] | None = None,
) -> str:
    """The whole result as JSON text."""
    return json.dumps(to_document(results, profile, extra), indent=2) + "\n"
