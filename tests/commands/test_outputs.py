"""Outputs of every command: two under one name are refused before any work."""

import argparse
from importlib import import_module
from itertools import combinations

import pytest

from borecheck.cli import _all_commands, main
from tests.places import ROBOTS

# Options that name a file or a folder which is written, in whatever command.
WRITTEN = (
    *("out", "report", "result", "certificate", "truth", "urdf"),
    *("uncertainty", "write_baseline", "write_srdf", "resume"),
)
# What is read under the same name elsewhere.
READ = {("check", "uncertainty"), ("verify", "result"), ("report", "out")}
READ |= {("report", "result"), ("calibrate", "result")}


def parsers(parser, words=()):
    """Every parser of a command with the words that lead to it."""
    below = [a for a in parser._actions if isinstance(a, argparse._SubParsersAction)]
    if not below:
        yield words, parser
    for action in below:
        for name, inner in action.choices.items():
            yield from parsers(inner, (*words, name))


def asked_for():
    """All pairs of outputs, with words that are enough to get as far as them."""
    for command, (module, _) in _all_commands().items():
        top = argparse.ArgumentParser()
        import_module(module).add_arguments(top)
        for words, parser in parsers(top, (command,)):
            written = [
                action
                for action in parser._actions
                if action.dest in WRITTEN
                and action.option_strings
                and (command, action.dest) not in READ
            ]
            for first, second in combinations(written, 2):
                needed = [w for w in needs(parser) if w not in (first, second)]
                yield pytest.param(
                    [*words, *filled(needed)],
                    (first.option_strings[-1], second.option_strings[-1]),
                    id=" ".join((*words, first.dest, second.dest)),
                )


def needs(parser):
    """What a parser asks for: positionals, required options, one of each group."""
    for action in parser._actions:
        if not action.option_strings or action.required:
            yield action
    for group in parser._mutually_exclusive_groups:
        if group.required:
            yield group._group_actions[0]


def filled(actions):
    """Words for them: first what has a name, then what has a place."""
    for action in actions:
        value = str(next(iter(action.choices))) if action.choices else "x.csv"
        if action.option_strings:
            yield from (action.option_strings[-1], value)
    for action in actions:
        if not action.option_strings:
            yield str(next(iter(action.choices))) if action.choices else "x.csv"


# What a command asks for without its parser saying so, or not for every choice.
ASKED_TOO = {"setup": ["--plan", "x.csv"]}


@pytest.mark.parametrize(("words", "options"), list(asked_for()))
def test_two_outputs_are_never_one_file(words, options, tmp_path, capsys, monkeypatch):
    """Neither by another way to the folder, nor by a link."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "folder").mkdir()
    (tmp_path / "link.csv").symlink_to(tmp_path / "same.csv")
    if words[0] == "crane" and "--uncertainty" in options:
        words = ["crane", "registration"]  # no other study has it
    if words[0] == "route" and "--out" not in options:
        words = [*words, "--out", "other.csv"]  # a certificate asks for it
    words = [*words, *ASKED_TOO.get(words[0], [])]
    same = [options[0], "folder/../same.csv", options[1], "link.csv"]
    assert main([*words, *same]) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert "name the same file" in line
    assert {path.name for path in tmp_path.iterdir()} == {"folder", "link.csv"}


def test_the_pairs_are_those_of_many_commands():
    """The test above looks for itself: it must have found what there is."""
    found = {pair.id.split()[0] for pair in asked_for()}
    assert {"check", "verify", "compare", "fk", "route", "validate"} <= found
    assert {"calibrate", "crane"} <= found


def test_meshes_of_a_certificate_are_an_output_too(tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    words = ["route", "crane", "ct_gantry", "--from", "home", "--to", "home"]
    words += ["--out", "way.csv", "--certificate", "c.json", "--result", "c.npz"]
    assert main(words) == 2
    assert "name the same file c.npz" in capsys.readouterr().err


def test_two_names_of_one_file_are_one_file(tmp_path, capsys):
    """A hard link: it is written in place, and the other name shows it."""
    one, two = tmp_path / "one", tmp_path / "two"
    one.write_text("before")
    two.hardlink_to(one)
    words = ["fk", "crane", "--q", "home", "--out", str(one), "--report", str(two)]
    assert main(words) == 2
    assert "name the same file" in capsys.readouterr().err
    assert one.read_text() == "before"


def test_a_page_does_not_replace_the_result_it_is_of(tmp_path, capsys):
    result = tmp_path / "result.json"
    assert main(["fk", "crane", "--q", "home", "--out", str(result)]) == 0
    before = result.read_bytes()
    assert main(["report", str(result), str(result)]) == 2
    assert "the file is read too" in capsys.readouterr().err
    assert result.read_bytes() == before


def test_a_baseline_may_be_renewed_and_nothing_else_lost(tmp_path, capsys):
    known = tmp_path / "known.json"
    words = ["validate", str(ROBOTS / "two_link.urdf"), "--no-run"]
    assert main([*words, "--write-baseline", str(known)]) in (0, 1)
    again = [*words, "--baseline", str(known)]
    assert main([*again, "--write-baseline", str(known)]) in (0, 1)
    capsys.readouterr()
    assert main([*again, "--out", str(known)]) == 2
    assert "the file is read too" in capsys.readouterr().err


PLAN = "{},0.02,0.0655,-0.0072,0.0157,0.0588,-0.045\n"


@pytest.mark.parametrize(
    ("plans", "names", "more", "message"),
    [
        ("p.csv", ("a b", "a_b"), (), "plans 'a b' and 'a_b' would both have"),
        ("p.csv", ("Left", "left"), (), "plans 'Left' and 'left' would both have"),
        ("ways/left.csv", ("left",), (), "the file is read too"),
        ("p.csv", ("left",), ("--out", "ways/left.csv"), "name the same file"),
    ],
)
def test_motions_of_setups_are_outputs(
    plans, names, more, message, tmp_path, capsys, monkeypatch
):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "ways").mkdir()
    head = "name,entry_x,entry_y,entry_z,target_x,target_y,target_z\n"
    text = head + "".join(PLAN.format(name) for name in names)
    (tmp_path / plans).write_text(text)
    words = ["setup", "crane", "ct_gantry", "--plan", plans, "--motions", "ways"]
    assert main([*words, *more]) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert message in line
    assert (tmp_path / plans).read_text() == text
