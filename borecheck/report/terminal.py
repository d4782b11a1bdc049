"""A result's text on a terminal: same words as in a pipe, with colour and tables."""

from collections.abc import Iterable
from typing import Any

from borecheck.core.text import printable
from borecheck.report.blocks import Block, Table

STYLES = {
    "CLEAR": "bold green",
    "AGREE": "bold green",
    "CONTACT": "bold red",
    "DISAGREE": "bold red",
    "UNKNOWN": "bold yellow",
    "warning:": "yellow",
    "not covered:": "dim",
}


def show(blocks: Iterable[Block], console: Any = None) -> None:
    """Prints a result's text on a terminal.

    Args:
        blocks: Its lines and tables.
        console: A rich console; one on standard output by default.
    """
    from rich.console import Console

    console = console or Console(highlight=False, soft_wrap=False)
    for block in blocks:
        console.print(_table(block) if isinstance(block, Table) else _styled(block))


def _styled(line: str) -> Any:
    """The line with its first words coloured; names in it are never markup."""
    from rich.text import Text

    text = Text(printable(line))
    for word, style in STYLES.items():
        if line.startswith(word):
            text.stylize(style, 0, len(line) if style == "dim" else len(word))
    return text


def _table(table: Table) -> Any:
    from rich import box
    from rich.table import Table as Drawn
    from rich.text import Text

    header, *rows = [[printable(cell) for cell in row] for row in table.rows]
    drawn = Drawn(box=box.SIMPLE_HEAD, pad_edge=False)
    for name in header:
        drawn.add_column(Text(name))
    for row in rows:
        drawn.add_row(*(Text(cell, style=STYLES.get(cell, "")) for cell in row))
    return drawn
