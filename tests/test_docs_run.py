"""Every command of README and docs, run on the files that `borecheck examples` writes.

A command ends with 0 unless its comment says `exit 1`; words in capitals there (CLEAR)
and lines shown below a command stand in its output. `not tested: ...` in a comment is
the one way to be left out, and a list here holds what is.
"""

import re
import shlex
from dataclasses import dataclass, field
from pathlib import Path

import pytest

from borecheck.cli import COMMANDS, main
from borecheck.commands.examples import CONTENTS
from tests.places import PROJECT

DOCUMENTS = sorted(
    file
    for file in (PROJECT / "README.md", *(PROJECT / "docs").glob("*.md"))
    # its commands are studies, each run for the record by a script of its own
    if file.name != "evidence.md"
)
BLOCK = re.compile(r"^```(\w*)\n(.*?)^```$", re.M | re.S)
RUN = ("", "sh", "console")
NOT_TESTED = re.compile(r"not tested(?: here)?: ([^;#]+)")
# Why a command may be left out, and how many of each there are.
LEFT_OUT = {
    "a browser": 4,
    "minutes": 2,
    "a workspace of ROS": 1,
    "a module of yours": 1,
    "the package, installed": 7,
    "a scan of yours": 5,
}


@dataclass
class Command:
    """A command as a document shows it."""

    words: list[str]
    status: int
    said: list[str]
    left_out: str | None
    lines: list[str] = field(default_factory=list)


def commands(text):
    """The commands of a document in order, each with the output shown below it."""
    found = []
    blocks = [(kind, block) for kind, block in BLOCK.findall(text) if kind in RUN]
    for kind, block in blocks:
        for line in block.replace("\\\n", " ").splitlines():
            typed = line.removeprefix("$ ")
            if re.match(r"borecheck (?!:)|cd ", typed) and (
                kind != "console" or line.startswith("$ ")
            ):
                found.append(_command(typed))
            elif kind == "console" and found:
                found[-1].lines.append(line)
    return found


def _command(line):
    typed, _, comment = line.partition(" #")
    left_out = NOT_TESTED.search(comment)
    status = re.search(r"\bexit (\d)\b", comment)
    said = re.findall(r"\b(?:CLEAR|CONTACT|UNKNOWN|AGREE|ACCEPTED|REJECTED)\b", comment)
    return Command(
        shlex.split(typed),
        int(status[1]) if status else 0,
        said,
        left_out[1].strip() if left_out else None,
    )


def shown(document):
    return commands(document.read_text(encoding="utf-8"))


WITH_COMMANDS = [file for file in DOCUMENTS if shown(file)]


@pytest.mark.parametrize("document", WITH_COMMANDS, ids=lambda file: file.name)
def test_every_command_ends_as_the_document_says(
    document, tmp_path, monkeypatch, capsys
):
    monkeypatch.chdir(tmp_path)
    for folder in ("urdf", "examples"):  # what a clone has
        (tmp_path / folder).symlink_to(PROJECT / folder)
    if document.name != "README.md":  # which writes them itself
        assert main(["examples", "."]) == 0
    capsys.readouterr()
    for command in shown(document):
        if command.left_out is None:
            _run(command, tmp_path, monkeypatch, capsys)


def _run(command, folder, monkeypatch, capsys):
    if command.words[0] == "cd":
        monkeypatch.chdir(folder / command.words[1])
        return
    words = [name for word in command.words[1:] for name in _expanded(word)]
    try:
        status = main(words)
    except SystemExit as stopped:  # argparse
        status = stopped.code
    out, err = capsys.readouterr()
    assert status == command.status, f"{shlex.join(command.words)}\n{out[-800:]}{err}"
    lines = {line.strip() for line in out.splitlines()}
    for line in command.lines:
        assert line.strip() in lines or line == "...", shlex.join(command.words)
    for word in command.said:
        assert re.search(rf"\b{word}\b", out), shlex.join(command.words)


def _expanded(word):
    """As a shell does it: the files that a pattern fits, or the word itself."""
    if "*" not in word:
        return [word]
    return sorted(file.name for file in Path().glob(word)) or [word]


def test_what_is_left_out_is_listed():
    reasons = [c.left_out for file in DOCUMENTS for c in shown(file) if c.left_out]
    assert {reason: reasons.count(reason) for reason in reasons} == LEFT_OUT


def test_no_command_is_written_where_it_is_not_run():
    """In a block that is indented, or of another language."""
    command = re.compile(rf"^ *(\$ )?borecheck ({'|'.join(COMMANDS)})\b", re.M)
    for file in DOCUMENTS:
        text = file.read_text(encoding="utf-8")
        rest = BLOCK.sub(lambda found: "" if found[1] in RUN else found[0], text)
        assert not command.search(rest), file


WRONG = (
    "```\nborecheck explain J302  # exit 1\n```\n",
    "```\nborecheck explain J302  # CLEAR\n```\n",
    "```console\n$ borecheck explain J302\nnot this line\n```\n",
    "```\nborecheck explain --no-such-option\n```\n",
)


@pytest.mark.parametrize("text", WRONG)
def test_what_ends_or_reads_otherwise_is_noticed(text, tmp_path, monkeypatch, capsys):
    (command,) = commands(text)
    with pytest.raises(AssertionError):
        _run(command, tmp_path, monkeypatch, capsys)


def test_examples_are_written_whole_or_not_at_all(tmp_path, capsys):
    folder = tmp_path / "new"
    assert main(["examples", str(folder)]) == 0
    written = {file.name: file.read_bytes() for file in folder.iterdir()}
    assert written.keys() == CONTENTS.keys()
    assert sum(map(len, written.values())) < 100_000
    shipped = PROJECT / "borecheck" / "examples"
    assert {file.name for file in shipped.iterdir()} == CONTENTS.keys()
    (folder / "arm.urdf").unlink()
    (folder / "path.csv").write_text("mine")
    capsys.readouterr()
    for where in (folder, folder / "path.csv", tmp_path / "no" / "folder"):
        assert main(["examples", str(where)]) == 2
        out, err = capsys.readouterr()
        assert (out, err.count("\n")) == ("", 1)
    assert not (folder / "arm.urdf").exists()
    assert (folder / "path.csv").read_text() == "mine"
