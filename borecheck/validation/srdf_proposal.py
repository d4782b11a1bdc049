"""An SRDF out of sampled self-contact: which pairs need no checking, and why."""

from collections.abc import Sequence
from pathlib import Path
from xml.sax.saxutils import quoteattr

from borecheck.core.whole_files import write_whole
from borecheck.errors import InputError, UsageError
from borecheck.validation.checks.self_contact import (
    ALWAYS,
    SOMETIMES,
    ContactTable,
    contact_table,
)
from borecheck.validation.findings import Finding
from borecheck.validation.load import Loaded, load_file
from borecheck.validation.options import Options
from borecheck.validation.reading.checked_urdf import CheckedUrdf


def write_proposal(files: Sequence[str], options: Options, out: Path) -> Loaded:
    """Writes the proposal for one robot.

    Args:
        files: One file.
        options: `self_contact` says how many configurations are sampled.
        out: The SRDF file; written whole or not at all.

    Returns:
        The robot as it was loaded; what was sampled is remembered in it.

    Raises:
        UsageError: Several files, or no number of samples.
        InputError: The robot cannot be moved, or some collision geometry not be read.
    """
    if len(files) != 1 or files[0] == "-":
        raise UsageError("--write-srdf is for one robot: name one file")
    if options.self_contact <= 0:
        raise UsageError("--write-srdf needs --self-contact N: how many are sampled")
    loaded = load_file(Path(files[0]), options)
    robot, _ = loaded
    if isinstance(robot, Finding):
        raise InputError(files[0], robot.message)
    table = contact_table(robot, options.self_contact)
    if table is None:
        raise InputError(files[0], "cannot be moved: see its findings without the SRDF")
    if table.missing:
        listed = ", ".join(map(repr, table.missing))
        raise InputError(files[0], f"no SRDF: collision geometry of {listed} not read")
    write_whole(out, srdf_proposal(robot, table))
    return loaded


def srdf_proposal(robot: CheckedUrdf, table: ContactTable) -> str:
    """An SRDF that disables adjacent pairs, and those that touch always or never.

    Pairs that never touched are marked with the samples they rest on.
    """
    name = quoteattr(robot.root.get("name") or "robot")
    never = f"Never in {table.samples}: below {table.bound:.2g} with 95 percent"
    rows = [(pair, "Adjacent") for pair in table.adjacent]
    for pair in table.counts:
        kind = table.kind(pair)
        if kind != SOMETIMES:
            rows.append((pair, "Always in contact" if kind == ALWAYS else never))
    lines = [
        f"  <disable_collisions link1={quoteattr(a)} link2={quoteattr(b)} "
        f"reason={quoteattr(reason)}/>"
        for (a, b), reason in rows
    ]
    return f"<robot name={name}>\n" + "\n".join(lines) + "\n</robot>\n"
