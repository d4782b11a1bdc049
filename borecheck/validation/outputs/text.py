"""Findings as text: one line each, the line of the source, and a caret under it."""

import os
import re
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import TextIO

from borecheck.core.text import printable
from borecheck.robots.urdf.source import LONGEST_TAG
from borecheck.robots.urdf.text import text_of
from borecheck.validation.findings import Finding, Severity

_COLOURS = {Severity.ERROR: "31", Severity.WARNING: "33", Severity.INFO: "36"}
_NOT_READ = "D101"  # of a file that is not there nothing can be shown or explained
_NAME = re.compile(r"'[^']*'")  # of an element, in a message
_LONGEST = 160  # characters of a source line that are shown


def wants_colour(stream: TextIO) -> bool:
    """Whether to colour: only on a terminal, never with NO_COLOR."""
    return stream.isatty() and not os.environ.get("NO_COLOR")


def as_text(
    results: Sequence[tuple[str, Sequence[Finding]]],
    *,
    colour: bool = False,
    explain: bool = True,
    source: bool = True,
) -> str:
    """The report of one or several files.

    Args:
        results: (file, findings) for each file.
        colour: Whether to use terminal colours.
        explain: Whether to say why it matters, how to mend it and who differs.
        source: Whether to show the line of the source.
    """
    excerpts = _Sources() if source else None
    blocks = []
    for _, findings in results:
        for same in _of_one_kind(findings) if explain else ([f] for f in findings):
            blocks.append(_block(same[0], excerpts, colour, explain))
            blocks += [_rest(same)] if len(same) > 1 else []
    return "".join(block + "\n" for block in [*blocks, summary(results)])


def _block(
    finding: Finding, sources: "_Sources | None", colour: bool, explain: bool
) -> str:
    severity = str(finding.severity)
    if colour:
        severity = f"\033[{_COLOURS[finding.severity]};1m{severity}\033[0m"
    file, message = shown_file(finding.file), printable(finding.message)
    if finding.code == _NOT_READ and not _is_there(finding.file):
        return f"{file}: {severity}: {finding.code}: {message}"
    element = f" [{printable(finding.element)}]" if finding.element else ""
    where = f"{file}:{finding.line}"
    lines = [f"{where}: {severity}: {finding.code}: {message}{element}"]
    if sources is not None:
        lines += sources.excerpt(finding)
    if explain:
        lines += _explanation(finding)
    return "\n".join(lines)


def _of_one_kind(findings: Sequence[Finding]) -> list[list[Finding]]:
    """Findings together that say the same of different elements, in order.

    What differs in more than names stays apart: a number may be what matters.
    """
    kinds: dict[object, list[Finding]] = {}
    for finding in findings:
        said = _NAME.sub("''", finding.message)
        if said == finding.message:
            said = f"{said} {finding.element}"
        key = (finding.file, finding.code, finding.severity, said, finding.hint)
        kinds.setdefault(key, []).append(finding)
    return list(kinds.values())


def _rest(same: Sequence[Finding]) -> str:
    """The line for all findings of a kind but the first."""
    named = ", ".join(
        f"{_named(finding)} (line {finding.line})" for finding in same[1:]
    )
    return f"    and {len(same) - 1} more {same[0].code}: {named}"


def _named(finding: Finding) -> str:
    return printable(", ".join(_NAME.findall(finding.message)))


def shown_file(file: str) -> str:
    """A file's name as a line may begin with it.

    Build servers read lines that begin with `::` or `##` as commands to them.
    """
    text = printable(file)
    return f"./{text}" if text.startswith((":", "#")) else text


def _is_there(file: str) -> bool:
    try:
        return Path(file).exists()
    except (OSError, ValueError):  # a name that no file can have
        return False


def _explanation(finding: Finding) -> list[str]:
    lines = [f"    why: {finding.why}"] if finding.why else []
    lines += [f"    fix: {printable(finding.hint)}"] if finding.hint else []
    if finding.libraries:
        lines.append(f"    libraries: {'; '.join(finding.libraries)}")
    return lines


def summary(results: Sequence[tuple[str, Sequence[Finding]]]) -> str:
    """How many files and findings, in one line."""
    found = [finding for _, findings in results for finding in findings]
    files = f"{len(results)} file{'' if len(results) == 1 else 's'}"
    counts = ", ".join(
        f"{count} {name}{'s' if count != 1 and name != 'info' else ''}"
        for name, count in count_by_severity(found).items()
    )
    return f"{files}: {counts if found else 'no findings'}"


def count_by_severity(findings: Iterable[Finding]) -> dict[str, int]:
    """How many findings of each severity, worst first."""
    found = [str(finding.severity) for finding in findings]
    return {name: found.count(name) for name in ("error", "warning", "info")}


class _Sources:
    """Lines of source files, read once."""

    def __init__(self) -> None:
        self._lines: dict[str, list[str]] = {}

    def excerpt(self, finding: Finding) -> list[str]:
        """The source line with a caret under the attribute or the tag."""
        lines = self._of(finding.file)
        at = finding.line - 1
        if not 0 <= at < len(lines):
            return []
        at = _line_of(lines, at, finding)
        text = printable(lines[at].rstrip().replace("\t", " "))
        if not text or not lines[at].replace("\t", " ").rstrip().isprintable():
            return []  # no text, so nothing to show
        start, length = _span(text, finding)
        number = str(at + 1)
        if len(text) > _LONGEST:
            text = text[:_LONGEST] + " ..."
        shown = [f"  {number} | {text}"]
        if start < _LONGEST:
            caret = " " * start + "^" * min(length, max(1, _LONGEST - start))
            shown.append(f"  {' ' * len(number)} | {caret}")
        return shown

    def _of(self, file: str) -> list[str]:
        if file not in self._lines:
            try:
                text = text_of(Path(file).read_bytes())
            except (OSError, ValueError):
                text = ""
            self._lines[file] = text.split("\n")
        return self._lines[file]


def _line_of(lines: list[str], at: int, finding: Finding) -> int:
    """The line of the attribute, when a start tag runs over several lines."""
    if finding.attribute is None:
        return at
    pattern = re.compile(rf"\b{re.escape(finding.attribute)}\s*=")
    for candidate in range(at, min(at + LONGEST_TAG, len(lines))):
        if pattern.search(lines[candidate]):
            return candidate
        if ">" in lines[candidate]:
            break
    return at


def _span(text: str, finding: Finding) -> tuple[int, int]:
    """Column and length of what is wrong."""
    if finding.attribute is not None:
        pattern = rf"\b{re.escape(finding.attribute)}\s*=\s*(\"[^\"]*\"|'[^']*')?"
        found = re.search(pattern, text)
        if found is not None:
            return found.start(), len(found.group())
    tag = re.sub(r"\[.*$", "", finding.element.rpartition("/")[2])
    found = re.search(rf"<{re.escape(tag)}\b", text) if tag else None
    if found is not None:
        return found.start(), len(found.group())
    return len(text) - len(text.lstrip()), max(1, len(text.strip()))
