from io import StringIO

from rich.console import Console

from borecheck.report.terminal import blocks, show
from borecheck.report.text import table

ROWS = [("plan", "verdict"), ("left [bold]", "CLEAR"), ("right", "CONTACT")]
TEXT = "\n".join(["CONTACT: 2 plans", "", *table(ROWS), "", "not covered: drapes"])


def test_a_table_is_found_with_its_cells():
    found = list(blocks(TEXT.splitlines()))
    assert found == [
        "CONTACT: 2 plans",
        "",
        [list(row) for row in ROWS],
        "",
        "not covered: drapes",
    ]


def test_lines_that_are_no_table_stay():
    lines = ["a - b", "---", "long words that reach beyond", "x"]
    assert list(blocks(lines))[-2:] == lines[-2:]


def test_terminal_shows_the_same_words_and_no_markup():
    out = StringIO()
    show(
        TEXT, Console(file=out, force_terminal=True, width=80, color_system="standard")
    )
    shown = out.getvalue()
    assert "left [bold]" in shown
    assert "\x1b[" in shown
    plain = StringIO()
    show(TEXT, Console(file=plain, width=80))
    words = set(TEXT.replace("-", "").split())
    assert words <= set(plain.getvalue().replace("─", "").replace("-", "").split())
