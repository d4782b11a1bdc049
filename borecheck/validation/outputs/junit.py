"""Findings as JUnit XML, for build servers: a test case per file and finding."""

import re
from collections.abc import Mapping, Sequence
from xml.sax.saxutils import escape, quoteattr

from borecheck.core.text import in_lines, printable
from borecheck.validation.findings import Finding, Severity
from borecheck.validation.outputs.text import shown_file

# Of XML; what else does not show is escaped before.
_FORBIDDEN = re.compile("[^\n\x20-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")


def as_junit(
    results: Sequence[tuple[str, Sequence[Finding]]],
    fail_on: Severity | Mapping[str, Severity | None] | None,
) -> str:
    """The whole result as JUnit text.

    Args:
        results: (file, findings) for each file.
        fail_on: Findings from this severity on are failures; None: none is. For all
            files, or by file.
    """
    suites = [
        _suite(file, found, fail_on[file] if isinstance(fail_on, Mapping) else fail_on)
        for file, found in results
    ]
    body = "".join(suites)
    return (
        f'<?xml version="1.0" encoding="UTF-8"?>\n<testsuites>\n{body}</testsuites>\n'
    )


def _suite(file: str, findings: Sequence[Finding], fail_on: Severity | None) -> str:
    failures = sum(_fails(finding, fail_on) for finding in findings)
    cases = "".join(_case(finding, fail_on) for finding in findings)
    if not findings:
        cases = f'    <testcase classname={_attribute(file)} name="sound"/>\n'
    tests = _attribute(max(1, len(findings)))
    head = (
        f"  <testsuite name={_attribute(file)} tests={tests}"
        f' failures={_attribute(failures)} errors="0" skipped="0">\n'
    )
    return f"{head}{cases}  </testsuite>\n"


def _case(finding: Finding, fail_on: Severity | None) -> str:
    name = f"{finding.code} {finding.element} line {finding.line}"
    head = f"    <testcase classname={_attribute(finding.file)} name={_attribute(name)}"
    where = f"{shown_file(finding.file)}:{finding.line}"
    text = f"{where}: {finding.severity}: {finding.message}"
    shown = _FORBIDDEN.sub("?", escape(in_lines([text, finding.why, finding.hint])))
    if not _fails(finding, fail_on):
        return f"{head}>\n      <system-out>{shown}</system-out>\n    </testcase>\n"
    message = _attribute(finding.message)
    kind = _attribute(str(finding.severity))
    failure = f"      <failure message={message} type={kind}>{shown}</failure>\n"
    return f"{head}>\n{failure}    </testcase>\n"


def _fails(finding: Finding, fail_on: Severity | None) -> bool:
    return fail_on is not None and finding.severity.rank >= fail_on.rank


def _attribute(value: object) -> str:
    return quoteattr(_FORBIDDEN.sub("?", printable(value)))
