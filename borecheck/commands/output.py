"""Writes a result where the user asked for it: standard output, a file, a page."""

import argparse
import sys
from collections.abc import Callable, Collection, Iterable, Mapping
from itertools import combinations
from pathlib import Path
from types import MappingProxyType
from typing import Any

from borecheck.core.whole_files import check_writable, same_file, write_whole
from borecheck.errors import UsageError
from borecheck.report.blocks import Block, plain
from borecheck.report.document import dumps

Text = Callable[[Mapping[str, Any]], Iterable[Block]]

# No result is called so, but what was read may be: a scene, a mesh of the robot's file.
_NO_RESULT = frozenset(
    (
        ".stl",
        ".obj",
        ".ply",
        ".dae",
        ".urdf",
        ".xacro",
        ".srdf",
        ".yaml",
        ".yml",
        ".toml",
        ".npz",
    )
)

# Outputs that are robot files themselves.
_ROBOT_FILES = ("urdf", "write_srdf")
_NOTHING: Mapping[str, Path] = MappingProxyType({})


def check_outputs(args: argparse.Namespace) -> None:
    """Refuses outputs that cannot be written, before any work is done."""
    refuse_outputs(args, "out", "report")


def refuse_outputs(
    args: argparse.Namespace,
    *names: str,
    more: Mapping[str, Path] = _NOTHING,
    renewed: Collection[str] = (),
) -> None:
    """Refuses options that name a file which cannot be written, or would be lost.

    Args:
        args: All options.
        names: Those that name an output.
        more: Other files that are written, by what the user would call them.
        renewed: Options whose file may be read and then written anew.

    Raises:
        InputError: It cannot be written.
        UsageError: Two of them are one file, or one is a file that is read as well, or
            a mesh or robot file that is there.
    """
    options = {n: getattr(args, n) for n in names if getattr(args, n) is not None}
    outputs = {_option(name): path for name, path in options.items()} | dict(more)
    for path in outputs.values():
        check_writable(path)
    for name, path in options.items():
        if name not in _ROBOT_FILES:
            _refuse_other_files(_option(name), path)
    _refuse_one_for_two(outputs | _beside(options))
    lost = {_option(n): p for n, p in options.items() if n not in renewed} | dict(more)
    written = [id(path) for path in outputs.values()]
    for option, value in vars(args).items():
        if option in (*names, "argv") or id(value) in written:
            continue
        for text in value if isinstance(value, list) else [value]:
            _refuse_input(lost, text)


def refuse_surface(args: argparse.Namespace, *names: str) -> None:
    """As `refuse_outputs`, where `--out` is a surface: one of ours is written anew.

    Raises:
        InputError, UsageError: As there, or it is no STL by its name or its content.
    """
    if args.out is None:
        refuse_outputs(args, *names)
        return
    from borecheck.geometry.mesh_files.stl import OURS

    refuse_outputs(args, *names, more={"--out": args.out})
    refuse_suffix("--out", args.out, "a surface is written as STL", ".stl")
    if args.out.is_file():
        with args.out.open("rb") as file:
            if file.read(len(OURS)) != OURS:
                raise UsageError(f"--out {args.out}: is there already and no result")


def refuse_suffix(option: str, path: Path | None, what: str, *suffixes: str) -> None:
    """Refuses a file, if one is named, whose name says another format.

    Args:
        option: Which names it.
        path: The file.
        what: What it will be, for the message.
        suffixes: In lower case, with their points.

    Raises:
        UsageError: So.
    """
    if path is not None and path.suffix.lower() not in suffixes:
        raise UsageError(f"{option} {path}: {what}: name it {' or '.join(suffixes)}")


def _option(name: str) -> str:
    return f"--{name.replace('_', '-')}"


def _beside(options: Mapping[str, Path]) -> dict[str, Path]:
    """The meshes of a certificate, which are written beside it."""
    file = options.get("certificate")
    if file is None or file.suffix.lower() == ".npz":  # refused for what it is
        return {}
    return {"the meshes of --certificate": file.with_suffix(".npz")}


def _refuse_one_for_two(outputs: Mapping[str, Path]) -> None:
    """Refuses two outputs under one name, links followed: the second loses the first.

    Raises:
        UsageError: There are such.
    """
    for (name, path), (other, second) in combinations(outputs.items(), 2):
        if same_file(path, second):
            raise UsageError(
                f"{name} and {other} name the same file {second}: one would be lost"
            )


def _refuse_other_files(name: str, path: Path) -> None:
    """Refuses to write a result over a file of another kind, links followed."""
    if path.is_file() and path.resolve().suffix.lower() in _NO_RESULT:
        raise UsageError(f"{name} {path}: is there already and no result")


def _refuse_input(outputs: Mapping[str, Path], text: object) -> None:
    """Refuses to write over a file that another option names."""
    if not isinstance(text, str | Path):
        return
    named = [Path(words) for words in _files_in(str(text))]
    for name, path in outputs.items():
        if path.is_file() and any(same_file(path, file) for file in named):
            raise UsageError(f"{name} {path}: the file is read too; it would be lost")


def _files_in(text: str) -> list[str]:
    """What may be a file's name in a word: all of it, or what is before a : or an @.

    Plans are named FILE:PLAN, meshes FILE:unit:frame@pose.
    """
    ends = [i for i, letter in enumerate(text) if letter in ":@" and i > 0]
    return [text, *(text[:i] for i in ends)]


def emit(args: argparse.Namespace, document: Mapping[str, Any], text: Text) -> None:
    """Prints the result and writes the files that were asked for.

    The full result goes to `--result` where a command's `--out` is what it makes.

    Args:
        args: The options.
        document: The full result; its geometry, if any, stands under `display`.
        text: Its lines and tables.
    """
    if args.case is not None:
        document = {**document, "case": args.case.to_json()}
    file = args.result if "result" in args else args.out
    report = getattr(args, "report", None)
    try:
        if file is not None:
            write_whole(file, dumps(document))
        if report is not None:
            from borecheck.report.page import page

            write_whole(report, page(document))
    finally:
        _show(args.format, document, text)  # the work is done; it is not lost


def _show(form: str, document: Mapping[str, Any], text: Text) -> None:
    if form == "json":
        bare = {key: value for key, value in document.items() if key != "display"}
        sys.stdout.write(dumps(bare))
    elif sys.stdout.isatty():
        from borecheck.report.terminal import show

        show(text(document))
    else:
        sys.stdout.write(plain(text(document)))


def wants_display(args: argparse.Namespace) -> bool:
    """Whether the result must carry geometry for a page."""
    return args.out is not None or args.report is not None
