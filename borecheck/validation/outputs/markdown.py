"""Findings as Markdown, for job summaries and review comments."""

import re
from collections.abc import Sequence

from borecheck.core.text import printable
from borecheck.validation.findings import Finding
from borecheck.validation.outputs.text import summary


def as_markdown(results: Sequence[tuple[str, Sequence[Finding]]]) -> str:
    """The whole result as Markdown."""
    lines = ["# borecheck validate", "", summary(results), ""]
    for file, findings in results:
        lines += [f"## {_plain(file)}", ""]
        if not findings:
            lines += ["No findings.", ""]
            continue
        lines += ["| line | severity | code | finding | element | fix |"]
        lines += ["|---:|---|---|---|---|---|"]
        lines += [_row(finding) for finding in findings]
        lines.append("")
    return "\n".join(lines)


def _row(finding: Finding) -> str:
    cells = (
        str(finding.line),
        str(finding.severity),
        finding.code,
        _plain(finding.message),
        _plain(finding.element),
        _plain(finding.hint),
    )
    return f"| {' | '.join(cells)} |"


def _plain(text: str) -> str:
    """Text that Markdown and HTML leave as it is."""
    escaped = re.sub(r"([\\`*_\[\]|#])", r"\\\1", printable(" ".join(text.split())))
    return escaped.replace("&", "&amp;").replace("<", "&lt;").replace(">", "&gt;")
