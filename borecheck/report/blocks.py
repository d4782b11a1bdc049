"""What a result's text is made of: lines and tables, written twice from the same rows.

Plain, for a pipe or a file, here; with colour and rich's tables in `report.terminal`.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from borecheck.core.text import printable


@dataclass(frozen=True)
class Table:
    """Rows of cells, the header first."""

    rows: Sequence[Sequence[str]]

    def lines(self) -> list[str]:
        """Aligned columns, the header underlined."""
        rows = [[printable(cell) for cell in row] for row in self.rows]
        widths = [max(len(row[k]) for row in rows) for k in range(len(rows[0]))]
        rows.insert(1, ["-" * width for width in widths])
        return ["  ".join(map(str.ljust, row, widths)).rstrip() for row in rows]


Block = str | Table


def plain(blocks: Iterable[Block]) -> str:
    """The text for a pipe or a file; every line is printable."""
    lines: list[str] = []
    for block in blocks:
        lines += block.lines() if isinstance(block, Table) else [printable(block)]
    return "".join(f"{line}\n" for line in lines)
