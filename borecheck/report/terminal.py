"""Plain text of a result, shown on a terminal: same words, with colour and tables.

What goes into a pipe or a file stays plain. A table is known by its rule, a line of
dashes under its header.
"""

import re
from collections.abc import Iterator, Sequence
from itertools import pairwise
from typing import Any

STYLES = {
    "CLEAR": "bold green",
    "AGREE": "bold green",
    "CONTACT": "bold red",
    "DISAGREE": "bold red",
    "UNKNOWN": "bold yellow",
    "warning:": "yellow",
    "not covered:": "dim",
}

_RULE = re.compile(r"-+(?:  -+)*")


def show(text: str, console: Any = None) -> None:
    """Prints a result's text on a terminal.

    Args:
        text: What would go into a pipe.
        console: A rich console; one on standard output by default.
    """
    from rich.console import Console

    console = console or Console(highlight=False, soft_wrap=False)
    for block in blocks(text.splitlines()):
        if isinstance(block, str):
            console.print(_styled(block))
        else:
            console.print(_table(block))


def blocks(lines: Sequence[str]) -> Iterator[str | list[list[str]]]:
    """Lines as they are, and tables as rows of cells, header first."""
    k = 0
    while k < len(lines):
        spans = _columns(lines, k)
        if spans is None:
            yield lines[k]
            k += 1
            continue
        rows = [_cells(lines[k], spans)]
        k += 2
        while k < len(lines) and _fits(lines[k], spans):
            rows.append(_cells(lines[k], spans))
            k += 1
        yield rows


def _columns(lines: Sequence[str], k: int) -> list[tuple[int, int]] | None:
    """Where the columns stand, if a table's header is here."""
    if k + 1 >= len(lines) or not _RULE.fullmatch(lines[k + 1]):
        return None
    spans = [match.span() for match in re.finditer("-+", lines[k + 1])]
    return spans if _fits(lines[k], spans) else None


def _fits(line: str, spans: Sequence[tuple[int, int]]) -> bool:
    """Whether a line is a row: something in it, nothing between the columns."""
    gaps = [line[a[1] : b[0]] for a, b in pairwise(spans)]
    inside = len(line) <= spans[-1][1]
    return bool(line.strip()) and inside and not any(gap.strip() for gap in gaps)


def _cells(line: str, spans: Sequence[tuple[int, int]]) -> list[str]:
    return [line[start:end].strip() for start, end in spans]


def _styled(line: str) -> Any:
    """The line with its first words coloured; names in it are never markup."""
    from rich.text import Text

    text = Text(line)
    for word, style in STYLES.items():
        if line.startswith(word):
            text.stylize(style, 0, len(line) if style == "dim" else len(word))
    return text


def _table(rows: Sequence[Sequence[str]]) -> Any:
    from rich import box
    from rich.table import Table
    from rich.text import Text

    table = Table(box=box.SIMPLE_HEAD, pad_edge=False)
    for name in rows[0]:
        table.add_column(Text(name))
    for row in rows[1:]:
        table.add_row(*(Text(cell, style=STYLES.get(cell, "")) for cell in row))
    return table
