"""The same rows in a pipe and on a terminal."""

from io import StringIO

from rich.console import Console

from borecheck.report.blocks import Table, plain
from borecheck.report.terminal import show

ROWS = [("plan", "verdict"), ("left [bold]", "CLEAR"), ("right\x1b[2J", "CONTACT")]
BLOCKS = ["CONTACT: 2 plans", "", Table(ROWS), "", "a - b", "---", "not covered: x\n"]


def test_plain_text_has_aligned_columns():
    assert plain(BLOCKS).splitlines() == [
        "CONTACT: 2 plans",
        "",
        "plan          verdict",
        "------------  -------",
        "left [bold]   CLEAR",
        "right\\x1b[2J  CONTACT",
        "",
        "a - b",
        "---",
        "not covered: x\\n",
    ]


def test_terminal_shows_the_same_words_and_no_markup():
    out = StringIO()
    colour = Console(file=out, force_terminal=True, width=80, color_system="standard")
    show(BLOCKS, colour)
    shown = out.getvalue()
    assert "left [bold]" in shown
    assert "\x1b[1;31mCONTACT" in shown
    assert "\x1b[2J" not in shown, "a name in a file erases the screen"
    bare = StringIO()
    show(BLOCKS, Console(file=bare, width=80))
    assert set(_words(plain(BLOCKS))) == set(_words(bare.getvalue()))


def _words(text: str) -> list[str]:
    return text.replace("─", " ").replace("-", " ").split()
